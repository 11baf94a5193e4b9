#ifndef HULLD_CLIENT_FORMATS_MESH_FILE_H_
#define HULLD_CLIENT_FORMATS_MESH_FILE_H_

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "client/formats/byte_source.h"

namespace hulld {

// A mesh for drawing, held whole in memory.
struct TriangleMesh {
  std::vector<std::array<double, 3>> vertices;
  // Indices into vertices, all in range.
  std::vector<std::array<uint32_t, 3>> triangles;
};

// Reads obj, off, stl, gltf or glb, by the extension; polygons become fans. INVALID_ARGUMENT names
// the file and the place.
absl::StatusOr<TriangleMesh> ReadMesh(const std::string& path);

// The readers of each format. Those of stl and gltf place each mesh as its node says.
absl::Status ReadObjMesh(ByteSource* source, TriangleMesh* mesh);
absl::Status ReadOffMesh(ByteSource* source, TriangleMesh* mesh);
absl::Status ReadAssimpMesh(const std::string& path, TriangleMesh* mesh);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_MESH_FILE_H_
