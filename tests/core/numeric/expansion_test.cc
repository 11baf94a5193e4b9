#include "core/numeric/expansion.h"

#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <random>

#include "tests/test_size.h"

namespace hulld {
namespace expansion_test {

using Rational = boost::multiprecision::cpp_rational;

template <size_t N>
Rational ValueOf(const Expansion<N>& e) {
  Rational sum = 0;
  for (size_t i = 0; i < e.size(); ++i) sum += Rational(e[i]);
  return sum;
}

template <size_t N>
void ExpectNonoverlapping(const Expansion<N>& e) {
  for (size_t i = 1; i < e.size(); ++i) {
    ASSERT_NE(e[i - 1], 0);
    ASSERT_LT(std::abs(e[i - 1]), std::abs(e[i]));
  }
}

double RandomDouble(std::mt19937_64& random) {
  std::uniform_real_distribution<double> mantissa(-1, 1);
  std::uniform_int_distribution<int> exponent(-60, 60);
  return std::ldexp(mantissa(random), exponent(random));
}

TEST(Expansion, TwoSumAndTwoProductAreExact) {
  std::mt19937_64 random(1);
  for (int i = 0; i < TestSize(20000, 2000); ++i) {
    const double a = RandomDouble(random);
    const double b = RandomDouble(random);
    const SumWithError sum = TwoSum(a, b);
    ASSERT_EQ(Rational(sum.sum) + Rational(sum.error), Rational(a) + Rational(b));
    const SumWithError product = TwoProduct(a, b);
    ASSERT_EQ(Rational(product.sum) + Rational(product.error), Rational(a) * Rational(b));
  }
}

TEST(Expansion, SumsAndProductsAreExactAndNonoverlapping) {
  std::mt19937_64 random(2);
  for (int i = 0; i < TestSize(5000, 500); ++i) {
    double x[8];
    for (double& value : x) value = RandomDouble(random);
    const auto e = Expansion<2>::DifferenceOf(x[0], x[1]) * Expansion<2>::DifferenceOf(x[2], x[3]);
    const auto f = Expansion<2>::DifferenceOf(x[4], x[5]) * Expansion<2>::DifferenceOf(x[6], x[7]);
    const Rational e_exact = (Rational(x[0]) - Rational(x[1])) * (Rational(x[2]) - Rational(x[3]));
    const Rational f_exact = (Rational(x[4]) - Rational(x[5])) * (Rational(x[6]) - Rational(x[7]));
    ASSERT_EQ(ValueOf(e), e_exact);
    ASSERT_EQ(ValueOf(e - f), e_exact - f_exact);
    ASSERT_EQ((e - f).sign(), Rational(e_exact - f_exact).sign());
    ExpectNonoverlapping(e - f);
    const auto cubic = (e - f) * Expansion<2>::DifferenceOf(x[0], x[7]);
    ASSERT_EQ(ValueOf(cubic), (e_exact - f_exact) * (Rational(x[0]) - Rational(x[7])));
    ExpectNonoverlapping(cubic);
  }
}

TEST(Expansion, ZeroHasNoComponents) {
  const auto zero = Expansion<2>::DifferenceOf(0.1, 0.1);
  EXPECT_EQ(zero.size(), 0u);
  EXPECT_EQ(zero.sign(), 0);
  EXPECT_EQ((zero * Expansion<2>::DifferenceOf(3, 1)).size(), 0u);
}

}  // namespace expansion_test
}  // namespace hulld
