#include "tests/oracle/exact_integers.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hulld::oracle {

Dyadic Decompose(double value) {
  if (value == 0) return {};
  int exponent = 0;
  const double fraction = std::frexp(value, &exponent);  // normalizes subnormals too
  Dyadic result{static_cast<int64_t>(std::ldexp(fraction, 53)), exponent - 53};
  while (result.mantissa % 2 == 0) {
    result.mantissa /= 2;
    ++result.exponent;
  }
  return result;
}

std::vector<Integer> ToIntegers(std::span<const double> values) {
  int least = std::numeric_limits<int>::max();
  for (double value : values) {
    if (value != 0) least = std::min(least, Decompose(value).exponent);
  }
  std::vector<Integer> result;
  result.reserve(values.size());
  for (double value : values) {
    const Dyadic dyadic = Decompose(value);
    Integer integer = dyadic.mantissa;
    // A product, because not every backend defines the shift of a negative number.
    if (dyadic.mantissa != 0) integer *= Integer(1) << (dyadic.exponent - least);
    result.push_back(std::move(integer));
  }
  return result;
}

std::vector<IntegerVector> ToIntegerVectors(std::span<const Point> points) {
  std::vector<double> values;
  values.reserve(3 * points.size());
  for (const Point& p : points) values.insert(values.end(), p.begin(), p.end());
  const std::vector<Integer> integers = ToIntegers(values);
  std::vector<IntegerVector> result(points.size());
  for (size_t i = 0; i < integers.size(); ++i) result[i / 3][i % 3] = integers[i];
  return result;
}

IntegerVector Subtract(const IntegerVector& a, const IntegerVector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

IntegerVector Negate(const IntegerVector& a) { return {-a[0], -a[1], -a[2]}; }

IntegerVector Cross(const IntegerVector& a, const IntegerVector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Integer Dot(const IntegerVector& a, const IntegerVector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

bool IsZero(const IntegerVector& a) { return a[0] == 0 && a[1] == 0 && a[2] == 0; }

int Sign(const Integer& a) { return a.sign(); }

}  // namespace hulld::oracle
