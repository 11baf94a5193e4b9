#include "server/process/metrics_endpoint.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <prometheus/exposer.h>

#include <exception>
#include <utility>
#include <vector>

#include "server/process/listen_address.h"

namespace hulld::server {
namespace {

constexpr char kFlag[] = "--metrics-address";
constexpr size_t kThreads = 2;

// Metrics that someone else owns.
class Borrowed : public prometheus::Collectable {
 public:
  explicit Borrowed(const Metrics& metrics) : metrics_(metrics) {}
  std::vector<prometheus::MetricFamily> Collect() const override { return metrics_.Collect(); }

 private:
  const Metrics& metrics_;
};

// As civetweb takes it, which knows no names.
std::string BindAddress(const ListenAddress& address) {
  if (address.host == "localhost") return absl::StrCat("127.0.0.1:", address.port);
  const bool is_v6 = address.host.find(':') != std::string::npos;
  return absl::StrCat(is_v6 ? "[" : "", address.host, is_v6 ? "]:" : ":", address.port);
}

}  // namespace

absl::StatusOr<ListenAddress> ParseMetricsAddress(const std::string& address, bool exposed) {
  absl::StatusOr<ListenAddress> parsed = ParseListenAddress(address, kFlag);
  if (!parsed.ok()) return parsed.status();
  if (parsed->is_unix()) {
    return absl::InvalidArgumentError(
        absl::StrCat(kFlag, " is \"", address, "\": Prometheus reads TCP; give host:port"));
  }
  if (!parsed->is_local() && !exposed) {
    return absl::InvalidArgumentError(absl::StrCat(
        kFlag, " is \"", address, "\", which other machines can reach, and metrics are neither ",
        "encrypted nor authenticated; use 127.0.0.1, or allow it with --metrics-insecure"));
  }
  return parsed;
}

MetricsEndpoint::MetricsEndpoint() = default;
MetricsEndpoint::~MetricsEndpoint() = default;

absl::StatusOr<std::unique_ptr<MetricsEndpoint>> MetricsEndpoint::Start(const std::string& address,
                                                                        bool exposed,
                                                                        const Metrics& metrics) {
  const absl::StatusOr<ListenAddress> parsed = ParseMetricsAddress(address, exposed);
  if (!parsed.ok()) return parsed.status();
  std::unique_ptr<MetricsEndpoint> endpoint(new MetricsEndpoint);
  endpoint->metrics_ = std::make_shared<Borrowed>(metrics);
  try {
    endpoint->exposer_ = std::make_unique<prometheus::Exposer>(BindAddress(*parsed), kThreads);
    endpoint->exposer_->RegisterCollectable(endpoint->metrics_);
    const std::vector<int> ports = endpoint->exposer_->GetListeningPorts();
    endpoint->address_ = parsed->Format(ports.empty() ? 0 : ports.front());
  } catch (const std::exception&) {  // civetweb does not say why
    return ExplainBindFailure(*parsed, kFlag);
  }
  return endpoint;
}

}  // namespace hulld::server
