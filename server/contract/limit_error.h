#ifndef HULLD_SERVER_CONTRACT_LIMIT_ERROR_H_
#define HULLD_SERVER_CONTRACT_LIMIT_ERROR_H_

#include <absl/status/status.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace hulld::server {

// Returns RESOURCE_EXHAUSTED for the limit of a flag: "<what>; the limit is <limit> (--<flag>)",
// with the reason LIMIT_EXCEEDED. flag: without dashes, as in "max-hulls".
absl::Status LimitExceeded(const std::string& what, const std::string& limit,
                           const std::string& flag);
absl::Status LimitExceeded(const std::string& what, uint64_t limit, const std::string& flag);

// As LimitExceeded, with the reason OVERLOADED: other calls have used up the limit, and the same
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

#endif  // HULLD_SERVER_CONTRACT_LIMIT_ERROR_H_
