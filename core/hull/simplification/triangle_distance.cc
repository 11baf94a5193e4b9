#include "core/hull/simplification/triangle_distance.h"

#include <algorithm>
#include <utility>

#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"

namespace hulld {
namespace {

// Coordinates of the point of the triangle a, a + e, a + f nearest to a + p, as a + s e + t f with
// s, t >= 0 and s + t <= 1. Source: Ericson 2005, Real-Time Collision Detection, section 5.1.5.
std::pair<double, double> NearestOnTriangle(const Vector& e, const Vector& f, const Vector& p) {
  const double d1 = e.dot(p);
  const double d2 = f.dot(p);
  if (d1 <= 0 && d2 <= 0) return {0, 0};
  const double d3 = e.dot(p - e);
  const double d4 = f.dot(p - e);
  if (d3 >= 0 && d4 <= d3) return {1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {d1 / (d1 - d3), 0};
  const double d5 = e.dot(p - f);
  const double d6 = f.dot(p - f);
  if (d6 >= 0 && d5 <= d6) return {0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {1 - t, t};
  }
  const double denominator = 1 / (va + vb + vc);
  return {vb * denominator, vc * denominator};
}

}  // namespace

// The distance to the point a + s e + t f, which belongs to the triangle for the doubles s and t;
// where it is does not matter for the bound, and kSubsetDistanceErrorFactor covers its evaluation.
double DistanceToTriangleBound(const Vector& a, const Vector& b, const Vector& c, const Vector& p) {
  const Vector e = b - a;
  const Vector f = c - a;
  const Vector offset = p - a;
  const double size =
      offset.cwiseAbs().maxCoeff() + e.cwiseAbs().maxCoeff() + f.cwiseAbs().maxCoeff();
  if (size == 0) return kLeastPositive;
  auto [s, t] = NearestOnTriangle(e / size, f / size, offset / size);
  if (!(s >= 0 && t >= 0 && s + t <= 1)) {
    s = std::clamp(s, 0.0, 1.0);
    t = std::clamp(t, 0.0, 1.0 - s);
    if (!(s + t <= 1)) s = t = 0;
  }
  const double distance = (offset - s * e - t * f).stableNorm();
  return distance + kSubsetDistanceErrorFactor * (distance + size) + kLeastPositive;
}

}  // namespace hulld
