#ifndef HULLD_CLIENT_VERIFY_TRIANGLE_TREE_H_
#define HULLD_CLIENT_VERIFY_TRIANGLE_TREE_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace hulld {

using Point3 = std::array<double, 3>;
// Three vertex indices, which may be equal.
using Triangle = std::array<uint32_t, 3>;

inline Point3 PointAt(std::span<const double> xyz, size_t i) {
  return {xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]};
}

// Maps the bounding box of all included points to coordinates from 0 to 1, so that floating point
// works at any size and position.
class UnitBox {
 public:
  // Requires at least one point.
  explicit UnitBox(std::span<const double> xyz);

  // Error: a few units of 2^-53.
  Point3 ToUnit(const Point3& p) const;
  double LengthToUnit(double length) const;

 private:
  // Exponent of the largest coordinate, divided out so that no difference overflows.
  int exponent_ = 0;
  Point3 low_ = {0, 0, 0};
  double size_ = 1;
};

// Finds candidate triangles for a query about a point. Works in floating point with slack, so it
// may report false candidates but misses none.
//
// A tree of boxes over the triangles. Cost: n log n to build; about log n per query, and one call
// per candidate.
class TriangleTree {
 public:
  // Returns true if the triangle of this index settles the query.
  using Visitor = std::function<bool(size_t triangle)>;

  // points: in a unit box. Both must outlive this object. Requires valid indices of points.
  TriangleTree(std::span<const Point3> points, std::span<const Triangle> triangles);

  // Visits the triangles within the distance of p, nearer boxes first, until one settles the query.
  // Returns true if one did.
  bool AnyNear(const Point3& p, double distance, const Visitor& settles) const;
  // Same as above, for the triangles that the ray from `apex` through p meets at or beyond p.
  // Requires a distance between the two far above the slack, 2^-40. Unchecked: replies may contain
  // closer points; then a triangle may be missed, and the claim that depends on it is not proven.
  bool AnyBeyond(const Point3& apex, const Point3& p, const Visitor& settles) const;

 private:
  struct Box {
    Point3 low;
    Point3 high;
  };
  // The triangles order_[first, end). The first child is the next node; `second_half` is the index
  // of the second child, 0 for a leaf.
  struct Node {
    Box box;
    uint32_t first;
    uint32_t end;
    uint32_t second_half;
  };

  Box BoxOf(const Triangle& triangle) const;
  void Build(uint32_t first, uint32_t end);
  bool VisitNear(uint32_t at, const Point3& p, double reach, const Visitor& settles) const;
  bool VisitBeyond(uint32_t at, const Point3& apex, const Point3& along,
                   const Visitor& settles) const;
  bool IsPlaneBeyond(const Triangle& triangle, const Point3& p, double reach) const;

  std::span<const Point3> points_;
  std::span<const Triangle> triangles_;
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_VERIFY_TRIANGLE_TREE_H_
