#ifndef HULLD_CORE_NUMERIC_INTEGER_H_
#define HULLD_CORE_NUMERIC_INTEGER_H_

#include <boost/multiprecision/cpp_int.hpp>

#include "core/base/check.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/vector.h"

namespace hulld {

// An integer of any size; up to 1024 bits it lives without allocation.
using Integer = boost::multiprecision::number<
    boost::multiprecision::cpp_int_backend<1024, 0, boost::multiprecision::signed_magnitude,
                                           boost::multiprecision::unchecked>,
    boost::multiprecision::et_off>;

// A point or direction with integer components.
struct IntegerVector {
  Integer x;
  Integer y;
  Integer z;

  const Integer& operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
  Integer& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }

  // Friends, so that they are candidates for nothing but IntegerVector: Integer claims to be
  // constructible from much.
  friend bool operator==(const IntegerVector&, const IntegerVector&) = default;
  friend IntegerVector operator+(const IntegerVector& a, const IntegerVector& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend IntegerVector operator-(const IntegerVector& a, const IntegerVector& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend IntegerVector operator-(const IntegerVector& a) { return {-a.x, -a.y, -a.z}; }
  friend IntegerVector operator*(const Integer& s, const IntegerVector& a) {
    return {s * a.x, s * a.y, s * a.z};
  }
};

inline Integer Dot(const IntegerVector& a, const IntegerVector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline IntegerVector Cross(const IntegerVector& a, const IntegerVector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline bool IsZero(const IntegerVector& a) {
  return a.x.is_zero() && a.y.is_zero() && a.z.is_zero();
}
inline int Sign(const Integer& a) { return a.sign(); }
// A direction across d. Requires d not zero.
inline IntegerVector AnyPerpendicular(const IntegerVector& d) {
  HULLD_CHECK(!IsZero(d));
  if (!d.y.is_zero() || !d.z.is_zero()) return {0, d.z, -d.y};
  return {0, 0, d.x};
}

// The exponent e of the lowest set bit of x: x is an odd multiple of 2^e. Requires x finite and not
// 0. Exact, subnormals included.
int LowestBitExponent(double x);

// The least LowestBitExponent of the non-zero components, or `otherwise` when it is less or all are
// zero.
int LowestBitExponent(const Vector& v, int otherwise);

// x / 2^exponent. Requires x finite and a multiple of 2^exponent.
Integer ToInteger(double x, int exponent);
IntegerVector ToInteger(const Vector& v, int exponent);

// The number of bits of the largest component; 0 for the zero vector.
unsigned BitLength(const IntegerVector& v);

// v divided by the power of two that brings its largest component into [2^62, 2^63), rounded: each
// component of the result errs by less than 2^-52 times the largest component, relative to the
// exact quotient. Requires v not zero.
Vector ToScaledDoubles(const IntegerVector& v);
inline constexpr double kScaledDoublesError = 0x1p-52;

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_INTEGER_H_
