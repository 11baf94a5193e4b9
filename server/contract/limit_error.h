#ifndef HULLD_SERVER_CONTRACT_LIMIT_ERROR_H_
#define HULLD_SERVER_CONTRACT_LIMIT_ERROR_H_

#include <absl/status/status.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace hulld::server {

// RESOURCE_EXHAUSTED because of the limit of a flag: "<what>; the limit is <limit> (--<flag>)",
// with the reason LIMIT_EXCEEDED. flag: without dashes, as in "max-hulls".
absl::Status LimitExceeded(const std::string& what, const std::string& limit,
                           const std::string& flag);
absl::Status LimitExceeded(const std::string& what, uint64_t limit, const std::string& flag);

// The same, with the reason OVERLOADED, for a limit that others use up at the moment: the same
// request may succeed after `retry`.
absl::Status Overloaded(const std::string& what, uint64_t limit, const std::string& flag,
                        std::chrono::milliseconds retry);

// LimitExceeded for a limit that core was given: core's words, followed by the flag.
absl::Status AtLimit(const absl::Status& status, uint64_t limit, const std::string& flag);

// The flag whose limit caused this error, if one did.
std::optional<std::string> ExceededLimit(const absl::Status& status);

// When a request that met this error may be repeated, if soon.
std::optional<std::chrono::milliseconds> RetryAfter(const absl::Status& status);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CONTRACT_LIMIT_ERROR_H_
