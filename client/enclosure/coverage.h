#ifndef HULLD_CLIENT_ENCLOSURE_COVERAGE_H_
#define HULLD_CLIENT_ENCLOSURE_COVERAGE_H_

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "client/client.h"
#include "client/formats/mesh_file.h"
#include "client/pose/rigid_pose.h"

namespace hulld {

// A triangle of which something sticks out of all pieces.
struct UncoveredTriangle {
  // Its index in the mesh.
  size_t triangle = 0;
  // The point of what sticks out, among the corners that clipping left, that is farthest from all
  // pieces; and how far it is. In floating point: each off by a few units of roundoff.
  std::array<double, 3> point = {0, 0, 0};
  double distance = 0;
  // What sticks out of it, in floating point; 0 for a triangle without area.
  double area = 0;
};

struct Coverage {
  // Exact: empty if and only if each point of each triangle is in a piece.
  std::vector<UncoveredTriangle> uncovered;
  // Triangles that lie in no single piece, and so were cut into parts.
  uint64_t clipped = 0;
  // Where the pieces are one: the farthest that any point of the mesh sticks out, up to rounding.
  // Where they are several: at least so far, as the farthest point need not be a corner.
  double distance = 0;
};

// A hull at a pose: a convex piece. Its vertices and facets are those of the hull; never null.
struct PlacedHull {
  std::shared_ptr<const HullMesh> mesh;
  RigidPose X_WH = kNoMotion;
};

// Whether convex pieces enclose a mesh, its triangles taken as closed sets in exact arithmetic.
//
// A triangle whose corners are all in one piece lies in it. Any other is cut: by the half spaces of
// each piece in turn, into what lies in the piece and convex polygons that do not; what is left
// after all pieces is outside of all. Corners are quotients of integers of any length, so nothing
// is rounded before the answer. Cut points are reduced, so that their digits are bounded by those
// of the planes that meet in them, however many cuts led there.
//
// Poses are exact, too: a piece that is turned is cut by its half spaces as they turn with it.
//
// It is the surface that is asked about. One piece that holds the surface holds what it encloses,
// for it is convex; several may leave a hollow inside of a solid whose surface they cover.
//
// `progress` is told the triangles that are done. INTERNAL: facets that do not fit their vertices.
// Cost: a test for each vertex and facet, and exact arithmetic for each cut.
absl::StatusOr<Coverage> CoverMesh(const std::vector<PlacedHull>& pieces, const TriangleMesh& mesh,
                                   const std::function<void(uint64_t done)>& progress);

}  // namespace hulld

#endif  // HULLD_CLIENT_ENCLOSURE_COVERAGE_H_
