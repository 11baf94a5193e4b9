#ifndef HULLD_SERVER_CALL_CALL_LIFETIME_H_
#define HULLD_SERVER_CALL_CALL_LIFETIME_H_

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <atomic>
#include <chrono>

#include "server/contract/errors.h"

namespace hulld::server {

// Deadline, cancellation, and revocation of a call. Any thread may poll it. Uses the monotonic
// clock, so setting the time of day neither ends nor extends a call.
class CallLifetime {
 public:
  using Clock = std::chrono::steady_clock;
  using WallClock = std::chrono::system_clock;

  // deadline: gRPC's wall-clock deadline. wall_now, now: the same time on both clocks.
  explicit CallLifetime(WallClock::time_point deadline,
                        WallClock::time_point wall_now = WallClock::now(),
                        Clock::time_point now = Clock::now())
      : deadline_(Monotonic(deadline, wall_now, now)) {}

  // The client's deadline.
  Clock::time_point deadline() const { return deadline_; }

  // Ends the call after `limit` (--max-request-time) from now; zero means never. A stream of
  // unlimited duration restarts the limit with every message.
  void LimitTime(std::chrono::milliseconds limit) {
    limit_.store(limit, std::memory_order_relaxed);
    const bool unlimited = limit == std::chrono::milliseconds::zero();
    limit_end_.store(unlimited ? Clock::duration::max() : (Clock::now() + limit).time_since_epoch(),
                     std::memory_order_relaxed);
  }

  void Cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  // Stops the call because its token was revoked.
  void Revoke() {
    revoked_.store(true);
    Cancel();
  }
  bool is_revoked() const { return revoked_.load(); }

  bool ShouldStop() const { return cancelled_.load(std::memory_order_relaxed) || Expired(); }

  // Returns the reason why the call stopped. Requires ShouldStop() (not checked, because EndMessage
  // may have lifted the limit since).
  absl::Status StopStatus() const {
    if (is_revoked()) {
      return WithReason(absl::UnauthenticatedError(kRevoked), v1::ERROR_REASON_TOKEN_UNKNOWN);
    }
    if (Clock::now() >= deadline_) {
      return absl::DeadlineExceededError(
          "the deadline expired while the call was running; increase the deadline or request less");
    }
    if (Expired()) {
      const auto limit = limit_.load(std::memory_order_relaxed);
      return LimitExceeded("the request took too long; split it into smaller requests",
                           absl::StrCat(static_cast<double>(limit.count()) / 1000, " s"),
                           "max-request-time");
    }
    return absl::CancelledError("the call was cancelled");
  }

  static constexpr char kRevoked[] =
      "the call's token is no longer valid; ask the server's operator for a new one";

 private:
  static Clock::time_point Monotonic(WallClock::time_point deadline, WallClock::time_point wall_now,
                                     Clock::time_point now) {
    if (deadline == WallClock::time_point::max()) return Clock::time_point::max();
    // Treats a distant deadline as no deadline, to avoid overflow.
    constexpr auto kFar = std::chrono::hours(24 * 365);
    if (deadline - kFar > wall_now) return Clock::time_point::max();
    return now + std::chrono::duration_cast<Clock::duration>(deadline - wall_now);
  }

  bool Expired() const {
    const Clock::time_point now = Clock::now();
    return now >= deadline_ || now.time_since_epoch() >= limit_end_.load(std::memory_order_relaxed);
  }

  const Clock::time_point deadline_;
  std::atomic<std::chrono::milliseconds> limit_ = std::chrono::milliseconds(0);
  std::atomic<Clock::duration> limit_end_ = Clock::duration::max();
  std::atomic<bool> cancelled_ = false;
  std::atomic<bool> revoked_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_CALL_LIFETIME_H_
