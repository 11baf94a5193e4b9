#include "core/numeric/integer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "core/base/check.h"

namespace hulld {

int LowestBitExponent(double x) {
  HULLD_CHECK(x != 0 && std::isfinite(x));
  const BinaryDouble d = Decompose(x);
  return d.exponent + std::countr_zero(d.magnitude);
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
  const BinaryDouble d = Decompose(x);
  const int shift = d.exponent - exponent;
  if (shift < 0) {
    HULLD_CHECK(shift > -53 && d.magnitude % (uint64_t{1} << -shift) == 0);
  }
  const Integer magnitude =
      shift >= 0 ? Integer(d.magnitude) << shift : Integer(d.magnitude >> -shift);
  return d.negative ? Integer(-magnitude) : magnitude;
}

Integer IntegerOf(std::span<const uint64_t> words, bool negative) {
  Integer magnitude = 0;
  for (size_t i = words.size(); i-- > 0;) {
    magnitude <<= 64;
    magnitude += words[i];
  }
  return negative ? Integer(-magnitude) : magnitude;
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
