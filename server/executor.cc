#include "server/executor.h"

#include <algorithm>
#include <thread>

namespace hulld::server {

Executor::Executor(int threads)
    : threads_(threads > 0 ? threads
                           : std::max(1, static_cast<int>(std::thread::hardware_concurrency()))),
      opener_(1) {}

}  // namespace hulld::server
