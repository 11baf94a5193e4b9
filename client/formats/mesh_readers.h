#ifndef HULLD_CLIENT_FORMATS_MESH_READERS_H_
#define HULLD_CLIENT_FORMATS_MESH_READERS_H_

#include <absl/status/status.h>

#include <array>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "client/formats/byte_source.h"
#include "client/formats/text_number.h"

// The readers of OBJ, OFF, and STL, which readers of points and of meshes share.
namespace hulld {

// Receives the statements of an OBJ file in order. Functions that are empty are not called.
struct ObjReceiver {
  // The text after `v`: three coordinates, then weight or color.
  std::function<absl::Status(std::string_view text)> vertex;
  // The vertices of a face, counted from 0. They may be defined later in the file.
  std::function<void(const std::vector<uint32_t>& corners)> face;
  // `o` or `g`, and the name after it.
  std::function<void(std::string_view keyword, std::string_view name)> name;
};

// Reads an OBJ file; the only reader of the format. A backslash continues a line, except in
// comments; a face may precede its vertices; negative numbers count back from the last vertex
// before the face. INVALID_ARGUMENT names the line, also if the file has no vertex, or a face names
// a missing one.
absl::Status WalkObj(ByteSource* source, const ObjReceiver& receiver);

// Reads an OFF file line by line: keyword, counts, vertices, faces. Supports the variants with the
// position first in each vertex line: OFF, COFF, NOFF, STOFF, and their combinations.
class OffReader {
 public:
  explicit OffReader(ByteSource* source) : source_(source) {}

  absl::Status ReadHeader();
  uint64_t vertex_count() const { return vertex_count_; }
  uint64_t face_count() const { return face_count_; }

  // Reads the line of the next vertex, the `index`-th.
  absl::Status NextVertex(uint64_t index, std::string_view* content);
  // Reads the next face, the `index`-th. Faces follow all vertices.
  absl::Status NextFace(uint64_t index, std::vector<uint32_t>* corners);
  // Requires that all faces were read. INVALID_ARGUMENT if more follows: a wrong count makes
  // readers mistake vertices for faces.
  absl::Status Finish();

  // Reads the next line that is not blank, without comments. Returns false at the end.
  bool NextContent(std::string_view* content);

 private:
  ByteSource* source_;
  uint64_t vertex_count_ = 0;
  uint64_t face_count_ = 0;
};

// Creates an error that names the location of a corner.
using StlErrorAt = std::function<absl::Status(const std::string& message)>;

// Receives the solids of an STL file in order, and three corners for each facet.
struct StlReceiver {
  // The name may be empty; binary files have one solid without a name.
  std::function<void(std::string_view name)> solid;
  // Parses a coordinate (axis: 0, 1, 2) of a text file.
  std::function<NumberText(std::string_view text, size_t axis, double* value)> parse;
  // Receives a corner of a text file.
  std::function<absl::Status(const std::array<double, 3>& p, const StlErrorAt& error_at)> corner;
  // Receives a corner of a binary file.
  std::function<absl::Status(const std::array<float, 3>& p, const StlErrorAt& error_at)>
      float_corner;
};

// Reads an STL file, text or binary. Text starts with `solid` and has no control characters in its
// first KiB; keywords may have any letter case, and normals are ignored and may be missing.
// INVALID_ARGUMENT, with the line or byte and the number of facets read: the file is truncated or
// has no facet, or a binary file has room for more whole triangles than it declares. Other bytes
// after the last triangle are ignored.
absl::Status WalkStl(ByteSource* source, const StlReceiver& receiver);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_MESH_READERS_H_
