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

using Quadratic = std::array<double, 3>;
using Quartic = std::array<double, 5>;

// Polynomials by their Bernstein coefficients: a product, and a linear polynomial as a quadratic.
Quartic Product(const Quadratic& f, const Quadratic& g) {
  return {f[0] * g[0], (f[0] * g[1] + f[1] * g[0]) / 2,
          (f[0] * g[2] + 4 * (f[1] * g[1]) + f[2] * g[0]) / 6, (f[1] * g[2] + f[2] * g[1]) / 2,
          f[2] * g[2]};
}
Quadratic Elevated(double f0, double f1) { return {f0, (f0 + f1) / 2, f1}; }

// Returns the coefficients of R(q)^T n for q from q0 to q1, and n from n0 to n1.
std::array<PlainVector, 5> TurnedBack(const Quaternion& q0, const Quaternion& q1,
                                      const PlainVector& n0, const PlainVector& n1, bool turns) {
  const PlainVector first = TurnedBack(q0, q0, n0);
  const PlainVector middle = TurnedBack(q0, q1, n0);
  const PlainVector last = TurnedBack(q1, q1, n0);
  const PlainVector first_1 = turns ? TurnedBack(q0, q0, n1) : first;
  const PlainVector middle_1 = turns ? TurnedBack(q0, q1, n1) : middle;
  const PlainVector last_1 = turns ? TurnedBack(q1, q1, n1) : last;
  return {first, 0.25 * (first + first_1) + 0.5 * middle,
          1.0 / 6 * (first_1 + 2 * (middle + middle_1) + last),
          0.5 * middle_1 + 0.25 * (last + last_1), last_1};
}

}  // namespace

// Bernstein coefficients of a hull in motion over an interval.
struct MovingPlane::Bounds {
  // Coefficients of |q|^2, of degree 2 and 4.
  Quadratic norms;
  Quartic weights;
  // Their inverses, rounded.
  Quartic inverse_weights;
  // The larger of |q|^2 at both ends.
  double weight = 0;
  // For each coefficient of |q|^2 n.p, its largest value over all vertices.
  Quartic most;
  // Error bound of `most`; the offset adds to it.
  double error = 0;
  // False if the hull turns too far.
  bool usable = false;

  // Returns `most` over the weights for offsets at both ends, less these.
  double HeightOver(double offset, double end_offset) const {
    const Quartic offsets = Product(norms, Elevated(offset, end_offset));
    double height = -kInfinity;
    for (int i = 0; i < 5; ++i)
      height = std::max(height, (most[i] - offsets[i]) * inverse_weights[i]);
    return height;
  }
  // Returns the error bound of `most` with offsets. `sizes`: lengths that the offsets are sums of.
  double ErrorWith(double sizes) const { return error + kMotionPlaneErrorFactor * weight * sizes; }
  // Returns true if all coefficients are below those of the offsets.
  bool IsBelow(double offset, double end_offset, double sizes) const {
    const Quartic offsets = Product(norms, Elevated(offset, end_offset));
    const double all = ErrorWith(sizes);
    bool below = true;
    for (int i = 0; i < 5; ++i) below = below && most[i] + all < offsets[i];
    return below;
  }
};

MovingPlane::MovingPlane(const MovingHull& a, const MovingHull& b)
    : a_(SideOf(a)), b_(SideOf(b)), size_((a_.size + a_.radius) + (b_.size + b_.radius)) {}

MovingPlane::Side MovingPlane::SideOf(const MovingHull& moving) {
  HULLD_DCHECK(!moving.hull.empty());
  const Pose& start = moving.X_WB.start;
  const Pose& end = moving.X_WB.end;
  const Pose& X_BH = moving.X_BH;
  Side side{&moving.hull, std::nullopt, start.q, end.q, start.t, end.t, 0, 0, false};
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
  side.at_rest = start.q == end.q && start.t == end.t;
  return side;
}

