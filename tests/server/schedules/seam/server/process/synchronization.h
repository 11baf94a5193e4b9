#ifndef HULLD_SERVER_PROCESS_SYNCHRONIZATION_H_
#define HULLD_SERVER_PROCESS_SYNCHRONIZATION_H_

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <source_location>
#include <utility>

#include "core/base/check.h"
#include "tests/server/schedules/scheduler.h"

// Replaces the header of this name in sources whose interleavings are explored: all blocking goes
// through the scheduler of the running schedule. The types implement a subset of their standard
// library counterparts.
namespace hulld::server {

// Not recursive. When released, goes to the first thread that runs.
class Mutex {
 public:
  // where: the place of construction, by which steps name the mutex.
  explicit Mutex(const std::source_location& where = std::source_location::current())
      : where_(where) {}
  Mutex(const Mutex&) = delete;
  Mutex& operator=(const Mutex&) = delete;
  ~Mutex() { HULLD_CHECK(!is_held_); }

  void lock() {
    Scheduler& scheduler = Scheduler::Current();
    scheduler.Yield("takes a mutex", this, where_);
    while (is_held_) {
      ++waiting_;
      scheduler.Block("waits for a mutex", this, where_);
      --waiting_;
    }
    is_held_ = true;
  }
  void unlock() {
    HULLD_CHECK(is_held_);
    is_held_ = false;
    if (waiting_ > 0) Scheduler::Current().Unblock(this);
  }

 private:
  const std::source_location where_;
  bool is_held_ = false;
  int waiting_ = 0;
};

// The steps of one schedule, as a clock.
struct SteadyClock {
  using duration = std::chrono::nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<SteadyClock>;
  static constexpr bool is_steady = true;

  static time_point now() { return time_point(duration(Scheduler::Current().Now())); }
};

class ConditionVariable {
 public:
  using Location = std::source_location;

  ConditionVariable() = default;
  ConditionVariable(const ConditionVariable&) = delete;
  ConditionVariable& operator=(const ConditionVariable&) = delete;

  void notify_one(const Location& where = Location::current()) {
    Scheduler::Current().Notify(this, false, where);
  }
  void notify_all(const Location& where = Location::current()) {
    Scheduler::Current().Notify(this, true, where);
  }

  template <typename Lock>
  void wait(Lock& lock, const Location& where = Location::current()) {
    Wait(lock, Scheduler::kNoDeadline, {}, where);
  }
  template <typename Lock, typename Predicate>
  requires std::is_invocable_r_v<bool, Predicate&>
  void wait(Lock& lock, Predicate holds, const Location& where = Location::current()) {
    while (!holds()) Wait(lock, Scheduler::kNoDeadline, ConditionOf(holds), where);
  }

  template <typename Lock>
  std::cv_status wait_until(Lock& lock, SteadyClock::time_point deadline,
                            const Location& where = Location::current()) {
    return Wait(lock, deadline.time_since_epoch().count(), {}, where);
  }
  template <typename Lock>
  std::cv_status wait_for(Lock& lock, SteadyClock::duration duration,
                          const Location& where = Location::current()) {
    return wait_until(lock, SteadyClock::now() + duration, where);
  }
  template <typename Lock, typename Predicate>
  requires std::is_invocable_r_v<bool, Predicate&>
  bool wait_for(Lock& lock, SteadyClock::duration duration, Predicate holds,
                const Location& where = Location::current()) {
    const int64_t deadline = (SteadyClock::now() + duration).time_since_epoch().count();
    while (!holds()) {
      if (Wait(lock, deadline, ConditionOf(holds), where) == std::cv_status::timeout) {
        return holds();
      }
    }
    return true;
  }

 private:
  template <typename Predicate>
  static Scheduler::Condition ConditionOf(Predicate& holds) {
    return {[](const void* context) -> bool {
              return (*static_cast<Predicate*>(const_cast<void*>(context)))();
            },
            &holds};
  }
  // Releasing the mutex and starting to wait are one atomic step.
  template <typename Lock>
  std::cv_status Wait(Lock& lock, int64_t deadline, const Scheduler::Condition& condition,
                      const Location& where) {
    lock.unlock();
    const bool notified = Scheduler::Current().Wait(this, deadline, condition, where);
    lock.lock();
    return notified ? std::cv_status::no_timeout : std::cv_status::timeout;
  }
};

// Ends the process if destroyed before it is joined, as std::thread does.
class Thread {
 public:
  Thread() = default;
  template <typename Task>
  requires std::is_invocable_v<Task&> &&
      (!std::is_same_v<std::remove_cvref_t<Task>, Thread>)explicit Thread(
          Task task, const char* name = nullptr,
          const std::source_location& where = std::source_location::current())
      : number_(Scheduler::Current().StartThread(std::move(task), name, where)),
        is_joinable_(true) {}
  Thread(Thread&& other) noexcept
      : number_(other.number_), is_joinable_(std::exchange(other.is_joinable_, false)) {}
  Thread& operator=(Thread&&) = delete;
  ~Thread() { HULLD_CHECK(!is_joinable_); }

  bool joinable() const { return is_joinable_; }
  void join() {
    HULLD_CHECK(std::exchange(is_joinable_, false));
    Scheduler::Current().JoinThread(number_);
  }

 private:
  size_t number_ = 0;
  bool is_joinable_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_SYNCHRONIZATION_H_
