#ifndef HULLD_CLIENT_POSE_RIGID_POSE_H_
#define HULLD_CLIENT_POSE_RIGID_POSE_H_

#include <array>

namespace hulld {

// X_AB, the pose of a frame B in a frame A, as Pose of the contract takes it: quaternion w x y z,
// which need not be normalized, then translation x y z. p_A = R(quaternion) p_B + translation.
using RigidPose = std::array<double, 7>;
inline constexpr RigidPose kNoMotion = {1, 0, 0, 0, 0, 0, 0};

// The rotation by `angle` (radians) about `axis`, which need not have unit length. An axis of
// length 0 gives no rotation.
RigidPose RotationAbout(const std::array<double, 3>& axis, double angle);

// Roll, pitch and yaw in radians, turned about the fixed axes x, y and z in this order, as URDF has
// them: R = Rz(yaw) Ry(pitch) Rx(roll).
RigidPose RotationOf(const std::array<double, 3>& roll_pitch_yaw);

// X_AC = X_AB X_BC, rounded: each number is off by a few units of roundoff of the lengths that go
// into it. Where X_AB turns nothing (its quaternion is (w, 0, 0, 0)), only the sum of the
// translations is rounded. Requires quaternions that are not zero; a zero one gives NaN.
RigidPose Compose(const RigidPose& X_AB, const RigidPose& X_BC);

}  // namespace hulld

#endif  // HULLD_CLIENT_POSE_RIGID_POSE_H_
