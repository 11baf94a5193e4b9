#ifndef HULLD_SERVER_PROCESS_WORKER_POOL_H_
#define HULLD_SERVER_PROCESS_WORKER_POOL_H_

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "server/process/fair_queue.h"
#include "server/process/metrics.h"
#include "server/process/synchronization.h"

namespace hulld::server {

// A few threads that run tasks at the priority of the process: clients take turns, and the tasks of
// a client stay in order. gRPC calls back on as few as two threads, which must stay free to move
// bytes. Work that may wait for the store or for a file runs here; pure computation runs on a
// TaskPool.
class WorkerPool {
 public:
  // metrics: metrics of the queue. Requires threads > 0.
  explicit WorkerPool(int threads, std::optional<PoolMetrics> metrics = std::nullopt);
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;
  // Runs the queued tasks, then ends.
  ~WorkerPool();

  // client: the client that waits for it.
  void Submit(std::function<void()> task, ClientId client = kNoClient);

  size_t threads() const { return threads_.size(); }
  // Number of tasks waiting for a thread.
  size_t waiting() const { return waiting_.load(std::memory_order_relaxed); }

 private:
  struct Task {
    std::function<void()> run;
    SteadyClock::time_point submitted;
  };

  void Work();
  // Requires the mutex (not checked: a Mutex does not track its owner).
  void NoteWaiting();

  std::optional<PoolMetrics> metrics_;
  Mutex mutex_;
  ConditionVariable ready_;
  FairQueue<Task> tasks_;
  std::atomic<size_t> waiting_ = 0;
  bool ending_ = false;
  std::vector<Thread> threads_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_WORKER_POOL_H_
