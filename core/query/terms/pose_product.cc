#include "core/query/terms/pose_product.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/check.h"
#include "core/numeric/double_double.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/integer.h"
#include "core/numeric/rational.h"

namespace hulld {
namespace {

using Quaternion = std::array<double, 4>;
using LongQuaternion = std::array<DoubleDouble, 4>;

// Products of components: exact, or in double-double arithmetic.
DoubleDouble Times(double x, double y) { return ExactProduct(x, y); }
DoubleDouble Times(const DoubleDouble& x, double y) { return x * DoubleDouble{y, 0}; }
DoubleDouble Times(const DoubleDouble& x, const DoubleDouble& y) { return x * y; }

// Returns true if the rotation angle is zero.
bool IsScalar(const Quaternion& q) { return q[1] == 0 && q[2] == 0 && q[3] == 0; }

// Scales q, without changing the rotation, so that its largest component is in [1/2, 1). Omits
// components too small to matter (kProductMinComponent).
Quaternion Scaled(const Quaternion& q) {
  double largest = 0;
  for (const double component : q) largest = std::max(largest, std::abs(component));
  int exponent = 0;
  std::frexp(largest, &exponent);
  Quaternion scaled;
  for (int i = 0; i < 4; ++i) {
    const double component = std::ldexp(q[i], -exponent);
    scaled[i] = std::abs(component) < kProductMinComponent ? 0 : component;
  }
  return scaled;
}

// Returns true if the largest component is in [1/2, 1).
bool IsScaled(const Quaternion& q) {
  double largest = 0;
  for (const double component : q) largest = std::max(largest, std::abs(component));
  return largest >= 0.5 && largest < 1;
}

// Returns Hamilton's product, with each component rounded once except for terms of the size of u^2.
// Requires: q scaled, p scaled or interpolated.
template <typename Number>
Quaternion Product(const std::array<Number, 4>& p, const Quaternion& q) {
  HULLD_DCHECK(IsScaled(q));
  const auto sum = [](DoubleDouble a, DoubleDouble b, DoubleDouble c, DoubleDouble d) {
    return ((a + b) + (c + d)).high;
  };
  const auto times = [&](int i, int j) { return Times(p[i], q[j]); };
  return {sum(times(0, 0), -times(1, 1), -times(2, 2), -times(3, 3)),
          sum(times(0, 1), times(1, 0), times(2, 3), -times(3, 2)),
          sum(times(0, 2), -times(1, 3), times(2, 0), times(3, 1)),
          sum(times(0, 3), times(1, 2), -times(2, 1), times(3, 0))};
}

// Returns R(q) v / |q|^2. Requires: q scaled or interpolated.
template <typename Number>
std::array<DoubleDouble, 3> Rotated(const std::array<Number, 4>& q, const Vector& v) {
  const auto times = [&](int i, int j) { return Times(q[i], q[j]); };
  const auto twice = [](const DoubleDouble& x) { return DoubleDouble{2 * x.high, 2 * x.low}; };
  const DoubleDouble ww = times(0, 0), xx = times(1, 1), yy = times(2, 2), zz = times(3, 3);
  const DoubleDouble wx = times(0, 1), wy = times(0, 2), wz = times(0, 3);
  const DoubleDouble xy = times(1, 2), xz = times(1, 3), yz = times(2, 3);
  const DoubleDouble norm = (ww + xx) + (yy + zz);
  const DoubleDouble rows[3][3] = {{(ww + xx) - (yy + zz), twice(xy - wz), twice(xz + wy)},
                                   {twice(xy + wz), (ww + yy) - (xx + zz), twice(yz - wx)},
                                   {twice(xz - wy), twice(yz + wx), (ww + zz) - (xx + yy)}};
  const auto component = [&](int i) {
    return DoubleDouble{std::abs(v[i]) < kProductUnderflow / 4 ? 0 : v[i], 0};
  };
  std::array<DoubleDouble, 3> result;
  for (int i = 0; i < 3; ++i) {
    result[i] = ((rows[i][0] / norm) * component(0) + (rows[i][1] / norm) * component(1)) +
                (rows[i][2] / norm) * component(2);
  }
  return result;
}

double LargestOf(const LongQuaternion& q) {
  double largest = 0;
  for (const DoubleDouble& component : q) largest = std::max(largest, std::abs(component.high));
  return largest;
}

// Returns the quaternion of a motion at a time, scaled so that its largest component is in [1, 2),
// and cut off below 2^-106.
LongQuaternion CutAt(const Motion& motion, double time) {
  constexpr int kBits = 106;
  const std::array<Integer, 4> q = QuaternionAt(motion, time);
  int largest = 0;
  for (const Integer& component : q) {
    if (component != 0) largest = std::max(largest, static_cast<int>(msb(abs(component))));
  }
  LongQuaternion cut;
  for (int i = 0; i < 4; ++i) {
    const Integer bits =
        largest > kBits ? Integer(q[i] >> (largest - kBits)) : Integer(q[i] << (kBits - largest));
    const double high = RoundToNearest(bits, 1, -kBits).value;
    cut[i] = {high, RoundToNearest(bits - ToInteger(high, -kBits), 1, -kBits).value};
  }
  return cut;
}

// Returns the quaternion of a motion at a time, scaled by a positive number. Components are below 2
// and err by at most 18 u^2; the largest is at least kInterpolationMinRemainder.
LongQuaternion InterpolatedAt(const Motion& motion, double time) {
  const Quaternion& q0 = motion.start.q;
  const Quaternion& q1 = motion.end.q;
  double largest = 0;
  for (int i = 0; i < 4; ++i) largest = std::max({largest, std::abs(q0[i]), std::abs(q1[i])});
  int exponent = 0;
  std::frexp(largest, &exponent);
  LongQuaternion q;
  const auto scaled = [=](double x) { return exponent == 0 ? x : std::ldexp(x, -exponent); };
  for (int i = 0; i < 4; ++i) q[i] = Interpolated(scaled(q0[i]), scaled(q1[i]), time);
  if (LargestOf(q) < kInterpolationMinRemainder) q = CutAt(motion, time);
  return q;
}

}  // namespace

PoseProduct::PoseProduct(const Motion& motion, double time, const Pose& X_BP)
    : motion_(&motion), time_(time), X_BP_(X_BP) {
  HULLD_DCHECK(ValidateMotion(motion).ok() && time >= 0 && time <= 1 && IsValidPose(X_BP));
  const LongQuaternion q = InterpolatedAt(motion, time);
  X_WB_.q = {q[0].high, q[1].high, q[2].high, q[3].high};
  rounded_.q = IsScalar(X_BP.q) ? X_WB_.q : Product(q, Scaled(X_BP.q));

  const Vector& x0 = motion.start.t;
  const Vector& x1 = motion.end.t;
  const double reach = X_BP.t.cwiseAbs().maxCoeff();
  const double size = (x0.cwiseAbs().maxCoeff() + x1.cwiseAbs().maxCoeff()) + reach;
  if (!(size <= kProductMaxTranslation)) {
    // Any value in range will do: only exact arithmetic uses this pose.
    X_WB_.t = (x0 / 2 + x1 / 2).cwiseMin(kLargestDouble).cwiseMax(-kLargestDouble);
    rounded_.t = X_WB_.t;
    translation_error_ = std::numeric_limits<double>::infinity();
    return;
  }
  for (int i = 0; i < 3; ++i) {
    const DoubleDouble x = Interpolated(x0[i], x1[i], time);
    X_WB_.t[i] = rounded_.t[i] = x.high;
    translation_rest_[i] = x.low;
  }
  translation_error_ = kProductTranslationError * size + kProductUnderflow;
  if (reach == 0) return;
  const std::array<DoubleDouble, 3> turned = Rotated(q, X_BP.t);
  for (int i = 0; i < 3; ++i) {
    const DoubleDouble sum = turned[i] + DoubleDouble{rounded_.t[i], translation_rest_[i]};
    rounded_.t[i] = sum.high;
    translation_rest_[i] = sum.low;
  }
  translation_error_ += kProductTurnError / LargestOf(q) * reach;
}

PoseProduct::PoseProduct(const Pose& X_WB, const Pose& X_BP) : X_WB_(X_WB), X_BP_(X_BP) {
  HULLD_DCHECK(IsValidPose(X_WB) && IsValidPose(X_BP));
  const Vector& t_B = X_WB.t;
  const Vector& t_P = X_BP.t;
  const bool turns_nothing = IsScalar(X_WB.q);
  if (turns_nothing || IsScalar(X_BP.q)) {
    rounded_.q = turns_nothing ? X_BP.q : X_WB.q;
  } else {
    rounded_.q = Product(Scaled(X_WB.q), Scaled(X_BP.q));
  }

  const double size = t_B.cwiseAbs().maxCoeff() + t_P.cwiseAbs().maxCoeff();
  if (!(size <= kProductMaxTranslation)) {
    // Any value in range will do: only exact arithmetic uses this pose.
    rounded_.t = (t_B / 4 + t_P / 4).cwiseMin(kLargestDouble).cwiseMax(-kLargestDouble);
    translation_error_ = std::numeric_limits<double>::infinity();
    return;
  }
  if (t_P.isZero(0)) {
    rounded_.t = t_B;
    return;
  }
  if (turns_nothing) {
    for (int i = 0; i < 3; ++i) {
      const SumWithError sum = TwoSum(t_B[i], t_P[i]);
      rounded_.t[i] = sum.sum;
      translation_rest_[i] = sum.error;
    }
    return;
  }
  const std::array<DoubleDouble, 3> turned = Rotated(Scaled(X_WB.q), t_P);
  for (int i = 0; i < 3; ++i) {
    const DoubleDouble sum = turned[i] + DoubleDouble{t_B[i], 0};
    rounded_.t[i] = sum.high;
    translation_rest_[i] = sum.low;
  }
  translation_error_ = kProductTranslationError * size + kProductUnderflow;
}

}  // namespace hulld
