#include "client/formats/length_scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "client/formats/text_number.h"
#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace length_scale_test {

using Integer = boost::multiprecision::cpp_int;
using Rational = boost::multiprecision::cpp_rational;
using testing::ElementsAre;
using testing::HasSubstr;

// Units in meters, and factors with many digits.
struct Unit {
  const char* text;
  Rational length;
};
const Unit kUnits[] = {
    {"0.001", Rational(1, 1000)},
    {"0.01", Rational(1, 100)},
    {"0.0254", Rational(127, 5000)},
    {"0.3048", Rational(381, 1250)},
    {"-12.5", Rational(-25, 2)},
    {"1e3", Rational(1000)},
    {"3e-30", Rational(3) / Rational(boost::multiprecision::pow(Integer(10), 30))},
    {"0.123456789012345678", Rational(123456789012345678, 1000000000000000000)}};

Rational Exact(double x) {
  int exponent = 0;
  const double mantissa = std::frexp(x, &exponent);
  Rational exact(static_cast<int64_t>(std::ldexp(mantissa, 53)));
  const Integer power = Integer(1) << std::abs(exponent - 53);
  if (exponent >= 53) return exact * power;
  return exact / power;
}

// True if no other double is nearer; of two at equal distance, `x` must be the even one.
bool IsNearest(double x, const Rational& exact) {
  const Rational error = abs(Exact(x) - exact);
  for (const double end : {-HUGE_VAL, HUGE_VAL}) {
    const Rational other = abs(Exact(std::nextafter(x, end)) - exact);
    if (other < error) return false;
    if (other == error && std::bit_cast<uint64_t>(x) % 2 != 0) return false;
  }
  return true;
}

LengthScale Scale(const std::string& text) { return LengthScale::FromText(text).value(); }

TEST(LengthScale, ThreeInchesAreTheDoubleNearestTo0Point0762) {
  EXPECT_EQ(Scale("0.0254").Apply(3), 0.0762);
  EXPECT_EQ(Scale("0.3048").Apply(11), 3.3528);
  EXPECT_EQ(Scale("0.001").Apply(7), 0.007);
  EXPECT_EQ(Scale("2").Apply(-0.0), 0);
  EXPECT_TRUE(std::signbit(Scale("2").Apply(-0.0)));
}

TEST(LengthScale, DoublesAreRoundedOnce) {
  std::mt19937_64 random(5);
  int differs = 0;
  for (const Unit& unit : kUnits) {
    const LengthScale scale = Scale(unit.text);
    double rounded_unit = 0;
    ASSERT_EQ(ParseDouble(unit.text, &rounded_unit), NumberText::kNumber);
    for (int i = 0; i < 4000; ++i) {
      // Few bits, as in files, or all of them.
      const int bits = i % 4 == 0 ? 53 : static_cast<int>(1 + random() % 53);
      const double mantissa = static_cast<double>(random() >> (64 - bits));
      const int exponent = i % 2 == 0 ? static_cast<int>(random() % 20) - 10 - bits
                                      : static_cast<int>(random() % 1800) - 950;
      const double x = std::ldexp(i % 3 == 0 ? -mantissa : mantissa, exponent);
      const double scaled = scale.Apply(x);
      ASSERT_TRUE(IsNearest(scaled, Exact(x) * unit.length)) << unit.text << " * " << x;
      differs += scaled != x * rounded_unit ? 1 : 0;
    }
  }
  // The product of doubles differs often enough for this test to detect it.
  EXPECT_GT(differs, 1000);
}

// Ties, which the fast path leaves to the exact one: odd integers of 54 bits times 1/2.
TEST(LengthScale, TiesGoToTheEvenDouble) {
  std::mt19937_64 random(6);
  for (int i = 0; i < 1000; ++i) {
    const double x = static_cast<double>((uint64_t{1} << 52 | random() >> 12) | 1);
    // 1.5 x and 2.5 x lie halfway between doubles for many x.
    for (const char* factor : {"1.5", "2.5", "0.75"}) {
      double value = 0;
      ASSERT_EQ(ParseDouble(factor, &value), NumberText::kNumber);
      EXPECT_EQ(Scale(factor).Apply(x), x * value);
    }
  }
}

TEST(LengthScale, TextIsRoundedOnce) {
  std::mt19937_64 random(7);
  int differs = 0;
  for (const Unit& unit : kUnits) {
    const LengthScale scale = Scale(unit.text);
    for (int i = 0; i < 2000; ++i) {
      const auto digits = static_cast<int64_t>(random() >> (1 + random() % 60));
      const int places = static_cast<int>(random() % 25);
      std::string text(1, i % 2 == 0 ? '-' : '+');
      text += std::to_string(digits) + "e-" + std::to_string(places);
      Rational exact = Rational(digits) / Rational(boost::multiprecision::pow(Integer(10), places));
      if (i % 2 == 0) exact = -exact;
      double value = 0;
      ASSERT_EQ(scale.Parse(text, &value), NumberText::kNumber);
      ASSERT_TRUE(IsNearest(value, exact * unit.length)) << text << " * " << unit.text;
      double read = 0;
      ASSERT_EQ(ParseDouble(text, &read), NumberText::kNumber);
      differs += value != scale.Apply(read) ? 1 : 0;
    }
  }
  EXPECT_GT(differs, 1000);
}

