#include "core/numeric/rational.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"

namespace hulld {
namespace {

// Bits of the quotients before they are rounded; 64 after a square root.
constexpr int kQuotientBits = 128;

// The exponent of the least double.
constexpr int kMinExponent = -1074;

int BitsOf(const Integer& value) {
  return value.is_zero() ? 0 : static_cast<int>(msb(Integer(abs(value)))) + 1;
}

// Returns value * 2^shift, rounded down. Requires: value >= 0.
Integer Shifted(const Integer& value, int shift) {
  HULLD_DCHECK(Sign(value) >= 0);
  return shift >= 0 ? Integer(value << shift) : Integer(value >> -shift);
}

// Rounds a number other than 0, given as mantissa * 2^exponent with relative error below 2^-60.
Rounded Round(double mantissa, int exponent) {
  const double value = std::ldexp(mantissa, exponent);
  if (std::isinf(value)) {
    return {std::copysign(kLargestDouble, mantissa), std::numeric_limits<double>::infinity()};
  }
  if (value == 0) return {std::copysign(kMinDouble, mantissa), kMinDouble};
  return {value, std::abs(value) * kRoundedRelativeError + kMinDouble};
}

// A square root as mantissa * 2^exponent, rounded down, with a relative error below 2^-63.
ScaledInteger SquareRoot(const Integer& numerator, const Integer& denominator, int exponent) {
  const int half = (kQuotientBits + BitsOf(denominator) - BitsOf(numerator)) / 2;
  const Integer quotient = half >= 0 ? Integer((numerator << 2 * half) / denominator)
                                     : Integer(numerator / (denominator << -2 * half));
  return {sqrt(quotient), exponent - half};
}

// Returns x in units of 2^exponent. Requires: exponent <= x.exponent.
Integer InUnits(const ScaledInteger& x, int exponent) {
  HULLD_DCHECK(exponent <= x.exponent);
  return x.mantissa << (x.exponent - exponent);
}

ScaledInteger Sum(const ScaledInteger& x, const ScaledInteger& y) {
  const int exponent = std::min(x.exponent, y.exponent);
  return {InUnits(x, exponent) + InUnits(y, exponent), exponent};
}

}  // namespace

ScaledDouble ToScaledDouble(const Integer& value) {
  const int shift = 62 - BitsOf(value);
  const auto magnitude = static_cast<int64_t>(Shifted(abs(value), shift));
  const double mantissa = static_cast<double>(magnitude);
  return {Sign(value) < 0 ? -mantissa : mantissa, -shift};
}

Rounded RoundRatio(const Integer& numerator, const Integer& denominator, int exponent) {
  HULLD_CHECK(Sign(denominator) > 0);
  if (numerator.is_zero()) return {0, 0};
  const int shift = kQuotientBits + BitsOf(denominator) - BitsOf(numerator);
  const Integer magnitude = abs(numerator);
  const Integer quotient = shift >= 0 ? Integer((magnitude << shift) / denominator)
                                      : Integer(magnitude / (denominator << -shift));
  const ScaledDouble scaled = ToScaledDouble(quotient);
  return Round(Sign(numerator) < 0 ? -scaled.mantissa : scaled.mantissa,
               scaled.exponent - shift + exponent);
}

Rounded RoundToNearest(const Integer& numerator, const Integer& denominator, int exponent) {
  HULLD_CHECK(Sign(denominator) > 0);
  if (numerator.is_zero()) return {0, 0};
  // The quotient has 62 or 63 bits: at least two more than a double, and its unit is at most a
  // quarter of the least double.
  constexpr int kMinUnit = kMinExponent - 2;
  const int unit = std::max(BitsOf(numerator) - BitsOf(denominator) + exponent - 62, kMinUnit);
  const int shift = exponent - unit;
  Integer quotient;
  Integer remainder;
  divide_qr(Integer(abs(numerator) << std::max(shift, 0)),
            Integer(denominator << std::max(-shift, 0)), quotient, remainder);
  // Sets the lowest bit if any bit below it is set (sticky bit).
  const uint64_t bits = static_cast<uint64_t>(quotient) | (remainder.is_zero() ? 0 : 1);
  const int dropped = std::max(static_cast<int>(std::bit_width(bits)) - 53, kMinExponent - unit);
  const uint64_t half = uint64_t{1} << (dropped - 1);
  const uint64_t rest = bits & (2 * half - 1);
  uint64_t kept = bits >> dropped;
  if (rest > half || (rest == half && kept % 2 == 1)) ++kept;
  const double sign = Sign(numerator) < 0 ? -1 : 1;
  const double value = std::ldexp(static_cast<double>(kept), unit + dropped);
  if (std::isinf(value)) return {sign * kLargestDouble, kInfinity};
  const double bound = std::max(std::ldexp(1.0, unit + dropped - 1), kMinDouble);
  return {value == 0 ? 0 : sign * value, rest == 0 ? 0 : bound};
}

Rounded RoundSquareRoot(const Integer& numerator, const Integer& denominator, int exponent) {
  HULLD_CHECK(Sign(numerator) >= 0 && Sign(denominator) > 0);
  if (numerator.is_zero()) return {0, 0};
  const ScaledInteger root = SquareRoot(numerator, denominator, exponent);
  const ScaledDouble scaled = ToScaledDouble(root.mantissa);
  return Round(scaled.mantissa, scaled.exponent + root.exponent);
}

ScaledInteger ExactSum(std::span<const double> terms) {
  ScaledInteger sum{0, kAboveAllExponents};
  for (const double term : terms) {
    if (term == 0) continue;
    const int exponent = LowestBitExponent(term);
    sum = Sum(sum, {ToInteger(term, exponent), exponent});
  }
  return sum;
}

int CompareSquareRoot(const Integer& numerator, const Integer& denominator, int exponent,
                      const ScaledInteger& threshold) {
  HULLD_CHECK(Sign(numerator) >= 0 && Sign(denominator) > 0 && Sign(threshold.mantissa) >= 0);
  // Compares numerator * 4^exponent with threshold^2 * denominator.
  const int shift = 2 * (exponent - threshold.exponent);
  Integer left = numerator;
  Integer right = threshold.mantissa * threshold.mantissa * denominator;
  (shift >= 0 ? left : right) <<= std::abs(shift);
  return left < right ? -1 : left > right ? 1 : 0;
}

// A difference d - t of positive numbers is (d^2 - t^2) / (d + t): the numerator is exact, and the
// sum of positive numbers is as accurate as its terms.
Rounded RoundRootMinus(int sign, const Integer& numerator, const Integer& denominator, int exponent,
                       const ScaledInteger& offset) {
  HULLD_CHECK(Sign(numerator) >= 0 && Sign(denominator) > 0 && Sign(offset.mantissa) >= 0);
  if (sign == 0 || numerator.is_zero()) return RoundRatio(-offset.mantissa, 1, offset.exponent);
  const ScaledInteger sum = Sum(SquareRoot(numerator, denominator, exponent), offset);
  if (sign < 0) return RoundRatio(-sum.mantissa, 1, sum.exponent);
  const ScaledInteger squares =
      Sum({numerator, 2 * exponent},
          {-offset.mantissa * offset.mantissa * denominator, 2 * offset.exponent});
  return RoundRatio(squares.mantissa, denominator * sum.mantissa, squares.exponent - sum.exponent);
}

}  // namespace hulld
