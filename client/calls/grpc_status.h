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

// The same code and message, with the reason that the server gave.
absl::Status FromGrpcStatus(const grpc::Status& status);

// The same with the request ID and the time to retry, too. `context` is that of the ended call.
absl::Status FromGrpcStatus(const grpc::Status& status, const grpc::ClientContext& context);

// Why hulld refused or failed. ERROR_REASON_UNSPECIFIED: hulld gave no reason, or the error is not
// hulld's: gRPC gives errors of its own, as when it reaches no server. A reason that this version
// of the contract does not know reads as unspecified, too.
v1::ErrorReason ReasonOf(const absl::Status& status);

// A value that error.proto lists for the reason, such as "expected_sequence"; nullopt when the
// server did not give it.
std::optional<std::string> MetadataOf(const absl::Status& status, const std::string& key);

// The ID under which the server's log knows the call that ended so; empty when unknown.
std::string RequestIdOf(const absl::Status& status);

// How long the server asks to wait before the same call is made again; nullopt when it does not say
// that it may be.
std::optional<std::chrono::milliseconds> RetryHintOf(const absl::Status& status);

}  // namespace hulld

#endif  // HULLD_CLIENT_CALLS_GRPC_STATUS_H_
