#ifndef HULLD_CLIENT_VERIFY_EXACT_VECTOR_H_
#define HULLD_CLIENT_VERIFY_EXACT_VECTOR_H_

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <span>
#include <vector>

namespace hulld {

using BigInteger = boost::multiprecision::number<boost::multiprecision::cpp_int_backend<>,
                                                 boost::multiprecision::et_off>;
using BigVector = std::array<BigInteger, 3>;

inline BigVector operator+(const BigVector& a, const BigVector& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline BigVector operator-(const BigVector& a, const BigVector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline BigVector operator*(const BigInteger& s, const BigVector& a) {
  return {s * a[0], s * a[1], s * a[2]};
}
inline BigInteger Dot(const BigVector& a, const BigVector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline BigVector Cross(const BigVector& a, const BigVector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline bool IsZero(const BigVector& a) { return a[0] == 0 && a[1] == 0 && a[2] == 0; }

// Numbers as integers times a common power of two.
class CommonExponent {
 public:
  // Widens the exponent so that it serves this number, too. Requires that it is finite.
  void Include(double number);
  void Include(std::span<const double> numbers) {
    for (const double number : numbers) Include(number);
  }
  // number / 2^exponent. Requires that it was included.
  BigInteger ToInteger(double number) const;
  int exponent() const { return exponent_; }

 private:
  // The exponent of the lowest bit of all numbers so far; no double has a higher one than this.
  int exponent_ = 1024;
};

// Whether 0 is in the convex hull of the points. Requires that all lie in a closed half space that
// has 0 on its boundary; unchecked, as callers find the half space by exact arithmetic just before.
// Cost: the cube of their number.
bool HoldsOriginOnBoundary(std::span<const BigVector> points);

// Whether 0 is in the interior of the convex hull of the points.
bool HoldsOriginInside(std::span<const BigVector> points);

}  // namespace hulld

#endif  // HULLD_CLIENT_VERIFY_EXACT_VECTOR_H_
