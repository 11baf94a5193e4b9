#include "server/process/executor.h"

#include "core/base/check.h"

namespace hulld::server {

Executor::Executor(int threads, std::optional<PoolMetrics> metrics)
    : threads_(threads), opener_(1, std::nullopt, metrics) {
  HULLD_CHECK(threads > 0);
}

}  // namespace hulld::server
