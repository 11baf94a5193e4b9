// PLY: a text header declares elements and their properties in order, then their values follow as
// text or as packed scalars. Only the element `vertex` is wanted; those before it are skipped,
// those after it are not read.
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

constexpr size_t kMaxHeaderLines = 10000;

struct Property {
  // For a list, the type of its items.
  ScalarType type;
  // The type of a list's count.
  std::optional<ScalarType> count_type;
  // 0, 1, 2 for x, y, z.
  std::optional<size_t> axis;
};

struct Element {
  std::string name;
  uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { kNone, kAscii, kLittleEndian, kBigEndian };

struct Header {
  Encoding encoding = Encoding::kNone;
  std::vector<Element> elements;
};

std::optional<ScalarType> TypeFromName(std::string_view name) {
  struct Name {
    std::string_view name;
    ScalarType type;
  };
  static constexpr Name kNames[] = {
      {"char", ScalarType::kInt8},     {"int8", ScalarType::kInt8},
      {"uchar", ScalarType::kUint8},   {"uint8", ScalarType::kUint8},
      {"short", ScalarType::kInt16},   {"int16", ScalarType::kInt16},
      {"ushort", ScalarType::kUint16}, {"uint16", ScalarType::kUint16},
      {"int", ScalarType::kInt32},     {"int32", ScalarType::kInt32},
      {"uint", ScalarType::kUint32},   {"uint32", ScalarType::kUint32},
      {"float", ScalarType::kFloat},   {"float32", ScalarType::kFloat},
      {"double", ScalarType::kDouble}, {"float64", ScalarType::kDouble},
  };
  for (const Name& entry : kNames) {
    if (entry.name == name) return entry.type;
  }
  return std::nullopt;
}

absl::Status ParseFormat(const ByteSource& source, std::string_view rest, Header* header) {
  const std::string_view encoding = NextToken(&rest);
  if (encoding == "ascii") {
    header->encoding = Encoding::kAscii;
  } else if (encoding == "binary_little_endian") {
    header->encoding = Encoding::kLittleEndian;
  } else if (encoding == "binary_big_endian") {
    header->encoding = Encoding::kBigEndian;
  } else {
    return source.ErrorAtLine(
        absl::StrCat("format ", Quoted(encoding),
                     " is unknown; known are ascii, binary_little_endian and binary_big_endian"));
  }
  return absl::OkStatus();
}

absl::Status ParseElement(const ByteSource& source, std::string_view rest, Header* header) {
  Element element;
  element.name = std::string(NextToken(&rest));
  const std::string_view count = NextToken(&rest);
  if (!ParseUnsigned(count, &element.count)) {
    return source.ErrorAtLine(
        absl::StrCat(Quoted(count), " is not a number of elements ", Quoted(element.name)));
  }
  header->elements.push_back(std::move(element));
  return absl::OkStatus();
}

absl::Status ParseProperty(const ByteSource& source, std::string_view rest, Header* header) {
  if (header->elements.empty()) return source.ErrorAtLine("a property before any element");
  Element& element = header->elements.back();
  Property property;
  std::string_view type_name = NextToken(&rest);
  if (type_name == "list") {
    const std::string_view count_name = NextToken(&rest);
    property.count_type = TypeFromName(count_name);
    if (!property.count_type || *property.count_type == ScalarType::kFloat ||
        *property.count_type == ScalarType::kDouble) {
      return source.ErrorAtLine(absl::StrCat(Quoted(count_name), " is no type of a list's count"));
    }
    type_name = NextToken(&rest);
  }
  const std::optional<ScalarType> type = TypeFromName(type_name);
  if (!type) return source.ErrorAtLine(absl::StrCat(Quoted(type_name), " is no type of PLY"));
  property.type = *type;
  const std::string_view name = NextToken(&rest);
  if (name.empty()) return source.ErrorAtLine("the property has no name");
  const size_t axis = std::string_view("xyz").find(name);
  if (name.size() == 1 && axis != std::string_view::npos && !property.count_type) {
    property.axis = axis;
  }
  element.properties.push_back(property);
  return absl::OkStatus();
}

absl::Status ParseHeader(ByteSource* source, Header* header) {
  std::string_view line;
  if (!source->ReadLine(&line)) return source->Truncated("before the keyword ply");
  if (Trim(line) != "ply") return source->ErrorAtLine("a PLY file starts with the line \"ply\"");
  while (source->ReadLine(&line)) {
    if (source->line() > kMaxHeaderLines) {
      return source->ErrorAtLine("the header does not end; is this a PLY file?");
    }
    std::string_view rest = line;
    const std::string_view keyword = NextToken(&rest);
    absl::Status status;
    if (keyword == "end_header") {
      if (header->encoding != Encoding::kNone) return absl::OkStatus();
      status = source->ErrorAtLine("the header has no line \"format\"");
    } else if (keyword == "format") {
      status = ParseFormat(*source, rest, header);
    } else if (keyword == "element") {
      status = ParseElement(*source, rest, header);
    } else if (keyword == "property") {
      status = ParseProperty(*source, rest, header);
    }
    // Everything else is a comment, or obj_info, or a line that some exporter wrote without a
    // keyword.
    if (!status.ok()) return status;
  }
  return source->Truncated("before end_header");
}

// Floats stay floats when all three coordinates are.
bool HoldsFloats(const Element& vertex) {
  for (const Property& property : vertex.properties) {
    if (property.axis && property.type != ScalarType::kFloat) return false;
  }
  return true;
}

absl::Status CheckVertex(const ByteSource& source, const Element& vertex) {
  std::array<bool, 3> found = {};
  for (const Property& property : vertex.properties) {
    if (!property.axis) continue;
    if (found[*property.axis]) {
      return source.ErrorAtLine("the element vertex has a coordinate twice");
    }
    found[*property.axis] = true;
  }
  if (found == std::array<bool, 3>{true, true, true}) return absl::OkStatus();
  return source.ErrorAtLine("the element vertex needs the properties x, y and z");
}

class AsciiBody {
 public:
  explicit AsciiBody(ByteSource* source) : source_(source) {}

