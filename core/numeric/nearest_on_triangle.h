#ifndef HULLD_CORE_NUMERIC_NEAREST_ON_TRIANGLE_H_
#define HULLD_CORE_NUMERIC_NEAREST_ON_TRIANGLE_H_

#include <cstdint>

namespace hulld {

// The part of a triangle a, b, c that contains its point nearest to a given point p: a corner, the
// interior of an edge, or the interior.
enum class TrianglePart : uint8_t { kA, kB, kC, kAB, kAC, kBC, kInside };

// The part, and the weights of the corners in the nearest point up to a common factor. The weights
// of corners outside the part are 0.
struct TriangleNearest {
  TrianglePart part;
  double a;
  double b;
  double c;
};

// Projections of the vector x from a corner to p on the two edges at a.
struct EdgeProjections {
  double on_ab;  // (b - a) . x
  double on_ac;  // (c - a) . x
};

// Finds the part in floating point, up to rounding: near the boundary of two parts the result may
// be either one, and weights of the interior that are near 0 may be negative. project(corner), for
// corners 0 to 2, returns EdgeProjections, rounded as the caller chooses; it is called only for the
// corners needed. Source: Ericson 2005, Real-Time Collision Detection, 5.1.5.
template <typename Project>
inline TriangleNearest FindNearestOnTriangle(Project project) {
  const EdgeProjections from_a = project(0);
  if (from_a.on_ab <= 0 && from_a.on_ac <= 0) return {TrianglePart::kA, 1, 0, 0};
  const EdgeProjections from_b = project(1);
  if (from_b.on_ab >= 0 && from_b.on_ac <= from_b.on_ab) return {TrianglePart::kB, 0, 1, 0};
  const double area_c = from_a.on_ab * from_b.on_ac - from_b.on_ab * from_a.on_ac;
  if (area_c <= 0 && from_a.on_ab >= 0 && from_b.on_ab <= 0) {
    return {TrianglePart::kAB, -from_b.on_ab, from_a.on_ab, 0};
  }
  const EdgeProjections from_c = project(2);
  if (from_c.on_ac >= 0 && from_c.on_ab <= from_c.on_ac) return {TrianglePart::kC, 0, 0, 1};
  const double area_b = from_c.on_ab * from_a.on_ac - from_a.on_ab * from_c.on_ac;
  if (area_b <= 0 && from_a.on_ac >= 0 && from_c.on_ac <= 0) {
    return {TrianglePart::kAC, -from_c.on_ac, 0, from_a.on_ac};
  }
  const double area_a = from_b.on_ab * from_c.on_ac - from_c.on_ab * from_b.on_ac;
  const double along_bc = from_b.on_ac - from_b.on_ab;
  const double along_cb = from_c.on_ab - from_c.on_ac;
  if (area_a <= 0 && along_bc >= 0 && along_cb >= 0) {
    return {TrianglePart::kBC, 0, along_cb, along_bc};
  }
  return {TrianglePart::kInside, area_a, area_b, area_c};
}

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_NEAREST_ON_TRIANGLE_H_