TEST(LengthScale, TextOfAnyFormIsScaled) {
  double value = 0;
  const LengthScale inch = Scale("0.0254");
  for (const char* text : {"0.1", ".1", "+1e-1", "00.100", "1.E-1", "10000e-5"}) {
    EXPECT_EQ(inch.Parse(text, &value), NumberText::kNumber) << text;
    EXPECT_EQ(value, 0.00254) << text;
  }
  EXPECT_EQ(inch.Parse("-0", &value), NumberText::kNumber);
  EXPECT_TRUE(value == 0 && std::signbit(value));
  EXPECT_EQ(inch.Parse("nan", &value), NumberText::kNumber);
  EXPECT_TRUE(std::isnan(value));
  EXPECT_EQ(inch.Parse("x", &value), NumberText::kNoNumber);
  // Out of range only before, or only after scaling.
  EXPECT_EQ(inch.Parse("1e309", &value), NumberText::kNumber);
  EXPECT_EQ(value, 2.54e307);
  EXPECT_EQ(Scale("1e9").Parse("1e300", &value), NumberText::kTooLarge);
  EXPECT_EQ(Scale("1e9").Parse("1e-330", &value), NumberText::kNumber);
  EXPECT_EQ(value, 1e-321);
  EXPECT_EQ(inch.Parse("1e99999999999999999999", &value), NumberText::kTooLarge);
  EXPECT_EQ(inch.Parse("1e-99999999999999999999", &value), NumberText::kNumber);
  EXPECT_EQ(value, 0);
}

TEST(LengthScale, RangeOfDoubles) {
  EXPECT_EQ(Scale("10").Apply(1e308), HUGE_VAL);
  EXPECT_EQ(Scale("-10").Apply(1e308), -HUGE_VAL);
  EXPECT_EQ(Scale("0.1").Apply(0x1p-1074), 0);
  EXPECT_EQ(Scale("0.5").Apply(0x1p-1073), 0x1p-1074);
  EXPECT_EQ(Scale("0.001").Apply(std::numeric_limits<double>::max()), 1.7976931348623157e305);
}

TEST(LengthScale, FactorsAreFiniteNumbersOtherThanZero) {
  for (const char* text : {"", "x", "0", "0.0e5", "-0", "nan", "inf", "1e400", "1e-400", "1,5"}) {
    EXPECT_FALSE(LengthScale::FromText(text).has_value()) << text;
  }
  EXPECT_TRUE(Scale("1.000").is_one());
  EXPECT_FALSE(Scale("-1").is_one());
  // 0.001 with more digits than a double distinguishes is 0.001.
  EXPECT_EQ(Scale("0.00100000000000000002").Apply(7), 0.007);
}

TEST(ScaledPoints, TextAndFloatsAreScaledByAxis) {
  ReadOptions options;
  options.scale = {Scale("0.0254"), Scale("-2"), Scale("0.001")};
  EXPECT_THAT(ReadText("0.1 1 7\n", PointFormat::kXyz, options).xyz(),
              ElementsAre(0.00254, -2, 0.007));
  EXPECT_THAT(ReadText("x,y,z\n0.1,1,7\n", PointFormat::kCsv, options).xyz(),
              ElementsAre(0.00254, -2, 0.007));
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n0.1 1 7\n";
  EXPECT_THAT(ReadText(ply, PointFormat::kPly, options).xyz(), ElementsAre(0.00254, -2, 0.007));
  const std::string pcd = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA ";
  EXPECT_THAT(ReadText(pcd + "ascii\n0.1 1 7\n", PointFormat::kPcd, options).xyz(),
              ElementsAre(0.00254, -2, 0.007));
  const float floats[] = {3, 1, 7};
  const PointsRead binary =
      ReadText(pcd + "binary\n" + std::string(reinterpret_cast<const char*>(floats), 12),
               PointFormat::kPcd, options);
  EXPECT_THAT(binary.xyz(), ElementsAre(0.0762, -2, 0.007));
  EXPECT_FALSE(binary.all_float());
  options.scale[1] = Scale("1e300");
  EXPECT_THAT(ReadText("0 1e9 0\n", PointFormat::kXyz, options).error(),
              HasSubstr("exceeds the largest double"));
}

// A URDF or COLLADA file may contain such scales, which formerly caused infinite recursion.
TEST(LengthScale, IntegersOfManyDigitsAreShortened) {
  EXPECT_EQ(Scale("18446744073709551615").Apply(1), 0x1p64);
  EXPECT_EQ(Scale("-9007199254740993000001").Apply(1), -9007199254740993000001.0);
  EXPECT_EQ(Scale("1" + std::string(300, '0') + "1").Apply(1), 1e301);
}

TEST(LengthScale, ProductsAreExact) {
  const LengthScale inches = Scale("0.0254");
  const auto product = inches.Times(Scale("-2e-3"));
  ASSERT_TRUE(product.has_value());
  EXPECT_EQ(product->Apply(1), -0.0000508);
  EXPECT_EQ(product->Apply(10), -0.000508);
  EXPECT_TRUE(inches.Times(LengthScale())->Apply(3) == 0.0762);
  EXPECT_TRUE(Scale("0.5").Times(Scale("2"))->is_one());
  EXPECT_TRUE(Scale("-1").Times(Scale("-1"))->is_one());
  EXPECT_FALSE(Scale("1e200").Times(Scale("1e200")).has_value());
  EXPECT_FALSE(Scale("1e-200").Times(Scale("1e-200")).has_value());
  // More than 18 digits stand for the shortest number with the same nearest double.
  const auto many = Scale("0.123456789012345678").Times(Scale("0.123456789012345678"));
  EXPECT_EQ(many->Apply(1), 0.015241578753238836);
}

}  // namespace length_scale_test
}  // namespace hulld