  // Reads one element, one line, and the coordinates on it.
  absl::Status ReadElement(const Element& element, std::array<double, 3>* xyz) {
    std::string_view line;
    do {
      if (!source_->ReadLine(&line))
        return source_->Truncated("within the element " + element.name);
      line = Trim(line);
    } while (line.empty());
    for (const Property& property : element.properties) {
      std::string_view token = NextToken(&line);
      if (property.count_type) {
        if (absl::Status status = SkipList(token, &line); !status.ok()) return status;
        continue;
      }
      if (token.empty()) return source_->ErrorAtLine("the line has fewer values than properties");
      if (!property.axis) continue;
      const NumberText kind = ParseDouble(token, &(*xyz)[*property.axis]);
      if (kind != NumberText::kNumber) return source_->ErrorAtLine(NumberProblem(kind, token));
    }
    return absl::OkStatus();
  }

  absl::Status Error(const std::string& message) const { return source_->ErrorAtLine(message); }

 private:
  absl::Status SkipList(std::string_view count_text, std::string_view* line) {
    uint64_t count = 0;
    if (!ParseUnsigned(count_text, &count)) {
      return source_->ErrorAtLine(absl::StrCat(Quoted(count_text), " is not the count of a list"));
    }
    for (uint64_t i = 0; i < count; ++i) {
      if (!NextToken(line).empty()) continue;
      return source_->ErrorAtLine(absl::StrCat("the list has ", i, " items of ", count));
    }
    return absl::OkStatus();
  }

  ByteSource* source_;
};

class BinaryBody {
 public:
  BinaryBody(ByteSource* source, bool big_endian) : source_(source), big_endian_(big_endian) {}

  absl::Status ReadElement(const Element& element, std::array<double, 3>* xyz) {
    element_offset_ = source_->offset();
    for (const Property& property : element.properties) {
      double value = 0;
      const bool complete =
          property.count_type
              ? ReadScalar(*property.count_type, &value) && value >= 0 &&
                    source_->Skip(static_cast<uint64_t>(value) * SizeOf(property.type))
              : ReadScalar(property.type, &value);
      if (value < 0 && property.count_type) {
        return source_->ErrorAtByte("the count of a list is negative");
      }
      if (!complete) return source_->Truncated("within the element " + element.name);
      if (property.axis) (*xyz)[*property.axis] = value;
    }
    return absl::OkStatus();
  }

  absl::Status Error(const std::string& message) const {
    return absl::InvalidArgumentError(
        absl::StrCat(source_->name(), ": byte ", element_offset_, ": ", message));
  }

 private:
  bool ReadScalar(ScalarType type, double* value) {
    unsigned char bytes[kMaxScalarBytes];
    if (!source_->Read(bytes, SizeOf(type))) return false;
    *value = LoadScalar(type, bytes, big_endian_);
    return true;
  }

  ByteSource* source_;
  bool big_endian_;
  uint64_t element_offset_ = 0;
};

template <typename Body>
absl::Status ReadBody(const Header& header, bool binary, Body body, PointCollector* points) {
  const auto error_at = [&body](const std::string& message) { return body.Error(message); };
  for (const Element& element : header.elements) {
    const bool is_vertex = element.name == "vertex";
    // An element without properties takes no bytes, whatever its count.
    if (element.properties.empty()) continue;
    const bool as_float = is_vertex && binary && HoldsFloats(element);
    std::array<double, 3> xyz = {};
    for (uint64_t i = 0; i < element.count; ++i) {
      absl::Status status = body.ReadElement(element, &xyz);
      if (status.ok() && is_vertex) {
        status = as_float ? points->AddFloat(static_cast<float>(xyz[0]), static_cast<float>(xyz[1]),
                                             static_cast<float>(xyz[2]), error_at)
                          : points->Add(xyz[0], xyz[1], xyz[2], error_at);
      }
      if (!status.ok()) return status;
    }
    if (is_vertex) break;
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ReadPly(ByteSource* source, PointCollector* points) {
  Header header;
  if (absl::Status status = ParseHeader(source, &header); !status.ok()) return status;
  const Element* vertex = nullptr;
  for (const Element& element : header.elements) {
    if (element.name == "vertex" && vertex == nullptr) vertex = &element;
  }
  if (vertex == nullptr) return source->ErrorAtLine("the header declares no element vertex");
  if (absl::Status status = CheckVertex(*source, *vertex); !status.ok()) return status;
  if (header.encoding == Encoding::kAscii) {
    return ReadBody(header, false, AsciiBody(source), points);
  }
  const bool big_endian = header.encoding == Encoding::kBigEndian;
  return ReadBody(header, true, BinaryBody(source, big_endian), points);
}

}  // namespace hulld
