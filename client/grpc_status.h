#ifndef HULLD_CLIENT_GRPC_STATUS_H_
#define HULLD_CLIENT_GRPC_STATUS_H_

#include <absl/status/status.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <optional>
#include <string>

namespace hulld {

// The same code and message.
inline absl::Status FromGrpcStatus(const grpc::Status& status) {
  return absl::Status(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
}

// The same with what the server told beside it, for the two functions below. `context` is that of
// the ended call.
absl::Status FromGrpcStatus(const grpc::Status& status, const grpc::ClientContext& context);

// The ID under which the server's log knows the call that ended so; empty when unknown.
std::string RequestIdOf(const absl::Status& status);

// How long the server asks to wait before the same call is made again; nullopt when it does not say
// that it may be.
std::optional<std::chrono::milliseconds> RetryHintOf(const absl::Status& status);

}  // namespace hulld

#endif  // HULLD_CLIENT_GRPC_STATUS_H_
