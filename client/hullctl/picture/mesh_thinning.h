#ifndef HULLD_CLIENT_HULLCTL_PICTURE_MESH_THINNING_H_
#define HULLD_CLIENT_HULLCTL_PICTURE_MESH_THINNING_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace hulld {

using DrawnPoint = std::array<double, 3>;
using DrawnTriangle = std::array<uint32_t, 3>;

// Replaces a mesh by a coarser one of at most `limit` triangles, for drawing. Vertices in one cell
// of a grid become their mean; triangles that collapse or coincide are dropped. Leaves a mesh
// within the limit unchanged. Requires coordinates in [-1, 1]; unchecked, as coordinates outside
// only move to the cells at the edge. Source: Rossignac and Borrel 1993, Multi-resolution 3D
// approximations for rendering complex scenes.
void ThinOut(size_t limit, std::vector<DrawnPoint>* vertices,
             std::vector<DrawnTriangle>* triangles);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PICTURE_MESH_THINNING_H_
