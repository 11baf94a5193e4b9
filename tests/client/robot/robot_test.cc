#include "client/robot/robot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "client/robot/urdf_file.h"
#include "tests/client/robot/urdf_text.h"

namespace hulld {
namespace robot_test {

using testing::ElementsAre;
using testing::HasSubstr;

Robot Arm() {
  auto robot = ParseUrdf(kArmUrdf, "arm.urdf");
  EXPECT_TRUE(robot.ok()) << robot.status();
  return *robot;
}

std::array<double, 3> PlaceOf(const Robot& robot, const std::vector<RigidPose>& poses,
                              const char* link) {
  const RigidPose& pose = poses[static_cast<size_t>(robot.FindLink(link))];
  return {pose[4], pose[5], pose[6]};
}

void ExpectNear(const std::array<double, 3>& p, const std::array<double, 3>& q) {
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(p[i], q[i], 1e-14) << i;
}

TEST(Robot, RestsAtZeroOrWithinLimits) { EXPECT_THAT(RestValues(Arm()), ElementsAre(0, 0, 0.75)); }

TEST(Robot, JointsMoveTheirDescendants) {
  const Robot robot = Arm();
  const double right = std::numbers::pi / 2;
  // The arm lies along x, its lower part points down; the finger is extended by 1, for any length
  // of the axis.
  const std::vector<JointValue> values =
      AllJointValues(robot, std::vector<double>{right, right, 1});
  const std::vector<RigidPose> poses = LinkPoses(robot, {1, 0, 0, 0, 10, 0, 0}, values);
  ExpectNear(PlaceOf(robot, poses, "upper"), {10, 0, 1});
  ExpectNear(PlaceOf(robot, poses, "lower"), {14, 0, 1});
  ExpectNear(PlaceOf(robot, poses, "finger"), {14, 0, -2});
}

TEST(Robot, MimicFollowsItsLeader) {
  const Robot robot = Arm();
  const std::vector<JointValue> values = AllJointValues(robot, std::vector<double>{0.5, 0, 0.75});
  EXPECT_EQ(values[static_cast<size_t>(robot.FindJoint("follow"))][0], 0);
  EXPECT_EQ(values[static_cast<size_t>(robot.FindJoint("bolt"))][0], 0);
}

// A link on a joint of that type, with the joint's frame at (10, 0, 0).
Robot Loose(const std::string& type, const std::string& axis) {
  return *ParseUrdf("<robot name='r'><link name='w'/><link name='o'/><joint name='j' type='" +
                        type + "'><parent link='w'/><child link='o'/><origin xyz='10 0 0'/>" +
                        axis + "</joint></robot>",
                    "r.urdf");
}

TEST(Robot, FloatingJointsTakeAPose) {
  const Robot robot = Loose("floating", "");
  // trans, then rot x y z w: a quarter turn about z.
  const std::vector<double> values = {1, 2, 3, 0, 0, 2, 2};
  const RigidPose X_WO = LinkPoses(robot, kNoMotion, AllJointValues(robot, values))[1];
  ExpectNear({X_WO[4], X_WO[5], X_WO[6]}, {11, 2, 3});
  const RigidPose tip = Compose(X_WO, {1, 0, 0, 0, 1, 0, 0});
  ExpectNear({tip[4], tip[5], tip[6]}, {11, 3, 3});
  EXPECT_EQ(JointWithoutRotation(robot, values), "");
  EXPECT_EQ(JointWithoutRotation(robot, std::vector<double>{1, 2, 3, 0, 0, 0, 0}), "j");
}

TEST(Robot, PlanarJointsMoveInThePlaneOfTheirAxis) {
  const std::vector<double> values = {1, 2, std::numbers::pi / 2};
  const auto tip = [&](const Robot& robot,
                       const std::array<double, 3>& p) -> std::array<double, 3> {
    const RigidPose X_WO = LinkPoses(robot, kNoMotion, AllJointValues(robot, values))[1];
    const RigidPose moved = Compose(X_WO, {1, 0, 0, 0, p[0], p[1], p[2]});
    return {moved[4], moved[5], moved[6]};
  };
  const Robot flat = Loose("planar", "<axis xyz='0 0 2'/>");
  // Exact if the plane is the xy plane.
  EXPECT_THAT(tip(flat, {0, 0, 0}), ElementsAre(11, 2, 0));
  ExpectNear(tip(flat, {1, 0, 0}), {11, 3, 0});
  // The normal is x: x runs along -z, y along y.
  const Robot upright = Loose("planar", "<axis xyz='1 0 0'/>");
  ExpectNear(tip(upright, {0, 0, 0}), {10, 2, -1});
  ExpectNear(tip(upright, {0, 1, 0}), {10, 2, 0});
  // Flipped: half a turn about x.
  const Robot below = Loose("planar", "<axis xyz='0 0 -1'/>");
  ExpectNear(tip(below, {0, 0, 0}), {11, -2, 0});
  ExpectNear(tip(below, {1, 0, 0}), {11, -3, 0});
}

TEST(Robot, ValuesBeyondLimitsAreNamed) {
  const Robot robot = Arm();
  EXPECT_TRUE(LimitProblems(robot, AllJointValues(robot, RestValues(robot))).empty());
  // The elbow is continuous.
  const auto problems =
      LimitProblems(robot, AllJointValues(robot, std::vector<double>{3, 100, 0.75}));
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_THAT(problems[0], HasSubstr("shoulder is at 3, beyond its limits -2 to 2"));
}

TEST(RigidPose, ComposesLikeMatrices) {
  // A quarter turn about z by a quaternion of any length, then one about x.
  const RigidPose a = {2, 0, 0, 2, 1, 2, 3};
  const RigidPose b = {1, 1, 0, 0, 5, 0, 0};
  const RigidPose c = Compose(a, b);
  ExpectNear({c[4], c[5], c[6]}, {1, 7, 3});
  // b maps z to -y, which a maps to x.
  const RigidPose z = Compose(c, {1, 0, 0, 0, 0, 0, 1});
  ExpectNear({z[4], z[5], z[6]}, {2, 7, 3});
  const RigidPose rpy = RotationOf({0.1, 0.2, 0.3});
  const RigidPose by_hand =
      Compose(RotationAbout({0, 0, 9}, 0.3),
              Compose(RotationAbout({0, 1, 0}, 0.2), RotationAbout({1, 0, 0}, 0.1)));
  for (size_t i = 0; i < 7; ++i) EXPECT_NEAR(rpy[i], by_hand[i], 1e-15);
}

}  // namespace robot_test
}  // namespace hulld
