#ifndef HULLD_SERVER_ADMIN_REFLECTION_SERVICE_H_
#define HULLD_SERVER_ADMIN_REFLECTION_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include <string>
#include <vector>

#include "grpc/reflection/v1alpha/reflection.grpc.pb.h"
#include "server/call/admission.h"
#include "server/call/call_stream.h"

namespace hulld::server {

// The generated service, with its method on bytes (message_bytes.h).
using ReflectionServiceOfBytes =
    grpc::reflection::v1alpha::ServerReflection::WithRawCallbackMethod_ServerReflectionInfo<
        grpc::reflection::v1alpha::ServerReflection::Service>;

// grpc.reflection.v1alpha.ServerReflection: lists the services for tools such as grpcurl. It needs
// no token, since the contract is no secret. Its streams count toward --max-streams-per-client and
// occupy no thread while they wait.
class ReflectionService : public ReflectionServiceOfBytes {
 public:
  // services: full names of the services to list. The admission must outlive this.
  ReflectionService(Admission& admission, std::vector<std::string> services)
      : admission_(admission), services_(std::move(services)) {}

  BidiReactor* ServerReflectionInfo(CallContext* context) override;

 private:
  Admission& admission_;
  const std::vector<std::string> services_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ADMIN_REFLECTION_SERVICE_H_
