#ifndef HULLD_SERVER_SETTINGS_CONTROL_GROUP_H_
#define HULLD_SERVER_SETTINGS_CONTROL_GROUP_H_

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>

namespace hulld::server {

inline constexpr uint64_t kNoGroupLimit = std::numeric_limits<uint64_t>::max();

// The limit that one group's directory holds, kNoGroupLimit where it holds none.
using GroupLimit = std::function<uint64_t(const std::filesystem::path& directory)>;

// The least limit among the control group of this process and the groups that hold it, as a group's
// own says nothing of those above it, which bind it too; of version 2 and of version 1, where both
// are in use. controller: its name in version 1, as "memory". root: where /proc and /sys/fs/cgroup
// are. Source: cgroups(7).
uint64_t LeastGroupLimit(const std::filesystem::path& root, const std::string& controller,
                         const GroupLimit& version_2, const GroupLimit& version_1);

}  // namespace hulld::server

#endif  // HULLD_SERVER_SETTINGS_CONTROL_GROUP_H_
