// PLY: a text header declares elements and their properties in order. Their values follow as text,
// in lines of any length, or as packed scalars. Elements that are not needed are read to check that
// the file is complete.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/base/status_macros.h"
#include "client/formats/binary_scalar.h"
#include "client/formats/mesh_file.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

constexpr size_t kMaxHeaderLines = 10000;
constexpr std::string_view kFaces = "face";
constexpr std::string_view kStrips = "tristrips";

// Indices of vertices, not checked.
using Corners = std::vector<int64_t>;

struct Property {
  // For a list, the type of its items.
  ScalarType type;
  // For a list, the type of its count.
  std::optional<ScalarType> count_type;
  // 0, 1, 2 for x, y, z.
  std::optional<size_t> axis;
  // True for the list of the vertices of a face or strip.
  bool is_corners = false;
};

struct Element {
  std::string name;
  uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { kNone, kAscii, kLittleEndian, kBigEndian };

struct PlyHeader {
  Encoding encoding = Encoding::kNone;
  std::vector<Element> elements;
};

std::optional<ScalarType> TypeFromName(std::string_view name) {
  static constexpr std::pair<std::string_view, ScalarType> kNames[] = {
      {"char", ScalarType::kInt8},     {"int8", ScalarType::kInt8},
      {"uchar", ScalarType::kUint8},   {"uint8", ScalarType::kUint8},
      {"short", ScalarType::kInt16},   {"int16", ScalarType::kInt16},
      {"ushort", ScalarType::kUint16}, {"uint16", ScalarType::kUint16},
      {"int", ScalarType::kInt32},     {"int32", ScalarType::kInt32},
      {"uint", ScalarType::kUint32},   {"uint32", ScalarType::kUint32},
      {"int64", ScalarType::kInt64},   {"uint64", ScalarType::kUint64},
      {"float", ScalarType::kFloat},   {"float32", ScalarType::kFloat},
      {"double", ScalarType::kDouble}, {"float64", ScalarType::kDouble},
  };
  for (const auto& [known, type] : kNames) {
    if (known == name) return type;
  }
  return std::nullopt;
}

absl::Status ParseFormat(const ByteSource& source, std::string_view rest, PlyHeader* header) {
  const std::string_view encoding = NextToken(&rest);
  if (header->encoding != Encoding::kNone) {
    return source.ErrorAtLine("the header has the line \"format\" twice");
  }
  static constexpr std::pair<std::string_view, Encoding> kEncodings[] = {
      {"ascii", Encoding::kAscii},
      {"binary_little_endian", Encoding::kLittleEndian},
      {"binary_big_endian", Encoding::kBigEndian}};
  for (const auto& [name, known] : kEncodings) {
    if (encoding == name) header->encoding = known;
  }
  if (header->encoding != Encoding::kNone) return absl::OkStatus();
  return source.ErrorAtLine(
      absl::StrCat("format ", Quoted(encoding),
                   " is unknown; supported are ascii, binary_little_endian and binary_big_endian"));
}

absl::Status ParseElement(const ByteSource& source, std::string_view rest, PlyHeader* header) {
  Element element;
  element.name = std::string(NextToken(&rest));
  const std::string_view count = NextToken(&rest);
  if (!ParseUnsigned(count, &element.count)) {
    return source.ErrorAtLine(
        absl::StrCat(Quoted(count), " is not a count of elements ", Quoted(element.name)));
  }
  header->elements.push_back(std::move(element));
  return absl::OkStatus();
}

absl::Status ParseProperty(const ByteSource& source, std::string_view rest, PlyHeader* header) {
  if (header->elements.empty()) return source.ErrorAtLine("a property before any element");
  Element& element = header->elements.back();
  Property property;
  std::string_view type_name = NextToken(&rest);
  if (type_name == "list") {
    const std::string_view count_name = NextToken(&rest);
    property.count_type = TypeFromName(count_name);
    if (!property.count_type || *property.count_type == ScalarType::kFloat ||
        *property.count_type == ScalarType::kDouble) {
      return source.ErrorAtLine(
          absl::StrCat(Quoted(count_name), " is not a valid type for the count of a list"));
    }
    type_name = NextToken(&rest);
  }
  const std::optional<ScalarType> type = TypeFromName(type_name);
  if (!type) return source.ErrorAtLine(absl::StrCat(Quoted(type_name), " is not a PLY type"));
  property.type = *type;
  const std::string_view name = NextToken(&rest);
  if (name.empty()) return source.ErrorAtLine("the property has no name");
  if (!property.count_type) property.axis = AxisNamed(name);
  property.is_corners = property.count_type && type != ScalarType::kFloat &&
                        type != ScalarType::kDouble &&
                        (name == "vertex_indices" || name == "vertex_index");
  element.properties.push_back(property);
  return absl::OkStatus();
}

absl::Status ParsePlyHeader(ByteSource* source, PlyHeader* header) {
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
    // Any other line is a comment, obj_info, or written by an exporter without a keyword.
    if (!status.ok()) return status;
  }
  return source->Truncated("before end_header");
}

