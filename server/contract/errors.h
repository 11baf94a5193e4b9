#ifndef HULLD_SERVER_CONTRACT_ERRORS_H_
#define HULLD_SERVER_CONTRACT_ERRORS_H_

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>

#include "hulld/rpc/error_details.pb.h"
#include "hulld/v1/error.pb.h"

// Statuses for callers: their reasons, exceeded limits, and gRPC codes.
namespace hulld::server {

// Converts a status for the caller: same code, same message.
grpc::Status ToGrpc(const absl::Status& status);

// Converts a code; also yields the google.rpc.Code of problems inside replies. All three have the
// same numbers.
inline grpc::StatusCode ToGrpc(absl::StatusCode code) {
  return static_cast<grpc::StatusCode>(code);
}

// Return an error whose message is the concatenation of `parts`, as by absl::StrCat.
template <typename... Parts>
absl::Status InvalidArgument(const Parts&... parts) {
  return absl::InvalidArgumentError(absl::StrCat(parts...));
}
template <typename... Parts>
absl::Status Unavailable(const Parts&... parts) {
  return absl::UnavailableError(absl::StrCat(parts...));
}

// Returns the status with `prefix` before its message, keeping its payloads; OK stays OK.
absl::Status Prefixed(const std::string& prefix, const absl::Status& status);

// A value of an error's metadata: text, or a number in decimal.
struct MetadataEntry {
  MetadataEntry(std::string key_name, std::string text)
      : key(std::move(key_name)), value(std::move(text)) {}
  MetadataEntry(std::string key_name, uint64_t number)
      : key(std::move(key_name)), value(std::to_string(number)) {}

  std::string key;
  std::string value;
};

// Returns the status with a reason and the metadata that error.proto lists for it; replaces any
// earlier reason. Stored as a payload, which Prefixed preserves.
absl::Status WithReason(absl::Status status, v1::ErrorReason reason,
                        std::initializer_list<MetadataEntry> metadata = {});

// UNAVAILABLE: the server is draining, so no call starts and no watch continues.
absl::Status Draining();

// Returns the reason of an error; without one, the reason implied by its code, if any.
v1::ErrorReason ReasonOf(const absl::Status& status);

// Returns a value of the metadata given to WithReason.
std::optional<std::string> MetadataOf(const absl::Status& status, const std::string& key);

// Returns the google.rpc.ErrorInfo of an error; nullopt for an error without a reason.
std::optional<rpc::ErrorInfo> ErrorInfoOf(const absl::Status& status);

// Returns RESOURCE_EXHAUSTED for the limit of a flag: "<what>; the limit is <limit> (--<flag>)",
// with the reason LIMIT_EXCEEDED. flag: without dashes, as in "max-hulls".
absl::Status LimitExceeded(const std::string& what, const std::string& limit,
                           const std::string& flag);
absl::Status LimitExceeded(const std::string& what, uint64_t limit, const std::string& flag);

// Like LimitExceeded, with the reason OVERLOADED: other calls have used up the limit, and the same
// request may succeed after `retry`.
absl::Status Overloaded(const std::string& what, uint64_t limit, const std::string& flag,
                        std::chrono::milliseconds retry);

// Returns LimitExceeded for a limit passed to core: core's message, followed by the flag.
absl::Status AtLimit(const absl::Status& status, uint64_t limit, const std::string& flag);

// Returns the flag of the limit that caused this error, if any.
std::optional<std::string> ExceededLimit(const absl::Status& status);

// Returns the delay after which a request with this error may be retried, if retrying soon may
// help.
std::optional<std::chrono::milliseconds> RetryAfter(const absl::Status& status);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CONTRACT_ERRORS_H_
