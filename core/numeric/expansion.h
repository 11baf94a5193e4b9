#ifndef HULLD_CORE_NUMERIC_EXPANSION_H_
#define HULLD_CORE_NUMERIC_EXPANSION_H_

#include <array>
#include <cmath>
#include <cstddef>

#include "core/base/check.h"

namespace hulld {

// Expansions: real numbers as unevaluated sums of non-overlapping doubles, smallest first, zeros
// omitted. Sums and products of expansions are exact unless a component overflows or underflows;
// the caller checks the exponent range beforehand (kExpansionMin, kExpansionMax). No allocation.
// Source: Shewchuk 1997, Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
// Predicates; Dekker 1971 for the product; Knuth for the sum.

// a + b = sum + error, exactly.
struct SumWithError {
  double sum;
  double error;
};

inline SumWithError TwoSum(double a, double b) {
  const double sum = a + b;
  const double b_virtual = sum - a;
  const double a_virtual = sum - b_virtual;
  return {sum, (a - a_virtual) + (b - b_virtual)};
}

// TwoSum for ordered arguments. Requires: |a| >= |b| or a == 0.
inline SumWithError FastTwoSum(double a, double b) {
  HULLD_DCHECK(std::abs(a) >= std::abs(b) || a == 0);
  const double sum = a + b;
  return {sum, b - (sum - a)};
}

// a * b = sum + error, exactly. Splits by multiplication, because the baseline has no FMA
// instruction.
inline SumWithError TwoProduct(double a, double b) {
  constexpr double kSplitter = 0x1p27 + 1;
  const double product = a * b;
  const double a_big = kSplitter * a;
  const double a_high = a_big - (a_big - a);
  const double a_low = a - a_high;
  const double b_big = kSplitter * b;
  const double b_high = b_big - (b_big - b);
  const double b_low = b - b_high;
  const double error =
      a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low);
  return {product, error};
}

// An expansion of at most N components.
template <size_t N>
class Expansion {
 public:
  Expansion() = default;
  // Returns the exact difference a - b.
  static Expansion DifferenceOf(double a, double b) requires(N == 2) {
    Expansion result;
    const SumWithError difference = TwoSum(a, -b);
    result.Append(difference.error);
    result.Append(difference.sum);
    return result;
  }

  size_t size() const { return size_; }
  double operator[](size_t i) const { return components_[i]; }
  // Returns the sign, which is that of the largest component.
  int sign() const {
    if (size_ == 0) return 0;
    return components_[size_ - 1] > 0 ? 1 : -1;
  }

  void Append(double component) {
    HULLD_DCHECK(component == 0 || size_ < N);
    if (component != 0) components_[size_++] = component;
  }

  Expansion operator-() const {
    Expansion result = *this;
    for (size_t i = 0; i < size_; ++i) result.components_[i] = -result.components_[i];
    return result;
  }

 private:
  std::array<double, N> components_;
  size_t size_ = 0;
};

// Returns the exact sum: merges by magnitude, then renormalizes in one pass.
template <size_t N, size_t M>
Expansion<N + M> operator+(const Expansion<N>& e, const Expansion<M>& f) {
  Expansion<N + M> result;
  size_t i = 0;
  size_t j = 0;
  const auto next = [&] {
    if (j == f.size() || (i < e.size() && std::abs(e[i]) < std::abs(f[j]))) return e[i++];
    return f[j++];
  };
  const size_t total = e.size() + f.size();
  if (total == 0) return result;
  double rest = next();
  for (size_t k = 1; k < total; ++k) {
    const SumWithError s = TwoSum(rest, next());
    result.Append(s.error);
    rest = s.sum;
  }
  result.Append(rest);
  return result;
}

template <size_t N, size_t M>
Expansion<N + M> operator-(const Expansion<N>& e, const Expansion<M>& f) {
  return e + (-f);
}

// Returns the exact product with one double.
template <size_t N>
Expansion<2 * N> Scale(const Expansion<N>& e, double factor) {
  Expansion<2 * N> result;
  if (e.size() == 0 || factor == 0) return result;
  SumWithError product = TwoProduct(e[0], factor);
  result.Append(product.error);
  double rest = product.sum;
  for (size_t i = 1; i < e.size(); ++i) {
    product = TwoProduct(e[i], factor);
    const SumWithError low = TwoSum(rest, product.error);
    result.Append(low.error);
    const SumWithError high = FastTwoSum(product.sum, low.sum);
    result.Append(high.error);
    rest = high.sum;
  }
  result.Append(rest);
  return result;
}

// Returns the exact product with the exact difference of two doubles.
template <size_t N>
Expansion<4 * N> operator*(const Expansion<N>& e, const Expansion<2>& f) {
  Expansion<4 * N> result;
  if (f.size() == 0) return result;
  if (f.size() == 1) {
    const Expansion<2 * N> only = Scale(e, f[0]);
    for (size_t i = 0; i < only.size(); ++i) result.Append(only[i]);
    return result;
  }
  return Scale(e, f[0]) + Scale(e, f[1]);
}

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_EXPANSION_H_
