#ifndef HULLD_SERVER_ADMIN_REFLECTION_SERVICE_H_
#define HULLD_SERVER_ADMIN_REFLECTION_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include <string>
#include <vector>

#include "grpc/reflection/v1alpha/reflection.grpc.pb.h"
#include "server/call/admission.h"
#include "server/call/call_stream.h"

namespace hulld::server {

// The generated service; its method takes and gives bytes (message_bytes.h).
using ReflectionServiceOfBytes =
    grpc::reflection::v1alpha::ServerReflection::WithRawCallbackMethod_ServerReflectionInfo<
        grpc::reflection::v1alpha::ServerReflection::Service>;

// grpc.reflection.v1alpha.ServerReflection: tells tools such as grpcurl what can be called. It
// needs no token, as the contract is no secret; its streams count among those of their client
// (--max-streams-per-client), and hold no thread while they wait.
class ReflectionService : public ReflectionServiceOfBytes {
 public:
  // services: the full names of those to tell of. The admission must outlive this.
  ReflectionService(Admission& admission, std::vector<std::string> services)
      : admission_(admission), services_(std::move(services)) {}

  BidiReactor* ServerReflectionInfo(grpc::CallbackServerContext* context) override;

 private:
  Admission& admission_;
  const std::vector<std::string> services_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ADMIN_REFLECTION_SERVICE_H_
