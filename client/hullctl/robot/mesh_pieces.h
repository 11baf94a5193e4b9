#ifndef HULLD_CLIENT_HULLCTL_ROBOT_MESH_PIECES_H_
#define HULLD_CLIENT_HULLCTL_ROBOT_MESH_PIECES_H_

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "client/formats/mesh_file.h"
#include "client/robot/robot.h"
#include "client/robot/shape_hull.h"

namespace hulld {

// Division of a mesh into pieces.
enum class MeshSplit {
  // By the names in the file if each part is convex, as convex decompositions (V-HACD, CoACD) write
  // them; otherwise one piece.
  kAutomatic,
  kNames,
  kComponents,
  kNone,
};

struct MeshPiece {
  ShapeHull hull;
  // The surface of the piece; empty if the format has none, or the file is larger than 64 MiB.
  TriangleMesh mesh;
};

// Returns true if the mesh is closed and no vertex is outside the plane of a triangle by more than
// a thousandth of the mesh size, because decompositions round their vertices. Meshes of more than
// 4096 vertices, which no decomposition produces, count as not convex. Cost: vertices times
// triangles.
bool IsConvexPart(const TriangleMesh& mesh);

// Returns the pieces of the mesh in `file`, each coordinate (a double) times its factor of the
// scale, rounded once. A format without triangles yields one piece. INVALID_ARGUMENT names the
// file and its defect.
absl::StatusOr<std::vector<MeshPiece>> MeshPieces(const CollisionShape& shape,
                                                  const std::string& file, MeshSplit split);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_ROBOT_MESH_PIECES_H_
