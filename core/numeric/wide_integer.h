#ifndef HULLD_CORE_NUMERIC_WIDE_INTEGER_H_
#define HULLD_CORE_NUMERIC_WIDE_INTEGER_H_

#include <cstdint>
#include <span>

#include "core/base/check.h"

namespace hulld {

__extension__ using Int128 = __int128;
__extension__ using UInt128 = unsigned __int128;

// An integer of a fixed number of 64-bit words, in two's complement: no allocation, no size to
// inspect. A product is as wide as its factors together, so it always fits. A sum or a difference
// is as wide as the wider of its terms and wraps, so the caller must ensure that it fits. Default
// construction leaves it uninitialized.
template <int kWords>
class WideInteger {
  static_assert(kWords >= 1);

 public:
  WideInteger() = default;
  WideInteger(int64_t value) {  // NOLINT: it is the same number
    words_[0] = static_cast<uint64_t>(value);
    FillFrom(1, value < 0);
  }
  // Sign-extends, or truncates to the low words; the truncated words must not matter (unchecked).
  template <int kOther>
  explicit WideInteger(const WideInteger<kOther>& other) {
    constexpr int kCommon = kOther < kWords ? kOther : kWords;
    for (int i = 0; i < kCommon; ++i) words_[i] = other.word(i);
    if constexpr (kOther < kWords) FillFrom(kOther, other.is_negative());
  }

  // Least significant word first.
  std::span<const uint64_t> words() const { return words_; }
  uint64_t word(int i) const { return words_[i]; }
  uint64_t& word(int i) { return words_[i]; }
  bool is_negative() const { return static_cast<int64_t>(words_[kWords - 1]) < 0; }
  bool is_zero() const {
    uint64_t any = 0;
    for (int i = 0; i < kWords; ++i) any |= words_[i];
    return any == 0;
  }

  friend bool operator==(const WideInteger&, const WideInteger&) = default;
  friend WideInteger operator+(const WideInteger& a, const WideInteger& b) {
    WideInteger sum;
    if constexpr (kWords == 2 || kWords == 3) {
      sum.SetHigh(a.high() + b.high());
      if constexpr (kWords == 3) {
        sum.words_[0] = a.words_[0] + b.words_[0];
        sum.SetHigh(sum.high() + (sum.words_[0] < a.words_[0] ? 1 : 0));
      }
      return sum;
    }
    uint64_t carry = 0;
#pragma GCC unroll 16
    for (int i = 0; i < kWords; ++i) {
      const UInt128 t = static_cast<UInt128>(a.words_[i]) + b.words_[i] + carry;
      sum.words_[i] = static_cast<uint64_t>(t);
      carry = static_cast<uint64_t>(t >> 64);
    }
    return sum;
  }
  friend WideInteger operator-(const WideInteger& a, const WideInteger& b) {
    WideInteger difference;
    if constexpr (kWords == 2 || kWords == 3) {
      difference.SetHigh(a.high() - b.high());
      if constexpr (kWords == 3) {
        difference.words_[0] = a.words_[0] - b.words_[0];
        difference.SetHigh(difference.high() - (a.words_[0] < b.words_[0] ? 1 : 0));
      }
      return difference;
    }
    uint64_t borrow = 0;
#pragma GCC unroll 16
    for (int i = 0; i < kWords; ++i) {
      const UInt128 t = static_cast<UInt128>(a.words_[i]) - b.words_[i] - borrow;
      difference.words_[i] = static_cast<uint64_t>(t);
      borrow = static_cast<uint64_t>(t >> 64) & 1;
    }
    return difference;
  }
  friend WideInteger operator-(const WideInteger& a) { return WideInteger(0) - a; }
  WideInteger& operator+=(const WideInteger& b) { return *this = *this + b; }

  // The two highest words. Requires: at least two.
  UInt128 high() const {
    return static_cast<UInt128>(words_[kWords - 1]) << 64 | words_[kWords - 2];
  }
  void SetHigh(UInt128 high) {
    words_[kWords - 1] = static_cast<uint64_t>(high >> 64);
    words_[kWords - 2] = static_cast<uint64_t>(high);
  }

 private:
  void FillFrom(int first, bool negative) {
    for (int i = first; i < kWords; ++i) words_[i] = negative ? ~uint64_t{0} : 0;
  }

