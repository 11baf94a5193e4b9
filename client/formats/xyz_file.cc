#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {

absl::Status ReadXyz(ByteSource* source, PointCollector* points) {
  std::string_view line;
  while (source->ReadLine(&line)) {
    const std::string_view content = Trim(line.substr(0, line.find('#')));
    if (content.empty()) continue;
    if (absl::Status status = AddTextPoint(*source, content, points); !status.ok()) return status;
  }
  return source->status();
}

}  // namespace hulld
