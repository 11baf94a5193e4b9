#ifndef HULLD_SERVER_CONTRACT_STATUS_MAP_H_
#define HULLD_SERVER_CONTRACT_STATUS_MAP_H_

#include <absl/status/status.h>
#include <grpcpp/support/status.h>

#include <string>

namespace hulld::server {

// Converts a status for the caller: same code, same message.
grpc::Status ToGrpc(const absl::Status& status);

// Converts a code; also yields the google.rpc.Code of problems inside replies. All three have the
// same numbers.
inline grpc::StatusCode ToGrpc(absl::StatusCode code) {
  return static_cast<grpc::StatusCode>(code);
}

// Returns the status with `prefix` before its message, keeping its payloads; OK stays OK.
absl::Status Prefixed(const std::string& prefix, const absl::Status& status);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CONTRACT_STATUS_MAP_H_
