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

// Points in the unit of the box of all that were included, each coordinate from 0 to 1, so that
// floating point serves whatever their size and place.
class UnitBox {
 public:
  // Requires points that are not empty.
  explicit UnitBox(std::span<const double> xyz);

  // Off by a few units of 2^-53.
  Point3 ToUnit(const Point3& p) const;
  double LengthToUnit(double length) const;

 private:
  // The exponent of the largest coordinate, divided out so that no difference overflows.
  int exponent_ = 0;
  Point3 low_ = {0, 0, 0};
  double size_ = 1;
};

// Finds the triangles that a question about a point may be about, among many. It answers in
// floating point, with slack: it may propose a triangle for nothing, but leaves none out.
//
// Idea: a tree of boxes over the triangles. Cost: n log n to make; about log n for a question, and
// a call for each triangle proposed.
class TriangleTree {
 public:
  // Whether the triangle of this index settles the question.
  using Visitor = std::function<bool(size_t triangle)>;

  // points: in a unit box; both must outlive this. Requires indices of points.
  TriangleTree(std::span<const Point3> points, std::span<const Triangle> triangles);

  // Proposes the triangles within the distance of p, those in near boxes first, until one settles
  // the question; whether one did.
  bool AnyNear(const Point3& p, double distance, const Visitor& settles) const;
  // The same of the triangles that the ray from `apex` through p meets at p or beyond. Requires
  // that the two are apart by much more than the slack, 2^-40 (unchecked: replies may hold points
  // that are not; then a triangle may be left out, and what depends on it is not shown).
  bool AnyBeyond(const Point3& apex, const Point3& p, const Visitor& settles) const;

 private:
  struct Box {
    Point3 low;
    Point3 high;
  };
  // The triangles order_[first, end), and where the second half of a node that has halves is; the
  // first half is the next node. 0: a leaf.
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
