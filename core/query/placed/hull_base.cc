#include "core/query/placed/hull_base.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/integer.h"
#include "core/numeric/orientation.h"

namespace hulld {

double RadiusTo(const Vector& difference) {
  constexpr double kRootOfThree = 1.7320508075688774;
  const double square = difference.squaredNorm();
  if (square > kRadiusSquareMin && square < kLargestDouble) {
    return std::sqrt(square) * kRadiusRoundUp + kMinPositive;
  }
  return kRootOfThree * difference.cwiseAbs().maxCoeff() * kRadiusRoundUp + kMinPositive;
}

HullBase::HullBase(const Hull& hull, const std::function<bool()>& should_stop)
    : points_(hull.vertices()), prepared_(true) {
  HULLD_CHECK(!hull.empty());
  Measure();
  HULLD_DCHECK(center_ == hull.center() && max_abs_ == hull.max_abs_coordinate());
  Span(hull.dimension());
  support_ = SupportMap(points_, should_stop);
  if (support_.stopped()) return;
  center_bounds_ = CenterBounds(hull, support_);
}

HullBase::HullBase(MappedPoints mapped, int dimension)
    : own_(std::move(mapped.points)),
      points_(own_),
      prepared_(true),
      support_(std::move(mapped.support)) {
  HULLD_CHECK(!own_.empty());
  Measure();
  Span(dimension);
  center_bounds_ = CenterBounds(points_, dimension, center_, max_abs_, support_,
                                CenterBounds::Making::kAtSecondUse);
}

HullBase::HullBase(std::vector<Vector> points, int dimension)
    : own_(std::move(points)),
      points_(own_),
      prepared_(false),
      support_(SupportMap::ForScanning(points_)) {
  HULLD_CHECK(!own_.empty());
  Measure();
  Span(dimension);
}

// Computes the axis extremes, the center, and sizes.
void HullBase::Measure() {
  std::array<uint32_t, 6> extremes = {};
  exponent_ = kAboveAllExponents;
  for (uint32_t i = 0; i < points_.size(); ++i) {
    const Vector& p = points_[i];
    for (int axis = 0; axis < 3; ++axis) {
      if (p[axis] < points_[extremes[axis]][axis]) extremes[axis] = i;
      // Takes the last of several equal points, so that the center of a box is its middle.
      if (p[axis] >= points_[extremes[axis + 3]][axis]) extremes[axis + 3] = i;
    }
    exponent_ = LowestBitExponent(p, exponent_);
  }
  for (int axis = 0; axis < 3; ++axis) {
    // Same as in Hull. Divides each point first, so that no sum overflows.
    center_ += points_[extremes[axis]] / 6 + points_[extremes[axis + 3]] / 6;
  }
  for (const uint32_t i : extremes) {
    inner_[inner_count_++] = i;
    max_abs_ = std::max(max_abs_, points_[i].cwiseAbs().maxCoeff());
  }
  for (const Vector& p : points_) radius_ = std::max(radius_, RadiusTo(p - center_));
}

// Adds the point with the largest size, in floating point, among the points that is_off shows to be
// outside the present span. The first of equal points wins.
template <typename Size, typename IsOff>
void HullBase::SpanWith(Size size, IsOff is_off) {
  uint32_t farthest = 0;
  double largest = -1;
  for (uint32_t i = 0; i < points_.size(); ++i) {
    const double value = size(points_[i]);
    if (!(value > largest)) continue;
    largest = value;
    farthest = i;
  }
  if (!is_off(points_[farthest])) {
    // The sizes overflowed or underflowed, or rounding hid them.
    farthest = 0;
    while (farthest < points_.size() && !is_off(points_[farthest])) ++farthest;
    HULLD_CHECK(farthest < points_.size());
  }
  spanning_[spanning_count_++] = farthest;
}

void HullBase::Span(int dimension) {
  HULLD_CHECK(dimension >= 0 && dimension <= 3);
  const auto p = [this](int i) -> const Vector& { return points_[spanning_[i]]; };
  spanning_[spanning_count_++] = inner_[0];
  if (dimension >= 1) {
    SpanWith([&](const Vector& x) { return (x - p(0)).cwiseAbs().maxCoeff(); },
             [&](const Vector& x) { return x != p(0); });
  }
  if (dimension >= 2) {
    const Vector u = p(1) - p(0);
    SpanWith([&](const Vector& x) { return u.cross(x - p(0)).cwiseAbs().maxCoeff(); },
             [&](const Vector& x) { return ProjectionOf(p(0), p(1), x).first >= 0; });
  }
  if (dimension == 3) {
    const Vector n = (p(1) - p(0)).cross(p(2) - p(0));
    SpanWith([&](const Vector& x) { return std::abs(n.dot(x - p(0))); },
             [&](const Vector& x) { return Orient3d(p(0), p(1), p(2), x) != 0; });
  }
  for (const uint32_t i : spanning()) inner_[inner_count_++] = i;
}

}  // namespace hulld
