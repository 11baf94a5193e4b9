#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <array>

#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

// Adds the point of a line with commas or semicolons as separators. With semicolons, a comma would
// be a decimal mark, which is not supported. White space within a number indicates decimal commas:
// "1,5 2,5 3,5" is not a row of four numbers.
absl::Status AddSeparatedPoint(const ByteSource& source, std::string_view line,
                               PointCollector* points) {
  const char separator = line.find(';') != std::string_view::npos ? ';' : ',';
  std::array<double, 3> xyz;
  size_t axis = 0;
  for (std::string_view rest = line;; ++axis) {
    const size_t end = rest.find(separator);
    std::string_view cell = Trim(rest.substr(0, end));
    if (cell.find_first_of(" \t") != std::string_view::npos) {
      return source.ErrorAtLine(
          absl::StrCat(Quoted(line), " has white space and \"", std::string(1, separator),
                       "\" between its numbers; use one of them, and a point as the decimal mark"));
    }
    if (axis < 3) {
      if (const NumberText kind = points->Parse(cell, axis, &xyz[axis]);
          kind != NumberText::kNumber) {
        return source.ErrorAtLine(NumberProblem(kind, cell));
      }
    }
    if (end == std::string_view::npos) break;
    rest.remove_prefix(end + 1);
  }
  if (axis < 2) {
    return source.ErrorAtLine(absl::StrCat("a point needs 3 coordinates, got ", axis + 1));
  }
  return points->AddScaled(xyz[0], xyz[1], xyz[2],
                           [&](const std::string& message) { return source.ErrorAtLine(message); });
}

// Returns an error about the first line, with the name of the format that such files have.
absl::Status WithAdvice(const absl::Status& error, std::string_view line) {
  uint64_t count = 0;
  double number = 0;
  const char* advice = "";
  if (ParseUnsigned(line, &count)) {
    advice = "; --format pts reads files that start with their number of points";
  } else if ((line[0] == '"' || absl::ascii_isalpha(static_cast<unsigned char>(line[0]))) &&
             ParseDouble(NextToken(&line), &number) == NumberText::kNoNumber) {
    advice = "; --format csv reads tables with a header";
  }
  return absl::Status(error.code(), absl::StrCat(error.message(), advice));
}

}  // namespace

absl::Status ReadXyz(ByteSource* source, PointCollector* points) {
  std::string_view line;
  for (bool first = true; source->ReadLine(&line);) {
    const std::string_view content = Trim(WithoutComment(line));
    // CloudCompare writes a header //X Y Z.
    if (content.empty() || content.substr(0, 2) == "//") continue;
    std::string_view rest = content;
    bool separated = false;
    for (int i = 0; i < 3; ++i) {
      separated |= NextToken(&rest).find_first_of(",;") != std::string_view::npos;
    }
    absl::Status status = separated ? AddSeparatedPoint(*source, content, points)
                                    : AddTextPoint(*source, content, points);
    if (!status.ok()) return first ? WithAdvice(status, content) : status;
    first = false;
  }
  return source->status();
}

}  // namespace hulld
