#include "core/numeric/orientation.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <optional>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/expansion.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/integer.h"
#include "core/numeric/wide_integer.h"

namespace hulld {
namespace {

thread_local OrientationCounts counts;

// Returns the sign of `value` if it exceeds its error bound. NaN and infinity fail the comparisons.
std::optional<int> CertainSign(double value, double bound) {
  if (value > bound) return 1;
  if (value < -bound) return -1;
  return std::nullopt;
}

std::optional<int> FilteredOrient3d(const Vector& r, const Vector& s, const Vector& t) {
  const double s_yt_z = s.y() * t.z();
  const double s_zt_y = s.z() * t.y();
  const double t_yr_z = t.y() * r.z();
  const double t_zr_y = t.z() * r.y();
  const double r_ys_z = r.y() * s.z();
  const double r_zs_y = r.z() * s.y();
  const double det =
      r.x() * (s_yt_z - s_zt_y) + s.x() * (t_yr_z - t_zr_y) + t.x() * (r_ys_z - r_zs_y);
  const double permanent = (std::abs(s_yt_z) + std::abs(s_zt_y)) * std::abs(r.x()) +
                           (std::abs(t_yr_z) + std::abs(t_zr_y)) * std::abs(s.x()) +
                           (std::abs(r_ys_z) + std::abs(r_zs_y)) * std::abs(t.x());
  if (!(permanent < kPermanentMax)) return std::nullopt;
  // The sum of the absolute values bounds the largest, and is cheaper than nine comparisons.
  const double size = std::abs(r.x()) + std::abs(r.y()) + std::abs(r.z()) + std::abs(s.x()) +
                      std::abs(s.y()) + std::abs(s.z()) + std::abs(t.x()) + std::abs(t.y()) +
                      std::abs(t.z());
  return CertainSign(det, kOrient3dErrorFactor * permanent + (size + 1) * kUnderflowError);
}

using FourPoints = std::array<Vector, 4>;

double LargestCoordinate(const FourPoints& points) {
  double largest = 0;
  for (const Vector& p : points) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  return largest;
}

// Returns 2^exponent. Requires: the result is a normal double.
double PowerOfTwo(int exponent) {
  HULLD_DCHECK(exponent > -1023 && exponent < 1024);
  return std::bit_cast<double>(static_cast<uint64_t>(1023 + exponent) << 52);
}

// Returns the exponent of a non-negative double; -1023 for zero and subnormals.
int ExponentOf(double x) { return static_cast<int>(std::bit_cast<uint64_t>(x) >> 52) - 1023; }

// Returns the difference times the power of two that brings its largest component into [1/2, 1); a
// subnormal one stays below. Rounded only if a component underflows.
Vector ToUnitSize(const Vector& difference) {
  const int exponent = -1 - ExponentOf(LargestComponent(difference));
  // Two factors, because one may exceed the range of doubles.
  const double first = PowerOfTwo(exponent / 2);
  const double second = PowerOfTwo(exponent - exponent / 2);
  return difference * first * second;
}

// The filter with another point as the origin, and each difference scaled separately.
//
// The bound grows in proportion to the three differences. If some of the points lie close together,
// differences from one of these are small, and so is the bound, while the determinant is the same.
// Scales change no sign, so nothing overflows and little is lost to underflow. Tried only if it is
// likely to decide more than the first filter. Requires: no difference overflows.
std::optional<int> FilteredFromNearest(const FourPoints& points) {
  // The sum of the exponents of the three differences from each point.
  std::array<int, 4> sizes{};
  for (size_t i = 0; i < 4; ++i) {
    for (size_t j = i + 1; j < 4; ++j) {
      const double size = LargestComponent(points[j] - points[i]);
      HULLD_DCHECK(size <= kLargestDouble);
      const int exponent = ExponentOf(size);
      sizes[i] += exponent;
      sizes[j] += exponent;
    }
  }
  constexpr int kMinGain = 4;
  constexpr int kLargestInRange = 900;
  const auto nearest =
      static_cast<size_t>(std::min_element(sizes.begin(), sizes.end()) - sizes.begin());
  const bool was_in_range = std::abs(sizes[0]) <= kLargestInRange;
  if (was_in_range && sizes[nearest] > sizes[0] - kMinGain) return std::nullopt;
  // Moving the origin to the front reverses the orientation if its index is odd.
  const Vector& origin = points[nearest];
  std::array<Vector, 3> differences;
  for (size_t k = 0; k < 3; ++k) {
    differences[k] = ToUnitSize(points[(nearest + 1 + k) % 4] - origin);
  }
  const std::optional<int> sign = FilteredOrient3d(differences[0], differences[1], differences[2]);
  if (!sign) return sign;
  return nearest % 2 == 0 ? *sign : -*sign;
}

// Four points as integers below 2^60 in magnitude, scaled alike.
struct FixedPoints {
  std::array<std::array<int64_t, 3>, 4> points;
};

// Returns the factors of a power of two that brings `largest` to [2^59, 2^60); two factors, because
// one may exceed the range of doubles.
std::array<double, 2> FixedPointScale(double largest) {
  const int exponent = 59 - ExponentOf(largest);
  return {PowerOfTwo(exponent / 2), PowerOfTwo(exponent - exponent / 2)};
}

// Returns the points if all coordinates are integers on the scale of the largest, as is usual for a
// lattice, a CAD model, or a scan. Otherwise empty.
std::optional<FixedPoints> ToFixedPoints(const FourPoints& points, double largest) {
  const std::array<double, 2> scale = FixedPointScale(largest);
  FixedPoints fixed;
  bool is_exact = true;
  for (size_t i = 0; i < 4; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double x = points[i][k];
      // Scaling rounds only results below one, and zero is the only integer among these.
      const double scaled = x * scale[0] * scale[1];
      const auto integer = static_cast<int64_t>(scaled);
      is_exact &= static_cast<double>(integer) == scaled && (integer == 0) == (x == 0);
      fixed.points[i][k] = integer;
    }
  }
  return is_exact ? std::optional(fixed) : std::nullopt;
}

// Differences are below 2^61, minors below 2^123; the sum of their products is accumulated in two
// halves, the lower one below 3 * 2^125.
int FixedPointOrient3d(const FixedPoints& fixed) {
  const auto& [a, b, c, d] = fixed.points;
  Int128 low = 0;
  Int128 high = 0;
  for (int k = 0; k < 3; ++k) {
    const int i = k == 2 ? 0 : k + 1;
    const int j = k == 0 ? 2 : k - 1;
    const Int128 minor = static_cast<Int128>(c[i] - a[i]) * (d[j] - a[j]) -
                         static_cast<Int128>(c[j] - a[j]) * (d[i] - a[i]);
    const int64_t r = b[k] - a[k];
    low += static_cast<Int128>(r) * static_cast<uint64_t>(minor);
    high += static_cast<Int128>(r) * static_cast<int64_t>(minor >> 64);
  }
  high += low >> 64;
  if (high != 0) return high > 0 ? 1 : -1;
  return static_cast<uint64_t>(low) != 0 ? 1 : 0;
}

bool InExpansionRange(std::initializer_list<double> coordinates) {
  return std::all_of(coordinates.begin(), coordinates.end(), [](double x) {
    const double magnitude = std::abs(x);
    return magnitude <= kExpansionMax && (magnitude == 0 || magnitude >= kExpansionMin);
  });
}

bool InExpansionRange(const Vector& v) { return InExpansionRange({v.x(), v.y(), v.z()}); }

// Returns the points times the power of two that brings their largest coordinate just below
// kExpansionMax, which changes no sign. Empty if another coordinate remains below kExpansionMin, so
// that the product might be rounded. Requires: a largest coordinate that is not zero.
std::optional<FourPoints> ScaledToExpansionRange(const FourPoints& points, double largest) {
  HULLD_CHECK(largest > 0);
  const int exponent = std::ilogb(kExpansionMax) - 1 - std::ilogb(largest);
  // Two factors, because one may exceed the range of doubles.
  const double first = std::ldexp(1.0, exponent / 2);
  const double second = std::ldexp(1.0, exponent - exponent / 2);
  FourPoints scaled;
  for (size_t i = 0; i < 4; ++i) {
    for (int k = 0; k < 3; ++k) {
      scaled[i][k] = points[i][k] * first * second;
      const bool is_exact = points[i][k] == 0 || std::abs(scaled[i][k]) >= kExpansionMin;
      if (!is_exact) return std::nullopt;
    }
  }
  return scaled;
}

using Difference = Expansion<2>;

Expansion<16> Minor(const Difference& a, const Difference& b, const Difference& c,
                    const Difference& d) {
  return a * d - b * c;
}

int ExpansionOrient3d(const Vector& a, const Vector& b, const Vector& c, const Vector& d) {
  Difference r[3];
  Difference s[3];
  Difference t[3];
  for (int i = 0; i < 3; ++i) {
    r[i] = Difference::DifferenceOf(b[i], a[i]);
    s[i] = Difference::DifferenceOf(c[i], a[i]);
    t[i] = Difference::DifferenceOf(d[i], a[i]);
  }
  return (Minor(s[1], s[2], t[1], t[2]) * r[0] + Minor(t[1], t[2], r[1], r[2]) * s[0] +
          Minor(r[1], r[2], s[1], s[2]) * t[0])
      .sign();
}

int IntegerOrient3d(const Vector& a, const Vector& b, const Vector& c, const Vector& d) {
  int exponent = kAboveAllExponents;
  for (const Vector* p : {&a, &b, &c, &d}) exponent = LowestBitExponent(*p, exponent);
  const IntegerVector origin = ToInteger(a, exponent);
  const IntegerVector r = ToInteger(b, exponent) - origin;
  const IntegerVector s = ToInteger(c, exponent) - origin;
  const IntegerVector t = ToInteger(d, exponent) - origin;
  return Sign(Dot(r, Cross(s, t)));
}

int ExactOrient2d(const Vector& a, const Vector& b, const Vector& c, CoordinatePlane plane) {
  const int i = plane.first;
  const int j = plane.second;
  if (InExpansionRange({a[i], a[j], b[i], b[j], c[i], c[j]})) {
    ++counts.expansion;
    return Minor(Difference::DifferenceOf(b[i], a[i]), Difference::DifferenceOf(b[j], a[j]),
                 Difference::DifferenceOf(c[i], a[i]), Difference::DifferenceOf(c[j], a[j]))
        .sign();
  }
  ++counts.integer;
  int exponent = kAboveAllExponents;
  for (const Vector* p : {&a, &b, &c}) exponent = LowestBitExponent(*p, exponent);
  const IntegerVector origin = ToInteger(a, exponent);
  const IntegerVector r = ToInteger(b, exponent) - origin;
  const IntegerVector s = ToInteger(c, exponent) - origin;
  return Sign(r[i] * s[j] - r[j] * s[i]);
}

}  // namespace

