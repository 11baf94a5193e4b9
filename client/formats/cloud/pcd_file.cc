// PCD: a text header declares the fields of a point, their sizes, types, and counts, and the number
// of points. The data follows as text, as packed rows, or compressed, with all values of a field
// stored together. The viewpoint is not applied, as in PCL.
#include <absl/strings/str_cat.h>
#include <liblzf/lzf.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "client/base/status_macros.h"
#include "client/formats/binary_scalar.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

// Maximum row size; rows are read whole. Typical rows take dozens of bytes, rows with descriptors
// thousands.
constexpr uint64_t kMaxRowBytes = uint64_t{1} << 20;
constexpr size_t kMaxFields = 1024;
// LZF copies at most 264 bytes per reference of 3.
constexpr uint64_t kMaxExpansion = 88;

struct Field {
  std::string name;
  uint64_t size = 4;
  char type = 'F';
  uint64_t count = 1;
};

struct PcdHeader {
  std::vector<Field> fields;
  std::optional<uint64_t> width;
  std::optional<uint64_t> height;
  std::optional<uint64_t> points;
  std::string data;
};

// Positions of x, y, and z in each row.
struct Layout {
  // From the start of the row: in values for text, in bytes for binary.
  std::array<uint64_t, 3> position = {};
  std::array<ScalarType, 3> type = {};
  uint64_t row = 0;
  // Bytes of a row in fields named _.
  uint64_t padding = 0;
};

std::vector<std::string_view> Tokens(std::string_view rest) {
  std::vector<std::string_view> tokens;
  for (std::string_view token; !(token = NextToken(&rest)).empty();) tokens.push_back(token);
  return tokens;
}

absl::Status ParseFields(const ByteSource& source, std::string_view keyword,
                         const std::vector<std::string_view>& values, PcdHeader* header) {
  if (keyword == "FIELDS" || keyword == "COLUMNS") {
    if (values.size() > kMaxFields) return source.ErrorAtLine("more than 1024 fields");
    header->fields.clear();
    for (const std::string_view name : values) header->fields.push_back({std::string(name)});
    return absl::OkStatus();
  }
  if (values.size() != header->fields.size()) {
    return source.ErrorAtLine(absl::StrCat(std::string(keyword), " has ", values.size(),
                                           " values for ", header->fields.size(), " FIELDS"));
  }
  for (size_t i = 0; i < values.size(); ++i) {
    Field& field = header->fields[i];
    if (keyword == "TYPE") {
      field.type = values[i][0];
    } else if (!ParseUnsigned(values[i], keyword == "SIZE" ? &field.size : &field.count)) {
      return source.ErrorAtLine(absl::StrCat(Quoted(values[i]), " is not a number"));
    }
  }
  return absl::OkStatus();
}

absl::Status ParseCount(const ByteSource& source, const std::vector<std::string_view>& values,
                        std::optional<uint64_t>* count) {
  uint64_t value = 0;
  if (values.size() != 1 || !ParseUnsigned(values[0], &value)) {
    return source.ErrorAtLine("expected a single number");
  }
  *count = value;
  return absl::OkStatus();
}

