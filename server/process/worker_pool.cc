#include "server/process/worker_pool.h"

#include <mutex>
#include <utility>

#include "core/base/check.h"

namespace hulld::server {

WorkerPool::WorkerPool(int threads, std::optional<PoolMetrics> metrics) : metrics_(metrics) {
  HULLD_CHECK(threads > 0);
  threads_.reserve(threads);
  for (int i = 0; i < threads; ++i) threads_.push_back(Thread([this] { Work(); }));
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ready_.notify_all();
  for (Thread& thread : threads_) thread.join();
}

void WorkerPool::Submit(std::function<void()> task, ClientId client) {
  {
    const std::lock_guard lock(mutex_);
    tasks_.Push(client, {std::move(task), SteadyClock::now()});
    NoteWaiting();
  }
  ready_.notify_one();
}

void WorkerPool::NoteWaiting() {
  const size_t before = waiting_.exchange(tasks_.size(), std::memory_order_relaxed);
  // Pools may share the gauge, which shows their sum.
  if (metrics_.has_value()) {
    metrics_->waiting.Increment(static_cast<double>(tasks_.size()) - static_cast<double>(before));
  }
}

void WorkerPool::Work() {
  std::unique_lock lock(mutex_);
  while (true) {
    ready_.wait(lock, [this] { return ending_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    Task task = tasks_.Pop();
    NoteWaiting();
    lock.unlock();
    if (metrics_.has_value()) {
      const auto waited = SteadyClock::now() - task.submitted;
      metrics_->wait_seconds.Observe(std::chrono::duration<double>(waited).count());
    }
    task.run();
    task.run = nullptr;  // destroys captured objects before the lock is acquired again
    lock.lock();
  }
}

}  // namespace hulld::server
