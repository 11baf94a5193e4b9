#ifndef HULLD_SERVER_ADMIN_HEALTH_SERVICE_H_
#define HULLD_SERVER_ADMIN_HEALTH_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "grpc/health/v1/health.grpc.pb.h"
#include "server/call/admission.h"
#include "server/call/call_stream.h"

namespace hulld::server {

// The generated service, with methods on bytes (message_bytes.h).
using HealthServiceOfBytes = grpc::health::v1::Health::WithRawCallbackMethod_Check<
    grpc::health::v1::Health::WithRawCallbackMethod_Watch<grpc::health::v1::Health::Service>>;

// grpc.health.v1.Health: SERVING for the server and each service until the server drains. It needs
// no token. Unlike gRPC's own service, it admits each Watch as a call. Check is always answered,
// for load balancers.
class HealthService : public HealthServiceOfBytes {
 public:
  // services: full names of the services. The admission must outlive this.
  HealthService(Admission& admission, std::vector<std::string> services);

  UnaryReactor* Check(CallContext* context, const Bytes* request, Bytes* response) override;
  WriteReactor* Watch(CallContext* context, const Bytes* request) override;

  // Switches the status to NOT_SERVING, and ends every Watch after reporting it.
  void EndServing();

 private:
  class WatchCall;
  using Status = grpc::health::v1::HealthCheckResponse::ServingStatus;

  // Requires mutex_.
  Status StatusOf(const std::string& service) const;

  Admission& admission_;
  // Includes "", the whole server.
  std::vector<std::string> services_;
  std::mutex mutex_;
  // The mutex guards the members below.
  bool serving_ = true;
  std::set<std::shared_ptr<WatchCall>> watches_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ADMIN_HEALTH_SERVICE_H_
