#include "core/numeric/integer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace hulld {
namespace integer_test {

TEST(Integer, LowestBitExponentReachesBothEndsOfTheDoubles) {
  EXPECT_EQ(LowestBitExponent(1.0), 0);
  EXPECT_EQ(LowestBitExponent(-6.0), 1);
  EXPECT_EQ(LowestBitExponent(0.75), -2);
  EXPECT_EQ(LowestBitExponent(std::numeric_limits<double>::denorm_min()), -1074);
  EXPECT_EQ(LowestBitExponent(std::numeric_limits<double>::max()), 971);
}

TEST(Integer, ConversionIsExact) {
  EXPECT_EQ(ToInteger(-6.5, -3), Integer(-52));
  EXPECT_EQ(ToInteger(0.0, -1074), Integer(0));
  EXPECT_EQ(ToInteger(std::numeric_limits<double>::denorm_min(), -1074), Integer(1));
  EXPECT_EQ(ToInteger(0x1p1023, -1074), Integer(1) << 2097);
  EXPECT_EQ(ToInteger(-0x1.8p10, 9), Integer(-3));
}

TEST(Integer, ScaledDoublesStayWithinTheirBound) {
  const IntegerVector v = {(Integer(1) << 900) + 12345, -(Integer(7) << 880), Integer(3)};
  const Vector scaled = ToScaledDoubles(v);
  EXPECT_EQ(scaled.x(), 0x1p62);
  EXPECT_EQ(scaled.y(), -std::ldexp(7.0, 880 - 838));
  EXPECT_EQ(scaled.z(), 0);
  EXPECT_EQ(ToScaledDoubles({0, 0, -1}), Vector(0, 0, -0x1p62));
}

TEST(IntegerDeathTest, RefusesUndefinedOperations) {
  EXPECT_DEATH(LowestBitExponent(0.0), "check failed: x != 0");
  EXPECT_DEATH(ToInteger(0.75, 0), "check failed: shift > -53");
  EXPECT_DEATH(ToInteger(std::numeric_limits<double>::infinity(), 0),
               "check failed: std::isfinite");
  EXPECT_DEATH(ToScaledDoubles({0, 0, 0}), "check failed: bits > 0");
  EXPECT_DEATH(AnyPerpendicular({0, 0, 0}), "check failed: !IsZero");
}

TEST(Integer, PerpendicularIsNonzeroAndPerpendicular) {
  for (const IntegerVector& d : {IntegerVector{5, 0, 0}, {0, -2, 0}, {0, 0, 1}, {1, 2, 3}}) {
    EXPECT_FALSE(IsZero(AnyPerpendicular(d)));
    EXPECT_EQ(Dot(d, AnyPerpendicular(d)), 0);
  }
}

}  // namespace integer_test
}  // namespace hulld
