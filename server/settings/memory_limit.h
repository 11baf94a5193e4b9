#ifndef HULLD_SERVER_SETTINGS_MEMORY_LIMIT_H_
#define HULLD_SERVER_SETTINGS_MEMORY_LIMIT_H_

#include <cstdint>
#include <filesystem>

namespace hulld::server {

// Returns the lowest memory limit, in bytes, among the control group of this process and its
// ancestors, of versions 1 and 2. UINT64_MAX: no limit. root: parent of /proc and /sys/fs/cgroup,
// for tests.
uint64_t ControlGroupMemory(const std::filesystem::path& root = "/");

// Returns half of the memory that this process may use, in bytes: the machine's memory, or
// ControlGroupMemory() if that is less.
uint64_t DefaultMemoryLimit();

}  // namespace hulld::server

#endif  // HULLD_SERVER_SETTINGS_MEMORY_LIMIT_H_