  uint64_t words_[kWords];
};

// Converts a 128-bit integer.
inline WideInteger<2> WideOf(Int128 value) {
  WideInteger<2> wide;
  wide.word(0) = static_cast<uint64_t>(value);
  wide.word(1) = static_cast<uint64_t>(value >> 64);
  return wide;
}

template <int kWords>
int Sign(const WideInteger<kWords>& a) {
  return a.is_negative() ? -1 : a.is_zero() ? 0 : 1;
}

// Returns the low kResult words of a product: the product modulo 2^(64 kResult).
template <int kResult, int kA, int kB>
[[gnu::always_inline]] inline WideInteger<kResult> LowProduct(const WideInteger<kA>& a,
                                                              const WideInteger<kB>& b) {
  WideInteger<kResult> product;
  if constexpr (kA == 1 && kB == 1 && kResult == 2) {
    const Int128 t =
        static_cast<Int128>(static_cast<int64_t>(a.word(0))) * static_cast<int64_t>(b.word(0));
    product.word(0) = static_cast<uint64_t>(t);
    product.word(1) = static_cast<uint64_t>(t >> 64);
    return product;
  }
  if constexpr (kA == 2 && kB == 1 && kResult == 3) {
    const auto factor = static_cast<Int128>(static_cast<int64_t>(b.word(0)));
    // Below 2^127 in magnitude, as is the sum.
    const Int128 low = static_cast<Int128>(a.word(0)) * factor;
    const Int128 high = static_cast<int64_t>(a.word(1)) * factor;
    product.word(0) = static_cast<uint64_t>(low);
    product.SetHigh(static_cast<UInt128>(high + (low >> 64)));
    return product;
  }
  // Multiplies as if both factors were unsigned.
  for (int i = 0; i < kResult; ++i) product.word(i) = 0;
#pragma GCC unroll 16
  for (int i = 0; i < kA; ++i) {
    uint64_t carry = 0;
#pragma GCC unroll 16
    for (int j = 0; j < kB; ++j) {
      if (i + j >= kResult) break;
      const UInt128 t = static_cast<UInt128>(a.word(i)) * b.word(j) + product.word(i + j) + carry;
      product.word(i + j) = static_cast<uint64_t>(t);
      carry = static_cast<uint64_t>(t >> 64);
    }
    if (i + kB < kResult) product.word(i + kB) = carry;
  }
  // Corrects for negative factors, which the unsigned product treats as 2^(64 kA) or 2^(64 kB) too
  // large.
  const auto subtract_above = [&](const auto& other, int other_words, int first, bool negative) {
    const uint64_t mask = negative ? ~uint64_t{0} : 0;
    uint64_t borrow = 0;
#pragma GCC unroll 16
    for (int i = 0; i < other_words; ++i) {
      if (first + i >= kResult) break;
      const UInt128 t =
          static_cast<UInt128>(product.word(first + i)) - (other.word(i) & mask) - borrow;
      product.word(first + i) = static_cast<uint64_t>(t);
      borrow = static_cast<uint64_t>(t >> 64) & 1;
    }
  };
  if constexpr (kA < kResult) subtract_above(b, kB, kA, a.is_negative());
  if constexpr (kB < kResult) subtract_above(a, kA, kB, b.is_negative());
  return product;
}

template <int kA, int kB>
WideInteger<kA + kB> operator*(const WideInteger<kA>& a, const WideInteger<kB>& b) {
  return LowProduct<kA + kB>(a, b);
}

// Returns a * 2^bits. Requires: bits >= 0, and the result fits (unchecked).
template <int kWords>
WideInteger<kWords> Shifted(const WideInteger<kWords>& a, int bits) {
  HULLD_DCHECK(bits >= 0);
  const int whole = bits / 64;
  const int rest = bits % 64;
  WideInteger<kWords> result;
  for (int i = kWords - 1; i >= 0; --i) {
    const uint64_t high = i - whole >= 0 ? a.word(i - whole) : 0;
    const uint64_t low = i - whole - 1 >= 0 ? a.word(i - whole - 1) : 0;
    result.word(i) = rest == 0 ? high : high << rest | low >> (64 - rest);
  }
  return result;
}

// A point or direction with components of a fixed width. Sums wrap like those of WideInteger.
template <int kWords>
struct WideVector {
  WideInteger<kWords> x;
  WideInteger<kWords> y;
  WideInteger<kWords> z;

  const WideInteger<kWords>& operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
  WideInteger<kWords>& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }

  friend bool operator==(const WideVector&, const WideVector&) = default;
  friend WideVector operator+(const WideVector& a, const WideVector& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend WideVector operator-(const WideVector& a, const WideVector& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend WideVector operator-(const WideVector& a) { return {-a.x, -a.y, -a.z}; }
};

template <int kA, int kB>
WideInteger<kA + kB> Dot(const WideVector<kA>& a, const WideVector<kB>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <int kA, int kB>
WideVector<kA + kB> Cross(const WideVector<kA>& a, const WideVector<kB>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <int kWords>
bool IsZero(const WideVector<kWords>& a) {
  return a.x.is_zero() && a.y.is_zero() && a.z.is_zero();
}
// Returns a direction perpendicular to d. Requires: d not zero.
template <int kWords>
WideVector<kWords> AnyPerpendicular(const WideVector<kWords>& d) {
  HULLD_CHECK(!IsZero(d));
  if (!d.y.is_zero() || !d.z.is_zero()) return {0, d.z, -d.y};
  return {0, 0, d.x};
}

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_WIDE_INTEGER_H_
