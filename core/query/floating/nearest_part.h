#ifndef HULLD_CORE_QUERY_FLOATING_NEAREST_PART_H_
#define HULLD_CORE_QUERY_FLOATING_NEAREST_PART_H_

#include <algorithm>
#include <array>
#include <cstdint>

#include "core/numeric/vector.h"

namespace hulld {

// The part of a triangle whose inside holds its point nearest to the origin.
struct NearestPart {
  uint32_t count = 0;
  // Which corners, and their weights: not negative, with sum 1 up to rounding.
  std::array<uint8_t, 3> corners = {};
  std::array<double, 3> weights = {};
  Vector point = Vector::Zero();
  // Towards the origin across the part, of any length; more accurate than -point.
  Vector towards = Vector::Zero();
};

inline NearestPart NearestOfVertex(const Vector& p) { return {1, {0}, {1}, p, -p}; }

inline NearestPart NearestOnEdge(const Vector& p, const Vector& q, uint8_t i, uint8_t j) {
  const Vector e = q - p;
  const double along = -e.dot(p);
  const double length = e.squaredNorm();
  if (!(along > 0)) return {1, {i}, {1}, p, -p};
  if (!(along < length)) return {1, {j}, {1}, q, -q};
  const double t = along / length;
  const Vector point = (1 - t) * p + t * q;
  return {2, {i, j}, {1 - t, t}, point, -t * e - p};
}

// In floating point, up to rounding. Source: Ericson 2005, Real-Time Collision Detection, 5.1.5.
inline NearestPart NearestOnTriangle(const Vector& a, const Vector& b, const Vector& c) {
  const Vector e = b - a;
  const Vector f = c - a;
  const double d1 = -e.dot(a), d2 = -f.dot(a);
  if (d1 <= 0 && d2 <= 0) return {1, {0}, {1}, a, -a};
  const double d3 = -e.dot(b), d4 = -f.dot(b);
  if (d3 >= 0 && d4 <= d3) return {1, {1}, {1}, b, -b};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return NearestOnEdge(a, b, 0, 1);
  const double d5 = -e.dot(c), d6 = -f.dot(c);
  if (d6 >= 0 && d5 <= d6) return {1, {2}, {1}, c, -c};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return NearestOnEdge(a, c, 0, 2);
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return NearestOnEdge(b, c, 1, 2);
  // Rounding may turn a weight near 0 negative, and a sliver may have none.
  const double x = std::max(va, 0.0), y = std::max(vb, 0.0), z = std::max(vc, 0.0);
  const double sum = x + y + z;
  if (!(sum > 0)) return {1, {0}, {1}, a, -a};
  const double u = x / sum, v = y / sum, w = z / sum;
  const Vector normal = e.cross(f);
  return {
      3, {0, 1, 2}, {u, v, w}, u * a + v * b + w * c, normal.dot(a) > 0 ? Vector(-normal) : normal};
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_NEAREST_PART_H_
