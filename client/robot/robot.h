#ifndef HULLD_CLIENT_ROBOT_ROBOT_H_
#define HULLD_CLIENT_ROBOT_ROBOT_H_

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/formats/length_scale.h"
#include "client/pose/rigid_pose.h"

namespace hulld {

// The collision model of a robot description: links that form a tree of joints, and their collision
// shapes. Lengths are meters and angles radians, as in URDF.

enum class ShapeKind { kBox, kCylinder, kSphere, kCapsule, kMesh };

// A collision shape.
struct CollisionShape {
  ShapeKind kind = ShapeKind::kMesh;
  // Box: edge lengths.
  std::array<double, 3> size = {0, 0, 0};
  // Cylinder, sphere, and capsule. The length of a capsule is that of its cylinder, without the
  // caps.
  double radius = 0;
  double length = 0;
  // Mesh: the file as named in the description, and the factors of its coordinates.
  std::string mesh;
  std::array<LengthScale, 3> scale;
  // Pose in the frame of the link.
  RigidPose X_LS = kNoMotion;
  // Line in the description.
  int line = 0;
};

struct RobotLink {
  std::string name;
  // -1 for the root.
  int parent_joint = -1;
  std::vector<CollisionShape> shapes;
};

enum class JointKind { kFixed, kRevolute, kContinuous, kPrismatic, kPlanar, kFloating };

// Value of a joint; unused components are 0. Floating: the child's pose. Planar: x, y, then the
// angle theta. Other kinds: one value, unused for a fixed joint.
using JointValue = std::array<double, 7>;

struct RobotJoint {
  std::string name;
  JointKind kind = JointKind::kFixed;
  int parent = 0;
  int child = 0;
  // Pose in the frame of the parent at value 0.
  RigidPose X_PJ = kNoMotion;
  // Unit length. For a planar joint, the normal of the plane: x and y run along the images of the x
  // and y axes under the shortest rotation from z to the normal, and theta turns about the normal.
  std::array<double, 3> axis = {1, 0, 0};
  // Absent for a continuous joint.
  std::optional<std::array<double, 2>> limits;
  // For a joint that follows another one: value = multiplier * (value of joint `mimics`) + offset.
  int mimics = -1;
  double multiplier = 1;
  double offset = 0;

  // Returns true if the joint has a value of its own.
  bool is_free() const { return kind != JointKind::kFixed && mimics < 0; }
  // Returns true if the child can move without bounds.
  bool is_loose() const { return kind == JointKind::kPlanar || kind == JointKind::kFloating; }
};

// A variable of a robot's configuration: a value of a free joint. Named after its joint; for a
// joint with several values, as MoveIt names them: JOINT/x, /y, and /theta of a planar joint,
// JOINT/trans_x, /trans_y, /trans_z, /rot_x, /rot_y, /rot_z, and /rot_w of a floating one.
struct JointVariable {
  std::string name;
  int joint = 0;
  // Index in the joint's value.
  size_t place = 0;
};

struct Robot {
  std::string name;
  // Parents precede their children; the first is the root.
  std::vector<RobotLink> links;
  // In the order of their child links.
  std::vector<RobotJoint> joints;

  // Returns the variables of all free joints, in the order of the joints.
  std::vector<JointVariable> Variables() const;
  // Returns -1 for an unknown name.
  int FindLink(const std::string& link) const;
  int FindJoint(const std::string& joint) const;
};

// Returns the value of each joint: free joints from `free_values`, in the order of Variables(),
// mimic joints computed from these, and 0 for fixed joints. Requires a number for each variable
// (unchecked: callers fill them from Variables()).
std::vector<JointValue> AllJointValues(const Robot& robot, std::span<const double> free_values);

// Returns the rest configuration: 0 for each variable, or the middle of its limits if they exclude
// 0; 1 for the w of a rotation.
std::vector<double> RestValues(const Robot& robot);

// Returns the name of a floating joint with the quaternion 0 0 0 0, which is not a rotation; empty
// if there is none.
std::string JointWithoutRotation(const Robot& robot, std::span<const double> free_values);

// Returns X_WL of each link for a root at X_WB. Floating point: each joint on the path adds an
// error of a few units of roundoff. Requires a value for each joint (unchecked: callers pass the
// result of AllJointValues).
std::vector<RigidPose> LinkPoses(const Robot& robot, const RigidPose& X_WB,
                                 std::span<const JointValue> joint_values);

// Returns the violations of joint limits, one sentence each; empty if all values are within limits.
// Same requirement as above.
std::vector<std::string> LimitProblems(const Robot& robot,
                                       std::span<const JointValue> joint_values);

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_ROBOT_H_
