#ifndef HULLD_CLIENT_CALLS_RETRY_H_
#define HULLD_CLIENT_CALLS_RETRY_H_

#include <absl/status/status.h>

#include <chrono>
#include <functional>
#include <limits>

namespace hulld {

// Monotonic, so that setting the system clock neither ends nor prolongs a wait.
using Deadline = std::chrono::steady_clock::time_point;

// Retries calls that are safe to repeat: after UNAVAILABLE (the server is unreachable or draining),
// and after RESOURCE_EXHAUSTED with a retry hint. Retries continue until the deadline of the call,
// so that a call outlives a server restart. The backoff doubles from initial_backoff to max_backoff
// and is at least the server's hint.
struct RetryPolicy {
  // Total attempts; 1 disables retries. By default only the deadline bounds them.
  int max_attempts = std::numeric_limits<int>::max();
  std::chrono::milliseconds initial_backoff{100};
  std::chrono::milliseconds max_backoff{2000};
  // Replacements for the wait and the clock, for tests. Default to a sleep and the monotonic clock.
  std::function<void(std::chrono::milliseconds)> wait;
  std::function<Deadline()> now;

  Deadline Now() const { return now ? now() : std::chrono::steady_clock::now(); }
  // Converts a deadline to the system clock, which gRPC expects.
  std::chrono::system_clock::time_point ForCall(Deadline deadline) const {
    return std::chrono::system_clock::now() +
           std::chrono::duration_cast<std::chrono::system_clock::duration>(deadline - Now());
  }
};

// Returns the backoff after `failures` >= 1 failed attempts.
std::chrono::milliseconds BackoffAfter(const RetryPolicy& policy, int failures);

// Returns true if this status permits a retry of a call that is safe to repeat.
bool MayRetry(const absl::Status& status);

// Waits for the backoff after `failures` failed attempts, the last of which returned `status`.
// Returns false without waiting if the attempts are exhausted or the wait would pass the deadline.
bool WaitBeforeRetry(const RetryPolicy& policy, int failures, Deadline deadline,
                     const absl::Status& status = absl::OkStatus());

// Calls `attempt` until its status rules out a retry, the attempts are exhausted, or the deadline
// is near. Returns the last status. Requires: `attempt` is safe to repeat.
absl::Status CallWithRetries(const RetryPolicy& policy, Deadline deadline,
                             const std::function<absl::Status()>& attempt);

}  // namespace hulld

#endif  // HULLD_CLIENT_CALLS_RETRY_H_
