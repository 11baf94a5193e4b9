#ifndef HULLD_CLIENT_ROBOT_JOINT_MOTION_H_
#define HULLD_CLIENT_ROBOT_JOINT_MOTION_H_

#include <span>
#include <vector>

#include "client/robot/robot.h"

namespace hulld {

// The motion of a robot while the values of all joints, mimic joints included, change linearly from
// one configuration at time 0 to another at time 1, and bounds that hold at all times.

// Bounds of the motion of a frame in the world. A bound is an upper bound up to the rounding of its
// own computation, which Deviation and Travel add.
struct MotionBound {
  // Sum of the rates of all rotations on the path from the root, in radians.
  double turn = 0;
  // First and second derivative of the origin, and its distance from the world's origin.
  double speed = 0;
  double bend = 0;
  double distance = 0;
  // Rounding errors of a computed pose: the distance of its normalized quaternion from the exact
  // unit quaternion, and that of its translation from the exact one.
  double quaternion_rounding = 0;
  double rounding = 0;

  // Returns an upper bound (proven) on the path length of every point within `reach` of the origin,
  // in a time span of this duration.
  double Travel(double duration, double reach) const;

  // Returns an upper bound (proven) on the distance between the exact position of a point within
  // `reach` of the origin and its position in the motion of Placement.end_pose between the
  // computed poses at the ends of a time span of this duration, at the same time, for normalized
  // quaternions that are not negated.
  //
  // Requires duration * turn <= kMaxTurn, so that the rotation of that motion does not vanish.
  double Deviation(double duration, double reach) const;
  static constexpr double kMaxTurn = 2;
};

// Returns the bound of each link's frame. Requires values of AllJointValues aligned by AlignTurns
// (unchecked: callers compute them this way).
std::vector<MotionBound> BoundMotions(const Robot& robot, const RigidPose& X_WB,
                                      std::span<const JointValue> from,
                                      std::span<const JointValue> to);

// Returns the bound of a frame fixed at X_LS in a link with this bound.
MotionBound BoundFixedFrame(const MotionBound& link, const RigidPose& X_LS);

// Negates the quaternions of floating joints in `to` where that shortens the rotation.
void AlignTurns(const Robot& robot, std::span<const JointValue> from, std::span<JointValue> to);

// Returns the joint values at time t in [0, 1], each within 3 units of roundoff of the larger of
// its ends; exact at 0 and 1. Requires that 1 - t is a double, as for multiples of 2^-53.
std::vector<JointValue> JointValuesAt(std::span<const JointValue> from,
                                      std::span<const JointValue> to, double t);

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_JOINT_MOTION_H_