absl::Status ParsePcdHeader(ByteSource* source, PcdHeader* header) {
  // Keywords that describe fields.
  std::set<std::string> known;
  std::string_view line;
  while (source->ReadLine(&line)) {
    std::string_view rest = line.substr(0, line.find('#'));
    const std::string_view keyword = NextToken(&rest);
    if (keyword.empty()) continue;
    const std::vector<std::string_view> values = Tokens(rest);
    absl::Status status;
    if (keyword == "DATA") {
      header->data = values.empty() ? "" : std::string(values[0]);
      return absl::OkStatus();
    } else if (keyword == "FIELDS" || keyword == "COLUMNS" || keyword == "SIZE" ||
               keyword == "TYPE" || keyword == "COUNT") {
      if (!known.emplace(keyword == "COLUMNS" ? "FIELDS" : keyword).second) {
        return source->ErrorAtLine(absl::StrCat("the header has ", Quoted(keyword), " twice"));
      }
      status = ParseFields(*source, keyword, values, header);
    } else if (keyword == "WIDTH") {
      status = ParseCount(*source, values, &header->width);
    } else if (keyword == "HEIGHT") {
      status = ParseCount(*source, values, &header->height);
    } else if (keyword == "POINTS") {
      status = ParseCount(*source, values, &header->points);
    } else if (keyword != "VERSION" && keyword != "VIEWPOINT") {
      status = source->ErrorAtLine(
          absl::StrCat(Quoted(keyword), " is not a keyword of a PCD header; is this a PCD file?"));
    }
    if (!status.ok()) return status;
  }
  return source->Truncated("before DATA");
}

std::optional<ScalarType> TypeOf(const Field& field) {
  struct TypeCode {
    char type;
    uint64_t size;
    ScalarType scalar;
  };
  static constexpr TypeCode kKnown[] = {
      {'I', 1, ScalarType::kInt8},   {'U', 1, ScalarType::kUint8},  {'I', 2, ScalarType::kInt16},
      {'U', 2, ScalarType::kUint16}, {'I', 4, ScalarType::kInt32},  {'U', 4, ScalarType::kUint32},
      {'I', 8, ScalarType::kInt64},  {'U', 8, ScalarType::kUint64}, {'F', 4, ScalarType::kFloat},
      {'F', 8, ScalarType::kDouble},
  };
  for (const TypeCode& known : kKnown) {
    if (known.type == field.type && known.size == field.size) return known.scalar;
  }
  return std::nullopt;
}

absl::Status MakeLayout(const ByteSource& source, const PcdHeader& header, bool binary,
                        Layout* layout) {
  std::array<bool, 3> found = {};
  for (const Field& field : header.fields) {
    if (field.count > kMaxRowBytes || field.size > kMaxScalarBytes) {
      return source.ErrorAtLine(absl::StrCat("field ", Quoted(field.name), " is too large"));
    }
    if (const std::optional<size_t> axis = AxisNamed(field.name)) {
      const std::optional<ScalarType> type = TypeOf(field);
      if (!type || field.count != 1 || found[*axis]) {
        return source.ErrorAtLine(
            absl::StrCat("field ", Quoted(field.name),
                         " must occur once, with COUNT 1 and a known TYPE and SIZE"));
      }
      layout->position[*axis] = layout->row;
      layout->type[*axis] = *type;
      found[*axis] = true;
    }
    layout->row += binary ? field.size * field.count : field.count;
    if (binary && field.name == "_") layout->padding += field.size * field.count;
    if (layout->row > kMaxRowBytes) return source.ErrorAtLine("a point is larger than 1 MiB");
  }
  if (found != std::array<bool, 3>{true, true, true}) {
    return source.ErrorAtLine("FIELDS must name x, y and z");
  }
  return absl::OkStatus();
}

absl::Status PointCount(const ByteSource& source, const PcdHeader& header, uint64_t* count) {
  const bool has_size = header.width.has_value();
  uint64_t size = 0;
  if (has_size && __builtin_mul_overflow(*header.width, header.height.value_or(1), &size)) {
    return source.ErrorAtLine("WIDTH times HEIGHT exceeds 2^64");
  }
  if (!has_size && !header.points) return source.ErrorAtLine("the header has no POINTS");
  *count = header.points.value_or(size);
  if (!has_size || *count == size) return absl::OkStatus();
  return source.ErrorAtLine(
      absl::StrCat("POINTS is ", *count, ", but WIDTH times HEIGHT is ", size));
}

