#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/formats/csv_reader.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

// Returns the separator: a semicolon or tab if the first row contains one. A comma may then be a
// decimal mark, which fails later.
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
    const bool is_separator =
        i == row.size() || row[i] == separator || (separator == ' ' && row[i] == '\t');
    if (!is_separator || (quoted && i < row.size())) continue;
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

// Returns the axis that a column is named after: x, or Points:0 as ParaView writes it.
std::optional<size_t> AxisOf(std::string_view cell) {
  const std::string name = absl::AsciiStrToLower(std::string(cell));
  for (size_t axis = 0; axis < 3; ++axis) {
    if (name == absl::StrCat("points:", axis) || name == absl::StrCat("points_", axis)) return axis;
  }
  return AxisNamed(name);
}

// Returns the axis that a column is named after with a unit, as in X [m], or a path, as in field.x.
std::optional<size_t> AxisOfQualified(std::string_view cell) {
  const std::string_view name = Trim(cell.substr(0, cell.find_first_of("[(")));
  return AxisNamed(name.substr(name.rfind('.') + 1));
}

absl::Status FindColumns(const ByteSource& source, std::string_view line,
                         const std::vector<std::string_view>& header,
                         std::array<size_t, 3>* columns) {
  std::array<std::optional<size_t>, 3> found;
  const bool is_qualified = std::none_of(header.begin(), header.end(), AxisOf);
  for (size_t i = 0; i < header.size(); ++i) {
    const std::optional<size_t> axis =
        is_qualified ? AxisOfQualified(header[i]) : AxisOf(header[i]);
    if (!axis) continue;
    if (found[*axis]) {
      return source.ErrorAtLine(absl::StrCat(
          "the header ", Quoted(line), " names ", std::string(1, "xyz"[*axis]), " in columns ",
          *found[*axis] + 1, " and ", i + 1, "; it must name x, y and z once"));
    }
    found[*axis] = i;
  }
  for (size_t axis = 0; axis < 3; ++axis) {
    if (!found[axis]) {
      return source.ErrorAtLine(absl::StrCat("the header ", Quoted(line), " has no column \"",
                                             std::string(1, "xyz"[axis]),
                                             "\"; it must name x, y and z"));
    }
    (*columns)[axis] = *found[axis];
  }
  return absl::OkStatus();
}

// Returns true if the cells are the numbers of their columns, as pandas names columns without
// names.
bool AreNumbered(std::span<const std::string_view> cells) {
  for (size_t i = 0; i < cells.size(); ++i) {
    if (cells[i] != absl::StrCat(i)) return false;
  }
  return cells.size() >= 3;
}

bool IsInteger(std::string_view cell) {
  return cell.find_first_not_of("+-0123456789") == std::string_view::npos;
}

