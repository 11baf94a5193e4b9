#ifndef HULLD_CORE_NUMERIC_DOUBLE_DOUBLE_H_
#define HULLD_CORE_NUMERIC_DOUBLE_DOUBLE_H_

#include "core/numeric/expansion.h"

namespace hulld {

// A number as the unevaluated sum of two doubles, the lower at most half a unit in the last place
// of the upper. Each operation errs by at most kDoubleDoubleError of its result, as long as nothing
// overflows or underflows. Source: Joldes, Muller and Popescu 2017, Tight and Rigorous Error Bounds
// for Basic Building Blocks of Double-Word Arithmetic, algorithms 6, 10 and 17.
struct DoubleDouble {
  double high = 0;
  double low = 0;

  DoubleDouble operator-() const { return {-high, -low}; }
};

inline DoubleDouble operator+(const DoubleDouble& x, const DoubleDouble& y) {
  const SumWithError s = TwoSum(x.high, y.high);
  const SumWithError t = TwoSum(x.low, y.low);
  const SumWithError v = FastTwoSum(s.sum, s.error + t.sum);
  const SumWithError z = FastTwoSum(v.sum, t.error + v.error);
  return {z.sum, z.error};
}

inline DoubleDouble operator-(const DoubleDouble& x, const DoubleDouble& y) { return x + -y; }

inline DoubleDouble operator*(const DoubleDouble& x, const DoubleDouble& y) {
  const SumWithError c = TwoProduct(x.high, y.high);
  const SumWithError z = FastTwoSum(c.sum, c.error + (x.high * y.low + x.low * y.high));
  return {z.sum, z.error};
}

// Requires y not zero.
inline DoubleDouble operator/(const DoubleDouble& x, const DoubleDouble& y) {
  const double quotient = x.high / y.high;
  const DoubleDouble r = y * DoubleDouble{quotient, 0};
  const double rest = (x.high - r.high) + (x.low - r.low);
  const SumWithError z = FastTwoSum(quotient, rest / y.high);
  return {z.sum, z.error};
}

// The exact product of two doubles.
inline DoubleDouble ExactProduct(double x, double y) {
  const SumWithError product = TwoProduct(x, y);
  return {product.sum, product.error};
}

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_DOUBLE_DOUBLE_H_
