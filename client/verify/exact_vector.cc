#include "client/verify/exact_vector.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "client/base/check.h"

namespace hulld {
namespace {

// mantissa (53 bits) * 2^exponent.
struct Parts {
  int64_t mantissa;
  int exponent;
};

// Reads the bits, because arithmetic takes subnormal numbers for zero in a program that was linked
// with -ffast-math.
Parts Split(double number) {
  constexpr int kFractionBits = 52;
  constexpr int kLeastExponent = -1074;
  const auto bits = std::bit_cast<uint64_t>(number);
  const auto biased = static_cast<int>(bits >> kFractionBits & 0x7FF);
  const int64_t leading = biased > 0 ? int64_t{1} << kFractionBits : 0;
  int64_t mantissa = leading | static_cast<int64_t>(bits & ((uint64_t{1} << kFractionBits) - 1));
  if (std::signbit(number)) mantissa = -mantissa;
  int exponent = kLeastExponent + std::max(biased - 1, 0);
  while (mantissa != 0 && mantissa % 2 == 0) {
    mantissa /= 2;
    ++exponent;
  }
  return {mantissa, exponent};
}

// Returns true if all are at least 0, and not all are 0.
bool AreWeights(std::span<const BigInteger> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](const auto& x) { return x >= 0; }) &&
         std::any_of(numbers.begin(), numbers.end(), [](const auto& x) { return x > 0; });
}

bool IsBetween(const BigVector& a, const BigVector& b) {
  return IsZero(Cross(a, b)) && Dot(a, b) <= 0;
}

// 0 = (b x c) a + (c x a) b + (a x b) c in the plane of the three, measured along its normal. A
// triangle without area is left to its sides.
bool IsInTriangle(const BigVector& a, const BigVector& b, const BigVector& c) {
  const BigVector bc = Cross(b, c);
  const BigVector ca = Cross(c, a);
  const BigVector ab = Cross(a, b);
  const BigVector normal = bc + ca + ab;
  if (IsZero(normal) || Dot(normal, a) != 0) return false;
  const BigInteger weights[] = {Dot(bc, normal), Dot(ca, normal), Dot(ab, normal)};
  return AreWeights(weights);
}

// Squared distances of 0 from points of a convex hull, as fractions, compared with r^2.
class Ball {
 public:
  Ball(const BigInteger& r_squared, bool nearer) : r_squared_(r_squared), nearer_(nearer) {}

  bool Contains(const BigInteger& numerator, const BigInteger& denominator) const {
    const BigInteger limit = r_squared_ * denominator;
    return nearer_ ? numerator < limit : numerator <= limit;
  }
  // The point of an edge nearest to 0, if it is inside the edge.
  bool MeetsEdge(const BigVector& a, const BigVector& b) const {
    const BigVector e = b - a;
    const BigVector moment = Cross(a, b);
    return Dot(a, e) < 0 && Dot(b, e) > 0 && Contains(Dot(moment, moment), Dot(e, e));
  }
  // The point of a triangle nearest to 0, if it is in the triangle; not for one without area.
  bool MeetsTriangle(const BigVector& a, const BigVector& b, const BigVector& c) const {
    const BigVector normal = Cross(b - a, c - a);
    const BigInteger height = Dot(normal, a);
    return !IsZero(normal) && Dot(normal, Cross(a, b)) >= 0 && Dot(normal, Cross(b, c)) >= 0 &&
           Dot(normal, Cross(c, a)) >= 0 && Contains(height * height, Dot(normal, normal));
  }

 private:
  const BigInteger& r_squared_;
  const bool nearer_;
};

}  // namespace

void CommonExponent::Include(double number) {
  HULLD_CLIENT_CHECK(std::isfinite(number));
  const Parts parts = Split(number);
  if (parts.mantissa != 0) exponent_ = std::min(exponent_, parts.exponent);
}

BigInteger CommonExponent::ToInteger(double number) const {
  const Parts parts = Split(number);
  if (parts.mantissa == 0) return 0;
  HULLD_CLIENT_CHECK(parts.exponent >= exponent_);
  return BigInteger(parts.mantissa) << (parts.exponent - exponent_);
}

// By Caratheodory 1907: the points with 0 in their hull lie in the plane that bounds the half
// space, so three of them suffice.
bool ContainsOriginOnBoundary(std::span<const BigVector> points) {
  const size_t n = points.size();
  for (size_t i = 0; i < n; ++i) {
    if (IsZero(points[i])) return true;
    for (size_t j = i + 1; j < n; ++j) {
      if (IsBetween(points[i], points[j])) return true;
      for (size_t k = j + 1; k < n; ++k) {
        if (IsInTriangle(points[i], points[j], points[k])) return true;
      }
    }
  }
  return false;
}

// 0 is inside unless all points lie on one side of, or in, a plane through 0. The normals of such
// planes form a cone. It is pointed if the points span space, and then has an edge that is
// perpendicular to two of the points. So the cross products of two points suffice as candidates.
bool ContainsOriginInside(std::span<const BigVector> points) {
  bool spans_space = false;
  for (size_t i = 0; i < points.size(); ++i) {
    for (size_t j = i + 1; j < points.size(); ++j) {
      const BigVector normal = Cross(points[i], points[j]);
      if (IsZero(normal)) continue;
      bool above = false;
      bool below = false;
      for (const BigVector& point : points) {
        const BigInteger height = Dot(normal, point);
        above |= height > 0;
        below |= height < 0;
      }
      if (!above || !below) return false;
      spans_space = true;
    }
  }
  return spans_space;
}

// The point nearest to 0 is a vertex, or inside an edge or a triangle, or it is 0 itself.
bool ComesWithin(std::span<const BigVector> points, const BigInteger& r_squared, bool nearer) {
  const Ball ball(r_squared, nearer);
  const size_t n = points.size();
  for (size_t i = 0; i < n; ++i) {
    if (ball.Contains(Dot(points[i], points[i]), 1)) return true;
    for (size_t j = i + 1; j < n; ++j) {
      if (ball.MeetsEdge(points[i], points[j])) return true;
      for (size_t k = j + 1; k < n; ++k) {
        if (ball.MeetsTriangle(points[i], points[j], points[k])) return true;
      }
    }
  }
  return ContainsOriginInside(points);
}

}  // namespace hulld
