#ifndef HULLD_SERVER_SETTINGS_CPU_LIMIT_H_
#define HULLD_SERVER_SETTINGS_CPU_LIMIT_H_

#include <filesystem>
#include <limits>
#include <string>

namespace hulld::server {

// How many processors' time this process may use.
struct CpuLimit {
  // Those that the process may run on: all of the machine, or those of its affinity, which taskset
  // and cpusets set. At least 1.
  int processors = 1;
  // What the control groups grant, in processors; infinity: there is no such limit.
  double quota = std::numeric_limits<double>::infinity();

  // As many threads as can run at a time: the lesser of both, rounded up, at least 1.
  int threads() const;
  // For the log: "2, as the control group grants 1.5 of 64 processors".
  std::string Describe() const;
};

// quota is the least of the control group of this process and the groups that hold it: cpu.max of
// version 2, the CFS quota of version 1. root: where /proc and /sys/fs/cgroup are, for tests.
CpuLimit ReadCpuLimit(const std::filesystem::path& root = "/");

// ReadCpuLimit().threads() when it was first asked.
int DefaultThreads();

}  // namespace hulld::server

#endif  // HULLD_SERVER_SETTINGS_CPU_LIMIT_H_
