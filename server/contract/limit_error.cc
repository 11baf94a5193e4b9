#include "server/contract/limit_error.h"

#include <absl/strings/cord.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

#include "server/contract/error_info.h"

namespace hulld::server {
namespace {

// Metadata keys of error.proto.
constexpr char kFlag[] = "flag";
constexpr char kLimit[] = "limit";
// Status payload, read at the end of the call.
constexpr char kRetryPayload[] = "hulld/retry-ms";

}  // namespace

absl::Status AtLimit(const absl::Status& status, uint64_t limit, const std::string& flag) {
  return WithReason(absl::ResourceExhaustedError(absl::StrCat(status.message(), " (--", flag, ")")),
                    v1::ERROR_REASON_LIMIT_EXCEEDED, {{kFlag, flag}, {kLimit, limit}});
}

absl::Status LimitExceeded(const std::string& what, const std::string& limit,
                           const std::string& flag) {
  return WithReason(
      absl::ResourceExhaustedError(absl::StrCat(what, "; the limit is ", limit, " (--", flag, ")")),
      v1::ERROR_REASON_LIMIT_EXCEEDED, {{kFlag, flag}, {kLimit, limit}});
}

absl::Status LimitExceeded(const std::string& what, uint64_t limit, const std::string& flag) {
  return LimitExceeded(what, std::to_string(limit), flag);
}

absl::Status Overloaded(const std::string& what, uint64_t limit, const std::string& flag,
                        std::chrono::milliseconds retry) {
  absl::Status status = WithReason(LimitExceeded(what, limit, flag), v1::ERROR_REASON_OVERLOADED,
                                   {{kFlag, flag}, {kLimit, limit}});
  status.SetPayload(kRetryPayload, absl::Cord(std::to_string(retry.count())));
  return status;
}

std::optional<std::string> ExceededLimit(const absl::Status& status) {
  return MetadataOf(status, kFlag);
}

std::optional<std::chrono::milliseconds> RetryAfter(const absl::Status& status) {
  const absl::optional<absl::Cord> retry = status.GetPayload(kRetryPayload);
  int64_t milliseconds = 0;
  if (!retry.has_value() || !absl::SimpleAtoi(std::string(*retry), &milliseconds)) {
    return std::nullopt;
  }
  return std::chrono::milliseconds(milliseconds);
}

}  // namespace hulld::server
