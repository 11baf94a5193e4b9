#include "core/numeric/integer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/base/check.h"

namespace hulld {
namespace {

// x = mantissa * 2^exponent with an integer mantissa, exactly.
struct Decomposed {
  int64_t mantissa;
  int exponent;
};

Decomposed Decompose(double x) {
  int exponent = 0;
  const double fraction = std::frexp(x, &exponent);
  return {static_cast<int64_t>(std::ldexp(fraction, 53)), exponent - 53};
}

}  // namespace

int LowestBitExponent(double x) {
  HULLD_CHECK(x != 0 && std::isfinite(x));
  const Decomposed d = Decompose(x);
  return d.exponent + __builtin_ctzll(static_cast<uint64_t>(d.mantissa));
}

int LowestBitExponent(const Vector& v, int otherwise) {
  for (int i = 0; i < 3; ++i) {
    if (v[i] != 0) otherwise = std::min(otherwise, LowestBitExponent(v[i]));
  }
  return otherwise;
}

Integer ToInteger(double x, int exponent) {
  if (x == 0) return 0;
  HULLD_CHECK(std::isfinite(x));
  const Decomposed d = Decompose(x);
  const int shift = d.exponent - exponent;
  if (shift >= 0) return Integer(d.mantissa) << shift;
  HULLD_CHECK(shift > -53 && d.mantissa % (int64_t{1} << -shift) == 0);
  // A multiple of 2^exponent: the bits that fall out are zero, so division is exact for either
  // sign.
  return Integer(d.mantissa / (int64_t{1} << -shift));
}

IntegerVector ToInteger(const Vector& v, int exponent) {
  return {ToInteger(v.x(), exponent), ToInteger(v.y(), exponent), ToInteger(v.z(), exponent)};
}

unsigned BitLength(const IntegerVector& v) {
  unsigned bits = 0;
  for (int i = 0; i < 3; ++i) {
    if (!v[i].is_zero()) {
      bits = std::max(bits, static_cast<unsigned>(boost::multiprecision::msb(abs(v[i]))) + 1);
    }
  }
  return bits;
}

Vector ToScaledDoubles(const IntegerVector& v) {
  const int bits = static_cast<int>(BitLength(v));
  HULLD_CHECK(bits > 0);
  Vector result;
  for (int i = 0; i < 3; ++i) {
    const int shift = bits - 63;
    const Integer magnitude =
        shift >= 0 ? Integer(abs(v[i]) >> shift) : Integer(abs(v[i]) << -shift);
    const double value = static_cast<double>(static_cast<int64_t>(magnitude));
    result[i] = v[i] < 0 ? -value : value;
  }
  return result;
}

}  // namespace hulld
