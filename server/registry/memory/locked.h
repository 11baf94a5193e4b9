#ifndef HULLD_SERVER_REGISTRY_MEMORY_LOCKED_H_
#define HULLD_SERVER_REGISTRY_MEMORY_LOCKED_H_

#include <absl/status/status.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "server/contract/stopped_call.h"
#include "server/process/synchronization.h"

namespace hulld::server {

// Maximum number of hulls and bodies looked up before the registry's mutex is released; takes about
// 50 us.
inline constexpr uint64_t kMaxLookupsPerHold = 128;

// Longest time that a mutex was held, and the maximum work done while it was held.
struct HoldStatistics {
  // Longest time within this minute and the one before, excluding waits on a condition variable.
  std::chrono::nanoseconds longest{0};
  // Maximum number of hulls looked up before the mutex was released.
  uint64_t max_lookups = 0;
};

// A mutex without barging: a waiting thread gets the mutex before the releasing thread can acquire
// it again, so work that is divided into slices yields between them. Measures its hold times.
//
// The next thread in line holds `entry_` while it waits. A thread that returns waits for `entry_`,
// and therefore until the next thread has the mutex.
class FairMutex {
 public:
  FairMutex() = default;
  FairMutex(const FairMutex&) = delete;
  FairMutex& operator=(const FairMutex&) = delete;

  // Interface of std::lock_guard. Cost: two mutexes, and a clock read.
  void lock() {
    const std::lock_guard entry(entry_);
    is_wanted_ = true;
    mutex_.lock();
    is_wanted_ = false;
    BeginHold();
  }
  void unlock() {
    EndHold();
    mutex_.unlock();
  }

  // True if a thread is next in line.
  bool is_wanted() const { return is_wanted_; }

  // Requires: the mutex is held (not checked, because it does not know its holder).
  HoldStatistics Statistics() const {
    const int64_t age = MinuteOf(Clock::now()) - minute_;
    const auto longest = age == 0   ? std::max(longest_, longest_before_)
                         : age == 1 ? longest_
                                    : std::chrono::nanoseconds(0);
    return {longest, std::max(max_lookups_, lookups_)};
  }

 private:
  friend class Locked;
  using Clock = SteadyClock;

  static int64_t MinuteOf(Clock::time_point time) {
    return std::chrono::floor<std::chrono::minutes>(time.time_since_epoch()).count();
  }
  void BeginHold() {
    since_ = Clock::now();
    lookups_ = 0;
  }
  void EndHold() {
    const Clock::time_point now = Clock::now();
    if (const int64_t minute = MinuteOf(now); minute != minute_) {
      longest_before_ = minute == minute_ + 1 ? longest_ : std::chrono::nanoseconds(0);
      longest_ = std::chrono::nanoseconds(0);
      minute_ = minute;
    }
    longest_ = std::max<std::chrono::nanoseconds>(longest_, now - since_);
    max_lookups_ = std::max(max_lookups_, lookups_);
  }

  Mutex entry_;
  Mutex mutex_;
  // Written by the thread that holds entry_.
  std::atomic<bool> is_wanted_ = false;
  // mutex_ guards the members below.
  Clock::time_point since_;
  uint64_t lookups_ = 0;
  uint64_t max_lookups_ = 0;
  int64_t minute_ = 0;
  std::chrono::nanoseconds longest_{0};
  std::chrono::nanoseconds longest_before_{0};
};

// A held mutex, and the tasks deferred until its release: callbacks, which may call back, and the
// destruction of large objects. A function with a Locked parameter requires the mutex; the type
// enforces it. Not thread-safe.
class Locked {
 public:
  explicit Locked(FairMutex& mutex) : mutex_(mutex) { Lock(); }
  Locked(const Locked&) = delete;
  Locked& operator=(const Locked&) = delete;
  ~Locked() {
    if (is_held_) Unlock();
  }

  // True if this mutex is the one held.
  bool Holds(const FairMutex& mutex) const { return is_held_ && &mutex_ == &mutex; }

  // Releases the mutex and runs the deferred tasks in order.
  void Unlock() {
    HULLD_CHECK(is_held_);
    const std::vector<std::function<void()>> due = std::exchange(deferred_, {});
    is_held_ = false;
    mutex_.unlock();
    for (const std::function<void()>& task : due) task();
  }
  void Lock() {
    HULLD_CHECK(!is_held_);
    mutex_.lock();
    is_held_ = true;
  }
  // Releases the mutex, runs the deferred tasks, and acquires the mutex again.
  void Yield() {
    Unlock();
    Lock();
  }
  // For condition variables: wait(lock) releases the mutex while it waits.
  template <typename Wait>
  void WaitOn(const Wait& wait) {
    HULLD_CHECK(is_held_);
    mutex_.EndHold();
    std::unique_lock lock(mutex_.mutex_, std::adopt_lock);
    wait(lock);
    lock.release();
    mutex_.BeginHold();
  }

  // Runs the deferred tasks, then blocks until is_over() returns true; `changed` is notified when
  // it may. CANCELLED: should_stop, which may be empty, returned true.
  absl::Status Await(ConditionVariable& changed, const std::function<bool()>& should_stop,
                     const std::function<bool()>& is_over) {
    Yield();
    while (!is_over()) {
      WaitOn([&](auto& lock) { changed.wait_for(lock, kStopPoll, is_over); });
      if (Stopped(should_stop)) return Cancelled();
    }
    return absl::OkStatus();
  }

  // Calls start(done), then blocks, like Await, until done(locked, status) is called with the mutex
  // held, perhaps on another thread. Returns that status.
  template <typename Start>
  absl::Status AwaitCall(const std::function<bool()>& should_stop, const Start& start) {
    struct Wait {
      ConditionVariable changed;
      std::optional<absl::Status> result;
    };
    const auto wait = std::make_shared<Wait>();
    start([wait](Locked&, const absl::Status& status) {
      wait->result = status;
      wait->changed.notify_all();
    });
    const absl::Status stopped =
        Await(wait->changed, should_stop, [&] { return wait->result.has_value(); });
    return stopped.ok() ? *wait->result : stopped;
  }

  // Counts a lookup since the mutex was acquired.
  void NoteLookup() { ++mutex_.lookups_; }
  uint64_t lookups() const { return mutex_.lookups_; }
  // Like NoteLookup, but first yields if kMaxLookupsPerHold is reached.
  void NoteLookupOrYield() {
    if (lookups() >= kMaxLookupsPerHold) Yield();
    NoteLookup();
  }

  void Defer(std::function<void()> task) { deferred_.push_back(std::move(task)); }
  // Defers a task that acquires the mutex again.
  void DeferLocked(std::function<void(Locked&)> task) {
    Defer([&mutex = mutex_, task = std::move(task)] {
      Locked again(mutex);
      task(again);
    });
  }
  template <typename T>
  void Discard(std::unique_ptr<T> object) {
    if (object != nullptr) Discard(std::shared_ptr<T>(std::move(object)));
  }
  template <typename T>
  void Discard(std::shared_ptr<T> object) {
    if (object != nullptr) deferred_.push_back([kept = std::move(object)] {});
  }

 private:
  FairMutex& mutex_;
  bool is_held_ = false;
  std::vector<std::function<void()>> deferred_;
};

// A task that runs with the mutex held.
using LockedTask = std::function<void(Locked&)>;

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_MEMORY_LOCKED_H_
