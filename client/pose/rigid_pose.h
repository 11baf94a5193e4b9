#ifndef HULLD_CLIENT_POSE_RIGID_POSE_H_
#define HULLD_CLIENT_POSE_RIGID_POSE_H_

#include <array>

namespace hulld {

// X_AB, the pose of a frame B in a frame A, as in Pose of the contract: quaternion w x y z, which
// need not be normalized, then translation x y z. p_A = R(quaternion) p_B + translation.
inline constexpr int kPoseNumbers = 7;
using RigidPose = std::array<double, kPoseNumbers>;
inline constexpr RigidPose kNoMotion = {1, 0, 0, 0, 0, 0, 0};

// Returns the rotation by `angle` (radians) about `axis`, which need not have unit length. An axis
// of length 0 yields the identity.
RigidPose RotationAbout(const std::array<double, 3>& axis, double angle);

// Returns the rotation by roll, pitch, and yaw (radians) about the fixed axes x, y, and z in this
// order, as in URDF: R = Rz(yaw) Ry(pitch) Rx(roll).
RigidPose RotationOf(const std::array<double, 3>& roll_pitch_yaw);

// Returns the end of a motion, with the sign of its quaternion that makes the path from the start
// shorter: both signs are the same rotation. Requires nonzero quaternions.
RigidPose OnShorterPath(const RigidPose& start, RigidPose end);

// Returns X_AC = X_AB X_BC, rounded: each number has an error of a few units of roundoff of the
// lengths involved. If X_AB has no rotation (its quaternion is (w, 0, 0, 0)), only the sum of the
// translations is rounded. Requires nonzero quaternions; a zero quaternion yields NaN.
RigidPose Compose(const RigidPose& X_AB, const RigidPose& X_BC);

}  // namespace hulld

#endif  // HULLD_CLIENT_POSE_RIGID_POSE_H_
