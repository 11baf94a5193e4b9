#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_NUMBER_OPTION_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_NUMBER_OPTION_H_

#include <CLI/App.hpp>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>

namespace hulld {

inline constexpr uint64_t kAnyNumber = std::numeric_limits<uint64_t>::max();

// An option or positional that takes a decimal whole number from `least` to `most`. (CLI11 itself
// reads 010 as eight.)
CLI::Option* AddNumberOption(CLI::App* command, const std::string& name, uint64_t least,
                             uint64_t most, const std::string& help,
                             std::function<void(uint64_t)> take);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_NUMBER_OPTION_H_
