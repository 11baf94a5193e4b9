#ifndef HULLD_SERVER_SETTINGS_MEMORY_LIMIT_H_
#define HULLD_SERVER_SETTINGS_MEMORY_LIMIT_H_

#include <cstdint>
#include <filesystem>

namespace hulld::server {

// The least limit of memory among the control group of this process and the groups that hold it;
// that of version 2 and of version 1, where both are in use. UINT64_MAX: there is none. Bytes.
// root: where /proc and /sys/fs/cgroup are, for tests.
uint64_t ControlGroupMemory(const std::filesystem::path& root = "/");

// Half of the memory that this process may use: the machine's, or ControlGroupMemory() where that
// is less. Bytes.
uint64_t DefaultMemoryLimit();

}  // namespace hulld::server

#endif  // HULLD_SERVER_SETTINGS_MEMORY_LIMIT_H_
