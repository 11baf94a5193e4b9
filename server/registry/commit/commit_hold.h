#ifndef HULLD_SERVER_REGISTRY_COMMIT_COMMIT_HOLD_H_
#define HULLD_SERVER_REGISTRY_COMMIT_COMMIT_HOLD_H_

#include <absl/status/status.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <mutex>

#include "server/contract/stopped_call.h"
#include "server/process/synchronization.h"

namespace hulld::server {

// A short time during which nothing is committed to one store, by this server or by others, so that
// a reader finds what several stores hold at one instant (Committer::Hold). Between the reader,
// which waits for it and ends it, and the committer's thread, which has it begin and lasts as long.
// Thread-safe.
class CommitHold {
 public:
  // Then it ends by itself: changes wait no longer than that for one reader. Enough to look up the
  // hulls of a large call that are in memory; a choice.
  static constexpr std::chrono::milliseconds kLongest{200};
  // The same for a reader that holds several stores, and restarts the time of all when it has the
  // last (Extend).
  static constexpr std::chrono::milliseconds kLongestOfSeveral{1000};

  // For the reader, once: waits until it has begun. CANCELLED: should_stop said so. Otherwise why
  // it cannot begin.
  absl::Status Await(const std::function<bool()>& should_stop) {
    std::unique_lock lock(mutex_);
    while (state_ == State::kWanted) {
      changed_.wait_for(lock, kStopPoll, [this] { return state_ != State::kWanted; });
      if (state_ != State::kWanted) break;
      lock.unlock();
      const bool stopped = Stopped(should_stop);
      lock.lock();
      if (stopped) return Cancelled();
    }
    return status_;
  }
  // For the reader: it lasts kLongest from now, within kLongestOfSeveral.
  void Extend() {
    const std::lock_guard lock(mutex_);
    end_ = std::min(SteadyClock::now() + kLongest, last_end_);
  }
  // For the reader: ends it, or what would begin. Returns whether nothing was committed from its
  // beginning until now. Waits for the store's word for that: a round trip, and until other readers
  // of the same hold have ended it.
  bool End() {
    std::unique_lock lock(mutex_);
    if (state_ == State::kHeld) {
      state_ = State::kEnding;
      changed_.notify_all();
      changed_.wait(lock, [this] { return state_ != State::kEnding; });
      return lasted_;
    }
    state_ = State::kOver;
    return false;
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
    last_end_ = SteadyClock::now() + kLongestOfSeveral;
    end_ = SteadyClock::now() + kLongest;
    changed_.notify_all();
  }
  // Waits until the reader ends it, or it has taken too long: then it is over.
  void Last() {
    std::unique_lock lock(mutex_);
    while (state_ == State::kHeld) {
      const SteadyClock::time_point now = SteadyClock::now();
      if (now >= end_) {
        state_ = State::kOver;
        return;
      }
      changed_.wait_for(lock, end_ - now, [this] { return state_ != State::kHeld; });
    }
  }
  // After Last: whether nothing was committed meanwhile.
  void Finish(bool lasted) {
    const std::lock_guard lock(mutex_);
    lasted_ = lasted && state_ == State::kEnding;
    state_ = State::kOver;
    changed_.notify_all();
  }

 private:
  // kEnding: the reader has ended it, and waits for Finish.
  enum class State { kWanted, kHeld, kEnding, kOver };

  Mutex mutex_;
  ConditionVariable changed_;
  State state_ = State::kWanted;
  absl::Status status_;
  SteadyClock::time_point end_;
  SteadyClock::time_point last_end_;
  bool lasted_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_COMMIT_COMMIT_HOLD_H_
