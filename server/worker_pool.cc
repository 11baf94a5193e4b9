#include "server/worker_pool.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdint>
#include <utility>

namespace hulld::server {
namespace {

// How long a thread that gives way runs before one that wakes up may take its core: the least that
// Linux takes, instead of some milliseconds.
constexpr uint64_t kSliceNanoseconds = 100'000;

// The first version of Linux's struct sched_attr, which no header of glibc 2.36 declares.
struct SchedulingAttributes {
  uint32_t size;
  uint32_t policy;  // 0: SCHED_OTHER
  uint64_t flags;
  int32_t nice;
  uint32_t priority;
  uint64_t runtime;  // of SCHED_OTHER: the slice, since Linux 6.12; ignored before
  uint64_t deadline;
  uint64_t period;
};

// Lets other threads have the core of this one sooner and longer. On Linux both belong to the
// thread, whatever POSIX says of niceness, and threads that it starts inherit them. Where the
// system refuses, latency under load is all that suffers.
void GiveWay(int niceness) {
  SchedulingAttributes attributes = {};
  attributes.size = sizeof attributes;
  attributes.nice = getpriority(PRIO_PROCESS, 0) + niceness;
  attributes.runtime = kSliceNanoseconds;
  syscall(SYS_sched_setattr, 0, &attributes, 0);
}

}  // namespace

WorkerPool::WorkerPool(int threads, std::optional<PoolMetrics> metrics, int niceness)
    : metrics_(metrics) {
  threads_.reserve(threads);
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this, niceness] { Work(niceness); });
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ready_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void WorkerPool::Submit(std::function<void()> task) {
  {
    const std::lock_guard lock(mutex_);
    tasks_.push_back({std::move(task), std::chrono::steady_clock::now()});
    NoteWaiting();
  }
  ready_.notify_one();
}

void WorkerPool::NoteWaiting() {
  waiting_.store(tasks_.size(), std::memory_order_relaxed);
  if (metrics_.has_value()) metrics_->waiting.Set(static_cast<double>(tasks_.size()));
}

void WorkerPool::Work(int niceness) {
  if (niceness > 0) GiveWay(niceness);
  std::unique_lock lock(mutex_);
  while (true) {
    ready_.wait(lock, [this] { return ending_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    Task task = std::move(tasks_.front());
    tasks_.pop_front();
    NoteWaiting();
    lock.unlock();
    if (metrics_.has_value()) {
      const auto waited = std::chrono::steady_clock::now() - task.submitted;
      metrics_->wait_seconds.Observe(std::chrono::duration<double>(waited).count());
    }
    task.run();
    task.run = nullptr;  // what it holds goes before the lock is taken again
    lock.lock();
  }
}

}  // namespace hulld::server
