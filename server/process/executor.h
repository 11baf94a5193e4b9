#ifndef HULLD_SERVER_PROCESS_EXECUTOR_H_
#define HULLD_SERVER_PROCESS_EXECUTOR_H_

#include <chrono>
#include <optional>

#include "server/process/task_pool.h"

namespace hulld::server {

// The one thread that opens OpenMP regions, for pairs whose textbook axes are worth a team: OpenMP
// keeps a team for each thread that opens one, so a second opener would double the threads. Pairs
// are answered in slices, each on the whole team: those of single calls first, in the turns of
// their clients, then those of batches. At the end of a region the team waits for its slowest
// thread, so only work that lasts far longer than that wait belongs here.
class Executor {
 public:
  // How long a slice may take: far longer than that wait, and too short for others to notice.
  static constexpr std::chrono::microseconds kSliceTime{20'000};

  // threads: how many the team has. metrics: told of the batches that wait. Requires threads > 0.
  explicit Executor(int threads, std::optional<PoolMetrics> metrics = std::nullopt);

  // The size of the team.
  int threads() const { return threads_; }
  // The one thread.
  TaskPool& opener() { return opener_; }

 private:
  const int threads_;
  TaskPool opener_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_EXECUTOR_H_
