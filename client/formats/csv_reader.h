#ifndef HULLD_CLIENT_FORMATS_CSV_READER_H_
#define HULLD_CLIENT_FORMATS_CSV_READER_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include "client/formats/byte_source.h"
#include "client/formats/point_collector.h"

namespace hulld {

// Columns of a table with a row for each point.
struct CsvLayout {
  // Columns of x, y, and z.
  std::array<size_t, 3> columns = {0, 1, 2};
  // Number of columns that the header names or, without a header, of the first row.
  size_t named = 0;
  bool has_header = true;
  // ' ': white space of any length.
  char separator = ',';
};

// Returns true if the trimmed line is a comment: it starts with #, %, or //.
bool IsCsvComment(std::string_view line);

// Returns the layout that a header defines: a row of names, among them x, y, and z in any case, or
// Points:0 to Points:2 as ParaView writes them. If no column has such a name, x, y, and z may have
// a unit, as in X [m], or a path, as in field.x. Also a header of pandas with an index: an empty
// name, then 0, 1, 2, and so on. Nullopt if the row has numbers and is not a header. `separator`:
// by default, a semicolon, tab, comma, or white space, whichever the row contains.
// INVALID_ARGUMENT, naming the source's current line: a coordinate is missing or named twice.
absl::StatusOr<std::optional<CsvLayout>> CsvHeader(const ByteSource& source, std::string_view line,
                                                   std::optional<char> separator = std::nullopt);

// INVALID_ARGUMENT: the first row of a table without a header numbers the columns from 0, as pandas
// does without an index, and the next row contains numbers other than integers, so that the row may
// be a header. May invalidate the source's current line.
absl::Status CheckFirstRow(ByteSource* source, std::string_view row,
                           std::optional<char> separator = std::nullopt);

// Returns the layout of a header in a comment, as CloudCompare and numpy write it. Nullopt for any
// other comment.
std::optional<CsvLayout> CsvHeaderInComment(const ByteSource& source, std::string_view line,
                                            std::optional<char> separator = std::nullopt);

// Returns true if the row has as many cells as the header. Otherwise the comment was prose.
bool IsRowOf(const CsvLayout& layout, std::string_view row);

// Adds the points of all rows from the next line on, after that of `row` if it is not empty.
absl::Status ReadCsvRows(ByteSource* source, const CsvLayout& layout, std::string_view row,
                         PointCollector* points);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_CSV_READER_H_
