#include "server/executor.h"

#include <algorithm>
#include <thread>

namespace hulld::server {

namespace {

// A tenth of the share of a thread of the ordinary niceness, when both want the same core.
constexpr int kNiceness = 10;

}  // namespace

Executor::Executor(int threads, std::optional<PoolMetrics> metrics)
    : threads_(threads > 0 ? threads
                           : std::max(1, static_cast<int>(std::thread::hardware_concurrency()))),
      opener_(1, metrics, kNiceness) {}

}  // namespace hulld::server