// Returns true if the element names the vertices of faces, or of triangle strips as in files of
// Stanford University.
bool HasFaces(const Element& element) {
  return (element.name == kFaces || element.name == kStrips) &&
         std::any_of(element.properties.begin(), element.properties.end(),
                     [](const Property& property) { return property.is_corners; });
}

bool HasFloats(const Element& vertex) {
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
  AsciiBody(ByteSource* source, const std::array<LengthScale, 3>& scale)
      : source_(source), scale_(scale) {}

  // Reads the values of an element and sets its coordinates, scaled, and its corners. White space
  // separates values, line ends included: RealSense Viewer splits a vertex and its color over two
  // lines.
  absl::Status ReadElement(const Element& element, std::array<double, 3>* xyz, Corners* corners) {
    std::string_view token;
    for (const Property& property : element.properties) {
      if (!NextValue(&token)) return source_->Truncated("within the element " + element.name);
      if (property.count_type) {
        HULLD_RETURN_IF_ERROR(ReadList(element, token, property.is_corners ? corners : nullptr));
        continue;
      }
      // Other values, such as a "1.#QNAN" in a normal, are not checked.
      if (!property.axis) continue;
      const NumberText kind = scale_[*property.axis].Parse(token, &(*xyz)[*property.axis]);
      if (kind != NumberText::kNumber) return source_->ErrorAtLine(NumberProblem(kind, token));
    }
    return absl::OkStatus();
  }

  template <typename ErrorAt>
  static absl::Status Add(const std::array<double, 3>& xyz, const Element& /*vertex*/,
                          const ErrorAt& error_at, PointCollector* points) {
    return points->AddScaled(xyz[0], xyz[1], xyz[2], error_at);
  }

  // Extra values mean that the file was misread and its points are wrong.
  absl::Status Finish() {
    std::string_view token;
    if (!NextValue(&token)) return source_->status();
    return source_->ErrorAtLine(
        absl::StrCat(Quoted(token),
                     " is beyond the last value that the header declares; its "
                     "counts and properties do not fit the file"));
  }

  absl::Status Error(const std::string& message) const { return source_->ErrorAtLine(message); }

 private:
  bool NextValue(std::string_view* token) {
    while ((*token = NextToken(&rest_)).empty()) {
      if (!source_->ReadLine(&rest_)) return false;
      std::string_view line = rest_;
      const std::string_view keyword = NextToken(&line);
      if (keyword == "comment" || keyword == "obj_info") rest_ = {};
    }
    return true;
  }

  // Reads a list, and stores its items in `corners` unless it is null.
  absl::Status ReadList(const Element& element, std::string_view count_text, Corners* corners) {
    uint64_t count = 0;
    if (!ParseUnsigned(count_text, &count)) {
      return source_->ErrorAtLine(absl::StrCat(Quoted(count_text), " is not the count of a list"));
    }
    std::string_view token;
    for (uint64_t i = 0; i < count; ++i) {
      if (!NextValue(&token)) {
        return source_->Truncated(absl::StrCat("within the element ", element.name, ", after ", i,
                                               " of ", count, " items of a list"));
      }
      if (corners == nullptr) continue;
      const char* const end = token.data() + token.size();
      const auto [stop, error] = std::from_chars(token.data(), end, corners->emplace_back());
      if (stop != end || error != std::errc()) {
        return source_->ErrorAtLine(Quoted(token) + " is not the index of a vertex");
      }
    }
    return absl::OkStatus();
  }

  ByteSource* source_;
  const std::array<LengthScale, 3>& scale_;
  // Rest of the current line.
  std::string_view rest_;
};

