#ifndef HULLD_SERVER_BODIES_BODY_SERVICE_H_
#define HULLD_SERVER_BODIES_BODY_SERVICE_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <chrono>

#include "hulld/v1/body.grpc.pb.h"
#include "server/call/call.h"
#include "server/call/service_parts.h"
#include "server/call/unary_call.h"

namespace hulld::server {

// The generated service, with methods that exchange bytes (message_bytes.h).
using BodyServiceOfBytes =
    v1::BodyService::WithRawCallbackMethod_PutBody<v1::BodyService::WithRawCallbackMethod_GetBody<
        v1::BodyService::WithRawCallbackMethod_ListBodies<
            v1::BodyService::WithRawCallbackMethod_DeleteBody<v1::BodyService::Service>>>>;

// hulld.v1.BodyService: implements the contract in body.proto on the registry. Calls that only read
// records are answered on arrival. Calls that involve pieces, possibly many, run on `readers`.
class BodyService : public BodyServiceOfBytes {
 public:
  explicit BodyService(const ServiceParts& parts) : parts_(parts) {}

  UnaryReactor* PutBody(CallContext* context, const Bytes* request, Bytes* response) override;
  UnaryReactor* GetBody(CallContext* context, const Bytes* request, Bytes* response) override;
  UnaryReactor* ListBodies(CallContext* context, const Bytes* request, Bytes* response) override;
  UnaryReactor* DeleteBody(CallContext* context, const Bytes* request, Bytes* response) override;

 private:
  using PutCall = UnaryCall<v1::PutBodyRequest, v1::PutBodyResponse>;
  using GetCall = UnaryCall<v1::GetBodyRequest, v1::GetBodyResponse>;
  using ListCall = UnaryCall<v1::ListBodiesRequest, v1::ListBodiesResponse>;
  using DeleteCall = UnaryCall<v1::DeleteBodyRequest, v1::DeleteBodyResponse>;

  // Ends the call after the change is committed.
  void Put(PutCall* call);
  absl::Status Get(const v1::GetBodyRequest& request, const Call& call,
                   std::chrono::nanoseconds staleness, v1::GetBodyResponse* response);

  const ServiceParts& parts_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_BODIES_BODY_SERVICE_H_
