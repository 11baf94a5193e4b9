#include "server/contract/limit_error.h"

#include <absl/strings/cord.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

namespace hulld::server {
namespace {

// Payloads of a status, read again where the call ends.
constexpr char kLimitPayload[] = "hulld/limit";
constexpr char kRetryPayload[] = "hulld/retry-ms";

}  // namespace

absl::Status AtLimit(const absl::Status& status, const std::string& flag) {
  absl::Status named =
      absl::ResourceExhaustedError(absl::StrCat(status.message(), " (--", flag, ")"));
  named.SetPayload(kLimitPayload, absl::Cord(flag));
  return named;
}

absl::Status LimitExceeded(const std::string& what, const std::string& limit,
                           const std::string& flag) {
  return AtLimit(absl::ResourceExhaustedError(absl::StrCat(what, "; the limit is ", limit)), flag);
}

absl::Status LimitExceeded(const std::string& what, uint64_t limit, const std::string& flag) {
  return LimitExceeded(what, std::to_string(limit), flag);
}

absl::Status Overloaded(const std::string& what, uint64_t limit, const std::string& flag,
                        std::chrono::milliseconds retry) {
  absl::Status status = LimitExceeded(what, limit, flag);
  status.SetPayload(kRetryPayload, absl::Cord(std::to_string(retry.count())));
  return status;
}

std::optional<std::string> ExceededLimit(const absl::Status& status) {
  const absl::optional<absl::Cord> flag = status.GetPayload(kLimitPayload);
  if (!flag.has_value()) return std::nullopt;
  return std::string(*flag);
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
