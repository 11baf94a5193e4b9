#include "client/robot/robot.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "client/formats/text_number.h"

namespace hulld {
namespace {

// A component of a joint's value: the suffix of its name, and its index.
struct NamedPlace {
  const char* suffix;
  size_t place;
};
constexpr NamedPlace kSinglePlace[] = {{"", 0}};
constexpr NamedPlace kPlanarPlaces[] = {{"/x", 0}, {"/y", 1}, {"/theta", 2}};
constexpr NamedPlace kFloatingPlaces[] = {{"/trans_x", 4}, {"/trans_y", 5}, {"/trans_z", 6},
                                          {"/rot_x", 1},   {"/rot_y", 2},   {"/rot_z", 3},
                                          {"/rot_w", 0}};

// Returns the free numbers of a joint.
std::span<const NamedPlace> PlacesOf(const RobotJoint& joint) {
  if (!joint.is_free()) return {};
  if (joint.kind == JointKind::kPlanar) return kPlanarPlaces;
  if (joint.kind == JointKind::kFloating) return kFloatingPlaces;
  return kSinglePlace;
}

// Moves by x and y in the plane with that normal, then by theta about the normal.
RigidPose PlanarMotion(const std::array<double, 3>& n, const JointValue& value) {
  // The shortest rotation from z to n, about z x n; for n = -z, half a turn about x.
  RigidPose turn = {1 + n[2], -n[1], n[0], 0, 0, 0, 0};
  if (turn[0] == 0) turn[1] = 1;
  const RigidPose moved = Compose(turn, {1, 0, 0, 0, value[0], value[1], 0});
  RigidPose motion = RotationAbout(n, value[2]);
  std::copy(moved.begin() + 4, moved.end(), motion.begin() + 4);
  return motion;
}

RigidPose MotionOf(const RobotJoint& joint, const JointValue& value) {
  const std::array<double, 3>& axis = joint.axis;
  switch (joint.kind) {
    case JointKind::kRevolute:
    case JointKind::kContinuous:
      return RotationAbout(axis, value[0]);
    case JointKind::kPrismatic:
      return {1, 0, 0, 0, value[0] * axis[0], value[0] * axis[1], value[0] * axis[2]};
    case JointKind::kPlanar:
      return PlanarMotion(axis, value);
    case JointKind::kFloating:
      return value;
    case JointKind::kFixed:
      break;
  }
  return kNoMotion;
}

template <typename Named>
int IndexOf(const std::vector<Named>& all, const std::string& name) {
  const auto found = std::ranges::find(all, name, &Named::name);
  return found == all.end() ? -1 : static_cast<int>(found - all.begin());
}

}  // namespace

std::vector<JointVariable> Robot::Variables() const {
  std::vector<JointVariable> variables;
  for (size_t j = 0; j < joints.size(); ++j) {
    for (const NamedPlace& one : PlacesOf(joints[j])) {
      variables.push_back({joints[j].name + one.suffix, static_cast<int>(j), one.place});
    }
  }
  return variables;
}

int Robot::FindLink(const std::string& link) const { return IndexOf(links, link); }
int Robot::FindJoint(const std::string& joint) const { return IndexOf(joints, joint); }

std::vector<JointValue> AllJointValues(const Robot& robot, std::span<const double> free_values) {
  std::vector<JointValue> values(robot.joints.size(), JointValue{});
  size_t next = 0;
  for (size_t j = 0; j < values.size(); ++j) {
    for (const NamedPlace& one : PlacesOf(robot.joints[j])) {
      values[j][one.place] = free_values[next++];
    }
  }
  for (size_t j = 0; j < values.size(); ++j) {
    // A joint may mimic one that mimics another; the reader rejects cycles.
    double multiplier = 1;
    double offset = 0;
    int leader = static_cast<int>(j);
    for (; robot.joints[static_cast<size_t>(leader)].mimics >= 0;) {
      const RobotJoint& joint = robot.joints[static_cast<size_t>(leader)];
      offset += multiplier * joint.offset;
      multiplier *= joint.multiplier;
      leader = joint.mimics;
    }
    if (leader != static_cast<int>(j)) {
      values[j][0] = multiplier * values[static_cast<size_t>(leader)][0] + offset;
    }
  }
  return values;
}

std::vector<double> RestValues(const Robot& robot) {
  std::vector<double> values;
  for (const RobotJoint& joint : robot.joints) {
    for (const NamedPlace& one : PlacesOf(joint)) {
      const bool excludes_zero = joint.limits && ((*joint.limits)[0] > 0 || (*joint.limits)[1] < 0);
      const bool is_w = joint.kind == JointKind::kFloating && one.place == 0;
      values.push_back(excludes_zero ? (*joint.limits)[0] / 2 + (*joint.limits)[1] / 2 : is_w);
    }
  }
  return values;
}

std::string JointWithoutRotation(const Robot& robot, std::span<const double> free_values) {
  const std::vector<JointValue> values = AllJointValues(robot, free_values);
  for (size_t j = 0; j < values.size(); ++j) {
    const bool turns =
        std::any_of(values[j].begin(), values[j].begin() + 4, [](double q) { return q != 0; });
    if (robot.joints[j].kind == JointKind::kFloating && !turns) return robot.joints[j].name;
  }
  return {};
}

std::vector<RigidPose> LinkPoses(const Robot& robot, const RigidPose& X_WB,
                                 std::span<const JointValue> joint_values) {
  std::vector<RigidPose> X_WL(robot.links.size(), X_WB);
  for (size_t i = 0; i < robot.links.size(); ++i) {
    const int parent_joint = robot.links[i].parent_joint;
    if (parent_joint < 0) continue;
    const auto j = static_cast<size_t>(parent_joint);
    const RobotJoint& joint = robot.joints[j];
    const RigidPose X_WJ = Compose(X_WL[static_cast<size_t>(joint.parent)], joint.X_PJ);
    X_WL[i] =
        joint.kind == JointKind::kFixed ? X_WJ : Compose(X_WJ, MotionOf(joint, joint_values[j]));
  }
  return X_WL;
}

std::vector<std::string> LimitProblems(const Robot& robot,
                                       std::span<const JointValue> joint_values) {
  std::vector<std::string> problems;
  for (size_t j = 0; j < robot.joints.size(); ++j) {
    const RobotJoint& joint = robot.joints[j];
    if (!joint.limits || joint.kind == JointKind::kFixed) continue;
    const auto [lower, upper] = *joint.limits;
    const double value = joint_values[j][0];
    if (lower <= value && value <= upper) continue;
    problems.push_back(absl::StrCat(joint.name, " is at ", ShortestText(value),
                                    ", beyond its limits ", ShortestText(lower), " to ",
                                    ShortestText(upper)));
  }
  return problems;
}

}  // namespace hulld
