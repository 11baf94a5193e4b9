#ifndef HULLD_CLIENT_ROBOT_SHAPE_HULL_H_
#define HULLD_CLIENT_ROBOT_SHAPE_HULL_H_

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "client/robot/robot.h"

namespace hulld {

// Points whose convex hull stands for a shape.
struct ShapeHull {
  // x y z each, in the frame of the shape.
  std::vector<double> xyz;
  // The hull holds the shape and reaches no farther beyond it than this, in metres; proven, up to
  // the rounding of this number. 0 for boxes, and for meshes, whose hull it is.
  double excess = 0;
};

// Box: its corners, exact but for halving the smallest numbers. Cylinder: a prism of
// kCylinderSides sides around it. Sphere: a geodesic polyhedron of 162 vertices around it.
// Capsule: the hull of two of those. None of them is larger than it must be but for a few units of
// roundoff. Requires sizes above 0, as ReadUrdf makes sure of; a mesh is not its business.
ShapeHull PrimitiveHull(const CollisionShape& shape);
inline constexpr int kCylinderSides = 32;

// The vertices of the mesh in `file`, each coordinate times its factor of the scale, rounded to the
// nearest double. INVALID_ARGUMENT names the file and what is wrong with it.
absl::StatusOr<ShapeHull> MeshHull(const CollisionShape& shape, const std::string& file);

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_SHAPE_HULL_H_
