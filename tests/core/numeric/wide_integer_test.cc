// Fixed-width integers against integers of any size, modulo the width.

#include "core/numeric/wide_integer.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <random>

#include "core/numeric/integer.h"

namespace hulld {
namespace wide_integer_test {

// Words of all kinds, with carry boundaries more often than other words.
template <int kWords>
WideInteger<kWords> AnyInteger(std::mt19937_64& random) {
  WideInteger<kWords> value;
  for (int i = 0; i < kWords; ++i) {
    switch (random() % 6) {
      case 0:
        value.word(i) = 0;
        break;
      case 1:
        value.word(i) = ~uint64_t{0};
        break;
      case 2:
        value.word(i) = uint64_t{1} << 63;
        break;
      case 3:
        value.word(i) = ~(uint64_t{1} << 63);
        break;
      case 4:
        value.word(i) = random() >> random() % 64;
        break;
      default:
        value.word(i) = random();
    }
  }
  return value;
}

// Returns a number wrapped to this many words.
Integer Wrapped(const Integer& value, int words) {
  const Integer range = Integer(1) << (64 * words);
  Integer rest = value % range;
  if (rest < 0) rest += range;
  if (rest >= range / 2) rest -= range;
  return rest;
}

template <int kWords>
void CheckSumsAndShifts(std::mt19937_64& random) {
  for (int i = 0; i < 2000; ++i) {
    const auto a = AnyInteger<kWords>(random);
    const auto b = AnyInteger<kWords>(random);
    const Integer exact_a = ToInteger(a);
    const Integer exact_b = ToInteger(b);
    ASSERT_EQ(ToInteger(a + b), Wrapped(exact_a + exact_b, kWords));
    ASSERT_EQ(ToInteger(a - b), Wrapped(exact_a - exact_b, kWords));
    ASSERT_EQ(ToInteger(-a), Wrapped(-exact_a, kWords));
    ASSERT_EQ(Sign(a), Sign(exact_a));
    ASSERT_EQ(a == b, exact_a == exact_b);
    ASSERT_EQ(a.is_zero(), exact_a == 0);
    const int bits = static_cast<int>(random() % (64 * kWords));
    ASSERT_EQ(ToInteger(Shifted(a, bits)), Wrapped(exact_a << bits, kWords)) << bits;
    // Sign-extension changes nothing.
    ASSERT_EQ(ToInteger(WideInteger<kWords + 2>(a)), exact_a);
    ASSERT_EQ(WideInteger<kWords>(WideInteger<kWords + 2>(a)), a);
  }
}

template <int kA, int kB>
void CheckProducts(std::mt19937_64& random) {
  for (int i = 0; i < 2000; ++i) {
    const auto a = AnyInteger<kA>(random);
    const auto b = AnyInteger<kB>(random);
    const Integer product = ToInteger(a) * ToInteger(b);
    ASSERT_EQ(ToInteger(a * b), product);
    ASSERT_EQ(ToInteger(LowProduct<kA>(a, b)), Wrapped(product, kA));
  }
}

TEST(WideInteger, SumsDifferencesAndShiftsAgreeWithIntegers) {
  std::mt19937_64 random(1);
  CheckSumsAndShifts<1>(random);
  CheckSumsAndShifts<2>(random);
  CheckSumsAndShifts<3>(random);
  CheckSumsAndShifts<5>(random);
  CheckSumsAndShifts<15>(random);
}

TEST(WideInteger, ProductsAgreeWithIntegers) {
  std::mt19937_64 random(2);
  CheckProducts<1, 1>(random);
  CheckProducts<2, 1>(random);
  CheckProducts<2, 2>(random);
  CheckProducts<3, 3>(random);
  CheckProducts<4, 2>(random);
  CheckProducts<5, 1>(random);
  CheckProducts<5, 2>(random);
  CheckProducts<5, 5>(random);
  CheckProducts<6, 3>(random);
  CheckProducts<10, 5>(random);
}

TEST(WideInteger, VectorProductsAgreeWithIntegers) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 2000; ++i) {
    // Halved, so that sums fit.
    const auto any = [&] {
      WideVector<2> v;
      for (int k = 0; k < 3; ++k) v[k] = WideInteger<2>(AnyInteger<1>(random));
      return v;
    };
    const WideVector<2> a = any();
    const WideVector<2> b = any();
    EXPECT_EQ(ToInteger(Cross(a, b)), Cross(ToInteger(a), ToInteger(b)));
    EXPECT_EQ(ToInteger(Dot(a, b)), Dot(ToInteger(a), ToInteger(b)));
    EXPECT_EQ(ToInteger(a - b), ToInteger(a) - ToInteger(b));
    EXPECT_EQ(ToInteger(-a), -ToInteger(a));
    if (!IsZero(a)) {
      EXPECT_EQ(ToInteger(AnyPerpendicular(a)), AnyPerpendicular(ToInteger(a)));
    }
  }
}

TEST(WideInteger, DoublesConvertAsToIntegers) {
  std::mt19937_64 random(4);
  const double values[] = {0.0,
                           1.0,
                           -6.5,
                           0x1.fffffffffffffp0,
                           std::numeric_limits<double>::min(),
                           std::numeric_limits<double>::denorm_min(),
                           -std::numeric_limits<double>::denorm_min() * 12345,
                           std::numeric_limits<double>::max()};
  for (const double value : values) {
    if (value == 0) {
      EXPECT_TRUE(WideIntegerOf<2>(value, 17).is_zero());
      continue;
    }
    const int lowest = LowestBitExponent(value);
    for (int below = 0; below < 64; ++below) {
      EXPECT_EQ(ToInteger(WideIntegerOf<2>(value, lowest - below)),
                ToInteger(value, lowest - below));
      if (below < 10) {
        EXPECT_EQ(ToInteger(WideIntegerOf<1>(value, lowest - below)),
                  ToInteger(value, lowest - below));
      }
    }
  }
}

TEST(WideInteger, WideOfAcceptsNegativeNumbers) {
  EXPECT_EQ(ToInteger(WideOf(Int128{-5})), Integer(-5));
  EXPECT_EQ(ToInteger(WideOf(Int128{7} << 100)), Integer(7) << 100);
  EXPECT_EQ(ToInteger(WideOf(-(Int128{7} << 100))), -(Integer(7) << 100));
}

TEST(WideInteger, IntegersConvertIfTheyFit) {
  const uint64_t seed = 11;
  std::mt19937_64 random(seed);
  for (int i = 0; i < 2000; ++i) {
    const int bits = static_cast<int>(random() % 200);
    Integer a = 0;
    for (int k = 0; k < 4; ++k) a = (a << 64) + random();
    a >>= 256 - bits;
    if (i % 2 == 0) a = -a;
    WideInteger<2> wide;
    const bool fits = a.is_zero() || msb(Integer(abs(a))) < 127;
    ASSERT_EQ(ToWide(a, wide), fits) << a << " seed " << seed;
    if (fits) {
      ASSERT_EQ(ToInteger(wide), a) << "seed " << seed;
    }
  }
  // The least number of two words has no negation of that width, and is excluded.
  WideInteger<2> wide;
  EXPECT_FALSE(ToWide(Integer(-(Integer(1) << 127)), wide));
  EXPECT_TRUE(ToWide(Integer((Integer(1) << 127) - 1), wide));
}

}  // namespace wide_integer_test
}  // namespace hulld
