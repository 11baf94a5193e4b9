#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <array>
#include <vector>

#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

// Columns of x, y, and z.
using Columns = std::array<size_t, 3>;

// Returns the separator: a semicolon or tab if the first row contains one. A comma may then be a
// decimal mark, which fails later.
char SeparatorOf(std::string_view first_row) {
  for (const char separator : {';', '\t'}) {
    if (first_row.find(separator) != std::string_view::npos) return separator;
  }
  return ',';
}

// Splits a row into cells without surrounding spaces and double quotes. Separators within quotes do
// not count.
void SplitRow(std::string_view row, char separator, std::vector<std::string_view>* cells) {
  cells->clear();
  size_t begin = 0;
  bool quoted = false;
  for (size_t i = 0; i <= row.size(); ++i) {
    if (i < row.size() && row[i] == '"') quoted = !quoted;
    if (i < row.size() && (row[i] != separator || quoted)) continue;
    std::string_view cell = Trim(row.substr(begin, i - begin));
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') {
      cell = Trim(cell.substr(1, cell.size() - 2));
    }
    cells->push_back(cell);
    begin = i + 1;
  }
}

// Returns true if the row consists of names only. A cell that starts like a number counts as a
// number even if it is malformed, such as 1,5.
bool IsHeader(const std::vector<std::string_view>& cells) {
  double ignored;
  for (const std::string_view cell : cells) {
    const bool like_number =
        !cell.empty() && std::string_view("0123456789+-.").find(cell[0]) != std::string_view::npos;
    if (like_number || ParseDouble(cell, &ignored) != NumberText::kNoNumber) return false;
  }
  return true;
}

absl::Status FindColumns(const ByteSource& source, const std::vector<std::string_view>& header,
                         Columns* columns) {
  for (size_t axis = 0; axis < 3; ++axis) {
    const char name = "xyz"[axis];
    bool found = false;
    for (size_t i = 0; i < header.size() && !found; ++i) {
      std::string_view cell = header[i];
      // CloudCompare starts its header with a comment mark.
      while (!cell.empty() && (cell.front() == '/' || cell.front() == '#')) cell.remove_prefix(1);
      found = cell.size() == 1 && absl::ascii_tolower(static_cast<unsigned char>(cell[0])) == name;
      if (found) (*columns)[axis] = i;
    }
    if (!found) {
      return source.ErrorAtLine(absl::StrCat("the header has no column \"", std::string(1, name),
                                             "\"; it must name x, y and z"));
    }
  }
  return absl::OkStatus();
}

absl::Status AddRow(const ByteSource& source, const std::vector<std::string_view>& cells,
                    const Columns& columns, PointCollector* points) {
  std::array<double, 3> xyz;
  for (size_t axis = 0; axis < 3; ++axis) {
    if (columns[axis] >= cells.size()) {
      return source.ErrorAtLine(absl::StrCat("the row has ", Counted(cells.size(), "column"), "; ",
                                             std::string(1, "xyz"[axis]), " is column ",
                                             columns[axis] + 1));
    }
    const std::string_view cell = cells[columns[axis]];
    const NumberText kind = points->Parse(cell, axis, &xyz[axis]);
    if (kind != NumberText::kNumber) return source.ErrorAtLine(NumberProblem(kind, cell));
  }
  return points->AddScaled(xyz[0], xyz[1], xyz[2],
                           [&](const std::string& message) { return source.ErrorAtLine(message); });
}

}  // namespace

absl::Status ReadCsv(ByteSource* source, PointCollector* points) {
  std::string_view line;
  std::vector<std::string_view> cells;
  Columns columns = {0, 1, 2};
  char separator = ',';
  bool first = true;
  while (source->ReadLine(&line)) {
    const std::string_view content = Trim(line);
    if (content.empty() || (content.front() == '#' && !first)) continue;
    if (first) separator = SeparatorOf(content);
    // Splits the untrimmed line, because trimming would remove the tab next to an empty first or
    // last cell.
    SplitRow(line, separator, &cells);
    absl::Status status;
    if (first && IsHeader(cells)) {
      status = FindColumns(*source, cells, &columns);
      // A first line such as "# exported by ..." is a comment.
      if (!status.ok() && content.front() == '#') continue;
    } else {
      status = AddRow(*source, cells, columns, points);
    }
    if (!status.ok()) return status;
    first = false;
  }
  return source->status();
}

}  // namespace hulld
