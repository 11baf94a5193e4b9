#include "core/hull/simplification/triangle_distance.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/nearest_on_triangle.h"

namespace hulld {
namespace {

// Returns the coordinates of the point of the triangle a, a + e, a + f nearest to a + p, as a + s e
// + t f with s, t >= 0 and s + t <= 1, up to rounding.
std::pair<double, double> NearestOnTriangle(const Vector& e, const Vector& f, const Vector& p) {
  const TriangleNearest nearest = FindNearestOnTriangle([&](int corner) -> EdgeProjections {
    if (corner == 0) return {e.dot(p), f.dot(p)};
    const Vector x = p - (corner == 1 ? e : f);
    return {e.dot(x), f.dot(x)};
  });
  const auto& [part, a, b, c] = nearest;
  switch (part) {
    case TrianglePart::kA:
      return {0, 0};
    case TrianglePart::kB:
      return {1, 0};
    case TrianglePart::kC:
      return {0, 1};
    case TrianglePart::kAB:
      return {b / (a + b), 0};
    case TrianglePart::kAC:
      return {0, c / (a + c)};
    case TrianglePart::kBC: {
      const double t = c / (b + c);
      return {1 - t, t};
    }
    case TrianglePart::kInside: {
      const double per_sum = 1 / (a + b + c);
      return {b * per_sum, c * per_sum};
    }
  }
  HULLD_UNREACHABLE();
}

}  // namespace

// Returns the distance to the point a + s e + t f, which belongs to the triangle for the doubles s
// and t. The bound is valid for any such point, and kSubsetDistanceErrorFactor covers its
// evaluation.
TriangleDistance DistanceToTriangle(const Vector& a, const Vector& b, const Vector& c,
                                    const Vector& p) {
  const Vector e = b - a;
  const Vector f = c - a;
  const Vector offset = p - a;
  const double size = LargestComponent(offset) + LargestComponent(e) + LargestComponent(f);
  if (size == 0) return {kMinPositive, a};
  auto [s, t] = NearestOnTriangle(e / size, f / size, offset / size);
  if (!(s >= 0 && t >= 0 && s + t <= 1)) {
    s = std::clamp(s, 0.0, 1.0);
    t = std::clamp(t, 0.0, 1.0 - s);
    if (!(s + t <= 1)) s = t = 0;
  }
  const Vector along = s * e + t * f;
  const double distance = (offset - along).stableNorm();
  return {distance + kSubsetDistanceErrorFactor * (distance + size) + kMinPositive, a + along};
}

}  // namespace hulld
