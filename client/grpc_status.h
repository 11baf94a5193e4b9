#ifndef HULLD_CLIENT_GRPC_STATUS_H_
#define HULLD_CLIENT_GRPC_STATUS_H_

#include <absl/status/status.h>
#include <grpcpp/support/status.h>

namespace hulld {

// The same code and message.
inline absl::Status FromGrpcStatus(const grpc::Status& status) {
  return absl::Status(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
}

}  // namespace hulld

#endif  // HULLD_CLIENT_GRPC_STATUS_H_
