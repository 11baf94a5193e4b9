#ifndef HULLD_CORE_NUMERIC_DOUBLE_DOUBLE_H_
#define HULLD_CORE_NUMERIC_DOUBLE_DOUBLE_H_

#include "core/base/check.h"
#include "core/numeric/expansion.h"

namespace hulld {

// A number as the unevaluated sum of two doubles, the lower at most half a unit in the last place
// of the upper. The comment of each operation states its relative error bound, with u the unit
// roundoff, in the absence of overflow and underflow. Sources: Joldes, Muller and Popescu 2017,
// Tight and Rigorous Error Bounds for Basic Building Blocks of Double-Word Arithmetic (JMP); Muller
// and Rideau 2022, Formalization of Double-Word Arithmetic (MR), a check of JMP's theorems by a
// proof assistant.
struct DoubleDouble {
  double high = 0;
  double low = 0;

  DoubleDouble operator-() const { return {-high, -low}; }
};

// Relative error: 3 u^2 + 13 u^3. Algorithm 6 of JMP, and its theorem.
inline DoubleDouble operator+(const DoubleDouble& x, const DoubleDouble& y) {
  const SumWithError s = TwoSum(x.high, y.high);
  const SumWithError t = TwoSum(x.low, y.low);
  const SumWithError v = FastTwoSum(s.sum, s.error + t.sum);
  const SumWithError z = FastTwoSum(v.sum, t.error + v.error);
  return {z.sum, z.error};
}

inline DoubleDouble operator-(const DoubleDouble& x, const DoubleDouble& y) { return x + -y; }

// Relative error: 5 u^2. Algorithm 10 of JMP, who prove 7 u^2; MR prove 5 u^2. If y is one double,
// with lower part 0, the steps are those of algorithm 8: 3 u^2.
inline DoubleDouble operator*(const DoubleDouble& x, const DoubleDouble& y) {
  const SumWithError c = TwoProduct(x.high, y.high);
  const SumWithError z = FastTwoSum(c.sum, c.error + (x.high * y.low + x.low * y.high));
  return {z.sum, z.error};
}

// Relative error: 17 u^2. Algorithm 17 of JMP, except for `r`. Theorem 7.1 gives 15 u^2 + 56 u^3
// for a product r with relative error 1.5 u^2 + 4 u^3 (algorithm 7); here the error of r is 3 u^2
// (algorithm 8). The error of r enters the quotient once, because x - r corrects it: 1.5 u^2 more,
// and terms of u^3. Requires: y not zero.
inline DoubleDouble operator/(const DoubleDouble& x, const DoubleDouble& y) {
  HULLD_DCHECK(y.high != 0);
  const double quotient = x.high / y.high;
  const DoubleDouble r = y * DoubleDouble{quotient, 0};
  const double rest = (x.high - r.high) + (x.low - r.low);
  const SumWithError z = FastTwoSum(quotient, rest / y.high);
  return {z.sum, z.error};
}

// Returns the exact product of two doubles.
inline DoubleDouble ExactProduct(double x, double y) {
  const SumWithError product = TwoProduct(x, y);
  return {product.sum, product.error};
}

// Returns (1 - t) a + t b for t in [0, 1] within 9 u^2 (|a| + |b|): the difference of a and b is
// exact, its product with t errs by 3 u^2 of itself, and the sum by 3 u^2 of at most |a| + |b|.
inline DoubleDouble Interpolated(double a, double b, double t) {
  const SumWithError difference = TwoSum(b, -a);
  return DoubleDouble{difference.sum, difference.error} * DoubleDouble{t, 0} + DoubleDouble{a, 0};
}

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_DOUBLE_DOUBLE_H_
