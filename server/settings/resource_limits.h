#ifndef HULLD_SERVER_SETTINGS_RESOURCE_LIMITS_H_
#define HULLD_SERVER_SETTINGS_RESOURCE_LIMITS_H_

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>

namespace hulld::server {

// Processor time available to this process.
struct CpuLimit {
  // Processors of the affinity mask, which taskset and cpusets restrict. At least 1.
  int processors = 1;
  // Quota of the control groups, in processors; infinity: no quota.
  double quota = std::numeric_limits<double>::infinity();

  // Returns the number of threads that can run concurrently: the smaller of the two values, rounded
  // up, at least 1.
  int threads() const;
  // Returns a text for the log: "2; the control group grants 1.5 of 64 processors".
  std::string Describe() const;
};

// Reads both limits. The quota is the lowest among the control group of this process and its
// ancestors: cpu.max in version 2, the CFS quota in version 1. root: parent of /proc and
// /sys/fs/cgroup, for tests.
CpuLimit ReadCpuLimit(const std::filesystem::path& root = "/");

// Returns ReadCpuLimit().threads(), computed at the first call.
int DefaultThreads();

// Returns the least memory limit of the control group of this process and its ancestors, in bytes,
// of versions 1 and 2. UINT64_MAX: no limit. root: as above.
uint64_t ControlGroupMemory(const std::filesystem::path& root = "/");

// Returns half of the memory that this process may use, in bytes: that of the machine, or
// ControlGroupMemory() if it is less.
uint64_t DefaultMemoryLimit();

}  // namespace hulld::server

#endif  // HULLD_SERVER_SETTINGS_RESOURCE_LIMITS_H_