MovingPlane::Bounds MovingPlane::BoundsOf(const Side& side, const Vector& n_start,
                                          const Vector& n_end, double start, double end) {
  Bounds bounds;
  if (!(side.size <= kMotionMaxSize)) return bounds;
  const Quaternion p = side.at_rest ? side.q0 : At(side.q0, side.q1, start);
  const Quaternion q = side.at_rest ? side.q0 : At(side.q0, side.q1, end);
  if (std::min(LargestOf(p), LargestOf(q)) < kInterpolationLeastRemainder) return bounds;
  bounds.norms = {Dot(p, p), Dot(p, q), Dot(q, q)};
  bounds.weights = Product(bounds.norms, {1, 1, 1});
  bounds.weight = std::max(bounds.norms[0], bounds.norms[2]);
  for (const double w : bounds.weights) {
    if (w < kLeastRelativeWeight * bounds.weight) return bounds;
  }
  bounds.usable = true;

  const PlainVector n0 = n_start;
  const PlainVector n1 = n_end;
  const bool turns = n_start != n_end;
  std::array<PlainVector, 5> turned = TurnedBack(p, q, n0, n1, turns);
  const auto position = [&](double t) {
    PlainVector x;
    x.x = Interpolated(side.x0.x(), side.x1.x(), t).high;
    x.y = Interpolated(side.x0.y(), side.x1.y(), t).high;
    x.z = Interpolated(side.x0.z(), side.x1.z(), t).high;
    return x;
  };
  const PlainVector x0 = side.at_rest ? PlainVector(side.x0) : position(start);
  const PlainVector x1 = side.at_rest ? x0 : position(end);
  Quartic moved = Product(
      bounds.norms,
      {hulld::Dot(n0, x0), (hulld::Dot(n0, x1) + hulld::Dot(n1, x0)) / 2, hulld::Dot(n1, x1)});
  const bool is_constant = (side.at_rest || start == end) && !turns;
  const int count = is_constant ? 1 : 5;
  for (int i = 0; i < count; ++i) {
    if (side.piece) {
      moved[i] += hulld::Dot(turned[i], PlainVector(side.piece->p_BH));
      turned[i] = TransposedProduct(side.piece->R_BH, turned[i]);
    }
    bounds.most[i] = ReachAlong(*side.hull, turned[i]) + moved[i];
  }
  if (is_constant) {
    bounds.weights.fill(bounds.norms[0]);
    bounds.most.fill(bounds.most[0]);
    bounds.inverse_weights.fill(1 / bounds.norms[0]);
  } else {
    for (int i = 0; i < 5; ++i) bounds.inverse_weights[i] = 1 / bounds.weights[i];
  }
  const double factor = side.piece ? kPiecePlaneErrorFactor : kMotionPlaneErrorFactor;
  const double largest = std::max(LargestComponent(n0), LargestComponent(n1));
  bounds.error = factor * bounds.weight * largest * std::max(side.size, kMotionMinSize);
  return bounds;
}

bool MovingPlane::IsUsableAt(double time) const {
  const auto is_usable = [=](const Side& side) {
    return side.size <= kMotionMaxSize &&
           LargestOf(At(side.q0, side.q1, time)) >= 2 * kInterpolationLeastRemainder;
  };
  return size_ >= kMotionMinSize && is_usable(a_) && is_usable(b_);
}

MovingPlane::Result MovingPlane::Try(const Vector& n0, const Vector& n1, double start, double end,
                                     double margin) const {
  HULLD_DCHECK(0 <= start && start <= end && end <= 1);
  Result result;
  const Bounds a = BoundsOf(a_, n0, n1, start, end);
  const Bounds b = BoundsOf(b_, -n0, -n1, start, end);
  if (!a.usable || !b.usable) return result;
  const std::array<double, 2> of_a = {a.most[0] / a.weights[0], a.most[4] / a.weights[4]};
  const std::array<double, 2> of_b = {-b.most[0] / b.weights[0], -b.most[4] / b.weights[4]};
  result.end_gap = (of_b[1] - b_.radius) - (of_a[1] + a_.radius);
  // The offset stays in the middle, or keeps pace with A or with B.
  for (const double share : {0.5, 0.0, 1.0}) {
    const double offset = (1 - share) * of_a[0] + share * of_b[0];
    const double end_offset = (1 - share) * of_a[1] + share * of_b[1];
    const double low = a.HeightOver(offset, end_offset) + a_.radius;
    const double high = -b.HeightOver(-offset, -end_offset) - b_.radius;
    if (!(high - low > result.gap)) continue;
    const double shift = low / 2 + high / 2;
    result.gap = high - low;
    result.offset = offset + shift;
    result.end_offset = end_offset + shift;
    if (result.gap > 2 * margin) break;
  }
  const double margin_a = a_.radius + margin;
  const double margin_b = b_.radius + margin;
  const double sizes = std::max(std::abs(result.offset), std::abs(result.end_offset)) +
                       std::abs(margin) + (a_.radius + b_.radius);
  result.proven = a.IsBelow(result.offset - margin_a, result.end_offset - margin_a, sizes) &&
                  b.IsBelow(-result.offset - margin_b, -result.end_offset - margin_b, sizes);
  result.gap -= a.ErrorWith(sizes) / a.weight + b.ErrorWith(sizes) / b.weight;
  return result;
}

}  // namespace hulld
