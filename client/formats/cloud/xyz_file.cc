// XYZ and PTS: one line per point, x y z and further columns. A number of points may precede each
// scan, as Leica and CloudCompare write it. A file with a header is read as a table.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "client/formats/csv_reader.h"
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

// Adds the point of a line, with any of the separators.
absl::Status AddPoint(const ByteSource& source, std::string_view line, PointCollector* points) {
  std::string_view rest = line;
  for (int i = 0; i < 3; ++i) {
    if (NextToken(&rest).find_first_of(",;") == std::string_view::npos) continue;
    return AddSeparatedPoint(source, line, points);
  }
  return AddTextPoint(source, line, points);
}

// Sets *columns, initially 0, to the number of columns of the scan's first row. A later row with
// more numbers is an error, because a lost line end joins two rows. Any number of words may follow.
absl::Status CheckColumns(const ByteSource& source, std::string_view row, size_t* columns) {
  const auto is_separator = [](char c) {
    return c == ' ' || c == ',' || c == ';' || (c >= '\t' && c <= '\r');
  };
  size_t found = 0;
  std::string_view excess;
  for (auto end = row.begin();; ++found) {
    const auto begin = std::find_if_not(end, row.end(), is_separator);
    if (begin == row.end()) break;
    end = std::find_if(begin, row.end(), is_separator);
    if (found == *columns) excess = row.substr(begin - row.begin(), end - begin);
  }
  if (*columns == 0) *columns = found;
  double number = 0;
  if (found == *columns || excess.empty() || ParseDouble(excess, &number) != NumberText::kNumber) {
    return absl::OkStatus();
  }
  return source.ErrorAtLine(absl::StrCat("the row has ", Counted(found, "column"),
                                         ", but the first row has ", *columns,
                                         "; is a line end missing?"));
}

}  // namespace

absl::Status ReadXyz(ByteSource* source, PointCollector* points) {
  // The current scan: its declared number of points, if any, the number read, and its columns.
  std::optional<uint64_t> declared;
  uint64_t found = 0;
  size_t columns = 0;
  bool first = true;
  std::string first_row;
  std::optional<CsvLayout> commented;
  for (std::string_view line; source->ReadLine(&line);) {
    std::string_view content = Trim(WithoutComment(line));
    if (content.empty() || IsCsvComment(content)) {
      if (first && !commented) commented = CsvHeaderInComment(*source, Trim(line));
      continue;
    }
    const bool has_other_columns = commented && commented->columns != CsvLayout().columns;
    if (first && has_other_columns && IsRowOf(*commented, line)) {
      return ReadCsvRows(source, *commented, line, points);
    }
    if (first) {
      const auto header = CsvHeader(*source, content);
      if (!header.ok()) return header.status();
      if (header->has_value()) return ReadCsvRows(source, **header, "", points);
      first_row = std::string(content);
      content = first_row;
      if (absl::Status status = CheckFirstRow(source, content); !status.ok()) return status;
    }
    uint64_t count = 0;
    const bool is_complete = declared && found == *declared;
    if ((first || is_complete) && ParseUnsigned(content, &count)) {
      declared = count;
      found = 0;
      columns = 0;
    } else if (declared && found == 0 && has_other_columns && IsRowOf(*commented, line)) {
      return source->ErrorAtLine(
          "the comment at the start names x, y, and z, but not as the first three columns, and a "
          "number of points follows; remove that number");
    } else if (is_complete) {
      return source->ErrorAtLine(absl::StrCat("the scan has more lines than the ",
                                              Counted(*declared, "point"), " it declares"));
    } else if (absl::Status added = AddPoint(*source, content, points); !added.ok()) {
      return added;
    } else if (absl::Status checked = CheckColumns(*source, content, &columns); !checked.ok()) {
      return checked;
    } else {
      ++found;
    }
    first = false;
  }
  if (!source->status().ok() || !declared || found == *declared) return source->status();
  return source->Truncated(absl::StrCat("after ", found, " of ", *declared, " points"));
}

}  // namespace hulld
