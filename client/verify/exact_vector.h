#ifndef HULLD_CLIENT_VERIFY_EXACT_VECTOR_H_
#define HULLD_CLIENT_VERIFY_EXACT_VECTOR_H_

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <span>

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

// Represents numbers as integers times a common power of two.
class CommonExponent {
 public:
  // Widens the exponent to cover this number. Requires a finite number.
  void Include(double number);
  void Include(std::span<const double> numbers) {
    for (const double number : numbers) Include(number);
  }
  // Returns number / 2^exponent. Requires that it was included.
  BigInteger ToInteger(double number) const;
  int exponent() const { return exponent_; }

 private:
  // Exponent of the lowest bit of all numbers so far. No double has a higher exponent than this
  // value.
  int exponent_ = 1024;
};

// Returns true if 0 is in the convex hull of the points. Requires that all lie in a closed half
// space with 0 on its boundary; unchecked, because callers have just found the half space by exact
// arithmetic. Cost: cubic in the number of points.
bool ContainsOriginOnBoundary(std::span<const BigVector> points);

// Returns true if 0 is in the interior of the convex hull of the points.
bool ContainsOriginInside(std::span<const BigVector> points);

// Returns true if a point of the convex hull of the points is within r of 0 or, if `nearer`, less
// than r from it. Cost: cubic in the number of points.
bool ComesWithin(std::span<const BigVector> points, const BigInteger& r_squared, bool nearer);

}  // namespace hulld

#endif  // HULLD_CLIENT_VERIFY_EXACT_VECTOR_H_
