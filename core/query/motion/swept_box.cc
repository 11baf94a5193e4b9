#include "core/query/motion/swept_box.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/query/body/placed_body.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/terms/motion.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/pose_product.h"

namespace hulld {
namespace {

// Returns an upper bound on the distance from a point to any point of a box.
double Reach(const Box& box, const Vector& from) {
  const Vector farthest = (box.low - from).cwiseAbs().cwiseMax((box.high - from).cwiseAbs());
  // The differences, squares, sum, and root together have a relative error below 2^-50, or lose
  // less than the smallest positive double.
  constexpr double kRoundedUp = 1 + 0x1p-50;
  return farthest.stableNorm() * kRoundedUp + std::numeric_limits<double>::min();
}

// A rotation about the origin of the frame preserves the distance of each point from it. The
// origin, and each point of a hull that translates, moves linearly between its positions at both
// ends. box_at: returns the bounding box at a pose.
template <typename BoxAt>
MovingBox Moving(const Motion& X_WB, const BoxAt& box_at) {
  const auto& [start, end] = X_WB;
  const Box at_start = box_at(start);
  if (at_start.IsEmpty()) return {at_start, at_start};
  if (IsTranslation(X_WB)) return {at_start, box_at(end)};
  const double reach = Reach(at_start, start.t);
  if (!std::isfinite(reach)) return {Box::All(), Box::All()};
  return {GrownBy({start.t, start.t}, reach), GrownBy({end.t, end.t}, reach)};
}

// An interval of times.
struct TimeSpan {
  double begin = 0;
  double end = 1;

  bool IsEmpty() const { return begin > end; }
  // Drops times at which a gap that changes linearly, from `first` at time 0 to `last` at time 1,
  // is negative; returns false if it is negative at all times. Both are differences of two doubles,
  // rounded: their signs are exact. If the signs differ, they err by u of themselves, their
  // difference by 2 u, and the time at which the gap is 0 by 4 u + 8 u^2 of itself, and by
  // underflow of the quotient. That time is moved outwards by 8 u and the smallest normal double.
  // **Proven.** An overflow or NaN drops nothing.
  bool KeepNonNegative(double first, double last) {
    if (first < 0 && last < 0) return false;
    if (!(first < 0) && !(last < 0)) return true;
    constexpr double kMargin = 0x1p-50;
    const double change = std::abs(first - last);
    if (!(change < std::numeric_limits<double>::infinity())) return true;
    const double time = std::abs(first) / change;
    if (first < 0) {
      begin = std::max(begin, time * (1 - kMargin) - std::numeric_limits<double>::min());
    } else {
      end = std::min(end, time * (1 + kMargin) + std::numeric_limits<double>::min());
    }
    return true;
  }
};

}  // namespace

MovingBox MovingBoxOf(const MovingHull& moving) {
  return Moving(moving.X_WB, [&](const Pose& X_WB) {
    if (IsIdentity(moving.X_BH) && moving.piece_radius == 0) {
      return BoundingBox(PlacedHull(moving.hull, X_WB, moving.radius));
    }
    const PoseProduct X_WH(X_WB, moving.X_BH);
    return BoundingBox(PlacedHull(moving.hull, X_WH, moving.radius, moving.piece_radius));
  });
}

MovingBox MovingBoxOf(const MovingBody& moving) {
  return Moving(moving.X_WB, [&](const Pose& X_WB) {
    return BoundingBox(PlacedBody(moving.body, X_WB, moving.radius));
  });
}

// The boxes meet along an axis while neither gap between opposite bounds is negative. These are
// linear in time, so they meet at some time if and only if the intervals of all six gaps have a
// common point.
bool MayMeet(const MovingBox& a, const MovingBox& b, double until) {
  TimeSpan times{.end = until};
  for (int axis = 0; axis < 3; ++axis) {
    if (!times.KeepNonNegative(a.start.high[axis] - b.start.low[axis],
                               a.end.high[axis] - b.end.low[axis]) ||
        !times.KeepNonNegative(b.start.high[axis] - a.start.low[axis],
                               b.end.high[axis] - a.end.low[axis])) {
      return false;
    }
  }
  return !times.IsEmpty();
}

}  // namespace hulld
