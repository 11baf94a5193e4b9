#ifndef HULLD_CORE_BASE_STOP_POLL_H_
#define HULLD_CORE_BASE_STOP_POLL_H_

#include <cstdint>
#include <functional>

namespace hulld {

// Asks should_stop, which may be empty and must outlive this, once in kStepsPerPoll steps of work.
class StopPoll {
 public:
  // Steps are exact operations of at most about 10 us each, most of them far less.
  static constexpr uint64_t kStepsPerPoll = 1024;

  explicit StopPoll(const std::function<bool()>& should_stop) : should_stop_(should_stop) {}
  StopPoll(const StopPoll&) = delete;
  StopPoll& operator=(const StopPoll&) = delete;

  // Counts a step; whether to stop, now or since an earlier one.
  bool Step() {
    if (++steps_ % kStepsPerPoll == 0 && !stopped_) stopped_ = should_stop_ && should_stop_();
    return stopped_;
  }
  bool stopped() const { return stopped_; }

 private:
  const std::function<bool()>& should_stop_;
  uint64_t steps_ = 0;
  bool stopped_ = false;
};

}  // namespace hulld

#endif  // HULLD_CORE_BASE_STOP_POLL_H_
