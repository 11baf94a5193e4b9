#ifndef HULLD_CLIENT_ROBOT_ROBOT_H_
#define HULLD_CLIENT_ROBOT_ROBOT_H_

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/pose/rigid_pose.h"

namespace hulld {

// What a robot description comes to, as far as collisions go: links that form a tree of joints, and
// the shapes on them. Lengths are metres and angles radians, as in URDF.

enum class ShapeKind { kBox, kCylinder, kSphere, kCapsule, kMesh };

// A shape that collides.
struct CollisionShape {
  ShapeKind kind = ShapeKind::kMesh;
  // Box: its edges.
  std::array<double, 3> size = {0, 0, 0};
  // Cylinder, sphere and capsule. A capsule's length is that of its cylinder, without the caps.
  double radius = 0;
  double length = 0;
  // Mesh: the file as the description names it, and the factors of its coordinates.
  std::string mesh;
  std::array<double, 3> scale = {1, 1, 1};
  // The pose in the frame of the link.
  RigidPose X_LS = kNoMotion;
  // Where the description has it.
  int line = 0;
};

struct RobotLink {
  std::string name;
  // -1 for the root.
  int parent_joint = -1;
  std::vector<CollisionShape> shapes;
};

enum class JointKind { kFixed, kRevolute, kContinuous, kPrismatic };

struct RobotJoint {
  std::string name;
  JointKind kind = JointKind::kFixed;
  int parent = 0;
  int child = 0;
  // The pose in the frame of the parent at value 0.
  RigidPose X_PJ = kNoMotion;
  std::array<double, 3> axis = {1, 0, 0};
  // Absent for a joint that turns on and on.
  std::optional<std::array<double, 2>> limits;
  // Where it follows another joint: value = multiplier * that of joint `mimics` + offset.
  int mimics = -1;
  double multiplier = 1;
  double offset = 0;

  // Whether it has a value of its own.
  bool is_free() const { return kind != JointKind::kFixed && mimics < 0; }
};

struct Robot {
  std::string name;
  // Parents before their children; the first is the root.
  std::vector<RobotLink> links;
  // In the order of their children.
  std::vector<RobotJoint> joints;

  // The indices of the joints that have values of their own.
  std::vector<int> FreeJoints() const;
  // -1 when there is none of that name.
  int FindLink(const std::string& link) const;
  int FindJoint(const std::string& joint) const;
};

// A value for each joint of the robot: those that are free as `free_values` says, in the order of
// FreeJoints(), those that mimic from them, and 0 for fixed ones. Requires as many values as free
// joints (unchecked: callers fill them from FreeJoints()).
std::vector<double> AllJointValues(const Robot& robot, std::span<const double> free_values);

// Where the robot starts: 0 for each free joint, or the middle of its limits where they exclude 0.
std::vector<double> RestValues(const Robot& robot);

// X_WL of each link, where the root stands at X_WB. In floating point: each joint on the way adds
// an error of a few units of roundoff. Requires a value for each joint (unchecked: callers pass on
// what AllJointValues gives).
std::vector<RigidPose> LinkPoses(const Robot& robot, const RigidPose& X_WB,
                                 std::span<const double> joint_values);

// What is wrong with the values for the limits of the joints, a sentence each; empty: nothing.
// Requires the same.
std::vector<std::string> LimitProblems(const Robot& robot, std::span<const double> joint_values);

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_ROBOT_H_
