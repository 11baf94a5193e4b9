#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_OUTPUT_FILE_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_OUTPUT_FILE_H_

#include <absl/status/status.h>

#include <functional>
#include <ostream>
#include <string>

namespace hulld {

// Calls `write` with the file `path`, or with `standard` if the path is empty or "-".
// INVALID_ARGUMENT if the file cannot be opened or not fully written.
absl::Status WriteOutput(const std::string& path, std::ostream& standard,
                         const std::function<void(std::ostream&)>& write);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_OUTPUT_FILE_H_
