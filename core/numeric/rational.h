#ifndef HULLD_CORE_NUMERIC_RATIONAL_H_
#define HULLD_CORE_NUMERIC_RATIONAL_H_

#include <span>

#include "core/numeric/integer.h"

namespace hulld {

// mantissa * 2^exponent within a relative 2^-52; mantissa 0, or at least 2^61 and at most 2^62 in
// magnitude.
struct ScaledDouble {
  double mantissa;
  int exponent;
};
ScaledDouble ToScaledDouble(const Integer& value);

// A real number rounded to a double: |value - number| <= bound. The sign is that of the number: a
// tiny number becomes the least positive double or its negative. A huge one saturates, and the
// bound is infinite.
struct Rounded {
  double value;
  double bound;
};

// Returns numerator / denominator * 2^exponent. Requires: denominator > 0.
Rounded RoundRatio(const Integer& numerator, const Integer& denominator, int exponent);

// Returns the double nearest to numerator / denominator * 2^exponent, ties to even, and half its
// distance from the next double as the bound, or 0 if it is exact. Zero and tiny numbers differ
// from Rounded: a number nearer to 0 than to the least double is 0. Requires: denominator > 0.
Rounded RoundToNearest(const Integer& numerator, const Integer& denominator, int exponent);

// Returns sqrt(numerator / denominator) * 2^exponent. Requires: numerator >= 0, denominator > 0.
Rounded RoundSquareRoot(const Integer& numerator, const Integer& denominator, int exponent);

// mantissa * 2^exponent.
struct ScaledInteger {
  Integer mantissa;
  int exponent = 0;
};

// Returns the exact sum of doubles. Requires: finite terms.
ScaledInteger ExactSum(std::span<const double> terms);

// Returns the sign of sqrt(numerator / denominator) * 2^exponent - threshold, exactly. Requires:
// numerator >= 0, denominator > 0, threshold >= 0.
int CompareSquareRoot(const Integer& numerator, const Integer& denominator, int exponent,
                      const ScaledInteger& threshold);

// Returns sign * sqrt(numerator / denominator) * 2^exponent - offset, without loss by cancellation.
// Requires: numerator >= 0, denominator > 0, offset >= 0.
Rounded RoundRootMinus(int sign, const Integer& numerator, const Integer& denominator, int exponent,
                       const ScaledInteger& offset);

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_RATIONAL_H_