class BinaryBody {
 public:
  BinaryBody(ByteSource* source, bool big_endian) : source_(source), big_endian_(big_endian) {}

  absl::Status ReadElement(const Element& element, std::array<double, 3>* xyz, Corners* corners) {
    element_offset_ = source_->offset();
    for (const Property& property : element.properties) {
      double value = 0;
      // No file holds a list of 2^60 items.
      const bool complete = property.count_type
                                ? ReadScalar(*property.count_type, &value) && value >= 0 &&
                                      value < 0x1p60 &&
                                      ReadList(property, static_cast<uint64_t>(value), corners)
                                : ReadScalar(property.type, &value);
      if (value < 0 && property.count_type) {
        return source_->ErrorAtByte("the count of a list is negative");
      }
      if (!complete) return source_->Truncated("within the element " + element.name);
      if (!property.axis) continue;
      if (!is_double_) return Error(kNoDouble);
      (*xyz)[*property.axis] = value;
    }
    return absl::OkStatus();
  }

  // Keeps floats if all three coordinates are floats.
  template <typename ErrorAt>
  static absl::Status Add(const std::array<double, 3>& xyz, const Element& vertex,
                          const ErrorAt& error_at, PointCollector* points) {
    if (!HasFloats(vertex)) return points->Add(xyz[0], xyz[1], xyz[2], error_at);
    return points->AddFloat(static_cast<float>(xyz[0]), static_cast<float>(xyz[1]),
                            static_cast<float>(xyz[2]), error_at);
  }

  absl::Status Finish() {
    return source_->CheckEnd("last element", source_->offset() - element_offset_);
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
    is_double_ = IsDouble(type, bytes, big_endian_);
    return true;
  }

  // Returns false if the file ends within the list.
  bool ReadList(const Property& property, uint64_t count, Corners* corners) {
    if (corners == nullptr || !property.is_corners) {
      return source_->Skip(count * SizeOf(property.type));
    }
    double value = 0;
    for (uint64_t i = 0; i < count; ++i) {
      if (!ReadScalar(property.type, &value)) return false;
      // Clamps values beyond 2^62, which are out of range anyway.
      corners->push_back(static_cast<int64_t>(std::min(value, 0x1p62)));
    }
    return true;
  }

  ByteSource* source_;
  bool big_endian_;
  uint64_t element_offset_ = 0;
  // False if the last scalar was rounded.
  bool is_double_ = true;
};

// Adds each vertex to a collector.
class PointSink {
 public:
  explicit PointSink(PointCollector* points) : points_(points) {}

  template <typename Body>
  absl::Status AddVertex(const Body& body, const Element& vertex,
                         const std::array<double, 3>& xyz) const {
    const auto error_at = [&body](const std::string& message) { return body.Error(message); };
    return Body::Add(xyz, vertex, error_at, points_);
  }

  // Faces are not needed.
  static Corners* CornersOf(const Element& /*element*/) { return nullptr; }
  template <typename Body>
  static absl::Status AddFace(const Body& /*body*/, const Element& /*element*/, uint64_t /*i*/) {
    return absl::OkStatus();
  }

 private:
  PointCollector* points_;
};

// Adds vertices and faces to a mesh.
class MeshSink {
 public:
  MeshSink(uint64_t vertex_count, TriangleMesh* mesh) : vertex_count_(vertex_count), mesh_(mesh) {}

  template <typename Body>
  absl::Status AddVertex(const Body& body, const Element& /*vertex*/,
                         const std::array<double, 3>& xyz) const {
    for (const double x : xyz) {
      if (!std::isfinite(x)) return body.Error("a coordinate is not finite");
    }
    mesh_->vertices.push_back(xyz);
    return absl::OkStatus();
  }

  Corners* CornersOf(const Element& element) {
    corners_.clear();
    return HasFaces(element) ? &corners_ : nullptr;
  }

  // Adds the face with the corners read: the `i`-th, from 0. In strips, -1 starts a new strip.
  template <typename Body>
  absl::Status AddFace(const Body& body, const Element& element, uint64_t i) {
    const bool is_strip = element.name == kStrips;
    std::vector<uint32_t> polygon;
    for (const int64_t corner : corners_) {
      if (is_strip && corner == -1) {
        AddStrip(polygon);
        polygon.clear();
      } else if (corner < 0 || static_cast<uint64_t>(corner) >= vertex_count_) {
        return body.Error(absl::StrCat(element.name, " ", i, " names vertex ", corner,
                                       ", but the vertices are 0 to ", vertex_count_ - 1));
      } else {
        polygon.push_back(static_cast<uint32_t>(corner));
      }
    }
    if (is_strip) {
      AddStrip(polygon);
    } else {
      AddPolygon(polygon, mesh_);
    }
    return absl::OkStatus();
  }