absl::Status ReadAscii(ByteSource* source, const Layout& layout, uint64_t count,
                       PointCollector* points) {
  const auto error_at = [source](const std::string& message) {
    return source->ErrorAtLine(message);
  };
  std::string_view line;
  for (uint64_t i = 0; i < count; ++i) {
    do {
      if (!source->ReadLine(&line)) {
        return source->Truncated(absl::StrCat("after ", i, " of ", count, " points"));
      }
      line = Trim(line);
    } while (line.empty());
    std::array<double, 3> xyz = {};
    for (uint64_t column = 0; column < layout.row; ++column) {
      const std::string_view token = NextToken(&line);
      if (token.empty()) {
        return source->ErrorAtLine(
            absl::StrCat("the line has ", column, " of ", layout.row, " values"));
      }
      for (size_t axis = 0; axis < 3; ++axis) {
        if (layout.position[axis] != column) continue;
        const NumberText kind = points->Parse(token, axis, &xyz[axis]);
        if (kind != NumberText::kNumber) return source->ErrorAtLine(NumberProblem(kind, token));
      }
    }
    // Extra values mean that the columns do not match the header.
    if (const std::string_view token = NextToken(&line); !token.empty()) {
      return source->ErrorAtLine(absl::StrCat(Quoted(token),
                                              " is one value too many; FIELDS and COUNT declare ",
                                              layout.row, " per point"));
    }
    HULLD_RETURN_IF_ERROR(points->AddScaled(xyz[0], xyz[1], xyz[2], error_at));
  }
  while (source->ReadLine(&line)) {
    if (Trim(line).empty()) continue;
    return source->ErrorAtLine(
        absl::StrCat("the file has more rows than the ", count, " POINTS of its header"));
  }
  return source->status();
}

// Adds a point of binary data, as floats if all three coordinates are floats.
template <typename ErrorAt>
absl::Status AddBinaryPoint(const Layout& layout,
                            const std::array<const unsigned char*, 3>& coordinates,
                            const ErrorAt& error_at, PointCollector* points) {
  std::array<double, 3> xyz = {};
  bool as_float = true;
  for (size_t axis = 0; axis < 3; ++axis) {
    if (!IsDouble(layout.type[axis], coordinates[axis], false)) return error_at(kNoDouble);
    xyz[axis] = LoadScalar(layout.type[axis], coordinates[axis], false);
    as_float &= layout.type[axis] == ScalarType::kFloat;
  }
  if (!as_float) return points->Add(xyz[0], xyz[1], xyz[2], error_at);
  return points->AddFloat(static_cast<float>(xyz[0]), static_cast<float>(xyz[1]),
                          static_cast<float>(xyz[2]), error_at);
}

absl::Status ReadBinary(ByteSource* source, const Layout& layout, uint64_t count,
                        PointCollector* points) {
  uint64_t offset = 0;
  const auto error_at = [&](const std::string& message) {
    return absl::InvalidArgumentError(
        absl::StrCat(source->name(), ": byte ", offset, ": ", message));
  };
  std::vector<unsigned char> row(layout.row);
  for (uint64_t i = 0; i < count; ++i) {
    offset = source->offset();
    if (!source->Read(row.data(), row.size())) {
      return source->Truncated(absl::StrCat("after ", i, " of ", count, " points"));
    }
    std::array<const unsigned char*, 3> coordinates;
    for (size_t axis = 0; axis < 3; ++axis) coordinates[axis] = row.data() + layout.position[axis];
    HULLD_RETURN_IF_ERROR(AddBinaryPoint(layout, coordinates, error_at, points));
  }
  return source->CheckEnd(Counted(count, "point"), layout.row);
}

// Reads exactly `size` bytes. Memory grows with the available data, not with the declared size.
// Returns false if fewer bytes are left.
bool ReadBytes(ByteSource* source, uint64_t size, std::vector<unsigned char>* bytes) {
  constexpr uint64_t kStep = uint64_t{1} << 20;
  while (bytes->size() < size) {
    const size_t begin = bytes->size();
    bytes->resize(begin + static_cast<size_t>(std::min(kStep, size - begin)));
    if (!source->Read(bytes->data() + begin, bytes->size() - begin)) return false;
  }
  return true;
}

