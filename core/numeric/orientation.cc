#include "core/numeric/orientation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>

#include "core/numeric/error_bounds.h"
#include "core/numeric/expansion.h"
#include "core/numeric/integer.h"

namespace hulld {
namespace {

thread_local OrientationCounts counts;

// The sign of `value` when it exceeds its error bound; not NaN or infinity, whose comparisons fail.
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
  if (!(permanent < 0x1p1000)) return std::nullopt;
  // A sum of absolute values stands for the largest: it is cheaper than nine comparisons.
  const double size = std::abs(r.x()) + std::abs(r.y()) + std::abs(r.z()) + std::abs(s.x()) +
                      std::abs(s.y()) + std::abs(s.z()) + std::abs(t.x()) + std::abs(t.y()) +
                      std::abs(t.z());
  return CertainSign(det, kOrient3dErrorFactor * permanent + (size + 1) * kUnderflowError);
}

bool InExpansionRange(std::initializer_list<double> coordinates) {
  return std::all_of(coordinates.begin(), coordinates.end(), [](double x) {
    const double magnitude = std::abs(x);
    return magnitude <= kExpansionMax && (magnitude == 0 || magnitude >= kExpansionMin);
  });
}

bool InExpansionRange(const Vector& v) { return InExpansionRange({v.x(), v.y(), v.z()}); }

using FourPoints = std::array<Vector, 4>;

// The points times the power of two that brings their largest coordinate next below kExpansionMax,
// which changes no sign; empty where some other coordinate stays below kExpansionMin, so that the
// product might be rounded. Requires a coordinate that is not zero.
std::optional<FourPoints> ScaledToExpansionRange(const FourPoints& points) {
  double largest = 0;
  for (const Vector& p : points) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  const int exponent = std::ilogb(kExpansionMax) - 1 - std::ilogb(largest);
  // Two factors, as one may exceed the range of doubles.
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
  constexpr int kAboveAll = 1024;
  int exponent = kAboveAll;
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
  int exponent = 1024;
  for (const Vector* p : {&a, &b, &c}) exponent = LowestBitExponent(*p, exponent);
  const IntegerVector origin = ToInteger(a, exponent);
  const IntegerVector r = ToInteger(b, exponent) - origin;
  const IntegerVector s = ToInteger(c, exponent) - origin;
  return Sign(r[i] * s[j] - r[j] * s[i]);
}

}  // namespace

int Orient3d(const Vector& a, const Vector& b, const Vector& c, const Vector& d) {
  if (const std::optional<int> sign = FilteredOrient3d(b - a, c - a, d - a)) {
    ++counts.filter;
    return *sign;
  }
  // Duplicates ask for the corners of triangles themselves.
  if (d == a || d == b || d == c) {
    ++counts.filter;
    return 0;
  }
  if (InExpansionRange(a) && InExpansionRange(b) && InExpansionRange(c) && InExpansionRange(d)) {
    ++counts.expansion;
    return ExpansionOrient3d(a, b, c, d);
  }
  if (const std::optional<FourPoints> scaled = ScaledToExpansionRange({a, b, c, d})) {
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
