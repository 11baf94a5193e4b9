#ifndef HULLD_SERVER_REGISTRY_COMMIT_HOLD_H_
#define HULLD_SERVER_REGISTRY_COMMIT_HOLD_H_

#include <absl/status/status.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <mutex>

#include "server/process/synchronization.h"

namespace hulld::server {

// A short time during which nothing is committed to one store, by this server or by others, so that
// a reader finds what several stores hold at one instant (Committer::Hold). Between the reader, who
// waits for it and ends it, and the committer's thread, which has it begin and lasts as long.
// Thread-safe.
class CommitHold {
 public:
  // Then it ends by itself: changes wait no longer than that for one reader. Enough to look up the
  // hulls of a large call that are in memory; a choice.
  static constexpr std::chrono::milliseconds kLongest{200};

  // For the reader, once: waits until it has begun. CANCELLED: should_stop said so. Otherwise why
  // it cannot begin.
  absl::Status Await(const std::function<bool()>& should_stop) {
    constexpr std::chrono::milliseconds kCancellationPoll(20);
    std::unique_lock lock(mutex_);
    while (state_ == State::kWanted) {
      changed_.wait_for(lock, kCancellationPoll, [this] { return state_ != State::kWanted; });
      if (state_ != State::kWanted) break;
      lock.unlock();
      const bool stopped = should_stop && should_stop();
      lock.lock();
      if (stopped) return absl::CancelledError("the call was cancelled");
    }
    return status_;
  }
  // For the reader: ends it, or what would begin. Returns whether it has lasted until now.
  bool End() {
    const std::lock_guard lock(mutex_);
    const bool lasted = state_ == State::kHeld;
    state_ = State::kOver;
    changed_.notify_all();
    return lasted;
  }

  // For the committer: whether somebody still waits for it.
  bool is_wanted() {
    const std::lock_guard lock(mutex_);
    return state_ == State::kWanted;
  }
  // Once: it begins if the status is OK, unless it was ended before.
  void Begin(const absl::Status& status) {
    const std::lock_guard lock(mutex_);
    if (state_ != State::kWanted) return;
    state_ = status.ok() ? State::kHeld : State::kOver;
    status_ = status;
    changed_.notify_all();
  }
  // Waits until the reader ends it, or until this time; it is over then.
  void LastUntil(SteadyClock::time_point end) {
    std::unique_lock lock(mutex_);
    const auto left = std::max<SteadyClock::duration>(end - SteadyClock::now(), {});
    changed_.wait_for(lock, left, [this] { return state_ != State::kHeld; });
    state_ = State::kOver;
  }

 private:
  enum class State { kWanted, kHeld, kOver };

  Mutex mutex_;
  ConditionVariable changed_;
  State state_ = State::kWanted;
  absl::Status status_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_COMMIT_HOLD_H_
