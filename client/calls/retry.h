#ifndef HULLD_CLIENT_CALLS_RETRY_H_
#define HULLD_CLIENT_CALLS_RETRY_H_

#include <absl/status/status.h>

#include <chrono>
#include <functional>

namespace hulld {

// By the monotonic clock: setting the time of day neither ends nor prolongs a wait.
using Deadline = std::chrono::steady_clock::time_point;

// When a call that is safe to repeat is repeated: after UNAVAILABLE, which says that the server was
// not reached or is draining, and when the server is overloaded and says when to retry.
// Waits double from initial_backoff to max_backoff, and are at least as long as the server asks.
struct RetryPolicy {
  // Attempts in all; 1 turns retries off.
  int max_attempts = 4;
  std::chrono::milliseconds initial_backoff{100};
  std::chrono::milliseconds max_backoff{2000};
  // Replace the wait and the clock, for tests. Empty: sleeps, and the monotonic clock.
  std::function<void(std::chrono::milliseconds)> wait;
  std::function<Deadline()> now;

  Deadline Now() const { return now ? now() : std::chrono::steady_clock::now(); }
  // The deadline of a call, as gRPC wants it.
  std::chrono::system_clock::time_point ForCall(Deadline deadline) const {
    return std::chrono::system_clock::now() +
           std::chrono::duration_cast<std::chrono::system_clock::duration>(deadline - Now());
  }
};

// The wait after `failures` >= 1 failed attempts.
std::chrono::milliseconds BackoffAfter(const RetryPolicy& policy, int failures);

// Whether a call that ended with this status may be repeated, if it is safe to repeat.
bool MayRetry(const absl::Status& status);

// Waits as the policy says after `failures` failed attempts, the last of which ended with `status`.
// False, without waiting, when the attempts are used up or the wait would pass the deadline.
bool WaitBeforeRetry(const RetryPolicy& policy, int failures, Deadline deadline,
                     const absl::Status& status = absl::OkStatus());

// Calls `attempt` until it returns something that may not be retried, the attempts are used up, or
// the deadline is near. Returns the last attempt's status. `attempt` must be safe to repeat.
absl::Status CallWithRetries(const RetryPolicy& policy, Deadline deadline,
                             const std::function<absl::Status()>& attempt);

}  // namespace hulld

#endif  // HULLD_CLIENT_CALLS_RETRY_H_
