#include "server/settings/memory_limit.h"

#include <absl/strings/str_split.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

namespace hulld::server {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kNoLimit = std::numeric_limits<uint64_t>::max();

// "max" is no number, and what is not mounted has no file: both are no limit.
uint64_t ReadLimit(const fs::path& path) {
  std::ifstream file(path);
  uint64_t limit = kNoLimit;
  return file >> limit ? limit : kNoLimit;
}

// A group's own limit says nothing of those above it, which bind it too. In a container the path
// may be the one that the host knows; of that the root alone is there, and is the container's own.
uint64_t LeastLimit(const fs::path& mount, const std::string& group, const char* file) {
  uint64_t least = ReadLimit(mount / file);
  fs::path path = mount;
  for (const fs::path& part : fs::path(group).lexically_normal().relative_path()) {
    path /= part;
    least = std::min(least, ReadLimit(path / file));
  }
  return least;
}

}  // namespace

// A line is hierarchy:controllers:group. Version 2 is the hierarchy 0, without controllers.
// Source: cgroups(7).
uint64_t ControlGroupMemory(const fs::path& root) {
  const fs::path mount = root / "sys/fs/cgroup";
  uint64_t least = std::min(LeastLimit(mount, "/", "memory.max"),
                            LeastLimit(mount / "memory", "/", "memory.limit_in_bytes"));
  std::ifstream groups(root / "proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const std::vector<std::string> parts = absl::StrSplit(line, absl::MaxSplits(':', 2));
    if (parts.size() < 3) continue;
    const std::vector<std::string> controllers = absl::StrSplit(parts[1], ',');
    if (parts[1].empty()) {
      least = std::min(least, LeastLimit(mount, parts[2], "memory.max"));
    } else if (std::ranges::find(controllers, "memory") != controllers.end()) {
      least = std::min(least, LeastLimit(mount / "memory", parts[2], "memory.limit_in_bytes"));
    }
  }
  return least;
}

uint64_t DefaultMemoryLimit() {
  const uint64_t machine =
      static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
  return std::min(machine, ControlGroupMemory()) / 2;
}

}  // namespace hulld::server
