#include "client/verify/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "client/base/check.h"
#include "client/pose/vector3.h"

namespace hulld {
namespace {

constexpr uint32_t kLeafSize = 4;
// Far above the rounding errors in a unit box, and too small to affect the cost.
constexpr double kSlack = 0x1p-40;
// Exceeds every distance in a unit box.
constexpr double kFar = 2;

double Norm(const Point3& a) { return std::sqrt(Dot(a, a)); }

double DistanceToBox(const Point3& low, const Point3& high, const Point3& p) {
  Point3 gap;
  for (size_t axis = 0; axis < 3; ++axis) {
    gap[axis] = std::max({low[axis] - p[axis], 0.0, p[axis] - high[axis]});
  }
  return Norm(gap);
}

// Returns true if apex + t along is in the box, within the slack, for some t of at least 1.
bool MeetsBox(const Point3& low, const Point3& high, const Point3& apex, const Point3& along) {
  double from = 1 - kSlack;
  double to = INFINITY;
  for (size_t axis = 0; axis < 3; ++axis) {
    const double below = low[axis] - kSlack - apex[axis];
    const double above = high[axis] + kSlack - apex[axis];
    // A ray almost perpendicular to this axis leaves the unit box before it moves along the axis.
    if (std::abs(along[axis]) < kSlack * kSlack) {
      if (below > 0 || above < 0) return false;
      continue;
    }
    const double a = below / along[axis];
    const double b = above / along[axis];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return from <= to;
}

}  // namespace

UnitBox::UnitBox(std::span<const double> xyz) {
  HULLD_CLIENT_CHECK(xyz.size() >= 3);
  double largest = 0;
  for (const double x : xyz) largest = std::max(largest, std::abs(x));
  std::frexp(largest, &exponent_);
  Point3 high;
  for (size_t axis = 0; axis < 3; ++axis) {
    low_[axis] = high[axis] = std::ldexp(xyz[axis], -exponent_);
  }
  for (size_t i = 0; i < xyz.size(); ++i) {
    const double x = std::ldexp(xyz[i], -exponent_);
    low_[i % 3] = std::min(low_[i % 3], x);
    high[i % 3] = std::max(high[i % 3], x);
  }
  const Point3 sides = Minus(high, low_);
  size_ = *std::max_element(sides.begin(), sides.end());
  if (size_ == 0) size_ = 1;
}

Point3 UnitBox::ToUnit(const Point3& p) const {
  Point3 unit;
  for (size_t axis = 0; axis < 3; ++axis) {
    unit[axis] = (std::ldexp(p[axis], -exponent_) - low_[axis]) / size_;
  }
  return unit;
}

double UnitBox::LengthToUnit(double length) const { return std::ldexp(length, -exponent_) / size_; }

TriangleTree::TriangleTree(std::span<const Point3> points, std::span<const Triangle> triangles)
    : points_(points), triangles_(triangles), order_(triangles.size()) {
  for (const Triangle& triangle : triangles) {
    HULLD_CLIENT_CHECK(*std::max_element(triangle.begin(), triangle.end()) < points.size());
  }
  std::iota(order_.begin(), order_.end(), 0);
  if (!order_.empty()) Build(0, static_cast<uint32_t>(order_.size()));
}

TriangleTree::Box TriangleTree::BoxOf(const Triangle& triangle) const {
  Box box = {points_[triangle[0]], points_[triangle[0]]};
  for (const uint32_t corner : triangle) {
    for (size_t axis = 0; axis < 3; ++axis) {
      box.low[axis] = std::min(box.low[axis], points_[corner][axis]);
      box.high[axis] = std::max(box.high[axis], points_[corner][axis]);
    }
  }
  return box;
}

// Splits at the median of the triangle centers along the longest side of their box.
void TriangleTree::Build(uint32_t first, uint32_t end) {
  Box box = BoxOf(triangles_[order_[first]]);
  for (uint32_t i = first + 1; i < end; ++i) {
    const Box other = BoxOf(triangles_[order_[i]]);
    for (size_t axis = 0; axis < 3; ++axis) {
      box.low[axis] = std::min(box.low[axis], other.low[axis]);
      box.high[axis] = std::max(box.high[axis], other.high[axis]);
    }
  }
  const size_t node = nodes_.size();
  nodes_.push_back({box, first, end, 0});
  if (end - first <= kLeafSize) return;
  const Point3 sides = Minus(box.high, box.low);
  const size_t axis = std::max_element(sides.begin(), sides.end()) - sides.begin();
  const auto middle = [&](uint32_t triangle) {
    const Triangle& t = triangles_[triangle];
    return points_[t[0]][axis] + points_[t[1]][axis] + points_[t[2]][axis];
  };
  const uint32_t half = first + (end - first) / 2;
  std::nth_element(order_.begin() + first, order_.begin() + half, order_.begin() + end,
                   [&](uint32_t a, uint32_t b) { return middle(a) < middle(b); });
  Build(first, half);
  nodes_[node].second_half = static_cast<uint32_t>(nodes_.size());
  Build(half, end);
}

bool TriangleTree::AnyNear(const Point3& p, double distance, const Visitor& settles) const {
  if (nodes_.empty()) return false;
  return VisitNear(0, p, std::min(distance, kFar) * (1 + kSlack) + kSlack, settles);
}

bool TriangleTree::VisitNear(uint32_t at, const Point3& p, double reach,
                             const Visitor& settles) const {
  const Node& node = nodes_[at];
  if (node.second_half == 0) {
    for (uint32_t i = node.first; i < node.end; ++i) {
      const Triangle& triangle = triangles_[order_[i]];
      const Box box = BoxOf(triangle);
      if (DistanceToBox(box.low, box.high, p) > reach) continue;
      if (!IsPlaneBeyond(triangle, p, reach) && settles(order_[i])) return true;
    }
    return false;
  }
  const auto distance_to = [&](uint32_t child) {
    return DistanceToBox(nodes_[child].box.low, nodes_[child].box.high, p);
  };
  std::array<uint32_t, 2> children = {at + 1, node.second_half};
  std::array<double, 2> distances = {distance_to(children[0]), distance_to(children[1])};
  if (distances[1] < distances[0]) {
    std::swap(children[0], children[1]);
    std::swap(distances[0], distances[1]);
  }
  for (size_t i = 0; i < 2; ++i) {
    if (distances[i] <= reach && VisitNear(children[i], p, reach, settles)) return true;
  }
  return false;
}

// Returns true if the plane of the triangle is certainly farther than `reach` from p. Each
// coordinate has an error of a few units of 2^-53, and the normal that error times the side
// lengths; the slack exceeds the sum.
bool TriangleTree::IsPlaneBeyond(const Triangle& triangle, const Point3& p, double reach) const {
  const Point3& corner = points_[triangle[0]];
  const Point3 ab = Minus(points_[triangle[1]], corner);
  const Point3 ac = Minus(points_[triangle[2]], corner);
  const Point3 normal = Cross(ab, ac);
  const double slack = kSlack * (Norm(ab) + Norm(ac));
  return std::abs(Dot(normal, Minus(p, corner))) - slack > reach * Norm(normal);
}

bool TriangleTree::AnyBeyond(const Point3& apex, const Point3& p, const Visitor& settles) const {
  return !nodes_.empty() && VisitBeyond(0, apex, Minus(p, apex), settles);
}

bool TriangleTree::VisitBeyond(uint32_t at, const Point3& apex, const Point3& along,
                               const Visitor& settles) const {
  const Node& node = nodes_[at];
  if (!MeetsBox(node.box.low, node.box.high, apex, along)) return false;
  if (node.second_half != 0) {
    return VisitBeyond(at + 1, apex, along, settles) ||
           VisitBeyond(node.second_half, apex, along, settles);
  }
  for (uint32_t i = node.first; i < node.end; ++i) {
    const Box box = BoxOf(triangles_[order_[i]]);
    if (MeetsBox(box.low, box.high, apex, along) && settles(order_[i])) return true;
  }
  return false;
}

}  // namespace hulld
