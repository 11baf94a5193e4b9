#ifndef HULLD_TESTS_ORACLE_EXACT_INTEGERS_H_
#define HULLD_TESTS_ORACLE_EXACT_INTEGERS_H_

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cstdint>
#include <span>
#include <vector>

namespace hulld::oracle {

using Point = std::array<double, 3>;

// Integers of any length. No expression templates, so that `auto` is always a number.
using Integer = boost::multiprecision::number<boost::multiprecision::cpp_int_backend<>,
                                              boost::multiprecision::et_off>;
using IntegerVector = std::array<Integer, 3>;

// Exact value of a finite double: mantissa * 2^exponent, with an odd mantissa; zero is 0 * 2^0.
struct Dyadic {
  int64_t mantissa = 0;
  int exponent = 0;
};
Dyadic Decompose(double value);

// Returns the values times a common power of two: the least one that makes them all integers. Signs
// of homogeneous expressions are preserved. Requires: finite values.
std::vector<Integer> ToIntegers(std::span<const double> values);
std::vector<IntegerVector> ToIntegerVectors(std::span<const Point> points);

IntegerVector Subtract(const IntegerVector& a, const IntegerVector& b);
IntegerVector Negate(const IntegerVector& a);
IntegerVector Cross(const IntegerVector& a, const IntegerVector& b);
Integer Dot(const IntegerVector& a, const IntegerVector& b);
bool IsZero(const IntegerVector& a);
int Sign(const Integer& a);

}  // namespace hulld::oracle

#endif  // HULLD_TESTS_ORACLE_EXACT_INTEGERS_H_