 private:
  // Every other triangle of a strip has the opposite orientation.
  void AddStrip(const std::vector<uint32_t>& strip) {
    for (size_t i = 2; i < strip.size(); ++i) {
      const size_t odd = i % 2;
      mesh_->triangles.push_back({strip[i - 2 + odd], strip[i - 1 - odd], strip[i]});
    }
  }

  uint64_t vertex_count_;
  TriangleMesh* mesh_;
  Corners corners_;
};

template <typename Body, typename Sink>
absl::Status ReadBody(const PlyHeader& header, Body body, Sink sink) {
  for (const Element& element : header.elements) {
    // An element without properties takes no bytes, regardless of its count.
    if (element.properties.empty()) continue;
    const bool is_vertex = element.name == "vertex";
    std::array<double, 3> xyz = {};
    for (uint64_t i = 0; i < element.count; ++i) {
      Corners* const corners = sink.CornersOf(element);
      absl::Status status = body.ReadElement(element, &xyz, corners);
      if (status.ok() && is_vertex) status = sink.AddVertex(body, element, xyz);
      if (status.ok() && corners != nullptr) status = sink.AddFace(body, element, i);
      if (!status.ok()) return status;
    }
  }
  return body.Finish();
}

template <typename Sink>
absl::Status ReadBody(ByteSource* source, const PlyHeader& header,
                      const std::array<LengthScale, 3>& scale, Sink sink) {
  if (header.encoding == Encoding::kAscii) return ReadBody(header, AsciiBody(source, scale), sink);
  const bool big_endian = header.encoding == Encoding::kBigEndian;
  return ReadBody(header, BinaryBody(source, big_endian), sink);
}

// Returns the only element `vertex`.
absl::StatusOr<const Element*> FindVertex(const ByteSource& source, const PlyHeader& header) {
  const Element* vertex = nullptr;
  for (const Element& element : header.elements) {
    if (element.name != "vertex") continue;
    if (vertex != nullptr)
      return source.ErrorAtLine("the header declares the element vertex twice");
    vertex = &element;
  }
  if (vertex == nullptr) return source.ErrorAtLine("the header declares no element vertex");
  HULLD_RETURN_IF_ERROR(CheckVertex(source, *vertex));
  if (vertex->count > 0) return vertex;
  for (const Element& element : header.elements) {
    if (element.count == 0 || element.properties.empty()) continue;
    return source.ErrorAtLine(absl::StrCat("the header declares ", element.count, " elements ",
                                           Quoted(element.name), ", but no vertex"));
  }
  return vertex;
}

}  // namespace

absl::Status ReadPly(ByteSource* source, PointCollector* points) {
  PlyHeader header;
  HULLD_RETURN_IF_ERROR(ParsePlyHeader(source, &header));
  if (const auto vertex = FindVertex(*source, header); !vertex.ok()) return vertex.status();
  return ReadBody(source, header, points->scale(), PointSink(points));
}

absl::Status ReadPlyMesh(ByteSource* source, TriangleMesh* mesh) {
  PlyHeader header;
  HULLD_RETURN_IF_ERROR(ParsePlyHeader(source, &header));
  HULLD_ASSIGN_OR_RETURN(const auto vertex, FindVertex(*source, header));
  bool has_faces = false;
  for (const Element& element : header.elements) {
    if (element.count == 0 || (element.name != kFaces && element.name != kStrips)) continue;
    if (!HasFaces(element)) {
      return source->ErrorAtLine(
          absl::StrCat("the element ", element.name, " has no list vertex_indices of integers"));
    }
    has_faces = true;
  }
  if (!has_faces) return absl::OkStatus();
  if (vertex->count > std::numeric_limits<uint32_t>::max()) {
    return source->ErrorAtLine("too many vertices");
  }
  return ReadBody(source, header, {}, MeshSink(vertex->count, mesh));
}

}  // namespace hulld
