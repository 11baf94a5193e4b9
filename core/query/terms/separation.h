#ifndef HULLD_CORE_QUERY_TERMS_SEPARATION_H_
#define HULLD_CORE_QUERY_TERMS_SEPARATION_H_

#include <cmath>
#include <limits>

#include "core/base/check.h"
#include "core/numeric/vector.h"

namespace hulld {

// The signed separation: the distance if positive; minus the penetration depth, the distance from 0
// to the boundary of A - B, if negative; exactly 0 if touching. |value - true value| <= bound, and
// the sign agrees with the relation. If a double cannot represent the value, it saturates and the
// bound is infinite.
struct Separation {
  double value = 0;
  double bound = 0;
};

// An optional separation without memory for a flag: NaN means none.
class OptionalSeparation {
 public:
  OptionalSeparation() = default;
  OptionalSeparation(const Separation& separation) : separation_(separation) {}  // NOLINT

  bool has_value() const { return !std::isnan(separation_.value); }
  explicit operator bool() const { return has_value(); }

  // Requires: has_value().
  const Separation& operator*() const {
    HULLD_DCHECK(has_value());
    return separation_;
  }
  Separation& operator*() {
    HULLD_DCHECK(has_value());
    return separation_;
  }
  const Separation* operator->() const { return &**this; }
  Separation* operator->() { return &**this; }

 private:
  Separation separation_{std::numeric_limits<double>::quiet_NaN(), 0};
};

// Points of A and B (world frame) that attain the separation. Separated: the nearest points.
// Touching: a common point. Overlapping: points that coincide after the shortest translation that
// ends the overlap. `error` bounds the distance of each point from its hull, and from a point that
// attains the separation. If several pairs attain it, this is one of them.
struct Witness {
  Vector p_WA;
  Vector p_WB;
  double error = 0;
};

// The direction (world frame, from A toward B, unit length up to rounding) in which the separation
// is attained. Separated: from the nearest point of A to the nearest point of B, which is unique.
// Overlapping: the direction of the shortest translation of B that ends the overlap. Touching:
// normal to a plane with A on one side and B on the other. If several directions attain it, this is
// one of them. `angle_bound`: upper bound on the angle to the exact direction, in radians.
struct Normal {
  Vector direction;
  double angle_bound = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_SEPARATION_H_
