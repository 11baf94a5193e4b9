#include "core/numeric/rational.h"

#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "core/numeric/exponent_limits.h"
#include "core/numeric/vector.h"

namespace hulld {
namespace rational_test {

using Rational = boost::multiprecision::cpp_rational;
using BigInteger = boost::multiprecision::cpp_int;

Rational PowerOfTwo(int exponent) {
  const BigInteger power = BigInteger(1) << std::abs(exponent);
  return exponent >= 0 ? Rational(power) : Rational(1, power);
}

Rational ExactValue(double value) {
  int exponent = 0;
  const double mantissa = std::frexp(value, &exponent);
  return Rational(static_cast<int64_t>(std::ldexp(mantissa, 53))) * PowerOfTwo(exponent - 53);
}

struct Fraction {
  int64_t numerator;
  int64_t denominator;
  int exponent;

  Rounded ToNearest() const { return RoundToNearest(numerator, denominator, exponent); }
  // Rational(numerator, denominator) causes false warnings of GCC 12.
  Rational Value() const { return PowerOfTwo(exponent) * numerator / denominator; }
};

TEST(RoundToNearest, ExactNumbersHaveBoundZero) {
  for (const Fraction& f :
       {Fraction{0, 7, 0}, {6, 3, 0}, {-3, 4, 5}, {1, 1, -1074}, {3, 3, 1023}}) {
    const Rounded rounded = f.ToNearest();
    EXPECT_EQ(ExactValue(rounded.value), f.Value());
    EXPECT_EQ(rounded.bound, 0);
  }
}

TEST(RoundToNearest, TiesGoToTheEvenNeighbor) {
  const int64_t odd = (int64_t{1} << 53) + 1;
  EXPECT_EQ(RoundToNearest(odd, 1, 0).value, 0x1p53);
  EXPECT_EQ(RoundToNearest(odd, 1, 0).bound, 1);
  EXPECT_EQ(RoundToNearest(-odd - 2, 1, 0).value, -(0x1p53 + 4));
  // Subnormal numbers: 2.5 and 3.5 times the least double.
  EXPECT_EQ(RoundToNearest(5, 1, -1075).value, 2 * kLeastDouble);
  EXPECT_EQ(RoundToNearest(7, 1, -1075).value, 4 * kLeastDouble);
  EXPECT_EQ(RoundToNearest(7, 1, -1075).bound, kLeastDouble);
}

TEST(RoundToNearest, TheEndsOfTheRangeSaturate) {
  EXPECT_EQ(RoundToNearest(1, 1, -1075).value, 0);
  EXPECT_EQ(RoundToNearest(-1, 1, -9000).value, 0);
  EXPECT_FALSE(std::signbit(RoundToNearest(-1, 1, -9000).value));
  EXPECT_EQ(RoundToNearest(-1, 1, -9000).bound, kLeastDouble);
  EXPECT_EQ(RoundToNearest(1, 1, 1024).value, kLargestDouble);
  EXPECT_EQ(RoundToNearest(1, 1, 1024).bound, kInfinity);
  EXPECT_EQ(RoundToNearest(-5, 3, 9000).value, -kLargestDouble);
  // Half a unit above the largest double is a tie, and goes to infinity in IEEE arithmetic.
  const Integer largest = (Integer(1) << 53) - 1;
  EXPECT_EQ(RoundToNearest(largest, 1, 971).bound, 0);
  EXPECT_EQ(RoundToNearest(4 * largest + 1, 4, 971).value, kLargestDouble);
  EXPECT_LT(RoundToNearest(4 * largest + 1, 4, 971).bound, kInfinity);
  EXPECT_EQ(RoundToNearest(2 * largest + 1, 2, 971).bound, kInfinity);
}

TEST(RoundToNearest, NoDoubleIsNearer) {
  std::mt19937_64 engine(41);
  for (int round = 0; round < 4000; ++round) {
    Fraction f{static_cast<int64_t>(engine()) >> engine() % 60,
               (static_cast<int64_t>(engine() >> 1) >> engine() % 60) | 1,
               static_cast<int>(engine() % 60)};
    f.exponent -= round % 2 == 0 ? 1100 : 30;
    const Rounded rounded = f.ToNearest();
    const Rational error = abs(Rational(ExactValue(rounded.value) - f.Value()));
    EXPECT_LE(error, ExactValue(rounded.bound));
    EXPECT_EQ(error == 0, rounded.bound == 0);
    for (const double toward : {-kInfinity, kInfinity}) {
      const double neighbor = std::nextafter(rounded.value, toward);
      EXPECT_LE(error, abs(Rational(ExactValue(neighbor) - f.Value()))) << "round " << round;
    }
  }
}

}  // namespace rational_test
}  // namespace hulld
