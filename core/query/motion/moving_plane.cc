#include "core/query/motion/moving_plane.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "core/base/check.h"
#include "core/numeric/double_double.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/placed/plain_vector.h"
#include "core/query/placed/rotation.h"
#include "core/query/terms/pose.h"

namespace hulld {
namespace {

using Quaternion = std::array<double, 4>;

// A hull turns too far in an interval if a Bernstein coefficient of |q(t)|^2 is below this times
// the largest of |q|^2 at the ends: about 220 degrees, if both have one length. A choice.
constexpr double kLeastRelativeWeight = 0x1p-4;

double LargestOf(const Quaternion& q) {
  return std::max(std::max(std::abs(q[0]), std::abs(q[1])),
                  std::max(std::abs(q[2]), std::abs(q[3])));
}

double Dot(const Quaternion& p, const Quaternion& q) {
  return (p[0] * q[0] + p[1] * q[1]) + (p[2] * q[2] + p[3] * q[3]);
}

Quaternion At(const Quaternion& q0, const Quaternion& q1, double t) {
  Quaternion q;
  for (int i = 0; i < 4; ++i) q[i] = Interpolated(q0[i], q1[i], t).high;
  return q;
}

// Returns the symmetric bilinear form of p and q that is R(q)^T n for p = q.
PlainVector TurnedBack(const Quaternion& p, const Quaternion& q, const PlainVector& n) {
  const PlainVector u(p[1], p[2], p[3]);
  const PlainVector v(q[1], q[2], q[3]);
  const double scale = p[0] * q[0] - Dot(u, v);
  return (scale * n + (Dot(v, n) * u + Dot(u, n) * v)) - (p[0] * Cross(v, n) + q[0] * Cross(u, n));
}

// Returns the largest n.v over the points of a hull, within kSupportBlurFactor times its largest
// coordinate times a bound of n.
double ReachAlong(const QueryHull& hull, const PlainVector& n) {
  // Too short to matter in kMotionPlaneErrorFactor.
  if (LargestComponent(n) < kDirectionMin) return 0;
  if (IsFilterSize(hull.max_abs_coordinate())) return hull.Farthest(n).value;
  double reach = -kInfinity;
  for (uint32_t i = 0; i < hull.point_count(); ++i) {
    reach = std::max(reach, hulld::Dot(n, PlainVector(hull.point(i))));
  }
  return reach;
}

using Cubic = std::array<double, 4>;

// Returns the Bernstein coefficients of a quadratic times a linear polynomial.
Cubic Product(const std::array<double, 3>& f, double g0, double g1) {
  return {f[0] * g0, (f[0] * g1 + 2 * f[1] * g0) / 3, (2 * f[1] * g1 + f[2] * g0) / 3, f[2] * g1};
}

}  // namespace

// Bernstein coefficients of a hull in motion over an interval.
struct MovingPlane::Bounds {
  // Coefficients of |q|^2.
  Cubic weights;
  // The larger of |q|^2 at both ends.
  double weight = 0;
  // For each coefficient of |q|^2 n.p, its largest and its least value over all vertices.
  Cubic most;
  Cubic least;
  // Error bound of `most` and `least`; the offset adds to it.
  double error = 0;
  // False if the hull turns too far.
  bool usable = false;
};

MovingPlane::MovingPlane(const MovingHull& a, const MovingHull& b)
    : a_(SideOf(a)), b_(SideOf(b)), size_((a_.size + a_.radius) + (b_.size + b_.radius)) {}

MovingPlane::Side MovingPlane::SideOf(const MovingHull& moving) {
  HULLD_DCHECK(!moving.hull.empty());
  const Pose& start = moving.X_WB.start;
  const Pose& end = moving.X_WB.end;
  const Pose& X_BH = moving.X_BH;
  Side side{&moving.hull, std::nullopt, start.q, end.q, start.t, end.t, 0, 0};
  if (!IsIdentity(X_BH)) side.piece = {PlacedHull(moving.hull, X_BH).R_WH(), X_BH.t};
  int exponent = 0;
  std::frexp(std::max(LargestOf(start.q), LargestOf(end.q)), &exponent);
  for (int i = 0; i < 4; ++i) {
    side.q0[i] = std::ldexp(start.q[i], -exponent);
    side.q1[i] = std::ldexp(end.q[i], -exponent);
  }
  side.size = (moving.hull.max_abs_coordinate() + X_BH.t.cwiseAbs().maxCoeff()) +
              std::max(start.t.cwiseAbs().maxCoeff(), end.t.cwiseAbs().maxCoeff());
  side.radius = moving.radius * kUnitLengthRoundUp;
  if (moving.piece_radius > 0) {
    side.radius = std::nextafter(side.radius + moving.piece_radius * kUnitLengthRoundUp, kInfinity);
  }
  return side;
}

MovingPlane::Bounds MovingPlane::BoundsOf(const Side& side, const Vector& n, double start,
                                          double end) {
  Bounds bounds;
  if (!(side.size <= kMotionMaxSize)) return bounds;
  const Quaternion p = At(side.q0, side.q1, start);
  const Quaternion q = At(side.q0, side.q1, end);
  if (std::min(LargestOf(p), LargestOf(q)) < kInterpolationLeastRemainder) return bounds;
  const std::array<double, 3> norms = {Dot(p, p), Dot(p, q), Dot(q, q)};
  bounds.weights = Product(norms, 1, 1);
  bounds.weight = std::max(norms[0], norms[2]);
  for (const double w : bounds.weights) {
    if (w < kLeastRelativeWeight * bounds.weight) return bounds;
  }
  bounds.usable = true;

  const PlainVector first = TurnedBack(p, p, n);
  const PlainVector middle = TurnedBack(p, q, n);
  const PlainVector last = TurnedBack(q, q, n);
  PlainVector turned[4] = {first, 1.0 / 3 * (first + 2 * middle), 1.0 / 3 * (2 * middle + last),
                           last};
  const auto along = [&](double t) {
    PlainVector x;
    x.x = Interpolated(side.x0.x(), side.x1.x(), t).high;
    x.y = Interpolated(side.x0.y(), side.x1.y(), t).high;
    x.z = Interpolated(side.x0.z(), side.x1.z(), t).high;
    return hulld::Dot(PlainVector(n), x);
  };
  Cubic moved = Product(norms, along(start), along(end));
  if (side.piece) {
    for (int i = 0; i < 4; ++i) {
      moved[i] += hulld::Dot(turned[i], PlainVector(side.piece->p_BH));
      turned[i] = TransposedProduct(side.piece->R_BH, turned[i]);
    }
  }
  for (int i = 0; i < 4; ++i) {
    bounds.most[i] = ReachAlong(*side.hull, turned[i]) + moved[i];
    bounds.least[i] = moved[i] - ReachAlong(*side.hull, -turned[i]);
  }
  const double factor = side.piece ? kPiecePlaneErrorFactor : kMotionPlaneErrorFactor;
  bounds.error = factor * bounds.weight * LargestComponent(n) * std::max(side.size, kMotionMinSize);
  return bounds;
}

MovingPlane::Result MovingPlane::Try(const Vector& n, double start, double end,
                                     double margin) const {
  HULLD_DCHECK(0 <= start && start <= end && end <= 1);
  Result result{false, 0, -kInfinity};
  const Bounds a = BoundsOf(a_, n, start, end);
  const Bounds b = BoundsOf(b_, n, start, end);
  if (!a.usable || !b.usable) return result;
  double low = -kInfinity;
  double high = kInfinity;
  for (int i = 0; i < 4; ++i) {
    low = std::max(low, a.most[i] / a.weights[i]);
    high = std::min(high, b.least[i] / b.weights[i]);
  }
  low += a_.radius;
  high -= b_.radius;
  result.offset = low / 2 + high / 2;
  result.gap = high - low;
  const double margin_a = a_.radius + margin;
  const double margin_b = b_.radius + margin;
  const double sizes = std::abs(result.offset) + std::abs(margin) + (a_.radius + b_.radius);
  const double error_a = a.error + kMotionPlaneErrorFactor * a.weight * sizes;
  const double error_b = b.error + kMotionPlaneErrorFactor * b.weight * sizes;
  result.proven = true;
  for (int i = 0; i < 4; ++i) {
    result.proven = result.proven &&
                    a.most[i] + error_a < (result.offset - margin_a) * a.weights[i] &&
                    b.least[i] - error_b > (result.offset + margin_b) * b.weights[i];
  }
  return result;
}

}  // namespace hulld
