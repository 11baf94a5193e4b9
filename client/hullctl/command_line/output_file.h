#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_OUTPUT_FILE_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_OUTPUT_FILE_H_

#include <absl/status/status.h>

#include <functional>
#include <ostream>
#include <string>

namespace hulld {

// Lets `write` fill the file `path`, or `standard` when the path is empty or "-". INVALID_ARGUMENT
// when the file cannot be opened or not all of it could be written.
absl::Status WriteOutput(const std::string& path, std::ostream& standard,
                         const std::function<void(std::ostream&)>& write);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_OUTPUT_FILE_H_
