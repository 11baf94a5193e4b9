#include "client/robot/joint_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hulld {
namespace {

// Derivation of the bounds (proven).
//
// The origin of a frame is c = sum of R_k d_k over the offsets d_k on its path from the root, where
// R_k is the product of the rotations before d_k. Each rotation turns at a rate of at most w_i:
// |R_i'| <= w_i and |R_i''| <= w_i^2 in operator norm, and its unit quaternion g_i has
// |g_i'| <= w_i / 2 and |g_i''| <= w_i^2 / 4. Equality holds for a fixed axis and a constant rate.
// By the product rule, with W = sum of w_i, the product R and its quaternion q satisfy
//   |R'| <= W,  |R''| <= W^2,  |q''| <= W^2 / 4,
// and, as d is linear in time, (R d)'' = R'' d + 2 R' d' gives
//   |c''| <= sum of W_k^2 |d_k| + 2 W_k |d_k'|.
//
// A function f differs from its linear interpolation over a span h by at most h^2 / 8 max |f''|
// (Davis, Interpolation and Approximation, 1963, theorem 3.1.1, applied in the direction of the
// error). This bounds the error of the translation by h^2 / 8 |c''|, and the distance of q from the
// interpolated quaternion r by h^2 / 8 W^2 / 4. The rotations of a unit quaternion q and of any
// quaternion r differ by twice the angle between q and r. Its sine is at most |q - r|, so the
// images of a point at a distance `reach` are at most 2 reach |q - r| apart. Together:
//   deviation <= h^2 / 8 (|c''| + reach W^2 / 2).
//
// Adaptive subdivision by bounds of the path length: Schwarzer, Saha, Latombe, Adaptive dynamic
// collision checking for single and multiple articulated robots, 2005.

// Unit roundoff.
constexpr double kUnit = std::numeric_limits<double>::epsilon() / 2;
// Covers the rounding of the bounds themselves, sums and products of fewer than 2^20 nonnegative
// terms, and products of rounding errors.
constexpr double kRoundedUp = 1 + 0x1p-20;

// Rounding errors (proven), in units of roundoff. A component of a product of quaternions is a sum
// of four products: an error of 4 |a| |b| (Cauchy-Schwarz), and 8 for four components.
constexpr double kQuaternionProduct = 9;
// RotationAbout: errors of 2 of sine and cosine, 2 of the length, and 1 of each other operation.
constexpr double kAxisQuaternion = 8;
constexpr double kNormalization = 4;
// Compose turns an offset p by p + (2 / |q|^2) (w v x p + v x (v x p)): errors of 3.5 |v| |p| of
// the inner product and 10.75 |q|^2 |p| of the sum, hence 21.5 |p|, 12 |p| for the factor and its
// product, and 1 |p| for the sum.
constexpr double kTurnedOffset = 40;
constexpr double kInterpolation = 3;

double LengthOf(const double* xyz) { return std::hypot(xyz[0], xyz[1], xyz[2]); }

// Adds an offset in the frame: at most `length` long, moving at most at `speed`, with a rounding
// error.
void AddOffset(double length, double speed, double rounding, MotionBound* bound) {
  bound->bend += bound->turn * (bound->turn * length + 2 * speed);
  bound->speed += bound->turn * length + speed;
  bound->distance += length;
  bound->rounding += 2 * bound->quaternion_rounding * length + kTurnedOffset * kUnit * length +
                     rounding + kUnit * bound->distance;
}

void AddRotation(double rate, double rounding, MotionBound* bound) {
  bound->turn += rate;
  bound->quaternion_rounding += rounding + kQuaternionProduct * kUnit;
}

// Adds a rotation about a fixed axis from one angle to another.
void AddTurn(double from, double to, MotionBound* bound) {
  // The quaternion contains half of the angle.
  const double angle_rounding = kInterpolation / 2 * kUnit * std::max(std::abs(from), std::abs(to));
  AddRotation(std::abs(to - from), angle_rounding + kAxisQuaternion * kUnit, bound);
}

// Adds an offset that moves from one position to another, each `factor` times the given length.
void AddTravel(const double* from, const double* to, double factor, double steps,
               MotionBound* bound) {
  const double delta[] = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
  const double length = factor * std::max(LengthOf(from), LengthOf(to));
  // The maximum of each component may come from a different end.
  AddOffset(length, factor * LengthOf(delta), 2 * steps * kUnit * length, bound);
}

// Adds a rotation by a quaternion that moves on a line from q0 to q1, with q0.q1 >= 0. Its length
// is then at least m = |q0| |q1| / sqrt(|q0|^2 + |q1|^2). It turns in a plane, at the angle
// atan((t - s) v / d) for the speed v = |q1 - q0|, with d >= 0 the distance of its line from 0. In
// terms of v / m, the unit quaternion has |g'| <= 1 and |g''| <= 1.16, and the rotation |R'| <= 2
// and |R''| <= 4, so w = 2.2 v / m bounds all four.
void AddQuaternion(const JointValue& from, const JointValue& to, MotionBound* bound) {
  const auto length = [](double w, double x, double y, double z) {
    return std::hypot(std::hypot(w, x), std::hypot(y, z));
  };
  const double length_from = length(from[0], from[1], from[2], from[3]);
  const double length_to = length(to[0], to[1], to[2], to[3]);
  const double speed = length(to[0] - from[0], to[1] - from[1], to[2] - from[2], to[3] - from[3]);
  const double least = length_from * (length_to / std::hypot(length_from, length_to));
  AddRotation(2.2 * speed / least, kInterpolation * kUnit * (length_from + length_to) / least,
              bound);
}

void AddJoint(const RobotJoint& joint, const JointValue& from, const JointValue& to,
              MotionBound* bound) {
  switch (joint.kind) {
    case JointKind::kRevolute:
    case JointKind::kContinuous:
      AddTurn(from[0], to[0], bound);
      break;
    case JointKind::kPrismatic: {
      const double ends[2][3] = {{from[0], 0, 0}, {to[0], 0, 0}};
      AddTravel(ends[0], ends[1], LengthOf(joint.axis.data()), kInterpolation + 1, bound);
      AddRotation(0, 0, bound);
      break;
    }
    case JointKind::kPlanar: {
      const double ends[2][3] = {{from[0], from[1], 0}, {to[0], to[1], 0}};
      // Rotated into the plane.
      AddTravel(ends[0], ends[1], 1, kInterpolation + kTurnedOffset, bound);
      AddTurn(from[2], to[2], bound);
      break;
    }
    case JointKind::kFloating:
      AddTravel(&from[4], &to[4], 1, kInterpolation, bound);
      AddQuaternion(from, to, bound);
      break;
    case JointKind::kFixed:
      break;
  }
}

}  // namespace

