#include "server/memory_limit.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace hulld::server {

uint64_t DefaultMemoryLimit() {
  uint64_t bytes =
      static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
  for (const char* path :
       {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
    // "max" is no number and leaves things as they are.
    std::ifstream file(path);
    uint64_t limit = 0;
    if (file >> limit) bytes = std::min(bytes, limit);
  }
  return bytes / 2;
}

}  // namespace hulld::server
