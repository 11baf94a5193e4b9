#include "core/query/motion/nearest_direction.h"

#include <algorithm>
#include <cstdint>
#include <span>

#include "core/query/exact/exact_nearest.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/floating/float_distance.h"

namespace hulld {
namespace {

// Relative width of the distance bounds at which the walk ends: the maximum share of the gap that
// the direction may lose. Not tuned.
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
  return ExactNearestUnit(pair, nearest, should_stop);
}

absl::StatusOr<Vector> ExactNearestUnit(const FloatPair& pair, FloatCombination& nearest,
                                        const std::function<bool()>& should_stop) {
  const absl::StatusOr<IntegerVector> n = ExactNearestDirection(pair, nearest, should_stop);
  if (!n.ok()) return n.status();
  if (IsZero(*n)) return Vector(Vector::Zero());
  return Vector((ToScaledDoubles(*n) / kScaledDoublesMax).normalized());
}

absl::StatusOr<IntegerVector> ExactNearestDirection(const FloatPair& pair,
                                                    FloatCombination& nearest,
                                                    const std::function<bool()>& should_stop) {
  ExactPair exact(pair, should_stop);
  const absl::StatusOr<ExactNearest> found =
      FindNearestExactly(exact, std::span(nearest.pairs).first(nearest.count), should_stop);
  if (!found.ok()) return found.status();
  const IntegerVector n = -PointOf(exact, found->point);
  // If the pair meets, the point may need a fourth pair of vertices.
  nearest.count = static_cast<uint32_t>(std::min(found->point.pairs.size(), nearest.pairs.size()));
  std::copy_n(found->point.pairs.begin(), nearest.count, nearest.pairs.begin());
  return n;
}

}  // namespace hulld
