#ifndef HULLD_CORE_BASE_STOP_POLL_H_
#define HULLD_CORE_BASE_STOP_POLL_H_

#include <cstdint>
#include <functional>

#include "core/base/check.h"

namespace hulld {

// Polls a caller's should_stop during long work: at the first step, so that abandoned work does not
// start, and then every `steps_per_poll` steps. After should_stop returns true, it is not polled
// again. Not thread-safe; each of several threads that share work needs a poll of its own.
class StopPoll {
 public:
  // For steps that take at most about 10 us each, most of them far less.
  static constexpr uint64_t kStepsPerPoll = 1024;

  // Never stops.
  StopPoll() = default;
  // should_stop may be empty; it must outlive this object. Requires: steps_per_poll > 0; 1 polls at
  // every step.
  explicit StopPoll(const std::function<bool()>& should_stop,
                    uint64_t steps_per_poll = kStepsPerPoll)
      : should_stop_(should_stop ? &should_stop : nullptr), steps_per_poll_(steps_per_poll) {
    HULLD_CHECK(steps_per_poll > 0);
  }
  explicit StopPoll(std::function<bool()>&&, uint64_t = kStepsPerPoll) = delete;
  StopPoll(const StopPoll&) = delete;
  StopPoll& operator=(const StopPoll&) = delete;

  // Counts steps of work that is about to be done. Returns true if should_stop has returned true,
  // now or at an earlier step.
  bool Step(uint64_t steps = 1) {
    if (steps_left_ >= steps) {
      steps_left_ -= steps;
      return stopped_;
    }
    steps_left_ = steps_per_poll_ - 1;
    return Poll();
  }
  // Polls immediately, regardless of the number of steps.
  bool Poll() {
    if (!stopped_ && should_stop_ != nullptr) stopped_ = (*should_stop_)();
    return stopped_;
  }
  bool stopped() const { return stopped_; }

 private:
  const std::function<bool()>* should_stop_ = nullptr;
  uint64_t steps_per_poll_ = kStepsPerPoll;
  // Remaining steps before the next poll.
  uint64_t steps_left_ = 0;
  bool stopped_ = false;
};

}  // namespace hulld

#endif  // HULLD_CORE_BASE_STOP_POLL_H_
