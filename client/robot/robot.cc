#include "client/robot/robot.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "client/formats/text_number.h"

namespace hulld {
namespace {

RigidPose MotionOf(const RobotJoint& joint, double value) {
  switch (joint.kind) {
    case JointKind::kRevolute:
    case JointKind::kContinuous:
      return RotationAbout(joint.axis, value);
    case JointKind::kPrismatic:
      return {1, 0, 0, 0, value * joint.axis[0], value * joint.axis[1], value * joint.axis[2]};
    case JointKind::kFixed:
      break;
  }
  return kNoMotion;
}

template <typename Named>
int IndexOf(const std::vector<Named>& all, const std::string& name) {
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Named& one) { return one.name == name; });
  return found == all.end() ? -1 : static_cast<int>(found - all.begin());
}

}  // namespace

std::vector<int> Robot::FreeJoints() const {
  std::vector<int> found;
  for (size_t j = 0; j < joints.size(); ++j) {
    if (joints[j].is_free()) found.push_back(static_cast<int>(j));
  }
  return found;
}

int Robot::FindLink(const std::string& link) const { return IndexOf(links, link); }
int Robot::FindJoint(const std::string& joint) const { return IndexOf(joints, joint); }

std::vector<double> AllJointValues(const Robot& robot, std::span<const double> free_values) {
  std::vector<double> values(robot.joints.size(), 0);
  size_t next = 0;
  for (size_t j = 0; j < values.size(); ++j) {
    if (robot.joints[j].is_free()) values[j] = free_values[next++];
  }
  for (size_t j = 0; j < values.size(); ++j) {
    // A joint may mimic one that mimics; the reader made sure that this ends.
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
      values[j] = multiplier * values[static_cast<size_t>(leader)] + offset;
    }
  }
  return values;
}

std::vector<double> RestValues(const Robot& robot) {
  std::vector<double> values;
  for (const int j : robot.FreeJoints()) {
    const auto& limits = robot.joints[static_cast<size_t>(j)].limits;
    const bool allows_zero = !limits || ((*limits)[0] <= 0 && 0 <= (*limits)[1]);
    values.push_back(allows_zero ? 0 : (*limits)[0] / 2 + (*limits)[1] / 2);
  }
  return values;
}

std::vector<RigidPose> LinkPoses(const Robot& robot, const RigidPose& X_WB,
                                 std::span<const double> joint_values) {
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

std::vector<std::string> LimitProblems(const Robot& robot, std::span<const double> joint_values) {
  std::vector<std::string> problems;
  for (size_t j = 0; j < robot.joints.size(); ++j) {
    const RobotJoint& joint = robot.joints[j];
    if (!joint.limits || joint.kind == JointKind::kFixed) continue;
    const auto [lower, upper] = *joint.limits;
    if (lower <= joint_values[j] && joint_values[j] <= upper) continue;
    problems.push_back(absl::StrCat(joint.name, " is at ", ShortestText(joint_values[j]),
                                    ", beyond its limits ", ShortestText(lower), " to ",
                                    ShortestText(upper)));
  }
  return problems;
}

}  // namespace hulld
