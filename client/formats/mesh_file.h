#ifndef HULLD_CLIENT_FORMATS_MESH_FILE_H_
#define HULLD_CLIENT_FORMATS_MESH_FILE_H_

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "client/formats/byte_source.h"

namespace hulld {

// A mesh, held whole in memory.
struct TriangleMesh {
  std::vector<std::array<double, 3>> vertices;
  // Indices into vertices, all in range.
  std::vector<std::array<uint32_t, 3>> triangles;
};

// Reads obj, off, stl, gltf, glb or dae, by the extension; polygons become fans. INVALID_ARGUMENT
// names the file and the place.
absl::StatusOr<TriangleMesh> ReadMesh(const std::string& path);

// A part of a file, under the name that the file has for it; empty where it has none.
struct MeshPart {
  std::string name;
  TriangleMesh mesh;
};

enum class SplitBy {
  // What the file names: objects and groups of obj, solids of stl, nodes of gltf and dae. Parts of
  // one name are one part; off has no names, and is one part.
  kName,
  // What hangs together: triangles that share a vertex, at the same coordinates. "component-1" and
  // so on, in the order of the file.
  kComponent,
};

// Reads the mesh of a file, as ReadMesh does, in parts. Vertices that no triangle names belong to
// no part; parts without triangles are left out. INVALID_ARGUMENT also when there is no triangle.
absl::StatusOr<std::vector<MeshPart>> ReadParts(const std::string& path, SplitBy split);

// The readers of each format. Those of parts keep vertices that no triangle names, and parts
// without triangles; glTF and COLLADA place each mesh as its node says.
absl::Status ReadObjMesh(ByteSource* source, TriangleMesh* mesh);
absl::Status ReadOffMesh(ByteSource* source, TriangleMesh* mesh);
absl::Status ReadObjParts(ByteSource* source, std::vector<MeshPart>* parts);
absl::Status ReadStlParts(ByteSource* source, std::vector<MeshPart>* parts);
absl::Status ReadGltfParts(ByteSource* source, std::vector<MeshPart>* parts);
absl::Status ReadDaeParts(const std::string& path, std::vector<MeshPart>* parts);

// Adds `part` to `to`. INVALID_ARGUMENT, naming `file`, if there are too many vertices.
absl::Status AddMesh(const std::string& file, const TriangleMesh& part, TriangleMesh* to);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_MESH_FILE_H_
