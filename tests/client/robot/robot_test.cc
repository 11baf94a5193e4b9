#include "client/robot/robot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "client/robot/urdf_file.h"
#include "tests/client/robot/urdf_text.h"

namespace hulld {
namespace {

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

TEST(Robot, JointsMoveWhatHangsOnThem) {
  const Robot robot = Arm();
  const double right = std::numbers::pi / 2;
  // The arm lies along x, its lower part hangs down; the finger is pushed out by 1, whatever the
  // length of the axis.
  const std::vector<double> values = AllJointValues(robot, std::vector<double>{right, right, 1});
  const std::vector<RigidPose> poses = LinkPoses(robot, {1, 0, 0, 0, 10, 0, 0}, values);
  ExpectNear(PlaceOf(robot, poses, "upper"), {10, 0, 1});
  ExpectNear(PlaceOf(robot, poses, "lower"), {14, 0, 1});
  ExpectNear(PlaceOf(robot, poses, "finger"), {14, 0, -2});
}

TEST(Robot, MimicFollowsItsLeader) {
  const Robot robot = Arm();
  const std::vector<double> values = AllJointValues(robot, std::vector<double>{0.5, 0, 0.75});
  EXPECT_EQ(values[static_cast<size_t>(robot.FindJoint("follow"))], 0);
  EXPECT_EQ(values[static_cast<size_t>(robot.FindJoint("bolt"))], 0);
}

TEST(Robot, ValuesBeyondLimitsAreNamed) {
  const Robot robot = Arm();
  EXPECT_TRUE(LimitProblems(robot, AllJointValues(robot, RestValues(robot))).empty());
  // The elbow turns on and on.
  const auto problems =
      LimitProblems(robot, AllJointValues(robot, std::vector<double>{3, 100, 0.75}));
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_THAT(problems[0], HasSubstr("shoulder is at 3, beyond its limits -2 to 2"));
}

TEST(RigidPose, ComposesLikeMatrices) {
  // A quarter turn about z of any length of quaternion, then one about x.
  const RigidPose a = {2, 0, 0, 2, 1, 2, 3};
  const RigidPose b = {1, 1, 0, 0, 5, 0, 0};
  const RigidPose c = Compose(a, b);
  ExpectNear({c[4], c[5], c[6]}, {1, 7, 3});
  // z goes to -y by b, which a turns to x.
  const RigidPose z = Compose(c, {1, 0, 0, 0, 0, 0, 1});
  ExpectNear({z[4], z[5], z[6]}, {2, 7, 3});
  const RigidPose rpy = RotationOf({0.1, 0.2, 0.3});
  const RigidPose by_hand =
      Compose(RotationAbout({0, 0, 9}, 0.3),
              Compose(RotationAbout({0, 1, 0}, 0.2), RotationAbout({1, 0, 0}, 0.1)));
  for (size_t i = 0; i < 7; ++i) EXPECT_NEAR(rpy[i], by_hand[i], 1e-15);
}

}  // namespace
}  // namespace hulld
