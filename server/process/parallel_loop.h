#ifndef HULLD_SERVER_PROCESS_PARALLEL_LOOP_H_
#define HULLD_SERVER_PROCESS_PARALLEL_LOOP_H_

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

#include "core/base/check.h"
#include "server/process/synchronization.h"
#include "server/process/task_pool.h"

namespace hulld::server {

// A loop over [0, count) shared by several threads: each takes the next `step` indices.
class ParallelLoop {
 public:
  // Several threads call it concurrently.
  using Work = std::function<void(size_t begin, size_t end)>;

  // Runs `work` on disjoint ranges that cover [0, count), on this thread and on up to `max_helpers`
  // free threads of a pool. Waits for helpers that have started, but not for queued ones, so it may
  // be called on any thread that may block. After should_stop, which may be empty and is called
  // only on this thread, returns true, the remaining indices are skipped. Requires step > 0.
  static void Run(TaskPool& helpers, size_t max_helpers, size_t count, size_t step, Work work,
                  const std::function<bool()>& should_stop = {}) {
    HULLD_CHECK(step > 0);
    const auto loop = std::make_shared<ParallelLoop>(count, step, std::move(work));
    const size_t steps = (count + step - 1) / step;
    for (size_t i = 1; i < steps && i <= max_helpers; ++i) {
      helpers.Submit([loop] { loop->RunSteps({}); });
    }
    loop->RunSteps(should_stop);
    std::unique_lock lock(loop->mutex_);
    while (loop->done_ < count) loop->all_done_.wait(lock);
  }

  // For Run.
  ParallelLoop(size_t count, size_t step, Work work)
      : count_(count), step_(step), work_(std::move(work)) {}

 private:
  // Works until no step is left.
  void RunSteps(const std::function<bool()>& should_stop) {
    for (size_t begin = next_.fetch_add(step_); begin < count_; begin = next_.fetch_add(step_)) {
      const size_t end = std::min(count_, begin + step_);
      if (!is_stopped_) work_(begin, end);
      if (should_stop && should_stop()) is_stopped_ = true;
      const std::lock_guard lock(mutex_);
      done_ += end - begin;
      if (done_ == count_) all_done_.notify_all();
    }
  }

  const size_t count_;
  const size_t step_;
  // Not called after the loop is done, although late helpers still hold it.
  const Work work_;
  std::atomic<size_t> next_ = 0;
  std::atomic<bool> is_stopped_ = false;
  Mutex mutex_;
  ConditionVariable all_done_;
  size_t done_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_PARALLEL_LOOP_H_
