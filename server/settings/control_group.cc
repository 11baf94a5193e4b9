#include "server/settings/control_group.h"

#include <absl/strings/str_split.h>

#include <algorithm>
#include <fstream>
#include <vector>

namespace hulld::server {
namespace {

namespace fs = std::filesystem;

// In a container, the path may be the host's. Then only the root directory exists, and it belongs
// to the container's own group.
uint64_t LeastAlong(const fs::path& mount, const std::string& group, const GroupLimit& limit) {
  uint64_t least = limit(mount);
  fs::path path = mount;
  for (const fs::path& part : fs::path(group).lexically_normal().relative_path()) {
    path /= part;
    least = std::min(least, limit(path));
  }
  return least;
}

}  // namespace

// A line is hierarchy:controllers:group. Version 2 uses hierarchy 0 and lists no controllers.
uint64_t LeastGroupLimit(const fs::path& root, const std::string& controller,
                         const GroupLimit& version_2, const GroupLimit& version_1) {
  const fs::path mount = root / "sys/fs/cgroup";
  uint64_t least = std::min(version_2(mount), version_1(mount / controller));
  std::ifstream groups(root / "proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const std::vector<std::string> parts = absl::StrSplit(line, absl::MaxSplits(':', 2));
    if (parts.size() < 3) continue;
    const std::vector<std::string> controllers = absl::StrSplit(parts[1], ',');
    if (parts[1].empty()) {
      least = std::min(least, LeastAlong(mount, parts[2], version_2));
    } else if (std::ranges::find(controllers, controller) != controllers.end()) {
      least = std::min(least, LeastAlong(mount / controller, parts[2], version_1));
    }
  }
  return least;
}

}  // namespace hulld::server
