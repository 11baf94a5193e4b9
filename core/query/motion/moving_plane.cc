#include "core/query/motion/moving_plane.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/expansion.h"
#include "core/numeric/exponent_limits.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/placed/plain_vector.h"
#include "core/query/placed/rotation.h"
#include "core/query/terms/pose.h"

namespace hulld {
namespace {

using Quaternion = std::array<double, 4>;

// A hull turns too far in an interval if a Bernstein coefficient of |q(t)|^2 is below this factor
// times the larger |q|^2 at the ends: about 220 degrees if both have the same length. Not tuned.
constexpr double kMinRelativeWeight = 0x1p-4;

double LargestOf(const Quaternion& q) {
  return std::max(std::max(std::abs(q[0]), std::abs(q[1])),
                  std::max(std::abs(q[2]), std::abs(q[3])));
}

double Dot(const Quaternion& p, const Quaternion& q) {
  return (p[0] * q[0] + p[1] * q[1]) + (p[2] * q[2] + p[3] * q[3]);
}

// Returns (1 - t) a + t b, rounded once except for terms of 6 u^2 (|a| + |b|): the sum of four
// doubles that represent it exactly.
double At(double a, double b, double t) {
  const SumWithError difference = TwoSum(b, -a);
  const SumWithError product = TwoProduct(difference.sum, t);
  const SumWithError sum = TwoSum(a, product.sum);
  return sum.sum + (sum.error + (product.error + t * difference.error));
}

Quaternion At(const Quaternion& q0, const Quaternion& q1, double t) {
  return {At(q0[0], q1[0], t), At(q0[1], q1[1], t), At(q0[2], q1[2], t), At(q0[3], q1[3], t)};
}

// Returns the symmetric bilinear form of p and q that is R(q)^T n for p = q (Frame::TurnedBack).
PlainVector TurnedBack(const Quaternion& p, const Quaternion& q, const PlainVector& n) {
  const PlainVector u(p[1], p[2], p[3]);
  const PlainVector v(q[1], q[2], q[3]);
  const double scale = p[0] * q[0] - Dot(u, v);
  return (scale * n + (Dot(v, n) * u + Dot(u, n) * v)) - (p[0] * Cross(v, n) + q[0] * Cross(u, n));
}

// Hulls of at most this many points are scanned for several directions at once. Not tuned.
constexpr size_t kMaxScanned = 16;

// Two doubles in a register.
using Pair = double __attribute__((vector_size(16)));

// Returns the largest n.v over the points for each direction, with the same bits as SupportValue.
std::array<double, 1> ScanAlong(std::span<const Vector> points,
                                const std::array<PlainVector, 1>& n) {
  double largest = -kInfinity;
  for (const Vector& v : points) {
    const double value = (n[0].x * v.x() + n[0].y * v.y()) + n[0].z * v.z();
    largest = value > largest ? value : largest;
  }
  return {largest};
}
template <size_t kCount>
std::array<double, kCount> ScanAlong(std::span<const Vector> points,
                                     const std::array<PlainVector, kCount>& n) {
  constexpr size_t kPairs = (kCount + 1) / 2;
  Pair x[kPairs];
  Pair y[kPairs];
  Pair z[kPairs];
  Pair largest[kPairs];
  for (size_t i = 0; i < kPairs; ++i) {
    const PlainVector& n0 = n[2 * i];
    const PlainVector& n1 = n[std::min(2 * i + 1, kCount - 1)];
    x[i] = Pair{n0.x, n1.x};
    y[i] = Pair{n0.y, n1.y};
    z[i] = Pair{n0.z, n1.z};
    largest[i] = Pair{-kInfinity, -kInfinity};
  }
  for (const Vector& v : points) {
    for (size_t i = 0; i < kPairs; ++i) {
      const Pair value = (x[i] * v.x() + y[i] * v.y()) + z[i] * v.z();
      largest[i] = value > largest[i] ? value : largest[i];
    }
  }
  std::array<double, kCount> result;
  for (size_t i = 0; i < kCount; ++i) result[i] = largest[i / 2][i % 2];
  return result;
}

// Returns the largest n.v over the points of a hull for each direction, within kSupportBlurFactor
// times its largest coordinate times a bound of n.
template <size_t kCount>
std::array<double, kCount> ReachAlong(const QueryHull& hull,
                                      const std::array<PlainVector, kCount>& n) {
  const std::span<const Vector> points = hull.points_together();
  if (!points.empty() && points.size() <= kMaxScanned) return ScanAlong(points, n);
  std::array<double, kCount> reach;
  for (size_t i = 0; i < kCount; ++i) {
    // Too short to matter in kMotionPlaneErrorFactor.
    if (LargestComponent(n[i]) < kDirectionMin) {
      reach[i] = 0;
    } else if (IsFilterSize(hull.max_abs_coordinate())) {
      reach[i] = hull.Farthest(n[i]).value;
    } else {
      reach[i] = -kInfinity;
      for (uint32_t k = 0; k < hull.point_count(); ++k) {
        reach[i] = std::max(reach[i], hulld::Dot(n[i], PlainVector(hull.point(k))));
      }
    }
  }
  return reach;
}

using Quadratic = std::array<double, 3>;
using Quartic = std::array<double, 5>;

// Operations on Bernstein coefficients: the product of two polynomials, and degree elevation from
// linear to quadratic.
Quartic Product(const Quadratic& f, const Quadratic& g) {
  return {f[0] * g[0], (f[0] * g[1] + f[1] * g[0]) / 2,
          (f[0] * g[2] + 4 * (f[1] * g[1]) + f[2] * g[0]) / 6, (f[1] * g[2] + f[2] * g[1]) / 2,
          f[2] * g[2]};
}
Quadratic Elevated(double f0, double f1) { return {f0, (f0 + f1) / 2, f1}; }

}  // namespace

// Bernstein coefficients of a hull in motion over an interval: first the end coefficients, which
// rule out most planes, then the middle ones.
class MovingPlane::Bounds {
 public:
  // Computes the coefficients at the ends.
  Bounds(Side& side, const PlainVector& n0, const PlainVector& n1, double start, double end);
  // Computes the middle coefficients. Requires: usable().
  void AddMiddle();

