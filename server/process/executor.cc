#include "server/process/executor.h"

#include <sched.h>

#include <algorithm>
#include <chrono>
#include <thread>

namespace hulld::server {

namespace {

// The least share, so that a single call has a core as soon as it wants one. Observed
// (tests/bench/service/overload_benchmark.cc): its p99 beside batches is 1.4 to 2.6 times that without,
// where 10 gives up to 4.8 and 5 up to 6.8. In a service of the system or in a container this
// concerns the threads of the process alone, as others compete with it as a whole.
constexpr int kNiceness = 19;

// How long a single pair may wait for a core that answers batches.
constexpr std::chrono::microseconds kTurn(100);

}  // namespace

void Executor::GiveWay() {
  thread_local std::chrono::steady_clock::time_point last;
  if (std::chrono::steady_clock::now() - last < kTurn) return;
  sched_yield();
  last = std::chrono::steady_clock::now();
}

Executor::Executor(int threads, std::optional<PoolMetrics> metrics)
    : threads_(threads > 0 ? threads
                           : std::max(1, static_cast<int>(std::thread::hardware_concurrency()))),
      opener_(1, metrics, kNiceness) {}

}  // namespace hulld::server
