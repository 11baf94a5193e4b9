#ifndef HULLD_CLIENT_CALLS_GRPC_STATUS_H_
#define HULLD_CLIENT_CALLS_GRPC_STATUS_H_

#include <absl/status/status.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <optional>
#include <string>

#include "hulld/v1/error.pb.h"

namespace hulld {

// Returns the same code and message, with the server's reason; UNAVAILABLE instead of CANCELLED.
// Requires: the client did not cancel the call.
absl::Status FromGrpcStatus(const grpc::Status& status);

// Same as above, with the request ID and the retry hint. context: the context of the finished call.
absl::Status FromGrpcStatus(const grpc::Status& status, const grpc::ClientContext& context);

// Returns hulld's reason for the error. Returns ERROR_REASON_UNSPECIFIED if hulld sent no reason,
// if this version of the contract does not know it, or if the error comes from gRPC itself, for
// example because no server can be reached.
v1::ErrorReason ReasonOf(const absl::Status& status);

// Returns a value that error.proto lists for the reason, such as "expected_sequence"; nullopt if
// the server did not send it.
std::optional<std::string> MetadataOf(const absl::Status& status, const std::string& key);

// Returns the request ID under which the server logged the failed call; empty if unknown.
std::string RequestIdOf(const absl::Status& status);

// Returns the delay that the server requests before a retry; nullopt if the server did not suggest
// one.
std::optional<std::chrono::milliseconds> RetryHintOf(const absl::Status& status);

}  // namespace hulld

#endif  // HULLD_CLIENT_CALLS_GRPC_STATUS_H_
