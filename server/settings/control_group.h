#ifndef HULLD_SERVER_SETTINGS_CONTROL_GROUP_H_
#define HULLD_SERVER_SETTINGS_CONTROL_GROUP_H_

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>

namespace hulld::server {

inline constexpr uint64_t kNoGroupLimit = std::numeric_limits<uint64_t>::max();

// Returns the limit in a group's directory, or kNoGroupLimit.
using GroupLimit = std::function<uint64_t(const std::filesystem::path& directory)>;

// Returns the lowest limit among this process's control group and that group's ancestors, which
// also bind the process. Supports versions 1 and 2. controller: its name in version 1, as in
// "memory". root: parent of /proc and /sys/fs/cgroup. Source: cgroups(7).
uint64_t LeastGroupLimit(const std::filesystem::path& root, const std::string& controller,
                         const GroupLimit& version_2, const GroupLimit& version_1);

}  // namespace hulld::server

#endif  // HULLD_SERVER_SETTINGS_CONTROL_GROUP_H_
