#ifndef HULLD_SERVER_PROCESS_METRICS_ENDPOINT_H_
#define HULLD_SERVER_PROCESS_METRICS_ENDPOINT_H_

#include <absl/status/statusor.h>

#include <memory>
#include <string>

#include "server/process/listen_address.h"
#include "server/process/metrics.h"

namespace hulld::server {

// INVALID_ARGUMENT: --metrics-address is malformed, or not local although `exposed` is false.
absl::StatusOr<ListenAddress> ParseMetricsAddress(const std::string& address, bool exposed);

// HTTP endpoint for Prometheus: GET /metrics, neither encrypted nor authenticated. A single thread
// serves a bounded number of connections. They do not delay each other, because requests have no
// body, have at most a few KiB, and are limited in time.
class MetricsEndpoint {
 public:
  // address: "host:port" or "[v6]:port"; port 0 picks a free one. exposed: true if other machines
  // may reach it. The metrics must outlive this. INVALID_ARGUMENT: see ParseMetricsAddress.
  // UNAVAILABLE: it cannot be bound.
  static absl::StatusOr<std::unique_ptr<MetricsEndpoint>> Start(const std::string& address,
                                                                bool exposed,
                                                                const Metrics& metrics);

  virtual ~MetricsEndpoint() = default;

  // The address with the chosen port.
  const std::string& address() const { return address_; }

 protected:
  std::string address_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_METRICS_ENDPOINT_H_
