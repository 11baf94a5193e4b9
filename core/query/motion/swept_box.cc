#include "core/query/motion/swept_box.h"

#include <cmath>
#include <limits>

#include "core/query/body/placed_body.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/terms/motion.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/pose_product.h"

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

// A rotation about the frame's origin keeps the distance of each point from it. box_at: returns the
// bounding box at a pose.
template <typename BoxAt>
Box Swept(const Motion& X_WB, const BoxAt& box_at) {
  const auto& [start, end] = X_WB;
  const Box at_start = box_at(start);
  if (at_start.IsEmpty()) return at_start;
  if (IsTranslation(X_WB)) return Union(at_start, box_at(end));
  const double reach = Reach(at_start, start.t);
  if (!std::isfinite(reach)) return Box::All();
  return GrownBy(Union({start.t, start.t}, {end.t, end.t}), reach);
}

}  // namespace

Box SweptBox(const MovingHull& moving) {
  return Swept(moving.X_WB, [&](const Pose& X_WB) {
    const PoseProduct X_WH(X_WB, moving.X_BH);
    return BoundingBox(PlacedHull(moving.hull, X_WH, moving.radius, moving.piece_radius));
  });
}

Box SweptBox(const MovingBody& moving) {
  return Swept(moving.X_WB, [&](const Pose& X_WB) {
    return BoundingBox(PlacedBody(moving.body, X_WB, moving.radius));
  });
}

}  // namespace hulld
