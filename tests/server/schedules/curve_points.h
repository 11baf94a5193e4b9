#ifndef HULLD_TESTS_SERVER_SCHEDULES_CURVE_POINTS_H_
#define HULLD_TESTS_SERVER_SCHEDULES_CURVE_POINTS_H_

#include <bit>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/numeric/vector.h"

namespace hulld::server {

// Points (t, t^2, t^3), t = 1, 2, ...: bit t is set if t is in the set. Every point is extreme in
// any subset, so a hull of a subset has exactly that subset as vertices (the cyclic polytope:
// Ziegler 1995, Lectures on Polytopes, 0.6).
using CurveSet = uint32_t;

inline uint64_t CountOf(CurveSet set) { return static_cast<uint64_t>(std::popcount(set)); }
inline constexpr uint32_t kCurvePoints = 12;

inline Vector CurvePoint(uint32_t t) {
  const double x = t;
  return {x, x * x, x * x * x};
}

inline std::vector<Vector> PointsOf(CurveSet set) {
  std::vector<Vector> points;
  for (uint32_t t = 1; t <= kCurvePoints; ++t) {
    if ((set >> t & 1) != 0) points.push_back(CurvePoint(t));
  }
  return points;
}

// Adds a point. Returns false if it is not on the curve, or already in the set.
inline bool AddPoint(const Vector& point, CurveSet& set) {
  const double x = point.x();
  if (!(x >= 1 && x <= kCurvePoints)) return false;
  const auto t = static_cast<uint32_t>(x);
  if (point != CurvePoint(t) || (set >> t & 1) != 0) return false;
  set |= CurveSet{1} << t;
  return true;
}

// Returns nullopt if a point is not on the curve or occurs twice.
template <typename Points>
std::optional<CurveSet> SetOf(const Points& points) {
  CurveSet set = 0;
  for (const Vector& point : points) {
    if (!AddPoint(point, set)) return std::nullopt;
  }
  return set;
}

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_CURVE_POINTS_H_