// Reads the two sizes and the LZF data, and decompresses it.
absl::Status Decompress(ByteSource* source, std::vector<unsigned char>* values) {
  unsigned char sizes[8];
  if (!source->Read(sizes, sizeof(sizes))) return source->Truncated("within the compressed sizes");
  const auto compressed = static_cast<uint32_t>(LoadScalar(ScalarType::kUint32, sizes, false));
  const auto full = static_cast<uint32_t>(LoadScalar(ScalarType::kUint32, sizes + 4, false));
  if (full > kMaxExpansion * compressed) {
    return source->ErrorAtByte(absl::StrCat(compressed, " compressed bytes cannot hold ", full));
  }
  const uint64_t begin = source->offset();
  std::vector<unsigned char> data;
  if (!ReadBytes(source, compressed, &data)) {
    return source->Truncated(absl::StrCat("within ", compressed, " bytes of compressed data"));
  }
  values->resize(full);
  if (full == 0 || lzf_decompress(data.data(), compressed, values->data(), full) == full) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrCat(source->name(), ": byte ", begin, ": the ", compressed,
                   " bytes from here on do not decompress to ", full, "; the file is damaged"));
}

// Reads data stored field after field. PCL omits fields named _; other writers may not. The size
// determines the variant.
absl::Status ReadCompressed(ByteSource* source, const PcdHeader& header, const Layout& layout,
                            uint64_t count, PointCollector* points) {
  std::vector<unsigned char> values;
  HULLD_RETURN_IF_ERROR(Decompress(source, &values));
  const auto holds = [&](uint64_t row) {
    uint64_t size = 0;
    return !__builtin_mul_overflow(row, count, &size) && size == values.size();
  };
  const bool padded = holds(layout.row);
  if (!padded && !holds(layout.row - layout.padding)) {
    return source->ErrorAtByte(absl::StrCat("the data decompresses to ", values.size(),
                                            " bytes, but ", count, " points of ", layout.row,
                                            " bytes are declared"));
  }
  std::array<const unsigned char*, 3> coordinates = {};
  const unsigned char* field_values = values.data();
  for (const Field& field : header.fields) {
    if (const auto axis = AxisNamed(field.name)) coordinates[*axis] = field_values;
    if (padded || field.name != "_") field_values += field.size * field.count * count;
  }
  for (uint64_t i = 0; i < count; ++i) {
    const auto error_at = [&](const std::string& message) {
      return absl::InvalidArgumentError(absl::StrCat(source->name(), ": ", message));
    };
    HULLD_RETURN_IF_ERROR(AddBinaryPoint(layout, coordinates, error_at, points));
    for (size_t axis = 0; axis < 3; ++axis) coordinates[axis] += SizeOf(layout.type[axis]);
  }
  return source->CheckEnd(Counted(count, "point"), layout.row);
}

}  // namespace

absl::Status ReadPcd(ByteSource* source, PointCollector* points) {
  PcdHeader header;
  HULLD_RETURN_IF_ERROR(ParsePcdHeader(source, &header));
  const bool ascii = header.data == "ascii";
  const bool compressed = header.data == "binary_compressed";
  if (!ascii && !compressed && header.data != "binary") {
    return source->ErrorAtLine(absl::StrCat("DATA ", Quoted(header.data),
                                            " is unknown; supported are ascii, binary and "
                                            "binary_compressed"));
  }
  Layout layout;
  uint64_t count = 0;
  HULLD_RETURN_IF_ERROR(MakeLayout(*source, header, !ascii, &layout));
  HULLD_RETURN_IF_ERROR(PointCount(*source, header, &count));
  return ascii        ? ReadAscii(source, layout, count, points)
         : compressed ? ReadCompressed(source, header, layout, count, points)
                      : ReadBinary(source, layout, count, points);
}

}  // namespace hulld
