#ifndef HULLD_CORE_QUERY_FLOATING_NEAREST_PART_H_
#define HULLD_CORE_QUERY_FLOATING_NEAREST_PART_H_

#include <algorithm>
#include <array>
#include <cstdint>

#include "core/numeric/nearest_on_triangle.h"
#include "core/query/placed/plain_vector.h"

namespace hulld {

// The part of a triangle that contains the point nearest to the origin in its interior.
struct NearestPart {
  uint32_t count = 0;
  // Indices and weights of the corners. Weights are not negative, with sum 1 up to rounding.
  std::array<uint8_t, 3> corners = {};
  std::array<double, 3> weights = {};
  PlainVector point;
  // Direction toward the origin across the part, of any length; more accurate than -point.
  PlainVector toward;
};

inline NearestPart NearestOfVertex(const PlainVector& p) { return {1, {0}, {1}, p, -p}; }

inline NearestPart NearestOnEdge(const PlainVector& p, const PlainVector& q, uint8_t i, uint8_t j) {
  const PlainVector e = q - p;
  const double along = -Dot(e, p);
  const double length = SquaredNorm(e);
  if (!(along > 0)) return {1, {i}, {1}, p, -p};
  if (!(along < length)) return {1, {j}, {1}, q, -q};
  const double t = along / length;
  const PlainVector point = (1 - t) * p + t * q;
  return {2, {i, j}, {1 - t, t}, point, -t * e - p};
}

// Finds the nearest part in floating point, up to rounding.
inline NearestPart NearestOnTriangle(const PlainVector& a, const PlainVector& b,
                                     const PlainVector& c) {
  const PlainVector e = b - a;
  const PlainVector f = c - a;
  const TriangleNearest nearest = FindNearestOnTriangle([&](int corner) -> EdgeProjections {
    const PlainVector& p = corner == 0 ? a : corner == 1 ? b : c;
    return {-Dot(e, p), -Dot(f, p)};
  });
  switch (nearest.part) {
    case TrianglePart::kA:
      return {1, {0}, {1}, a, -a};
    case TrianglePart::kB:
      return {1, {1}, {1}, b, -b};
    case TrianglePart::kC:
      return {1, {2}, {1}, c, -c};
    case TrianglePart::kAB:
      return NearestOnEdge(a, b, 0, 1);
    case TrianglePart::kAC:
      return NearestOnEdge(a, c, 0, 2);
    case TrianglePart::kBC:
      return NearestOnEdge(b, c, 1, 2);
    case TrianglePart::kInside:
      break;
  }
  // Rounding may make a weight near 0 negative, and a sliver may have no positive weight.
  const double x = std::max(nearest.a, 0.0);
  const double y = std::max(nearest.b, 0.0);
  const double z = std::max(nearest.c, 0.0);
  const double sum = x + y + z;
  if (!(sum > 0)) return {1, {0}, {1}, a, -a};
  const double u = x / sum, v = y / sum, w = z / sum;
  const PlainVector normal = Cross(e, f);
  return {3, {0, 1, 2}, {u, v, w}, u * a + v * b + w * c, Dot(normal, a) > 0 ? -normal : normal};
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_NEAREST_PART_H_
