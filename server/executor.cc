#include "server/executor.h"

#include <sched.h>

#include <algorithm>
#include <chrono>
#include <thread>

namespace hulld::server {

namespace {

// A third of the share of an ordinary thread when both want the same core: no less, as it also
// gives way to other programs.
constexpr int kNiceness = 5;

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
