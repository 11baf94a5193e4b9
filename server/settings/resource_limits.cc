#include "server/settings/resource_limits.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <thread>
#include <vector>

namespace hulld::server {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kNoGroupLimit = std::numeric_limits<uint64_t>::max();

// Returns the limit in a group's directory, or kNoGroupLimit.
using GroupLimit = std::function<uint64_t(const fs::path& directory)>;

// In a container, the path may be the host's. Then only the root exists, and it is the container's
// own group.
uint64_t MinAlong(const fs::path& mount, const std::string& group, const GroupLimit& limit) {
  uint64_t least = limit(mount);
  fs::path path = mount;
  for (const fs::path& part : fs::path(group).lexically_normal().relative_path()) {
    path /= part;
    least = std::min(least, limit(path));
  }
  return least;
}

// Returns the least limit of this process's control group and of that group's ancestors, which also
// bind the process; of versions 1 and 2. controller: its name in version 1, as in "memory". A line
// is hierarchy:controllers:group; version 2 is the hierarchy 0, without controllers. Source:
// cgroups(7).
uint64_t MinGroupLimit(const fs::path& root, const std::string& controller,
                       const GroupLimit& version_2, const GroupLimit& version_1) {
  const fs::path mount = root / "sys/fs/cgroup";
  uint64_t least = std::min(version_2(mount), version_1(mount / controller));
  std::ifstream groups(root / "proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const std::vector<std::string> parts = absl::StrSplit(line, absl::MaxSplits(':', 2));
    if (parts.size() < 3) continue;
    const std::vector<std::string> controllers = absl::StrSplit(parts[1], ',');
    if (parts[1].empty()) {
      least = std::min(least, MinAlong(mount, parts[2], version_2));
    } else if (std::ranges::find(controllers, controller) != controllers.end()) {
      least = std::min(least, MinAlong(mount / controller, parts[2], version_1));
    }
  }
  return least;
}

// Converts a quota of time per period, both in microseconds, to thousandths of a processor. In
// version 1, a quota of -1 means no limit.
uint64_t Thousandths(double quota, double period) {
  if (!(quota > 0 && period > 0)) return kNoGroupLimit;
  return static_cast<uint64_t>(std::max(1.0, std::round(1000 * quota / period)));
}

// "200000 100000", or "max 100000" for none.
uint64_t ReadCpuMax(const fs::path& directory) {
  std::ifstream file(directory / "cpu.max");
  double quota = 0;
  double period = 0;
  return file >> quota >> period ? Thousandths(quota, period) : kNoGroupLimit;
}

uint64_t ReadCfsQuota(const fs::path& directory) {
  std::ifstream quota_file(directory / "cpu.cfs_quota_us");
  std::ifstream period_file(directory / "cpu.cfs_period_us");
  double quota = 0;
  double period = 0;
  return quota_file >> quota && period_file >> period ? Thousandths(quota, period) : kNoGroupLimit;
}

// Reads one file of a group. "max" is not a number, and an unmounted controller has no file: both
// mean no limit.
GroupLimit NumberIn(const char* name) {
  return [name](const fs::path& directory) {
    std::ifstream file(directory / name);
    uint64_t limit = kNoGroupLimit;
    return file >> limit ? limit : kNoGroupLimit;
  };
}

}  // namespace

int CpuLimit::threads() const {
  return std::max(1, static_cast<int>(std::ceil(std::min<double>(processors, quota))));
}

std::string CpuLimit::Describe() const {
  const char* const noun = processors == 1 ? " processor" : " processors";
  if (quota >= processors) {
    return absl::StrCat(threads(), "; the process may use ", processors, noun);
  }
  return absl::StrCat(threads(), "; the control group grants ", quota, " of ", processors, noun);
}

CpuLimit ReadCpuLimit(const fs::path& root) {
  CpuLimit limit;
  // The C library counts the processors of the affinity.
  limit.processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const uint64_t thousandths = MinGroupLimit(root, "cpu", ReadCpuMax, ReadCfsQuota);
  if (thousandths != kNoGroupLimit) limit.quota = 0.001 * static_cast<double>(thousandths);
  return limit;
}

int DefaultThreads() {
  static const int kThreads = ReadCpuLimit().threads();
  return kThreads;
}

uint64_t ControlGroupMemory(const fs::path& root) {
  return MinGroupLimit(root, "memory", NumberIn("memory.max"), NumberIn("memory.limit_in_bytes"));
}

uint64_t DefaultMemoryLimit() {
  const uint64_t machine =
      static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
  return std::min(machine, ControlGroupMemory()) / 2;
}

}  // namespace hulld::server
