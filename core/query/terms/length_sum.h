#ifndef HULLD_CORE_QUERY_TERMS_LENGTH_SUM_H_
#define HULLD_CORE_QUERY_TERMS_LENGTH_SUM_H_

#include <array>
#include <cmath>
#include <cstddef>

#include "core/numeric/error_bounds.h"
#include "core/numeric/rational.h"
#include "core/numeric/vector.h"

namespace hulld {

// The exact sum of a few lengths, such as the radii of a pair and a clearance, with bounds in
// floating point.
class LengthSum {
 public:
  // Requires: finite terms.
  explicit LengthSum(const std::array<double, 5>& terms) : terms_(terms) {
    double absolute = 0;
    int count = 0;
    for (const double term : terms_) {
      value_ += term;
      absolute += std::abs(term);
      count += term == 0 ? 0 : 1;
    }
    // A single term is exact. Otherwise each of four additions errs by u of the sum of the absolute
    // terms, and that sum by 4 u of itself: below 8 u in total. Sums never err by underflow.
    // Proven.
    error_ = count <= 1 ? 0 : std::nextafter(8 * kUnitRoundoff * absolute, kInfinity);
    if (!std::isfinite(absolute)) error_ = kInfinity;
  }

  bool is_zero() const { return value_ == 0 && error_ == 0; }
  // Within error() of the sum; the error is infinite if the sum of the absolute terms overflows.
  double value() const { return value_; }
  double error() const { return error_; }
  // Bounds of the sum.
  double low() const {
    return error_ == 0          ? value_
           : error_ < kInfinity ? std::nextafter(value_ - error_, -kInfinity)
                                : -kInfinity;
  }
  double high() const {
    return error_ == 0          ? value_
           : error_ < kInfinity ? std::nextafter(value_ + error_, kInfinity)
                                : kInfinity;
  }
  int Sign() const { return low() > 0 ? 1 : high() < 0 ? -1 : hulld::Sign(Exact().mantissa); }
  ScaledInteger Exact() const { return ExactSum(terms_); }

 private:
  std::array<double, 5> terms_;
  double value_ = 0;
  double error_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_LENGTH_SUM_H_
