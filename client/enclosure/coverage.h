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

// A triangle with a part outside of all pieces.
struct UncoveredTriangle {
  // Its index in the mesh.
  size_t triangle = 0;
  // The point of the uncovered part, among the corners left by clipping, that is farthest from all
  // pieces, and its distance. In floating point, with errors of a few units of roundoff.
  std::array<double, 3> point = {0, 0, 0};
  double distance = 0;
  // Area of the uncovered part, in floating point; 0 for a triangle without area.
  double area = 0;
};

struct Coverage {
  // Exact: empty if and only if each point of each triangle is in a piece.
  std::vector<UncoveredTriangle> uncovered;
  // Triangles that lie in no single piece and were cut into parts.
  uint64_t clipped = 0;
  // For one piece: the largest distance of any point of the mesh from it, up to rounding. For
  // several: a lower bound, because the farthest point need not be a corner.
  double distance = 0;
};

// A convex piece: a hull at a pose. `mesh` is never null.
struct CoveringPiece {
  std::shared_ptr<const HullMesh> mesh;
  RigidPose X_WH = kNoMotion;
};

// Checks in exact arithmetic that convex pieces cover a mesh, with its triangles as closed
// sets.
//
// A triangle with all corners in one piece lies in it. Any other is clipped by the half spaces of
// each piece in turn into the part in the piece and convex polygons outside. Polygons left after
// all pieces are uncovered. Corners are quotients of integers of any length, so nothing is rounded
// before the answer. They are reduced to lowest terms, so that the size of the integers depends on
// the planes that meet in a corner, not on the number of cuts.
//
// Poses are exact, too: half spaces rotate with their piece.
//
// Only the surface is checked. A single piece that contains the surface also contains its interior
// because it is convex; several pieces may cover the surface of a solid and leave a cavity inside.
//
// `progress` receives the number of finished triangles. INTERNAL: facets that do not match their
// vertices. Cost: one test per vertex and facet, and exact arithmetic for each cut.
absl::StatusOr<Coverage> CoverMesh(const std::vector<CoveringPiece>& pieces,
                                   const TriangleMesh& mesh,
                                   const std::function<void(uint64_t done)>& progress);

}  // namespace hulld

#endif  // HULLD_CLIENT_ENCLOSURE_COVERAGE_H_
