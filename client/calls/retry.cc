#include "client/calls/retry.h"

#include <algorithm>
#include <thread>

#include "client/calls/grpc_status.h"

namespace hulld {

std::chrono::milliseconds BackoffAfter(const RetryPolicy& policy, int failures) {
  std::chrono::milliseconds backoff = policy.initial_backoff;
  for (int i = 1; i < failures && backoff < policy.max_backoff; ++i) backoff *= 2;
  return std::min(backoff, policy.max_backoff);
}

bool MayRetry(const absl::Status& status) {
  return absl::IsUnavailable(status) ||
         (absl::IsResourceExhausted(status) && RetryHintOf(status).has_value());
}

bool WaitBeforeRetry(const RetryPolicy& policy, int failures, Deadline deadline,
                     const absl::Status& status) {
  if (failures >= policy.max_attempts) return false;
  const std::chrono::milliseconds requested =
      RetryHintOf(status).value_or(std::chrono::milliseconds(0));
  const std::chrono::milliseconds backoff = std::max(BackoffAfter(policy, failures), requested);
  if (policy.Now() + backoff >= deadline) return false;
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
    if (!MayRetry(status)) return status;
    if (!WaitBeforeRetry(policy, ++failures, deadline, status)) return status;
  }
}

}  // namespace hulld
