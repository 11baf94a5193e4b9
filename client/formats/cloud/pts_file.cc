// PTS, Leica's text format: each scan starts with its number of points, followed by one line per
// point, x y z [intensity [r g b]]. Files without the number are also common.
#include <absl/strings/str_cat.h>

#include <optional>

#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {

absl::Status ReadPts(ByteSource* source, PointCollector* points) {
  // Points of the current scan: the declared number, if any, and the number read.
  std::optional<uint64_t> declared;
  uint64_t found = 0;
  bool is_first = true;
  std::string_view line;
  while (source->ReadLine(&line)) {
    const std::string_view content = Trim(WithoutComment(line));
    if (content.empty() || content.substr(0, 2) == "//") continue;
    std::string_view rest = content;
    const std::string_view first = NextToken(&rest);
    uint64_t count = 0;
    const bool is_count = Trim(rest).empty() && ParseUnsigned(first, &count);
    if (is_count && (is_first || (declared && found == *declared))) {
      declared = count;
      found = 0;
    } else if (declared && found == *declared) {
      return source->ErrorAtLine(
          absl::StrCat("the scan has more lines than the ", *declared, " points it declares"));
    } else {
      if (absl::Status status = AddTextPoint(*source, content, points); !status.ok()) return status;
      ++found;
    }
    is_first = false;
  }
  if (!source->status().ok() || !declared || found == *declared) return source->status();
  return source->Truncated(absl::StrCat("after ", found, " of ", *declared, " points"));
}

}  // namespace hulld
