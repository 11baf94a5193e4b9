#include "core/query/motion/nearest_direction.h"

#include <span>

#include "core/query/exact/exact_nearest.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/floating/float_distance.h"

namespace hulld {
namespace {

// Relative width of the distance bounds at which the walk ends: the maximum share of the gap that
// the direction may lose. A choice.
constexpr double kRelativeWidth = 0x1p-10;

}  // namespace

absl::StatusOr<Vector> NearestDirection(const FloatPair& pair, const Vector& first,
                                        FloatCombination& nearest,
                                        const std::function<bool()>& should_stop) {
  if (pair.usable()) {
    SeparationGoal goal;
    // With radii, the gap may be an arbitrarily small share of the distance.
    const bool rounded = pair.a().is_rounded() || pair.b().is_rounded();
    goal.relative_error = rounded ? 0 : kRelativeWidth;
    const SeparationBounds bounds =
        BoundDistance(pair, first, std::span(nearest.pairs).first(nearest.count), goal);
    nearest = bounds.point;
    return bounds.direction;
  }
  return ExactNearestUnit(pair, should_stop);
}

absl::StatusOr<Vector> ExactNearestUnit(const FloatPair& pair,
                                        const std::function<bool()>& should_stop) {
  const absl::StatusOr<IntegerVector> n = ExactNearestDirection(pair, should_stop);
  if (!n.ok()) return n.status();
  if (IsZero(*n)) return Vector(Vector::Zero());
  return Vector((ToScaledDoubles(*n) / kScaledDoublesMax).normalized());
}

absl::StatusOr<IntegerVector> ExactNearestDirection(const FloatPair& pair,
                                                    const std::function<bool()>& should_stop) {
  ExactPair exact(pair, should_stop);
  absl::StatusOr<ExactNearest> nearest = FindNearestExactly(exact, {}, should_stop);
  if (!nearest.ok()) return nearest.status();
  IntegerVector n = {0, 0, 0};
  for (size_t i = 0; i < nearest->point.pairs.size(); ++i) {
    n = n - nearest->point.weights[i] * exact.Difference(nearest->point.pairs[i]);
  }
  return n;
}

}  // namespace hulld
