#ifndef HULLD_CLIENT_FORMATS_MESH_FILE_H_
#define HULLD_CLIENT_FORMATS_MESH_FILE_H_

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "client/formats/byte_source.h"

namespace hulld {

// A mesh, entirely in memory.
struct TriangleMesh {
  std::vector<std::array<double, 3>> vertices;
  // Indices into vertices, all in range.
  std::vector<std::array<uint32_t, 3>> triangles;
};

// Reads obj, off, ply, stl, gltf, glb or dae, by the extension; polygons become fans. The mesh of a
// PLY file without faces is empty. INVALID_ARGUMENT names the file and the location.
absl::StatusOr<TriangleMesh> ReadMesh(const std::string& path);

// A part of a file. The name comes from the file, or is empty.
struct MeshPart {
  std::string name;
  TriangleMesh mesh;
};

enum class SplitBy {
  // By name: objects and groups of obj, solids of stl, nodes of gltf and dae. Parts with the same
  // name form one part; off and ply have no names and form one part.
  kName,
  // By connected component: triangles that share a vertex (by coordinates) belong together. Named
  // "component-1" and so on, in the order of the file.
  kComponent,
};

// Reads the mesh of a file, as ReadMesh does, in parts. Vertices without a triangle belong to no
// part; parts without triangles are omitted. INVALID_ARGUMENT also if the file has no triangle.
absl::StatusOr<std::vector<MeshPart>> ReadParts(const std::string& path, SplitBy split);

// Readers by format. Readers of parts keep vertices without a triangle and parts without triangles.
// The readers of glTF and COLLADA apply the transform of each node to its meshes.
absl::Status ReadObjMesh(ByteSource* source, TriangleMesh* mesh);
absl::Status ReadOffMesh(ByteSource* source, TriangleMesh* mesh);
absl::Status ReadPlyMesh(ByteSource* source, TriangleMesh* mesh);
absl::Status ReadObjParts(ByteSource* source, std::vector<MeshPart>* parts);
absl::Status ReadStlParts(ByteSource* source, std::vector<MeshPart>* parts);
absl::Status ReadGltfParts(ByteSource* source, std::vector<MeshPart>* parts);
absl::Status ReadDaeParts(ByteSource* source, std::vector<MeshPart>* parts);

// Adds the polygon as a fan from its first corner.
void AddPolygon(const std::vector<uint32_t>& corners, TriangleMesh* mesh);

// Adds `part` to `to`. INVALID_ARGUMENT, naming `file`, if there are too many vertices.
absl::Status AddMesh(const std::string& file, const TriangleMesh& part, TriangleMesh* to);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_MESH_FILE_H_
