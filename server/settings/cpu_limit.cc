#include "server/settings/cpu_limit.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <thread>

#include "server/settings/control_group.h"

namespace hulld::server {
namespace {

namespace fs = std::filesystem;

// Converts a quota of time per period, both in microseconds, to thousandths of a processor. In
// version 1, a quota of -1 means none.
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
  // The C library counts the processors in the affinity mask.
  limit.processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const uint64_t thousandths = LeastGroupLimit(root, "cpu", ReadCpuMax, ReadCfsQuota);
  if (thousandths != kNoGroupLimit) limit.quota = 0.001 * static_cast<double>(thousandths);
  return limit;
}

int DefaultThreads() {
  static const int kThreads = ReadCpuLimit().threads();
  return kThreads;
}

}  // namespace hulld::server