double MotionBound::Travel(double duration, double reach) const {
  return kRoundedUp * duration * (speed + turn * reach) + std::numeric_limits<double>::min();
}

double MotionBound::Deviation(double duration, double reach) const {
  const double curved = duration * duration / 8 * (bend + reach * turn * turn / 2);
  const double rounded = rounding + 2 * reach * (quaternion_rounding + kNormalization * kUnit);
  // The smallest normal double covers underflow.
  return kRoundedUp * (curved + rounded) + std::numeric_limits<double>::min();
}

MotionBound BoundFixedFrame(const MotionBound& link, const RigidPose& X_LS) {
  MotionBound bound = link;
  AddOffset(LengthOf(&X_LS[4]), 0, 0, &bound);
  AddRotation(0, 0, &bound);
  return bound;
}

std::vector<MotionBound> BoundMotions(const Robot& robot, const RigidPose& X_WB,
                                      std::span<const JointValue> from,
                                      std::span<const JointValue> to) {
  MotionBound base;
  base.distance = LengthOf(&X_WB[4]);
  std::vector<MotionBound> bounds(robot.links.size(), base);
  for (size_t i = 0; i < robot.links.size(); ++i) {
    const int parent_joint = robot.links[i].parent_joint;
    if (parent_joint < 0) continue;
    const auto j = static_cast<size_t>(parent_joint);
    const RobotJoint& joint = robot.joints[j];
    bounds[i] = BoundFixedFrame(bounds[static_cast<size_t>(joint.parent)], joint.X_PJ);
    AddJoint(joint, from[j], to[j], &bounds[i]);
  }
  return bounds;
}

void AlignTurns(const Robot& robot, std::span<const JointValue> from, std::span<JointValue> to) {
  for (size_t j = 0; j < to.size(); ++j) {
    if (robot.joints[j].kind != JointKind::kFloating) continue;
    const JointValue& p = from[j];
    JointValue& q = to[j];
    if (p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3] >= 0) continue;
    for (size_t i = 0; i < 4; ++i) q[i] = -q[i];
  }
}

std::vector<JointValue> JointValuesAt(std::span<const JointValue> from,
                                      std::span<const JointValue> to, double t) {
  std::vector<JointValue> values(from.begin(), from.end());
  for (size_t j = 0; j < values.size(); ++j) {
    for (size_t i = 0; i < values[j].size(); ++i) {
      values[j][i] = (1 - t) * from[j][i] + t * to[j][i];
    }
  }
  return values;
}

}  // namespace hulld
