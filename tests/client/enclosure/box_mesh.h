#ifndef HULLD_TESTS_CLIENT_ENCLOSURE_BOX_MESH_H_
#define HULLD_TESTS_CLIENT_ENCLOSURE_BOX_MESH_H_

#include <array>
#include <cstdint>
#include <vector>

#include "client/client.h"
#include "client/formats/mesh_file.h"

namespace hulld {

using Corner3 = std::array<double, 3>;

// Faces of a box: bit k of corner c selects the upper coordinate of axis k. Counter-clockwise seen
// from outside.
inline constexpr std::array<std::array<uint32_t, 4>, 6> kBoxFaces = {
    {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};

inline std::array<Corner3, 8> BoxCorners(const Corner3& low, const Corner3& high) {
  std::array<Corner3, 8> corners;
  for (size_t c = 0; c < 8; ++c) {
    for (size_t axis = 0; axis < 3; ++axis) {
      corners[c][axis] = (c >> axis) % 2 == 0 ? low[axis] : high[axis];
    }
  }
  return corners;
}

// As the server sends the hull of its corners. Flat if an edge is 0 along z.
inline HullMesh BoxHull(const Corner3& low, const Corner3& high) {
  HullMesh mesh;
  const bool flat = low[2] == high[2];
  const std::array<Corner3, 8> corners = BoxCorners(low, high);
  for (size_t c = 0; c < (flat ? 4 : 8); ++c) {
    mesh.xyz.insert(mesh.xyz.end(), corners[c].begin(), corners[c].end());
  }
  if (flat) {
    mesh.facet_sizes = {4};
    mesh.facet_indices = {0, 1, 3, 2};
    return mesh;
  }
  for (const auto& face : kBoxFaces) {
    mesh.facet_sizes.push_back(4);
    mesh.facet_indices.insert(mesh.facet_indices.end(), face.begin(), face.end());
  }
  return mesh;
}

inline TriangleMesh BoxMesh(const Corner3& low, const Corner3& high) {
  TriangleMesh mesh;
  for (const Corner3& corner : BoxCorners(low, high)) mesh.vertices.push_back(corner);
  for (const auto& [a, b, c, d] : kBoxFaces) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  }
  return mesh;
}

}  // namespace hulld

#endif  // HULLD_TESTS_CLIENT_ENCLOSURE_BOX_MESH_H_
