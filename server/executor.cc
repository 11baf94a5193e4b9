#include "server/executor.h"

#include <algorithm>
#include <thread>

namespace hulld::server {

namespace {

// Two thirds of the share of an ordinary thread when both want the same core: a little, as it also
// gives way to other programs.
constexpr int kNiceness = 2;

}  // namespace

Executor::Executor(int threads, std::optional<PoolMetrics> metrics)
    : threads_(threads > 0 ? threads
                           : std::max(1, static_cast<int>(std::thread::hardware_concurrency()))),
      opener_(1, metrics, kNiceness) {}

}  // namespace hulld::server
