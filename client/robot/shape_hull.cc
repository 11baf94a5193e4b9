#include "client/robot/shape_hull.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "client/formats/point_file.h"

namespace hulld {
namespace {

// Margin for the rounding of the following computation, a few tens of operations of relative error
// 2^-53 each. Proven: 64 operations lose less than 2^-46 of a length.
constexpr double kOutward = 1 + 0x1p-46;

ShapeHull CylinderHull(const CollisionShape& cylinder) {
  ShapeHull hull;
  // Ratio of the distance of a regular polygon's sides from its center to that of its corners.
  const double reach = kOutward * cylinder.radius / std::cos(std::numbers::pi / kCylinderSides);
  for (int side = 0; side < kCylinderSides; ++side) {
    const double angle = 2 * std::numbers::pi * side / kCylinderSides;
    for (const double z : {-cylinder.length / 2, cylinder.length / 2}) {
      hull.xyz.insert(hull.xyz.end(), {reach * std::cos(angle), reach * std::sin(angle), z});
    }
  }
  hull.excess = reach - cylinder.radius;
  return hull;
}

}  // namespace

std::vector<double> BoxCorners(std::span<const double, 3> size) {
  std::vector<double> xyz;
  for (const int corner : {0, 1, 2, 3, 4, 5, 6, 7}) {
    for (size_t axis = 0; axis < 3; ++axis) {
      const double half = size[axis] / 2;
      xyz.push_back((corner >> axis) % 2 == 0 ? -half : half);
    }
  }
  return xyz;
}

ShapeHull PrimitiveHull(const CollisionShape& shape) {
  switch (shape.kind) {
    case ShapeKind::kBox:
      return {BoxCorners(shape.size)};
    case ShapeKind::kCylinder:
      return CylinderHull(shape);
    case ShapeKind::kSphere:
      return {{0, 0, 0}, shape.radius};
    case ShapeKind::kCapsule:
      return {{0, 0, -shape.length / 2, 0, 0, shape.length / 2}, shape.radius};
    case ShapeKind::kMesh:
      break;
  }
  return {};
}

absl::StatusOr<ShapeHull> MeshHull(const CollisionShape& shape, const std::string& file) {
  const auto format = PointFormatOfPath(file);
  if (!format.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat(file, ": meshes are read from obj, stl, ply, off, gltf and dae; convert it"));
  }
  ReadRequest request{file, *format, {}, {}};
  request.options.scale = shape.scale;
  auto xyz = ReadAllPoints(request);
  if (!xyz.ok()) return xyz.status();
  return ShapeHull{*std::move(xyz)};
}

}  // namespace hulld
