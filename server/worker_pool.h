#ifndef HULLD_SERVER_WORKER_POOL_H_
#define HULLD_SERVER_WORKER_POOL_H_

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace hulld::server {

// A few threads that run tasks in the order in which they came. gRPC calls back on as few as two
// threads, which must stay free to move bytes; whatever may take longer than that runs here.
class WorkerPool {
 public:
  explicit WorkerPool(int threads);
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;
  // Runs what is queued, then ends.
  ~WorkerPool();

  void Submit(std::function<void()> task);

 private:
  void Work();

  std::mutex mutex_;
  std::condition_variable ready_;
  std::deque<std::function<void()>> tasks_;
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_WORKER_POOL_H_
