#ifndef HULLD_CLIENT_ROBOT_SHAPE_HULL_H_
#define HULLD_CLIENT_ROBOT_SHAPE_HULL_H_

#include <absl/status/statusor.h>

#include <span>
#include <string>
#include <vector>

#include "client/robot/robot.h"

namespace hulld {

// A rounded hull that represents a shape.
struct ShapeHull {
  // n x 3, in the frame of the shape.
  std::vector<double> xyz;
  // Placement.radius, in meters.
  double radius = 0;
  // The rounded hull contains the shape and extends at most this far beyond it, in meters; proven,
  // up to the rounding of this number. 0 except for cylinders; a mesh is replaced by its hull.
  double excess = 0;
};

// Returns the rounded hull of a shape. Box: its corners. Sphere: its center and radius. Capsule:
// its segment and radius. These are exact, except for halving the smallest numbers. Cylinder: a
// prism of kCylinderSides sides around it, as tight as possible within a few units of roundoff.
// Requires sizes of at least 0, as ReadUrdf ensures, and no mesh.
ShapeHull PrimitiveHull(const CollisionShape& shape);
inline constexpr int kCylinderSides = 32;

// Returns the corners of a box with these edge lengths, centered on the origin.
std::vector<double> BoxCorners(std::span<const double, 3> size);

// Returns the vertices of the mesh in `file`, each coordinate times its factor of the scale,
// rounded to the nearest double. INVALID_ARGUMENT names the file and its defect.
absl::StatusOr<ShapeHull> MeshHull(const CollisionShape& shape, const std::string& file);

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_SHAPE_HULL_H_
