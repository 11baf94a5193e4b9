#ifndef HULLD_SERVER_ADMIN_STATUS_SERVICE_H_
#define HULLD_SERVER_ADMIN_STATUS_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include <chrono>

#include "hulld/v1/status.grpc.pb.h"
#include "server/access/caller.h"
#include "server/call/message_bytes.h"
#include "server/call/service_parts.h"

namespace hulld::server {

// hulld.v1.StatusService: the contract in status.proto.
class StatusService
    : public v1::StatusService::WithRawCallbackMethod_GetStatus<v1::StatusService::Service> {
 public:
  explicit StatusService(const ServiceParts& parts) : parts_(parts) {}

  UnaryReactor* GetStatus(CallContext* context, const Bytes* request, Bytes* response) override;

 private:
  void Fill(const Caller& caller, v1::GetStatusResponse* response) const;

  const ServiceParts& parts_;
  const std::chrono::system_clock::time_point started_ = std::chrono::system_clock::now();
  const std::chrono::steady_clock::time_point started_steady_ = std::chrono::steady_clock::now();
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ADMIN_STATUS_SERVICE_H_
