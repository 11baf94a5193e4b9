#include "tests/oracle/exact_integers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/oracle/linear_program.h"

namespace hulld::oracle {
namespace exact_integers_test {

TEST(ExactIntegers, DecompositionIsReversible) {
  std::mt19937_64 random(20240501);
  const double denormal = std::numeric_limits<double>::denorm_min();
  std::vector<double> values = {0.0,
                                -0.0,
                                1.0,
                                -3.0,
                                0.1,
                                1e300,
                                1e-310,
                                denormal,
                                7 * denormal,
                                std::numeric_limits<double>::max(),
                                std::numeric_limits<double>::min()};
  for (int i = 0; i < 1000; ++i) {
    const double mantissa = std::uniform_real_distribution<double>(-1, 1)(random);
    values.push_back(std::ldexp(mantissa, static_cast<int>(random() % 2090) - 1070));
  }
  for (double value : values) {
    const Dyadic dyadic = Decompose(value);
    EXPECT_TRUE(dyadic.mantissa == 0 || dyadic.mantissa % 2 != 0) << value;
    EXPECT_EQ(std::ldexp(static_cast<double>(dyadic.mantissa), dyadic.exponent), value);
  }
}

TEST(ExactIntegers, OneCommonScaleKeepsRatios) {
  const double denormal = std::numeric_limits<double>::denorm_min();
  const std::vector<Integer> integers =
      ToIntegers(std::vector<double>{denormal, -1.0, 0.0, 3 * denormal});
  EXPECT_EQ(integers[0], 1);
  EXPECT_EQ(integers[1], -(Integer(1) << 1074));
  EXPECT_EQ(integers[2], 0);
  EXPECT_EQ(integers[3], 3);
}

TEST(ExactIntegers, TheScaleIsTheSmallestThatYieldsIntegers) {
  EXPECT_EQ(ToIntegers(std::vector<double>{8, 24, -16}), (std::vector<Integer>{1, 3, -2}));
}

TEST(LinearProgram, FindsWeightsIffTheyExist) {
  EXPECT_TRUE(HasNonnegativeSolution({{1, 0}, {0, 1}}, {3, 5}));
  EXPECT_FALSE(HasNonnegativeSolution({{1, 0}, {0, 1}}, {3, -5}));
  EXPECT_TRUE(HasNonnegativeSolution({{1, -1}, {-1, -1}}, {0, -7}));
  EXPECT_FALSE(HasNonnegativeSolution({}, {1}));
  EXPECT_TRUE(HasNonnegativeSolution({}, {0}));
  // Redundant rows.
  EXPECT_TRUE(HasNonnegativeSolution({{1, 2}, {2, 4}}, {3, 6}));
  EXPECT_FALSE(HasNonnegativeSolution({{1, 2}, {2, 4}}, {3, 7}));
}

}  // namespace exact_integers_test
}  // namespace hulld::oracle
