#ifndef HULLD_SERVER_CALL_CALL_LIFETIME_H_
#define HULLD_SERVER_CALL_CALL_LIFETIME_H_

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <atomic>
#include <chrono>

#include "server/contract/limit_error.h"

namespace hulld::server {

// Whether a call still has someone who waits for its answer. Polled by any thread.
class CallLifetime {
 public:
  using Clock = std::chrono::system_clock;

  explicit CallLifetime(Clock::time_point deadline) : deadline_(deadline) {}

  // Ends the call after `limit` (--max-request-time), from now on; zero: never. A stream that lasts
  // as long as its client likes begins anew with every message.
  void LimitTime(std::chrono::milliseconds limit) {
    limit_ = limit;
    const bool unlimited = limit == std::chrono::milliseconds::zero();
    limit_end_.store(unlimited ? Clock::duration::max() : (Clock::now() + limit).time_since_epoch(),
                     std::memory_order_relaxed);
  }

  void Cancel() { cancelled_.store(true, std::memory_order_relaxed); }

  bool ShouldStop() const { return cancelled_.load(std::memory_order_relaxed) || Expired(); }

  // Why the call stopped. Requires ShouldStop() a moment ago; unchecked, as the system clock may
  // have been set back since.
  absl::Status StopStatus() const {
    if (Clock::now() >= deadline_) {
      return absl::DeadlineExceededError(
          "the deadline passed while the call was running; give it more time or ask for less");
    }
    if (Expired()) {
      return LimitExceeded("the request took too long; ask for less at once",
                           absl::StrCat(static_cast<double>(limit_.count()) / 1000, " s"),
                           "max-request-time");
    }
    return absl::CancelledError("the call was cancelled");
  }

 private:
  bool Expired() const {
    const Clock::time_point now = Clock::now();
    return now >= deadline_ || now.time_since_epoch() >= limit_end_.load(std::memory_order_relaxed);
  }

  const Clock::time_point deadline_;
  // Set before anyone polls.
  std::chrono::milliseconds limit_{0};
  std::atomic<Clock::duration> limit_end_ = Clock::duration::max();
  std::atomic<bool> cancelled_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_CALL_LIFETIME_H_
