#ifndef HULLD_SERVER_PROCESS_EXECUTOR_H_
#define HULLD_SERVER_PROCESS_EXECUTOR_H_

#include <functional>
#include <optional>

#include "server/process/worker_pool.h"

namespace hulld::server {

// The one thread that opens OpenMP regions: OpenMP keeps a team of threads for each thread that
// opens one, so a second opener would double the threads. Tasks run one after the other, each on
// the whole team; long work comes in slices that queue again, so that calls take turns. The team
// runs at a lower priority than all other threads, which bring what it works on and send what it
// found, and answer single pairs meanwhile.
class Executor {
 public:
  // threads: of the team; 0: one per core. metrics: as for WorkerPool.
  explicit Executor(int threads, std::optional<PoolMetrics> metrics = std::nullopt);

  int threads() const { return threads_; }
  // Lets threads that wait for this one's core have it, now and then; called often by what runs on
  // the team. Linux would else let a thread that computes go on until its next tick, of 4 ms as a
  // rule, whoever wakes up meanwhile. Cost: ~30 ns, and a system call every 100 us.
  static void GiveWay();

  void Submit(std::function<void()> task) { opener_.Submit(std::move(task)); }

 private:
  const int threads_;
  WorkerPool opener_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_EXECUTOR_H_
