#include "core/query/motion/nearest_direction.h"

#include "core/numeric/integer.h"
#include "core/query/exact/exact_nearest.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/floating/float_distance.h"
#include "core/query/terms/separation_bounds.h"

namespace hulld {
namespace {

// The relative width of the bounds of the distance at which the walk ends. A choice: a direction
// that is off by an angle e loses e^2 / 2 of the gap.
constexpr double kRelativeWidth = 0x1p-10;

// Returns n over its length; zero if n is zero.
Vector Unit(const Vector& n) {
  const double largest = n.cwiseAbs().maxCoeff();
  return largest > 0 ? Vector((n / largest).normalized()) : Vector(Vector::Zero());
}

Vector ToOrigin(const FloatPair& pair, const FloatCombination& point) {
  Vector to_origin = Vector::Zero();
  for (uint32_t i = 0; i < point.count; ++i) {
    to_origin -= Vector(point.weights[i] * pair.Difference(point.pairs[i]));
  }
  return to_origin;
}

}  // namespace

absl::StatusOr<Vector> NearestDirection(const FloatPair& pair, const Vector& first,
                                        const std::function<bool()>& should_stop) {
  if (pair.usable()) {
    SeparationGoal goal;
    goal.relative_error = kRelativeWidth;
    return Unit(ToOrigin(pair, BoundDistance(pair, first, goal).point));
  }
  ExactPair exact(pair, should_stop);
  absl::StatusOr<ExactNearest> nearest = FindNearestExactly(exact, {}, should_stop);
  if (!nearest.ok()) return nearest.status();
  IntegerVector point = {0, 0, 0};
  for (size_t i = 0; i < nearest->point.pairs.size(); ++i) {
    point = point + nearest->point.weights[i] * exact.Difference(nearest->point.pairs[i]);
  }
  return IsZero(point) ? Vector(Vector::Zero()) : Unit(ToScaledDoubles(-point));
}

}  // namespace hulld
