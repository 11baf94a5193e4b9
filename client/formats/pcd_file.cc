// PCD: a text header names the fields of a point, their sizes, types and counts, and the number of
// points; rows follow as text or as packed scalars. The viewpoint is not applied, as in PCL.
#include <absl/strings/str_cat.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "client/formats/binary_scalar.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

// Rows are read whole. Real ones take some dozens of bytes, those with descriptors some thousands.
constexpr uint64_t kMaxRowBytes = uint64_t{1} << 20;
constexpr size_t kMaxFields = 1024;

struct Field {
  std::string name;
  uint64_t size = 4;
  char type = 'F';
  uint64_t count = 1;
};

struct Header {
  std::vector<Field> fields;
  std::optional<uint64_t> width;
  std::optional<uint64_t> height;
  std::optional<uint64_t> points;
  std::string data;
};

// What is read of each row: where x, y and z stand.
struct Layout {
  // In values from the row's start for text, in bytes for binary.
  std::array<uint64_t, 3> position = {};
  std::array<ScalarType, 3> type = {};
  uint64_t row = 0;
};

std::vector<std::string_view> Tokens(std::string_view rest) {
  std::vector<std::string_view> tokens;
  for (std::string_view token; !(token = NextToken(&rest)).empty();) tokens.push_back(token);
  return tokens;
}

absl::Status ParseFields(const ByteSource& source, std::string_view keyword,
                         const std::vector<std::string_view>& values, Header* header) {
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
    return source.ErrorAtLine("one number is expected here");
  }
  *count = value;
  return absl::OkStatus();
}

absl::Status ParseHeader(ByteSource* source, Header* header) {
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
      status = ParseFields(*source, keyword, values, header);
    } else if (keyword == "WIDTH") {
      status = ParseCount(*source, values, &header->width);
    } else if (keyword == "HEIGHT") {
      status = ParseCount(*source, values, &header->height);
    } else if (keyword == "POINTS") {
      status = ParseCount(*source, values, &header->points);
    } else if (keyword != "VERSION" && keyword != "VIEWPOINT") {
      status = source->ErrorAtLine(
          absl::StrCat(Quoted(keyword), " is no keyword of a PCD header; is this a PCD file?"));
    }
    if (!status.ok()) return status;
  }
  return source->Truncated("before DATA");
}

std::optional<ScalarType> TypeOf(const Field& field) {
  struct Known {
    char type;
    uint64_t size;
    ScalarType scalar;
  };
  static constexpr Known kKnown[] = {
      {'I', 1, ScalarType::kInt8},   {'U', 1, ScalarType::kUint8},  {'I', 2, ScalarType::kInt16},
      {'U', 2, ScalarType::kUint16}, {'I', 4, ScalarType::kInt32},  {'U', 4, ScalarType::kUint32},
      {'I', 8, ScalarType::kInt64},  {'U', 8, ScalarType::kUint64}, {'F', 4, ScalarType::kFloat},
      {'F', 8, ScalarType::kDouble},
  };
  for (const Known& known : kKnown) {
    if (known.type == field.type && known.size == field.size) return known.scalar;
  }
  return std::nullopt;
}

absl::Status MakeLayout(const ByteSource& source, const Header& header, bool binary,
                        Layout* layout) {
  std::array<bool, 3> found = {};
  for (const Field& field : header.fields) {
    if (field.count > kMaxRowBytes || field.size > kMaxScalarBytes) {
      return source.ErrorAtLine(absl::StrCat("field ", Quoted(field.name), " is too large"));
    }
    const size_t axis = std::string_view("xyz").find(field.name);
    if (field.name.size() == 1 && axis != std::string_view::npos) {
      const std::optional<ScalarType> type = TypeOf(field);
      if (!type || field.count != 1 || found[axis]) {
        return source.ErrorAtLine(absl::StrCat("field ", Quoted(field.name),
                                               " must be there once, with COUNT 1 and a known "
                                               "TYPE and SIZE"));
      }
      layout->position[axis] = layout->row;
      layout->type[axis] = *type;
      found[axis] = true;
    }
    layout->row += binary ? field.size * field.count : field.count;
    if (layout->row > kMaxRowBytes) return source.ErrorAtLine("a point takes more than 1 MiB");
  }
  if (found != std::array<bool, 3>{true, true, true}) {
    return source.ErrorAtLine("FIELDS must name x, y and z");
  }
  return absl::OkStatus();
}

absl::Status PointCount(const ByteSource& source, const Header& header, uint64_t* count) {
  const uint64_t height = header.height.value_or(1);
  if (header.points) {
    *count = *header.points;
  } else if (header.width && !__builtin_mul_overflow(*header.width, height, count)) {
    return absl::OkStatus();
  } else {
    return source.ErrorAtLine("the header gives no POINTS");
  }
  return absl::OkStatus();
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
        const NumberText kind = ParseDouble(token, &xyz[axis]);
        if (kind != NumberText::kNumber) return source->ErrorAtLine(NumberProblem(kind, token));
      }
    }
    absl::Status status = points->Add(xyz[0], xyz[1], xyz[2], error_at);
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status ReadBinary(ByteSource* source, const Layout& layout, uint64_t count,
                        PointCollector* points) {
  const bool as_float =
      layout.type ==
      std::array<ScalarType, 3>{ScalarType::kFloat, ScalarType::kFloat, ScalarType::kFloat};
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
    std::array<double, 3> xyz = {};
    for (size_t axis = 0; axis < 3; ++axis) {
      xyz[axis] = LoadScalar(layout.type[axis], row.data() + layout.position[axis], false);
    }
    absl::Status status =
        as_float ? points->AddFloat(static_cast<float>(xyz[0]), static_cast<float>(xyz[1]),
                                    static_cast<float>(xyz[2]), error_at)
                 : points->Add(xyz[0], xyz[1], xyz[2], error_at);
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ReadPcd(ByteSource* source, PointCollector* points) {
  Header header;
  if (absl::Status status = ParseHeader(source, &header); !status.ok()) return status;
  if (header.data == "binary_compressed") {
    return source->ErrorAtLine(
        "binary_compressed data is not supported; convert the file first, as with "
        "pcl_convert_pcd_ascii_binary IN.pcd OUT.pcd 1");
  }
  if (header.data != "ascii" && header.data != "binary") {
    return source->ErrorAtLine(
        absl::StrCat("DATA ", Quoted(header.data), " is unknown; known are ascii and binary"));
  }
  const bool binary = header.data == "binary";
  Layout layout;
  uint64_t count = 0;
  if (absl::Status status = MakeLayout(*source, header, binary, &layout); !status.ok())
    return status;
  if (absl::Status status = PointCount(*source, header, &count); !status.ok()) return status;
  return binary ? ReadBinary(source, layout, count, points)
                : ReadAscii(source, layout, count, points);
}

}  // namespace hulld
