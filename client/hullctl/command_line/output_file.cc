#include "client/hullctl/command_line/output_file.h"

#include <absl/strings/str_cat.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace hulld {

absl::Status WriteOutput(const std::string& path, std::ostream& standard,
                         const std::function<void(std::ostream&)>& write) {
  if (path.empty() || path == "-") {
    write(standard);
    return absl::OkStatus();
  }
  errno = 0;
  std::ofstream file(path, std::ios::binary);
  if (!file) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot open ", path, " for writing: ", strerror(errno)));
  }
  write(file);
  file.close();
  if (file) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("cannot write ", path, ": ", strerror(errno)));
}

}  // namespace hulld
