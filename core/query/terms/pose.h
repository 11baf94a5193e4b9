#ifndef HULLD_CORE_QUERY_TERMS_POSE_H_
#define HULLD_CORE_QUERY_TERMS_POSE_H_

#include <absl/status/status.h>

#include <array>

#include "core/numeric/vector.h"

namespace hulld {

// X_WA, the pose of frame A in the world: p_W = R(q) p_A / |q|^2 + t over the reals for the given
// doubles, where R(q) is the homogeneous matrix of the quaternion q = (w, x, y, z). q and s q
// denote exactly the same rotation.
struct Pose {
  std::array<double, 4> q = {1, 0, 0, 0};
  Vector t = Vector::Zero();
};

// Returns true if all components are finite and q is not zero, the condition of ValidatePose. Cost:
// 2 ns.
inline bool IsValidPose(const Pose& pose) {
  const auto& [w, x, y, z] = pose.q;
  // Zero times a non-finite value is NaN.
  const double zero =
      ((0 * w + 0 * x) + (0 * y + 0 * z)) + ((0 * pose.t.x() + 0 * pose.t.y()) + 0 * pose.t.z());
  return zero == 0 && (w != 0 || x != 0 || y != 0 || z != 0);
}

// Returns true if the pose has neither a rotation nor a translation.
inline bool IsIdentity(const Pose& pose) {
  return pose.q[1] == 0 && pose.q[2] == 0 && pose.q[3] == 0 && pose.t.isZero(0);
}

// Returns OK, or INVALID_ARGUMENT "rotation.x is NaN", "translation.z is infinite", "rotation is
// zero".
absl::Status ValidatePose(const Pose& pose);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_POSE_H_
