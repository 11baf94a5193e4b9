#ifndef HULLD_SERVER_PROCESS_EXECUTOR_H_
#define HULLD_SERVER_PROCESS_EXECUTOR_H_

#include <chrono>
#include <optional>

#include "server/process/task_pool.h"

namespace hulld::server {

// The only thread that opens OpenMP regions, for pairs with enough textbook axes to justify a team:
// OpenMP keeps a team for each thread that opens one, so a second one would double the threads.
// Pairs are answered in slices, each on the whole team: single calls first, in turns of their
// clients, then batches. A region ends with a wait for the slowest thread, so only work that takes
// far longer than that wait belongs here.
class Executor {
 public:
  // Duration of a slice: far longer than that wait, and too short for other calls to notice.
  static constexpr std::chrono::microseconds kSliceTime{20'000};

  // threads: size of the team. metrics: metrics of the queue of batches. Requires threads > 0.
  explicit Executor(int threads, std::optional<PoolMetrics> metrics = std::nullopt);

  // Size of the team.
  int threads() const { return threads_; }
  // The pool with the only opening thread.
  TaskPool& opener() { return opener_; }

 private:
  const int threads_;
  TaskPool opener_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_EXECUTOR_H_
