#include "server/process/task_pool.h"

#include <sys/prctl.h>

#include <mutex>
#include <thread>
#include <utility>

#include "core/base/check.h"

namespace hulld::server {

TaskPool::Lane::~Lane() { HULLD_CHECK(slices_.empty()); }

void TaskPool::Lane::Submit(std::function<void()> slice, ClientId client) {
  {
    const std::lock_guard lock(pool_.mutex_);
    client_ = client;
    if (slices_.empty()) pool_.lanes_.Push(client, this);
    slices_.push_back({std::move(slice), SteadyClock::now(), true});
    ++pool_.slices_waiting_;
    pool_.NoteWaiting();
  }
  pool_.ready_.notify_one();
}

TaskPool::TaskPool(int threads, std::optional<PoolMetrics> single_metrics,
                   std::optional<PoolMetrics> slice_metrics)
    : single_metrics_(single_metrics),
      slice_metrics_(slice_metrics),
      last_single_call_((SteadyClock::now() - kReserveTime).time_since_epoch()) {
  HULLD_CHECK(threads > 0);
  // Holds the mutex because the first threads read threads().
  const std::lock_guard lock(mutex_);
  threads_.reserve(threads);
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { Work(); });
}

TaskPool::~TaskPool() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ready_.notify_all();
  for (Thread& thread : threads_) thread.join();
}

void TaskPool::Submit(std::function<void()> task, ClientId client, bool is_last) {
  NoteSingleCall();
  {
    const std::lock_guard lock(mutex_);
    single_tasks_.Push(client, {std::move(task), SteadyClock::now(), false});
    NoteWaiting();
    if (is_last && single_tasks_.size() == 1) return;
  }
  ready_.notify_one();
}

void TaskPool::NoteSingleCall() {
  last_single_call_.store(SteadyClock::now().time_since_epoch(), std::memory_order_relaxed);
}

void TaskPool::NoteWaiting() {
  waiting_.store(single_tasks_.size(), std::memory_order_relaxed);
  if (single_metrics_) single_metrics_->waiting.Set(static_cast<double>(single_tasks_.size()));
  if (slice_metrics_) slice_metrics_->waiting.Set(static_cast<double>(slices_waiting_));
}

bool TaskPool::IsReserved() const {
  const SteadyClock::time_point last(last_single_call_.load(std::memory_order_relaxed));
  return SteadyClock::now() - last < kReserveTime;
}

bool TaskPool::MayRunSlice() const {
  if (ending_ || threads_.size() == 1) return true;
  return slices_running_ + size_t{IsReserved()} < threads();
}

std::optional<TaskPool::Task> TaskPool::Next() {
  std::optional<Task> task;
  if (!single_tasks_.empty()) {
    task = single_tasks_.Pop();
  } else if (!lanes_.empty() && MayRunSlice()) {
    Lane& lane = *lanes_.Pop();
    task = std::move(lane.slices_.front());
    lane.slices_.pop_front();
    if (!lane.slices_.empty()) lanes_.Push(lane.client_, &lane);
    --slices_waiting_;
    ++slices_running_;
  }
  if (task.has_value()) NoteWaiting();
  return task;
}

void TaskPool::Work() {
  // By default, the system may extend a pause by 50 us.
  prctl(PR_SET_TIMERSLACK, 1000UL);
  std::unique_lock lock(mutex_);
  while (true) {
    std::optional<Task> task = Next();
    if (!task.has_value()) {
      if (!lanes_.empty()) {
        ready_.wait_for(lock, kReserveTime);  // slices wait until the reserve ends
      } else if (ending_) {
        return;
      } else {
        ready_.wait(lock);
      }
      continue;
    }
    lock.unlock();
    const std::optional<PoolMetrics>& metrics = task->is_slice ? slice_metrics_ : single_metrics_;
    if (metrics.has_value()) {
      const auto waited = SteadyClock::now() - task->submitted;
      metrics->wait_seconds.Observe(std::chrono::duration<double>(waited).count());
    }
    task->run();
    task->run = nullptr;  // destroys captured objects before the lock is acquired again
    if (task->is_slice && IsReserved()) std::this_thread::sleep_for(kPauseTime);
    lock.lock();
    if (task->is_slice) --slices_running_;
  }
}

}  // namespace hulld::server
