#ifndef HULLD_SERVER_CALL_LIFETIME_H_
#define HULLD_SERVER_CALL_LIFETIME_H_

#include <absl/status/status.h>

#include <atomic>
#include <chrono>

namespace hulld::server {

// Whether a call still has someone who waits for its answer. Polled by any thread.
class CallLifetime {
 public:
  explicit CallLifetime(std::chrono::system_clock::time_point deadline) : deadline_(deadline) {}

  void Cancel() { cancelled_.store(true, std::memory_order_relaxed); }

  bool ShouldStop() const { return cancelled_.load(std::memory_order_relaxed) || Expired(); }

  // Why the call stopped. Requires ShouldStop().
  absl::Status StopStatus() const {
    if (Expired()) {
      return absl::DeadlineExceededError(
          "the deadline passed while the call was running; give it more time or ask for less");
    }
    return absl::CancelledError("the call was cancelled");
  }

 private:
  bool Expired() const { return std::chrono::system_clock::now() >= deadline_; }

  const std::chrono::system_clock::time_point deadline_;
  std::atomic<bool> cancelled_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_LIFETIME_H_