  // False if the hull rotates too far.
  bool usable() const { return usable_; }
  // The larger of |q|^2 at both ends.
  double weight() const { return weight_; }
  // Returns the maximum reach of the hull along n at the start and at the end.
  std::array<double, 2> Reach() const {
    return {largest_[0] * inverse_weights_[0], largest_[4] * inverse_weights_[4]};
  }
  // Returns the maximum coefficient of `largest_` minus the offsets at both ends, divided by the
  // weights.
  double HeightOver(double offset, double end_offset) const {
    const Quartic offsets = Product(norms_, Elevated(offset, end_offset));
    double height = -kInfinity;
    for (int i = 0; i < 5; ++i)
      height = std::max(height, (largest_[i] - offsets[i]) * inverse_weights_[i]);
    return height;
  }
  // Returns the error bound of `largest_` minus offsets. `sizes`: sum of the magnitudes of the
  // terms of the offsets.
  double ErrorWith(double sizes) const {
    return error_ + kMotionPlaneErrorFactor * weight_ * sizes;
  }
  // Returns true if all coefficients are below those of the offsets.
  bool IsBelow(double offset, double end_offset, double sizes) const {
    const Quartic offsets = Product(norms_, Elevated(offset, end_offset));
    const double all = ErrorWith(sizes);
    bool below = true;
    for (int i = 0; i < 5; ++i) below = below && largest_[i] + all < offsets[i];
    return below;
  }

