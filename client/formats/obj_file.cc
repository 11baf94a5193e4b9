#include <absl/strings/str_cat.h>

#include <string>

#include "client/formats/obj_face.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {

absl::Status ReadObj(ByteSource* source, PointCollector* points) {
  std::string_view line;
  std::string continued;
  ObjFaceCheck faces;
  uint64_t vertices = 0;
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
    const std::string_view keyword = NextToken(&rest);
    absl::Status status;
    if (keyword == "v") {
      status = AddTextPoint(*source, rest, points);
      ++vertices;
    } else if (keyword == "f") {
      status = faces.Add(*source, rest, vertices);
    }
    if (!status.ok()) return status;
    continued.clear();
  }
  if (!source->status().ok()) return source->status();
  if (vertices == 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        source->name(), ": holds no vertex: no line starts with v; is it an OBJ file?"));
  }
  return faces.Finish(*source, vertices);
}

}  // namespace hulld
