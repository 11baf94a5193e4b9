#ifndef HULLD_CLIENT_HULLCTL_PICTURE_MESH_THINNING_H_
#define HULLD_CLIENT_HULLCTL_PICTURE_MESH_THINNING_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace hulld {

using DrawnPoint = std::array<double, 3>;
using DrawnTriangle = std::array<uint32_t, 3>;

// Replaces a mesh by a coarser one of at most `limit` triangles, for drawing: vertices in one cell
// of a grid become their mean; triangles that collapse or coincide are dropped. Requires
// coordinates in [-1, 1]; unchecked, as others only move to the cells at the edge. Leaves a mesh
// within the limit as it is. Source: Rossignac and Borrel 1993, Multi-resolution 3D approximations
// for rendering complex scenes.
void ThinOut(size_t limit, std::vector<DrawnPoint>* vertices,
             std::vector<DrawnTriangle>* triangles);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PICTURE_MESH_THINNING_H_