int Orient3d(const Vector& a, const Vector& b, const Vector& c, const Vector& d) {
  // Points in a plane perpendicular to an axis, as on many facets of CAD models. Usually costs one
  // comparison per axis.
  for (int k = 0; k < 3; ++k) {
    if (a[k] == b[k] && a[k] == c[k] && a[k] == d[k]) {
      ++counts.filter;
      return 0;
    }
  }
  if (const std::optional<int> sign = FilteredOrient3d(b - a, c - a, d - a)) {
    ++counts.filter;
    return *sign;
  }
  // Duplicate points lead to queries with corners and edges of the triangles themselves.
  if (d == a || d == b || d == c || c == a || c == b) {
    ++counts.filter;
    return 0;
  }
  const FourPoints points = {a, b, c, d};
  const double largest = LargestCoordinate(points);
  if (largest > kLargestDifferenceable) {
    if (const std::optional<FourPoints> scaled = ScaledToExpansionRange(points, largest)) {
      return Orient3d((*scaled)[0], (*scaled)[1], (*scaled)[2], (*scaled)[3]);
    }
  } else if (const std::optional<int> sign = FilteredFromNearest(points)) {
    ++counts.nearest_filter;
    return *sign;
  }
  if (const std::optional<FixedPoints> fixed = ToFixedPoints(points, largest)) {
    ++counts.fixed_point;
    return FixedPointOrient3d(*fixed);
  }
  if (InExpansionRange(a) && InExpansionRange(b) && InExpansionRange(c) && InExpansionRange(d)) {
    ++counts.expansion;
    return ExpansionOrient3d(a, b, c, d);
  }
  if (const std::optional<FourPoints> scaled = ScaledToExpansionRange(points, largest)) {
    return Orient3d((*scaled)[0], (*scaled)[1], (*scaled)[2], (*scaled)[3]);
  }
  ++counts.integer;
  return IntegerOrient3d(a, b, c, d);
}

int Orient2d(const Vector& a, const Vector& b, const Vector& c, CoordinatePlane plane) {
  const int i = plane.first;
  const int j = plane.second;
  const double left = (b[i] - a[i]) * (c[j] - a[j]);
  const double right = (b[j] - a[j]) * (c[i] - a[i]);
  const double bound = kOrient2dErrorFactor * (std::abs(left) + std::abs(right)) + kUnderflowError;
  if (const std::optional<int> sign = CertainSign(left - right, bound)) {
    ++counts.filter;
    return *sign;
  }
  return ExactOrient2d(a, b, c, plane);
}

CoordinatePlane ProjectionOf(const Vector& a, const Vector& b, const Vector& c) {
  for (const CoordinatePlane plane : {CoordinatePlane{0, 1}, {1, 2}, {2, 0}}) {
    if (Orient2d(a, b, c, plane) != 0) return plane;
  }
  return {-1, -1};
}

OrientationCounts ThreadOrientationCounts() { return counts; }

}  // namespace hulld
