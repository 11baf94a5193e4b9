#include "client/pose/rigid_pose.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "client/pose/vector3.h"

namespace hulld {
namespace {

using Vector = std::array<double, 3>;

// p rotated by the quaternion w + v, of any length: p + 2 (w v x p + v x (v x p)) / |q|^2.
Vector Turn(double w, const Vector& v, const Vector& p) {
  if (v[0] == 0 && v[1] == 0 && v[2] == 0) return p;
  const double scale = 2 / (w * w + v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  const Vector t = Cross(v, p);
  const Vector u = Cross(v, t);
  return {p[0] + scale * (w * t[0] + u[0]), p[1] + scale * (w * t[1] + u[1]),
          p[2] + scale * (w * t[2] + u[2])};
}

}  // namespace

RigidPose RotationAbout(const Vector& axis, double angle) {
  const double length = std::hypot(axis[0], axis[1], axis[2]);
  if (length == 0) return kNoMotion;
  const double s = std::sin(angle / 2) / length;
  return {std::cos(angle / 2), s * axis[0], s * axis[1], s * axis[2], 0, 0, 0};
}

RigidPose RotationOf(const Vector& roll_pitch_yaw) {
  const RigidPose roll = RotationAbout({1, 0, 0}, roll_pitch_yaw[0]);
  const RigidPose pitch = RotationAbout({0, 1, 0}, roll_pitch_yaw[1]);
  const RigidPose yaw = RotationAbout({0, 0, 1}, roll_pitch_yaw[2]);
  return Compose(yaw, Compose(pitch, roll));
}

RigidPose OnShorterPath(const RigidPose& start, RigidPose end) {
  // Makes the largest component 1, so that products do not overflow.
  const auto largest = [](const RigidPose& pose) {
    return std::max({std::abs(pose[0]), std::abs(pose[1]), std::abs(pose[2]), std::abs(pose[3])});
  };
  double cosine = 0;
  for (size_t i = 0; i < 4; ++i) cosine += start[i] / largest(start) * (end[i] / largest(end));
  if (cosine < 0) std::transform(end.begin(), end.begin() + 4, end.begin(), std::negate<>());
  return end;
}

RigidPose Compose(const RigidPose& X_AB, const RigidPose& X_BC) {
  const double w = X_AB[0];
  const Vector v = {X_AB[1], X_AB[2], X_AB[3]};
  const double a = X_BC[0];
  const Vector b = {X_BC[1], X_BC[2], X_BC[3]};
  const Vector vb = Cross(v, b);
  const Vector p = Turn(w, v, {X_BC[4], X_BC[5], X_BC[6]});
  return {w * a - (v[0] * b[0] + v[1] * b[1] + v[2] * b[2]),
          w * b[0] + a * v[0] + vb[0],
          w * b[1] + a * v[1] + vb[1],
          w * b[2] + a * v[2] + vb[2],
          X_AB[4] + p[0],
          X_AB[5] + p[1],
          X_AB[6] + p[2]};
}

}  // namespace hulld
