#include "core/query/scene/swept_box.h"

#include <cmath>
#include <limits>

#include "core/query/placed/placed_hull.h"
#include "core/query/terms/motion.h"

namespace hulld {
namespace {

Box Union(const Box& a, const Box& b) { return {a.low.cwiseMin(b.low), a.high.cwiseMax(b.high)}; }

// Returns an upper bound of the distance of the points of a box from a point.
double Reach(const Box& box, const Vector& from) {
  const Vector farthest = (box.low - from).cwiseAbs().cwiseMax((box.high - from).cwiseAbs());
  // Differences, squares, sum, and root have a relative error below 2^-50, or lose less than the
  // least double.
  constexpr double kRoundedUp = 1 + 0x1p-50;
  return farthest.stableNorm() * kRoundedUp + std::numeric_limits<double>::min();
}

}  // namespace

// A rotation about the frame's origin keeps the distance of each point from it.
Box SweptBox(const MovingHull& moving) {
  const auto& [start, end] = moving.X_WH;
  const Box at_start = BoundingBox(PlacedHull(moving.hull, start, moving.radius));
  if (at_start.IsEmpty()) return at_start;
  if (IsTranslation(moving.X_WH)) {
    return Union(at_start, BoundingBox(PlacedHull(moving.hull, end, moving.radius)));
  }
  const double reach = Reach(at_start, start.t);
  if (!std::isfinite(reach)) return Box::All();
  return GrownBy(Union({start.t, start.t}, {end.t, end.t}), reach);
}

}  // namespace hulld
