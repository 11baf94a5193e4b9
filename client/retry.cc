#include "client/retry.h"

#include <algorithm>
#include <thread>

namespace hulld {

std::chrono::milliseconds BackoffAfter(const RetryPolicy& policy, int failures) {
  std::chrono::milliseconds backoff = policy.initial_backoff;
  for (int i = 1; i < failures && backoff < policy.max_backoff; ++i) backoff *= 2;
  return std::min(backoff, policy.max_backoff);
}

bool WaitBeforeRetry(const RetryPolicy& policy, int failures, Deadline deadline) {
  if (failures >= policy.max_attempts) return false;
  const std::chrono::milliseconds backoff = BackoffAfter(policy, failures);
  if (std::chrono::system_clock::now() + backoff >= deadline) return false;
  if (policy.wait) {
    policy.wait(backoff);
  } else {
    std::this_thread::sleep_for(backoff);
  }
  return true;
}

absl::Status CallWithRetries(const RetryPolicy& policy, Deadline deadline,
                             const std::function<absl::Status()>& attempt) {
  for (int failures = 0;;) {
    absl::Status status = attempt();
    if (!absl::IsUnavailable(status)) return status;
    if (!WaitBeforeRetry(policy, ++failures, deadline)) return status;
  }
}

}  // namespace hulld
