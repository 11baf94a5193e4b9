#ifndef HULLD_CORE_NUMERIC_INTEGER_H_
#define HULLD_CORE_NUMERIC_INTEGER_H_

#include <bit>
#include <boost/multiprecision/cpp_int.hpp>
#include <cstdint>
#include <span>

#include "core/base/check.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/vector.h"
#include "core/numeric/wide_integer.h"

namespace hulld {

// An integer of any size, without allocation up to 1024 bits.
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

  // Friends, so that they are candidates only for IntegerVector: Integer claims to be constructible
  // from many types.
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
// Returns a direction perpendicular to d. Requires: d not zero.
inline IntegerVector AnyPerpendicular(const IntegerVector& d) {
  HULLD_CHECK(!IsZero(d));
  if (!d.y.is_zero() || !d.z.is_zero()) return {0, d.z, -d.y};
  return {0, 0, d.x};
}

// x = magnitude * 2^exponent, or the negative of that. Exact for every finite x.
struct BinaryDouble {
  uint64_t magnitude;  // below 2^53
  int exponent;
  bool negative;
};
inline BinaryDouble Decompose(double x) {
  constexpr uint64_t kImplicitBit = uint64_t{1} << 52;
  const auto bits = std::bit_cast<uint64_t>(x);
  const int biased = static_cast<int>(bits >> 52 & 0x7ff);
  const uint64_t fraction = bits & (kImplicitBit - 1);
  // Subnormals share their exponent with the least normal numbers.
  if (biased == 0) return {fraction, -1074, x < 0};
  return {fraction | kImplicitBit, biased - 1075, x < 0};
}

// Returns the exponent e of the lowest set bit of x: x is an odd multiple of 2^e. Exact, subnormals
// included. Requires: x finite and not 0.
int LowestBitExponent(double x);

// Returns the least LowestBitExponent of the non-zero components, or `otherwise` if it is less or
// all are zero.
int LowestBitExponent(const Vector& v, int otherwise);

// Returns x / 2^exponent. Requires: x finite and a multiple of 2^exponent.
Integer ToInteger(double x, int exponent);
IntegerVector ToInteger(const Vector& v, int exponent);

// ToInteger in a fixed width. Requires: the quotient fits (unchecked).
template <int kWords>
WideInteger<kWords> WideIntegerOf(double x, int exponent) {
  const BinaryDouble d = Decompose(x);
  if (d.magnitude == 0) return 0;
  const int shift = d.exponent - exponent;
  HULLD_DCHECK(shift >= -52 && shift < 64 * kWords);
  WideInteger<kWords> magnitude;
  if constexpr (kWords == 1) {
    magnitude = static_cast<int64_t>(shift >= 0 ? d.magnitude << shift : d.magnitude >> -shift);
  } else {
    magnitude = static_cast<int64_t>(shift >= 0 ? d.magnitude : d.magnitude >> -shift);
    if (shift > 0) magnitude = Shifted(magnitude, shift);
  }
  return d.negative ? -magnitude : magnitude;
}

// Returns the number with these words as its magnitude, the least significant first.
Integer IntegerOf(std::span<const uint64_t> words, bool negative);

// Converts to an integer of any size.
template <int kWords>
Integer ToInteger(const WideInteger<kWords>& a) {
  const WideInteger<kWords> magnitude = a.is_negative() ? -a : a;
  return IntegerOf(magnitude.words(), a.is_negative());
}
template <int kWords>
IntegerVector ToInteger(const WideVector<kWords>& v) {
  return {ToInteger(v.x), ToInteger(v.y), ToInteger(v.z)};
}
inline const IntegerVector& ToInteger(const IntegerVector& v) { return v; }

// Converts to a fixed width. Returns false, and leaves `wide` unset, if the words are too few.
template <int kWords>
bool ToWide(const Integer& a, WideInteger<kWords>& wide) {
  const auto& limbs = a.backend();
  static_assert(sizeof(*limbs.limbs()) == sizeof(uint64_t));
  if (limbs.size() > kWords) return false;
  wide = 0;
  for (unsigned i = 0; i < limbs.size(); ++i) wide.word(static_cast<int>(i)) = limbs.limbs()[i];
  // The sign would need the highest bit.
  if (wide.is_negative()) return false;
  if (limbs.sign()) wide = -wide;
  return true;
}
template <int kWords>
bool ToWide(const IntegerVector& v, WideVector<kWords>& wide) {
  return ToWide(v.x, wide.x) && ToWide(v.y, wide.y) && ToWide(v.z, wide.z);
}

// Returns the number of bits of the largest component; 0 for the zero vector.
unsigned BitLength(const IntegerVector& v);

// Returns v, rounded, divided by the power of two that brings its largest component into [2^62,
// 2^63). Each component of the result errs by less than 2^-52 times the largest component, relative
// to the exact quotient. Requires: v not zero.
Vector ToScaledDoubles(const IntegerVector& v);
inline constexpr double kScaledDoublesError = 0x1p-52;
inline constexpr double kScaledDoublesMax = 0x1p63;

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_INTEGER_H_
