#ifndef HULLD_SERVER_PROCESS_METRICS_ENDPOINT_H_
#define HULLD_SERVER_PROCESS_METRICS_ENDPOINT_H_

#include <absl/status/statusor.h>

#include <memory>
#include <string>

#include "server/process/listen_address.h"
#include "server/process/metrics.h"

namespace prometheus {
class Exposer;
}  // namespace prometheus

namespace hulld::server {

// INVALID_ARGUMENT: --metrics-address is malformed, or not local although not `exposed`.
absl::StatusOr<ListenAddress> ParseMetricsAddress(const std::string& address, bool exposed);

// Where Prometheus reads the metrics over HTTP: GET /metrics, neither encrypted nor authenticated.
class MetricsEndpoint {
 public:
  // address: "host:port" or "[v6]:port"; port 0 picks a free one. exposed: whether other machines
  // may reach it. The metrics must outlive this.
  // INVALID_ARGUMENT: as ParseMetricsAddress. UNAVAILABLE: it cannot be bound.
  static absl::StatusOr<std::unique_ptr<MetricsEndpoint>> Start(const std::string& address,
                                                                bool exposed,
                                                                const Metrics& metrics);

  MetricsEndpoint(const MetricsEndpoint&) = delete;
  MetricsEndpoint& operator=(const MetricsEndpoint&) = delete;
  ~MetricsEndpoint();

  // With the port that was chosen.
  const std::string& address() const { return address_; }

 private:
  MetricsEndpoint();

  std::string address_;
  // The exposer only borrows it.
  std::shared_ptr<prometheus::Collectable> metrics_;
  std::unique_ptr<prometheus::Exposer> exposer_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_METRICS_ENDPOINT_H_
