#include "core/numeric/rational.h"

#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

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
  EXPECT_EQ(RoundToNearest(5, 1, -1075).value, 2 * kMinDouble);
  EXPECT_EQ(RoundToNearest(7, 1, -1075).value, 4 * kMinDouble);
  EXPECT_EQ(RoundToNearest(7, 1, -1075).bound, kMinDouble);
}

TEST(RoundToNearest, TheEndsOfTheRangeSaturate) {
  EXPECT_EQ(RoundToNearest(1, 1, -1075).value, 0);
  EXPECT_EQ(RoundToNearest(-1, 1, -9000).value, 0);
  EXPECT_FALSE(std::signbit(RoundToNearest(-1, 1, -9000).value));
  EXPECT_EQ(RoundToNearest(-1, 1, -9000).bound, kMinDouble);
  EXPECT_EQ(RoundToNearest(1, 1, 1024).value, kLargestDouble);
  EXPECT_EQ(RoundToNearest(1, 1, 1024).bound, kInfinity);
  EXPECT_EQ(RoundToNearest(-5, 3, 9000).value, -kLargestDouble);
  // Half a unit above the largest double is a tie, which IEEE arithmetic rounds to infinity.
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

Rational ExactValue(const ScaledInteger& x) {
  return PowerOfTwo(x.exponent) * Rational(BigInteger(x.mantissa.str()));
}

TEST(ExactSum, IsExact) {
  const std::vector<double> terms = {0x1p1000, 1, -0x1p-1074, 0, 3 * 0x1p-60, -0x1p1000};
  Rational sum = 0;
  for (const double term : terms) sum += ExactValue(term);
  EXPECT_EQ(ExactValue(ExactSum(terms)), sum);
  EXPECT_EQ(ExactSum(std::vector<double>{0.0, -0.0}).mantissa, 0);
}

// sqrt(n^2 + 1) - n is 1 / (2 n) but for a relative 1 / (4 n^2), below the bound here.
TEST(RoundRootMinus, KeepsTheDigitsOfATinyDifference) {
  for (const int bits : {40, 200, 900}) {
    const Integer n = Integer(1) << bits;
    const Rounded over = RoundRootMinus(1, n * n + 1, 1, 0, {n, 0});
    EXPECT_NEAR(over.value * std::ldexp(1.0, bits), 0.5, 1e-15);
    EXPECT_LE(over.bound, over.value * 0x1p-50);
    const Rounded under = RoundRootMinus(1, n * n - 1, 1, 0, {n, 0});
    EXPECT_NEAR(under.value * std::ldexp(1.0, bits), -0.5, 1e-15);
  }
}

TEST(RoundRootMinus, SignsAndZerosAreExact) {
  EXPECT_EQ(RoundRootMinus(1, 25, 4, 1, {5, 0}).value, 0);
  EXPECT_EQ(RoundRootMinus(1, 25, 4, 1, {5, 0}).bound, 0);
  EXPECT_EQ(RoundRootMinus(1, 25, 1, 0, {1, 1}).value, 3);
  EXPECT_EQ(RoundRootMinus(-1, 25, 1, 0, {1, 1}).value, -7);
  EXPECT_EQ(RoundRootMinus(0, 0, 1, 0, {3, -1}).value, -1.5);
  EXPECT_EQ(RoundRootMinus(-1, 1, 1, 1023, {1, 1023}).bound, kInfinity);
  EXPECT_EQ(RoundRootMinus(1, 2, 1, -3000, {1, -3000}).value, kMinDouble);
}

TEST(RoundRootMinus, IsWithinItsBound) {
  std::mt19937_64 random(3103);
  for (int round = 0; round < 2000; ++round) {
    const auto numerator = static_cast<int64_t>(random() >> 20);
    const auto denominator = static_cast<int64_t>(random() >> 34) + 1;
    const auto offset = static_cast<int64_t>(random() >> (16 + round % 40));
    const int sign = round % 2 == 0 ? 1 : -1;
    const int exponent = round % 7 - 3;
    const Rounded got = RoundRootMinus(sign, numerator, denominator, exponent, {offset, -20});
    // value - bound + offset <= sign * root <= value + bound + offset.
    const Rational squared = PowerOfTwo(2 * exponent) * numerator / denominator;
    for (const int side : {-1, 1}) {
      const Rational end =
          ExactValue(got.value) + side * ExactValue(got.bound) + PowerOfTwo(-20) * offset;
      const Rational signed_square = end < 0 ? Rational(-end * end) : Rational(end * end);
      EXPECT_GE(side * (signed_square - sign * squared), 0) << round;
    }
  }
}

}  // namespace rational_test
}  // namespace hulld
