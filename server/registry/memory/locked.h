#ifndef HULLD_SERVER_REGISTRY_MEMORY_LOCKED_H_
#define HULLD_SERVER_REGISTRY_MEMORY_LOCKED_H_

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "server/process/synchronization.h"

namespace hulld::server {

// Hulls and bodies that are looked up within one hold of the registry's mutex, at most: some 50 us.
inline constexpr uint64_t kMostLookupsPerHold = 128;

// How long a mutex was held at once, and for how much work.
struct HoldStatistics {
  // The longest hold within this minute and the one before. Waiting on a condition is none.
  std::chrono::nanoseconds longest{0};
  // Hulls that were looked up within one hold, at most.
  uint64_t most_lookups = 0;
};

// A mutex without barging: a waiting thread gets it before the thread that releases it can take it
// again. So work that is cut in slices lets others pass between them. It knows how long it was
// held.
//
// The next thread in line holds `entry_` while it waits. A thread that comes again waits for that,
// and so until the next one has the mutex.
class FairMutex {
 public:
  FairMutex() = default;
  FairMutex(const FairMutex&) = delete;
  FairMutex& operator=(const FairMutex&) = delete;

  // As std::lock_guard wants them. Cost: two mutexes, and a look at the clock.
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

  // Whether a thread is the next to have it.
  bool is_wanted() const { return is_wanted_; }

  // Requires that it is held (unchecked: it does not tell which thread holds it).
  HoldStatistics Statistics() const {
    const int64_t age = MinuteOf(Clock::now()) - minute_;
    const auto longest = age == 0   ? std::max(longest_, longest_before_)
                         : age == 1 ? longest_
                                    : std::chrono::nanoseconds(0);
    return {longest, std::max(most_lookups_, lookups_)};
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
    most_lookups_ = std::max(most_lookups_, lookups_);
  }

  Mutex entry_;
  Mutex mutex_;
  // Written by the thread that holds entry_.
  std::atomic<bool> is_wanted_ = false;
  // The rest is guarded by mutex_.
  Clock::time_point since_;
  uint64_t lookups_ = 0;
  uint64_t most_lookups_ = 0;
  int64_t minute_ = 0;
  std::chrono::nanoseconds longest_{0};
  std::chrono::nanoseconds longest_before_{0};
};

// A mutex that is held, and the work that is due once it is not: callbacks, which may call back,
// and the end of large objects. A function that takes a Locked requires the mutex; its type is the
// check. Not thread-safe.
class Locked {
 public:
  explicit Locked(FairMutex& mutex) : mutex_(mutex) { Lock(); }
  Locked(const Locked&) = delete;
  Locked& operator=(const Locked&) = delete;
  ~Locked() {
    if (is_held_) Unlock();
  }

  // Whether it is this mutex that is held.
  bool Holds(const FairMutex& mutex) const { return is_held_ && &mutex_ == &mutex; }

  // Releases the mutex, and does what is due, in the order in which it was given.
  void Unlock() {
    HULLD_CHECK(is_held_);
    const std::vector<std::function<void()>> due = std::exchange(afterwards_, {});
    is_held_ = false;
    mutex_.unlock();
    for (const std::function<void()>& task : due) task();
  }
  void Lock() {
    HULLD_CHECK(!is_held_);
    mutex_.lock();
    is_held_ = true;
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

  // A hull is looked up. Counts those since the mutex was taken.
  void NoteLookup() { ++mutex_.lookups_; }
  uint64_t lookups() const { return mutex_.lookups_; }

  // Before a lookup that is one of many: counts it, and lets others have the mutex after
  // kMostLookupsPerHold of them.
  void LetOthersPass() {
    if (lookups() == kMostLookupsPerHold) {
      Unlock();
      Lock();
    }
    NoteLookup();
  }

  void Afterwards(std::function<void()> task) { afterwards_.push_back(std::move(task)); }
  // The same for a task that needs the mutex, which is taken anew for it.
  void AfterwardsLocked(std::function<void(Locked&)> task) {
    Afterwards([&mutex = mutex_, task = std::move(task)] {
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
    if (object != nullptr) afterwards_.push_back([kept = std::move(object)] {});
  }

 private:
  FairMutex& mutex_;
  bool is_held_ = false;
  std::vector<std::function<void()>> afterwards_;
};

// Something that is done with the mutex held.
using LockedTask = std::function<void(Locked&)>;

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_MEMORY_LOCKED_H_
