#include "server/settings/memory_limit.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "server/settings/control_group.h"

namespace hulld::server {
namespace {

// Reads one file of a group. "max" is not a number, and an unmounted controller has no file: both
// mean no limit.
GroupLimit NumberIn(const char* name) {
  return [name](const std::filesystem::path& directory) {
    std::ifstream file(directory / name);
    uint64_t limit = kNoGroupLimit;
    return file >> limit ? limit : kNoGroupLimit;
  };
}

}  // namespace

uint64_t ControlGroupMemory(const std::filesystem::path& root) {
  return LeastGroupLimit(root, "memory", NumberIn("memory.max"), NumberIn("memory.limit_in_bytes"));
}

uint64_t DefaultMemoryLimit() {
  const uint64_t machine =
      static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
  return std::min(machine, ControlGroupMemory()) / 2;
}

}  // namespace hulld::server
