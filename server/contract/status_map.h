#ifndef HULLD_SERVER_CONTRACT_STATUS_MAP_H_
#define HULLD_SERVER_CONTRACT_STATUS_MAP_H_

#include <absl/status/status.h>
#include <grpcpp/support/status.h>

#include <string>

namespace hulld::server {

// The status that a caller gets for a status of ours: same code, same message.
grpc::Status ToGrpc(const absl::Status& status);

// The same for a code alone; also the google.rpc.Code of problems inside replies.
grpc::StatusCode ToGrpc(absl::StatusCode code);

// The status with `prefix` before its message and its payloads kept; OK stays OK.
absl::Status Prefixed(const std::string& prefix, const absl::Status& status);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CONTRACT_STATUS_MAP_H_