 private:
  const Side& side_;
  const Frame& start_;
  const Frame& end_;
  const PlainVector n0_;
  const PlainVector n1_;
  const bool turns_;
  // Coefficients of |q|^2, of degree 2 and 4.
  Quadratic norms_;
  Quartic weights_;
  // Their inverses, rounded.
  Quartic inverse_weights_;
  double weight_ = 0;
  // Coefficients of |q|^2 n.x.
  Quartic moved_;
  // Maximum of each coefficient of |q|^2 n.p over all vertices.
  Quartic largest_;
  // Error bound of `largest_`, without that of the offsets.
  double error_ = 0;
  bool usable_ = false;
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
  if (exponent != 0) {
    for (int i = 0; i < 4; ++i) {
      side.q0[i] = std::ldexp(start.q[i], -exponent);
      side.q1[i] = std::ldexp(end.q[i], -exponent);
    }
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

const MovingPlane::Frame& MovingPlane::FrameAt(Side& side, double time, const Frame* kept) {
  if (side.at_rest) time = 0;
  for (const Frame& frame : side.frames) {
    if (frame.time == time) return frame;
  }
  const auto take = [&]() -> Frame& { return side.frames[side.oldest++ % side.frames.size()]; };
  Frame* const taken = &take();
  Frame& frame = taken == kept ? take() : *taken;
  frame.time = time;
  frame.q = side.at_rest ? side.q0 : At(side.q0, side.q1, time);
  frame.SetRotation();
  frame.usable = LargestOf(frame.q) >= kInterpolationMinRemainder;
  frame.x = side.x0;
  if (side.at_rest) return frame;
  frame.x.x = At(side.x0.x(), side.x1.x(), time);
  frame.x.y = At(side.x0.y(), side.x1.y(), time);
  frame.x.z = At(side.x0.z(), side.x1.z(), time);
  return frame;
}

Pose MovingPlane::PoseAt(Side& side, double time) {
  const Frame& frame = FrameAt(side, time);
  return {frame.q, frame.x};
}

// R(q)^T n errs by less than the bilinear form of q and q: its terms sum to at most sqrt(3) |q|^2
// |n| per component instead of 6 |q|^2 |n|, with fewer roundings (kMotionPlaneErrorFactor).
void MovingPlane::Frame::SetRotation() {
  const auto [qw, qx, qy, qz] = q;
  const double ww = qw * qw;
  const double xx = qx * qx;
  const double yy = qy * qy;
  const double zz = qz * qz;
  squared_norm = (ww + xx) + (yy + zz);
  columns = {PlainVector((ww + xx) - (yy + zz), 2 * (qx * qy + qw * qz), 2 * (qx * qz - qw * qy)),
             PlainVector(2 * (qx * qy - qw * qz), (ww + yy) - (xx + zz), 2 * (qy * qz + qw * qx)),
             PlainVector(2 * (qx * qz + qw * qy), 2 * (qy * qz - qw * qx), (ww + zz) - (xx + yy))};
}

PlainVector MovingPlane::Frame::TurnedBack(const PlainVector& n) const {
  return {hulld::Dot(columns[0], n), hulld::Dot(columns[1], n), hulld::Dot(columns[2], n)};
}

template <size_t kCount>
std::array<double, kCount> MovingPlane::HullReach(const Side& side,
                                                  std::array<PlainVector, kCount> turned) {
  if (!side.piece) return ReachAlong(*side.hull, turned);
  std::array<double, kCount> moved;
  for (size_t i = 0; i < kCount; ++i) {
    moved[i] = hulld::Dot(turned[i], PlainVector(side.piece->p_BH));
    turned[i] = TransposedProduct(side.piece->R_BH, turned[i]);
  }
  std::array<double, kCount> reach = ReachAlong(*side.hull, turned);
  for (size_t i = 0; i < kCount; ++i) reach[i] += moved[i];
  return reach;
}

double MovingPlane::TurnedReach(Side& side, const Frame& frame, const PlainVector& n) {
  for (const Reach& known : side.reaches) {
    if (known.n.x == n.x && known.time == frame.time && known.n.y == n.y && known.n.z == n.z) {
      return known.value;
    }
  }
  Reach& reach = side.reaches[side.oldest_reach++ % side.reaches.size()];
  reach = {frame.time, n, HullReach<1>(side, {frame.TurnedBack(n)})[0]};
  return reach.value;
}

double MovingPlane::ReachAt(Side& side, const PlainVector& n, double time) {
  const Frame& frame = FrameAt(side, time);
  return TurnedReach(side, frame, n) / frame.squared_norm + hulld::Dot(n, frame.x);
}

double MovingPlane::GapAt(const Vector& n, double time) {
  const PlainVector n_A = n;
  return (-ReachAt(b_, -n_A, time) - b_.radius) - (ReachAt(a_, n_A, time) + a_.radius);
}

MovingPlane::Bounds::Bounds(Side& side, const PlainVector& n0, const PlainVector& n1, double start,
                            double end)
    : side_(side),
      start_(FrameAt(side, start)),
      end_(FrameAt(side, end, &start_)),
      n0_(n0),
      n1_(n1),
      turns_(n0.x != n1.x || n0.y != n1.y || n0.z != n1.z) {
  if (!(side.size <= kMotionMaxSize && start_.usable && end_.usable)) return;
  const bool is_fixed = start_.time == end_.time;
  const double middle = is_fixed ? start_.squared_norm : Dot(start_.q, end_.q);
  norms_ = {start_.squared_norm, middle, end_.squared_norm};
  weight_ = std::max(norms_[0], norms_[2]);
  if (is_fixed) {
    weights_.fill(weight_);
    inverse_weights_.fill(1 / weight_);
  } else {
    weights_ = Product(norms_, {1, 1, 1});
    for (int i = 0; i < 5; ++i) {
      if (weights_[i] < kMinRelativeWeight * weight_) return;
      inverse_weights_[i] = 1 / weights_[i];
    }
  }
  usable_ = true;
  moved_ = Product(
      norms_, {hulld::Dot(n0, start_.x), (hulld::Dot(n0, end_.x) + hulld::Dot(n1, start_.x)) / 2,
               hulld::Dot(n1, end_.x)});
  const double factor = side.piece ? kPiecePlaneErrorFactor : kMotionPlaneErrorFactor;
  const double largest = std::max(LargestComponent(n0), LargestComponent(n1));
  error_ = factor * weight_ * largest * std::max(side.size, kMotionMinSize);
  largest_[0] = TurnedReach(side, start_, n0) + moved_[0];
  if (turns_ || !is_fixed) {
    largest_[4] = TurnedReach(side, end_, n1) + moved_[4];
  } else {
    largest_.fill(largest_[0]);
  }
}

void MovingPlane::Bounds::AddMiddle() {
  if (start_.time == end_.time) {
    // Each vertex has a linear polynomial. The error of a mean of two values is below that of a
    // mean of six directions, which kMotionPlaneErrorFactor includes.
    for (int i = 1; i < 4; ++i) largest_[i] = 0.25 * ((4 - i) * largest_[0] + i * largest_[4]);
    return;
  }
  const Quaternion& q0 = start_.q;
  const Quaternion& q1 = end_.q;
  // Coefficients of R(q)^T n of degree 2 for constant n, then of degree 4.
  const PlainVector first = start_.TurnedBack(n0_);
  const PlainVector middle = TurnedBack(q0, q1, n0_);
  const PlainVector last = end_.TurnedBack(n0_);
  const PlainVector first_1 = turns_ ? start_.TurnedBack(n1_) : first;
  const PlainVector middle_1 = turns_ ? TurnedBack(q0, q1, n1_) : middle;
  const PlainVector last_1 = turns_ ? end_.TurnedBack(n1_) : last;
  const std::array<double, 3> reach =
      HullReach<3>(side_, {0.25 * (first + first_1) + 0.5 * middle,
                           1.0 / 6 * (first_1 + 2 * (middle + middle_1) + last),
                           0.5 * middle_1 + 0.25 * (last + last_1)});
  for (int i = 0; i < 3; ++i) largest_[i + 1] = reach[i] + moved_[i + 1];
}

bool MovingPlane::IsUsableAt(double time) {
  const auto is_usable = [=](Side& side) {
    return side.size <= kMotionMaxSize &&
           LargestOf(FrameAt(side, time).q) >= 2 * kInterpolationMinRemainder;
  };
  return size_ >= kMotionMinSize && is_usable(a_) && is_usable(b_);
}

MovingPlane::Result MovingPlane::Try(const Vector& n0, const Vector& n1, double start, double end,
                                     double margin) {
  HULLD_DCHECK(0 <= start && start <= end && end <= 1);
  Result result;
  const PlainVector from = n0;
  const PlainVector to = n1;
  Bounds a(a_, from, to, start, end);
  Bounds b(b_, -from, -to, start, end);
  if (!a.usable() || !b.usable()) return result;
  const std::array<double, 2> of_a = a.Reach();
  std::array<double, 2> of_b = b.Reach();
  of_b = {-of_b[0], -of_b[1]};
  const double gap = (of_b[0] - b_.radius) - (of_a[0] + a_.radius);
  result.end_gap = (of_b[1] - b_.radius) - (of_a[1] + a_.radius);
  if (const double least = std::min(gap, result.end_gap); least <= 2 * margin) {
    result.gap = least;
    return result;
  }
  a.AddMiddle();
  b.AddMiddle();
  // The offset stays in the middle, or moves with A or with B.
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
  result.gap -= a.ErrorWith(sizes) / a.weight() + b.ErrorWith(sizes) / b.weight();
  return result;
}

}  // namespace hulld
