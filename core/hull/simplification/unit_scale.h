#ifndef HULLD_CORE_HULL_SIMPLIFICATION_UNIT_SCALE_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_UNIT_SCALE_H_

#include <cmath>
#include <span>
#include <vector>

#include "core/base/check.h"
#include "core/numeric/vector.h"

namespace hulld {

// Converts lengths and points to units of a power of two above the largest coordinate, so that no
// difference or product of two of them overflows, and no significant product underflows.
class UnitScale {
 public:
  // Requires: a finite length >= 0. Coordinates of at most that map to at most 1.
  explicit UnitScale(double largest) {
    HULLD_CHECK(std::isfinite(largest) && largest >= 0);
    std::frexp(largest, &exponent_);
  }

  // Exact except for components that become subnormal, which err by at most 2^-1075 each (see
  // kMinPositive).
  Vector ToUnit(const Vector& p) const { return Times(p, -exponent_); }
  std::vector<Vector> ToUnit(std::span<const Vector> points) const {
    std::vector<Vector> scaled;
    scaled.reserve(points.size());
    for (const Vector& p : points) scaled.push_back(ToUnit(p));
    return scaled;
  }
  // Rounded; infinite beyond the largest double.
  Vector FromUnit(const Vector& p) const { return Times(p, exponent_); }
  // Rounded up; infinite beyond the largest double.
  double LengthFromUnit(double length) const {
    const double scaled = std::ldexp(length, exponent_);
    // Only a subnormal result is rounded.
    return std::ldexp(scaled, -exponent_) < length ? std::nextafter(scaled, INFINITY) : scaled;
  }
  // Rounded down.
  double LengthToUnit(double length) const {
    const double scaled = std::ldexp(length, -exponent_);
    return LengthFromUnit(scaled) > length ? std::nextafter(scaled, 0.0) : scaled;
  }

 private:
  static Vector Times(const Vector& p, int exponent) {
    return p.unaryExpr([exponent](double x) { return std::ldexp(x, exponent); });
  }

  int exponent_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_UNIT_SCALE_H_
