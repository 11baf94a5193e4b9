#include "client/robot/shape_hull.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "client/formats/point_file.h"

namespace hulld {
namespace {

using Vector = std::array<double, 3>;
using Triangle = std::array<int, 3>;

// Margin for the rounding of the following computation, a few tens of operations of relative error
// 2^-53 each. Proven: 64 operations lose less than 2^-46 of a length.
constexpr double kOutward = 1 + 0x1p-46;

struct Sphere {
  std::vector<Vector> vertices;
  std::vector<Triangle> triangles;
};

Vector Unit(const Vector& v) {
  const double length = std::hypot(v[0], v[1], v[2]);
  return {v[0] / length, v[1] / length, v[2] / length};
}

// Splits each triangle into four, with the new vertices on the unit sphere.
Sphere Subdivide(const Sphere& from) {
  Sphere to;
  to.vertices = from.vertices;
  std::map<std::pair<int, int>, int> middles;
  const auto middle = [&](int a, int b) {
    const auto [entry, is_new] = middles.emplace(std::pair(std::min(a, b), std::max(a, b)),
                                                 static_cast<int>(to.vertices.size()));
    if (is_new) {
      const Vector& p = from.vertices[static_cast<size_t>(a)];
      const Vector& q = from.vertices[static_cast<size_t>(b)];
      to.vertices.push_back(Unit({p[0] + q[0], p[1] + q[1], p[2] + q[2]}));
    }
    return entry->second;
  };
  for (const auto& [a, b, c] : from.triangles) {
    const int ab = middle(a, b);
    const int bc = middle(b, c);
    const int ca = middle(c, a);
    for (const Triangle& part :
         {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{ab, bc, ca}}) {
      to.triangles.push_back(part);
    }
  }
  return to;
}

Sphere Icosahedron() {
  constexpr double g = std::numbers::phi;
  Sphere sphere;
  for (const Vector& v : {Vector{-1, g, 0}, Vector{1, g, 0}, Vector{-1, -g, 0}, Vector{1, -g, 0},
                          Vector{0, -1, g}, Vector{0, 1, g}, Vector{0, -1, -g}, Vector{0, 1, -g},
                          Vector{g, 0, -1}, Vector{g, 0, 1}, Vector{-g, 0, -1}, Vector{-g, 0, 1}}) {
    sphere.vertices.push_back(Unit(v));
  }
  sphere.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                      {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                      {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                      {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  return sphere;
}

// Returns the distance of the nearest triangle plane from the origin.
double InnerRadius(const Sphere& sphere) {
  double least = 1;
  for (const auto& [a, b, c] : sphere.triangles) {
    const Vector& p = sphere.vertices[static_cast<size_t>(a)];
    const Vector& q = sphere.vertices[static_cast<size_t>(b)];
    const Vector& r = sphere.vertices[static_cast<size_t>(c)];
    const Vector u = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
    const Vector v = {r[0] - p[0], r[1] - p[1], r[2] - p[2]};
    const Vector n =
        Unit({u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]});
    least = std::min(least, std::abs(n[0] * p[0] + n[1] * p[1] + n[2] * p[2]));
  }
  return least;
}

// Returns the vertices of a polyhedron that contains the unit ball around the origin. The triangles
// form a closed surface that each ray from the origin meets exactly once, and no point of it is
// nearer than the nearest plane. So its interior contains the ball, and so does the convex hull of
// its vertices.
const std::vector<Vector>& RoundVertices() {
  static const auto* const vertices = [] {
    const Sphere sphere = Subdivide(Subdivide(Icosahedron()));
    const double scale = kOutward / InnerRadius(sphere);
    auto* const scaled = new std::vector<Vector>;
    for (const Vector& v : sphere.vertices) {
      scaled->push_back({scale * v[0], scale * v[1], scale * v[2]});
    }
    return scaled;
  }();
  return *vertices;
}

double RoundReach() {
  double most = 0;
  for (const Vector& v : RoundVertices()) most = std::max(most, std::hypot(v[0], v[1], v[2]));
  return most;
}

void AddRound(double radius, double z, std::vector<double>* xyz) {
  for (const Vector& v : RoundVertices()) {
    xyz->insert(xyz->end(), {radius * v[0], radius * v[1], z + radius * v[2]});
  }
}

ShapeHull BoxHull(const CollisionShape& box) {
  ShapeHull hull;
  for (const int corner : {0, 1, 2, 3, 4, 5, 6, 7}) {
    for (size_t axis = 0; axis < 3; ++axis) {
      const double half = box.size[axis] / 2;
      hull.xyz.push_back((corner >> axis) % 2 == 0 ? -half : half);
    }
  }
  return hull;
}

ShapeHull CylinderHull(const CollisionShape& cylinder) {
  ShapeHull hull;
  // The sides of a regular polygon are nearer to its center than its corners, by this factor.
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

ShapeHull PrimitiveHull(const CollisionShape& shape) {
  ShapeHull hull;
  switch (shape.kind) {
    case ShapeKind::kBox:
      return BoxHull(shape);
    case ShapeKind::kCylinder:
      return CylinderHull(shape);
    case ShapeKind::kSphere:
      AddRound(shape.radius, 0, &hull.xyz);
      break;
    case ShapeKind::kCapsule: {
      // Adding the radius to half the length has a rounding error relative to the sum, not to the
      // radius.
      const double half = shape.length / 2;
      const double slack = 1 + 0x1p-51 * (1 + half / shape.radius);
      AddRound(slack * shape.radius, half, &hull.xyz);
      AddRound(slack * shape.radius, -half, &hull.xyz);
      break;
    }
    case ShapeKind::kMesh:
      return hull;
  }
  hull.excess = shape.radius * (RoundReach() - 1);
  return hull;
}

absl::StatusOr<ShapeHull> MeshHull(const CollisionShape& shape, const std::string& file) {
  const auto format = PointFormatOfPath(file);
  if (!format.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat(file, ": meshes are read from obj, stl, ply, off, gltf and dae; convert it"));
  }
  ShapeHull hull;
  ReadRequest request{file, *format, {}, {}};
  request.options.scale = shape.scale;
  const auto counts = ReadPoints(request, [&](const PointChunk& block) {
    hull.xyz.insert(hull.xyz.end(), block.xyz.begin(), block.xyz.end());
    hull.xyz.insert(hull.xyz.end(), block.xyz_float.begin(), block.xyz_float.end());
    return absl::OkStatus();
  });
  if (!counts.ok()) return counts.status();
  if (hull.xyz.empty()) return absl::InvalidArgumentError(absl::StrCat(file, ": holds no vertex"));
  return hull;
}

}  // namespace hulld
