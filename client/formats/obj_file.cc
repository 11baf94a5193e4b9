#include <string>

#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {

absl::Status ReadObj(ByteSource* source, PointCollector* points) {
  std::string_view line;
  std::string continued;
  while (source->ReadLine(&line)) {
    // A backslash at the end of a line continues it on the next.
    if (!line.empty() && line.back() == '\\') {
      continued.append(line.substr(0, line.size() - 1)).push_back(' ');
      if (continued.size() > ByteSource::kMaxLineBytes) {
        return source->ErrorAtLine("the continued line is longer than 16 MiB");
      }
      continue;
    }
    if (!continued.empty()) {
      continued.append(line);
      line = continued;
    }
    std::string_view rest = line;
    if (NextToken(&rest) == "v") {
      if (absl::Status status = AddTextPoint(*source, rest, points); !status.ok()) return status;
    }
    continued.clear();
  }
  return source->status();
}

}  // namespace hulld
