#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

// Columns of x, y, and z.
using Columns = std::array<size_t, 3>;

// Returns the separator: a semicolon or tab if the first row contains one. A comma may then be a
// decimal mark, which fails later. ' ': white space of any length.
char SeparatorOf(std::string_view first_row) {
  for (const char separator : {';', '\t', ',', ' '}) {
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
    begin = i + 1;
    if (separator == ' ' && cell.empty()) continue;
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') {
      cell = Trim(cell.substr(1, cell.size() - 2));
    }
    cells->push_back(cell);
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
  Columns places = {};
  for (size_t axis = 0; axis < 3; ++axis) {
    const auto found = std::find_if(header.begin(), header.end(), [axis](std::string_view cell) {
      return cell.size() == 1 &&
             absl::ascii_tolower(static_cast<unsigned char>(cell[0])) == "xyz"[axis];
    });
    if (found == header.end()) {
      return source.ErrorAtLine(absl::StrCat("the header has no column \"",
                                             std::string(1, "xyz"[axis]),
                                             "\"; it must name x, y and z"));
    }
    places[axis] = static_cast<size_t>(found - header.begin());
  }
  *columns = places;
  return absl::OkStatus();
}

// named: the number of columns that the header names, 0 without a header.
absl::Status AddRow(const ByteSource& source, const std::vector<std::string_view>& cells,
                    size_t named, const Columns& columns, PointCollector* points) {
  // R's write.table names the columns of the data, but not that of the row names.
  if (named > 0 && cells.size() > named && !cells[named].empty()) {
    return source.ErrorAtLine(absl::StrCat("the row has ", Counted(cells.size(), "column"),
                                           ", but the header names ", named, "; name each column"));
  }
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
  // Number of columns that the header names; 0 without a header.
  size_t named = 0;
  std::optional<char> declared;
  char separator = ',';
  for (bool first = true; source->ReadLine(&line);) {
    const std::string_view content = Trim(line);
    const bool is_comment = content.substr(0, 1) == "#" || content.substr(0, 2) == "//";
    if (content.empty() || (is_comment && !first)) continue;
    if (first && content.size() == 5 && content.substr(0, 4) == "sep=") {
      declared = content[4];
      continue;
    }
    // CloudCompare and numpy start a header with a comment mark. Other rows are split untrimmed,
    // because trimming would remove the tab next to an empty first or last cell.
    if (is_comment) {
      line = Trim(content.substr(std::min(content.find_first_not_of("/#"), content.size())));
    }
    if (first) separator = declared.value_or(SeparatorOf(Trim(line)));
    SplitRow(line, separator, &cells);
    absl::Status status;
    bool is_header = false;
    if (first) {
      status = FindColumns(*source, cells, &columns);
      // A first line such as "# exported by ..." is a comment.
      if (!status.ok() && content.front() == '#') continue;
      is_header = status.ok() || IsHeader(cells);
      named = is_header ? cells.size() : 0;
      first = false;
    }
    if (!is_header) status = AddRow(*source, cells, named, columns, points);
    if (!status.ok()) return status;
  }
  return source->status();
}

}  // namespace hulld