absl::Status AddRow(const ByteSource& source, const std::vector<std::string_view>& cells,
                    const CsvLayout& layout, PointCollector* points) {
  const auto& columns = layout.columns;
  const size_t named = layout.named;
  // R's write.table names the columns of the data, but not the column of row names. Without a
  // header, only a further number is an error: a lost line end joins two rows.
  double number = 0;
  if (cells.size() > named &&
      (layout.has_header ? !cells[named].empty()
                         : ParseDouble(cells[named], &number) == NumberText::kNumber)) {
    return source.ErrorAtLine(
        absl::StrCat("the row has ", Counted(cells.size(), "column"),
                     layout.has_header ? ", but the header names " : ", but the first row has ",
                     named, layout.has_header ? "; name each column" : "; is a line end missing?"));
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

bool IsCsvComment(std::string_view line) {
  return line.starts_with('#') || line.starts_with('%') || line.starts_with("//");
}

absl::StatusOr<std::optional<CsvLayout>> CsvHeader(const ByteSource& source, std::string_view line,
                                                   std::optional<char> separator) {
  line = Trim(line);
  CsvLayout layout;
  layout.separator = separator.value_or(SeparatorOf(line));
  std::vector<std::string_view> cells;
  SplitRow(line, layout.separator, &cells);
  // White space also precedes a unit, as in "X [m] Y [m] Z [m]".
  if (layout.separator == ' ') {
    std::erase_if(cells, [](std::string_view cell) { return cell.find_first_of("[(") == 0; });
  }
  const absl::Status status = FindColumns(source, line, cells, &layout.columns);
  layout.named = cells.size();
  if (status.ok()) return layout;
  if (IsHeader(cells)) return status;
  // pandas leaves the name of the index empty.
  if (!cells.front().empty() || !AreNumbered(std::span(cells).subspan(1))) return std::nullopt;
  layout.columns = {1, 2, 3};
  return layout;
}

absl::Status CheckFirstRow(ByteSource* source, std::string_view row,
                           std::optional<char> separator) {
  if (!separator) separator = SeparatorOf(row);
  std::vector<std::string_view> cells;
  SplitRow(row, *separator, &cells);
  if (!AreNumbered(cells)) return absl::OkStatus();
  constexpr size_t kBytesOfRow = 4096;
  std::string_view next = source->Peek(kBytesOfRow);
  next.remove_prefix(std::min(next.find_first_not_of(" \t\r\n"), next.size()));
  next = next.substr(0, next.find_first_of("\r\n"));
  SplitRow(next, *separator, &cells);
  if (IsCsvComment(next) || std::all_of(cells.begin(), cells.end(), IsInteger)) {
    return absl::OkStatus();
  }
  return source->ErrorAtLine(
      absl::StrCat(Quoted(row),
                   " may be a point, or a header that numbers the columns, as pandas "
                   "writes it; replace it with x,y,z if it is a header, or insert x,y,z above it"));
}

std::optional<CsvLayout> CsvHeaderInComment(const ByteSource& source, std::string_view line,
                                            std::optional<char> separator) {
  line.remove_prefix(std::min(line.find_first_not_of("/#%"), line.size()));
  return CsvHeader(source, line, separator).value_or(std::nullopt);
}

bool IsRowOf(const CsvLayout& layout, std::string_view row) {
  std::vector<std::string_view> cells;
  SplitRow(row, layout.separator, &cells);
  while (cells.size() > layout.named && cells.back().empty()) cells.pop_back();
  return cells.size() == layout.named;
}

absl::Status ReadCsvRows(ByteSource* source, const CsvLayout& layout, std::string_view row,
                         PointCollector* points) {
  std::vector<std::string_view> cells;
  do {
    const std::string_view content = Trim(row);
    if (content.empty() || IsCsvComment(content)) continue;
    // Split untrimmed, because trimming would remove the tab next to an empty first or last cell.
    SplitRow(row, layout.separator, &cells);
    if (absl::Status status = AddRow(*source, cells, layout, points); !status.ok()) return status;
  } while (source->ReadLine(&row));
  return source->status();
}

absl::Status ReadCsv(ByteSource* source, PointCollector* points) {
  std::optional<CsvLayout> commented;
  std::optional<char> declared;
  for (std::string_view line; source->ReadLine(&line);) {
    const std::string_view content = Trim(line);
    if (content.empty()) continue;
    if (content.size() == 5 && content.substr(0, 4) == "sep=") {
      declared = content[4];
      continue;
    }
    if (IsCsvComment(content)) {
      if (!commented) commented = CsvHeaderInComment(*source, content, declared);
      continue;
    }
    if (commented && IsRowOf(*commented, line)) {
      return ReadCsvRows(source, *commented, line, points);
    }
    const auto header = CsvHeader(*source, content, declared);
    if (!header.ok()) return header.status();
    if (header->has_value()) return ReadCsvRows(source, **header, "", points);
    CsvLayout layout;
    layout.separator = declared.value_or(SeparatorOf(content));
    const std::string row(line);
    std::vector<std::string_view> cells;
    SplitRow(row, layout.separator, &cells);
    layout.named = cells.size();
    layout.has_header = false;
    const absl::Status checked = CheckFirstRow(source, row, layout.separator);
    return checked.ok() ? ReadCsvRows(source, layout, row, points) : checked;
  }
  return source->status();
}

}  // namespace hulld
