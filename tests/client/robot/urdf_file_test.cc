#include "client/robot/urdf_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "tests/client/robot/urdf_text.h"

namespace hulld {
namespace urdf_file_test {

using testing::HasSubstr;
using testing::StartsWith;

std::string ErrorOf(const std::string& urdf) {
  const auto robot = ParseUrdf(urdf, "arm.urdf");
  EXPECT_TRUE(absl::IsInvalidArgument(robot.status())) << robot.status() << "\n" << urdf;
  return std::string(robot.status().message().data(), robot.status().message().size());
}

// Returns the arm's URDF with one replacement.
std::string Changed(const std::string& from, const std::string& to) {
  std::string urdf = kArmUrdf;
  const size_t at = urdf.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return urdf.replace(at, from.size(), to);
}

TEST(UrdfFile, LinksJointsAndShapesAreRead) {
  const auto robot = ParseUrdf(kArmUrdf, "arm.urdf");
  ASSERT_TRUE(robot.ok()) << robot.status();
  EXPECT_EQ(robot->name, "arm");
  ASSERT_EQ(robot->links.size(), 6u);
  EXPECT_EQ(robot->links[0].name, "base");
  EXPECT_EQ(robot->links[0].parent_joint, -1);
  const RobotLink& upper = robot->links[static_cast<size_t>(robot->FindLink("upper"))];
  ASSERT_EQ(upper.shapes.size(), 2u);
  EXPECT_EQ(upper.shapes[0].kind, ShapeKind::kCylinder);
  EXPECT_EQ(upper.shapes[0].radius, 0.25);
  EXPECT_EQ(upper.shapes[0].length, 3);
  EXPECT_EQ(upper.shapes[0].X_LS, (RigidPose{1, 0, 0, 0, 0, 0, 2}));
  EXPECT_EQ(upper.shapes[1].kind, ShapeKind::kSphere);
  const RobotLink& lower = robot->links[static_cast<size_t>(robot->FindLink("lower"))];
  ASSERT_EQ(lower.shapes.size(), 1u);
  EXPECT_EQ(lower.shapes[0].kind, ShapeKind::kCapsule);
  EXPECT_EQ(lower.shapes[0].length, 1.5);
  const RobotJoint& follow = robot->joints[static_cast<size_t>(robot->FindJoint("follow"))];
  EXPECT_EQ(follow.mimics, robot->FindJoint("shoulder"));
  EXPECT_EQ(follow.multiplier, -2);
  EXPECT_EQ(follow.offset, 1);
  // The finger's limits lack effort and velocity, which collisions do not need.
  const RobotJoint& slide = robot->joints[static_cast<size_t>(robot->FindJoint("slide"))];
  EXPECT_EQ(*slide.limits, (std::array<double, 2>{0.5, 1}));
  EXPECT_EQ(robot->Variables().size(), 3u);
}

TEST(UrdfFile, JointsThatMimicNeedNoLimit) {
  const std::string limit = "<limit lower=\"-9\" upper=\"9\"/>";
  for (const char* type : {"revolute", "prismatic"}) {
    std::string urdf = Changed(limit, "");
    urdf.replace(urdf.find("name=\"follow\" type=\"revolute\"") + 20, 8, type);
    const auto robot = ParseUrdf(urdf, "arm.urdf");
    ASSERT_TRUE(robot.ok()) << robot.status();
    const RobotJoint& follow = robot->joints[static_cast<size_t>(robot->FindJoint("follow"))];
    EXPECT_EQ(follow.mimics, robot->FindJoint("shoulder"));
    EXPECT_FALSE(follow.limits.has_value());
    // It exceeds limits of 0 without a warning.
    const auto values = AllJointValues(*robot, std::vector<double>{1.5, 0, 0.75});
    EXPECT_TRUE(LimitProblems(*robot, values).empty());
  }
  EXPECT_THAT(ErrorOf(Changed("<limit lower=\"-2\" upper=\"2\" effort=\"1\" velocity=\"1\"/>", "")),
              HasSubstr("joint \"shoulder\" lacks <limit"));
}

TEST(UrdfFile, PlanarAndFloatingJointsHaveSeveralVariables) {
  std::string urdf =
      Changed("name=\"elbow\" type=\"continuous\"", "name=\"elbow\" type=\"floating\"");
  urdf.replace(urdf.find("name=\"slide\" type=\"prismatic\""), 29,
               "name=\"slide\" type=\"planar\"");
  const auto robot = ParseUrdf(urdf, "arm.urdf");
  ASSERT_TRUE(robot.ok()) << robot.status();
  std::vector<std::string> names;
  for (const JointVariable& variable : robot->Variables()) names.push_back(variable.name);
  EXPECT_THAT(names,
              testing::ElementsAre("shoulder", "elbow/trans_x", "elbow/trans_y", "elbow/trans_z",
                                   "elbow/rot_x", "elbow/rot_y", "elbow/rot_z", "elbow/rot_w",
                                   "slide/x", "slide/y", "slide/theta"));
  EXPECT_THAT(RestValues(*robot), testing::ElementsAre(0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0));
}

TEST(UrdfFile, ScalesOfMeshesAreExact) {
  const auto robot = ParseUrdf(
      Changed("<box size=\"2 2 1\"/>", "<mesh filename=\"a.stl\" scale=\"0.001 0.0254 -1\"/>"),
      "arm.urdf");
  ASSERT_TRUE(robot.ok()) << robot.status();
  const auto& scale = robot->links[0].shapes[0].scale;
  EXPECT_EQ(scale[0].Apply(7), 0.007);
  EXPECT_EQ(scale[1].Apply(3), 0.0762);
  EXPECT_EQ(scale[2].Apply(3), -3);
}

// The attribute was ignored: the shape was not rotated.
TEST(UrdfFile, OriginsMayHaveQuaternions) {
  const auto pose_of = [](const std::string& attributes) {
    const auto robot =
        ParseUrdf(Changed("<box size=\"2 2 1\"/></geometry>",
                          "<box size=\"2 2 1\"/></geometry><origin " + attributes + "/>"),
                  "arm.urdf");
    EXPECT_TRUE(robot.ok()) << robot.status();
    return robot.ok() ? robot->links[0].shapes[0].X_LS : RigidPose();
  };
  EXPECT_EQ(pose_of("quat_xyzw=\"0 0 3 4\" xyz=\"1 2 3\""), (RigidPose{0.8, 0, 0, 0.6, 1, 2, 3}));
  EXPECT_EQ(pose_of("quat_xyzw=\"0 1 0 0\""), (RigidPose{0, 0, 1, 0, 0, 0, 0}));
}

// Atlas has spheres of radius 0, and the Kinova arms have a box of size 0.
TEST(UrdfFile, SizesMayBeZero) {
  for (const char* shape :
       {"<box size=\"0 0 0\"/>", "<box size=\"2 0 1\"/>", "<sphere radius=\"0\"/>",
        "<capsule radius=\"0\" length=\"0\"/>", "<cylinder radius=\"0\" length=\"1\"/>"}) {
    const auto robot = ParseUrdf(Changed("<box size=\"2 2 1\"/>", shape), "arm.urdf");
    EXPECT_TRUE(robot.ok()) << robot.status();
  }
  EXPECT_THAT(ErrorOf(Changed("<box size=\"2 2 1\"/>", "<sphere radius=\"-0.1\"/>")),
              HasSubstr("arm.urdf:5: <sphere> radius must not be negative"));
}

TEST(UrdfFile, ErrorsNameLineAndElement) {
  const std::pair<std::string, std::string> none = {"", ""};
  const struct {
    std::pair<std::string, std::string> change;
    const char* error;
  } cases[] = {
      {{"size=\"2 2 1\"", "size=\"2 2\""}, "arm.urdf:5: <box> size needs 3 numbers, got 2"},
      {{"size=\"2 2 1\"", "size=\"2 two 1\""}, "arm.urdf:5: <box> size: \"two\" is not a number"},
      {{"size=\"2 2 1\"", "size=\"2 -1 1\""}, "arm.urdf:5: <box> size must not be negative"},
      {{"size=\"2 2 1\"", ""}, "arm.urdf:5: <box> lacks size=\"...\""},
      {{"<geometry><box", "<origin xyz=\"0 0 0\" rot=\"1 0 0\"/><geometry><box"},
       "arm.urdf:5: <origin> has no attribute \"rot\"; attributes are xyz, rpy, and quat_xyzw"},
      {{"<geometry><box", "<origin rpy=\"0 0 0\" quat_xyzw=\"0 0 0 1\"/><geometry><box"},
       "arm.urdf:5: <origin> has both rpy and quat_xyzw; remove one"},
      {{"<geometry><box", "<origin quat_xyzw=\"0 0 0 0\"/><geometry><box"},
       "arm.urdf:5: <origin> quat_xyzw is not a unit quaternion"},
      {{"<geometry><box", "<origin quat_xyzw=\"0 0 1e200 0\"/><geometry><box"},
       "arm.urdf:5: <origin> quat_xyzw is not a unit quaternion"},
      {{"<geometry><box", "<geometry><sphere radius=\"1\"/><box"},
       "arm.urdf:5: <geometry> contains several shapes; write one <collision> for each"},
      {{"<box size=\"2 2 1\"/></geometry>",
        "<box size=\"2 2 1\"/></geometry><geometry><sphere radius=\"1\"/></geometry>"},
       "arm.urdf:5: <collision> contains <geometry> twice; remove one of them"},
      {{"<geometry><box", "<origin/><origin xyz=\"1 0 0\"/><geometry><box"},
       "arm.urdf:5: <collision> contains <origin> twice"},
      {{"<child link=\"upper\"/>", "<child link=\"upper\"/><child link=\"lower\"/>"},
       "arm.urdf:8: <joint> contains <child> twice"},
      {{"<box size=\"2 2 1\"/>", "<cone/>"}, "arm.urdf:5: <geometry> contains \"cone\""},
      {{"<link name=\"upper\">", "<link>"}, "arm.urdf:12: <link> lacks name"},
      {{"<link name=\"upper\">", "<link name=\"base\">"},
       "arm.urdf:12: link \"base\" is defined twice; the first definition is in line 3"},
      {{"<child link=\"upper\"/>", "<child link=\"uper\"/>"},
       "arm.urdf:8: joint \"shoulder\" has a child that does not exist: \"uper\""},
      {{"type=\"revolute\"", "type=\"screw\""},
       "arm.urdf:7: joint \"shoulder\" has type \"screw\""},
      {{"<origin xyz=\"0 0 2\"/><axis xyz=\"0 0 3\"/>\n    <limit lower=\"0.5\" upper=\"1\"/>",
        "<x/>"},
       "joint \"slide\" lacks <limit"},
      {{"<box size=\"2 2 1\"/>", "<mesh filename=\"a.stl\" scale=\"1 0 1\"/>"},
       "arm.urdf:5: <mesh> scale must not be 0"},
      {{"axis xyz=\"0 1 0\"", "axis xyz=\"0 0 0\""}, "arm.urdf:9: <axis> xyz must not be 0 0 0"},
      {{"lower=\"-2\"", "lower=\"nan\""}, "arm.urdf:10: <limit> lower: \"nan\" is not a finite"},
      {{"mimic joint=\"shoulder\"", "mimic joint=\"follow\""},
       "mimics itself through other joints"},
      {{"<parent link=\"base\"/>", "<parent link=\"lower\"/>"}, "is part of a cycle of joints"},
      {{"</link>\n  <joint name=\"elbow\"", "</lnk>\n  <joint name=\"elbow\""},
       "arm.urdf:19: </lnk> does not close <link> of line 12"},
      {{"</robot>", ""}, "the file ends before </robot>"},
      {{"<link name=\"flange\"/>", "<xacro:flange/>"}, "expand the file with 'xacro' first"},
      {{"<link name=\"flange\"/>", "<macro name=\"flange\"/>"},
       "<macro> is a macro; expand the file with 'xacro' first"},
      {{"<link name=\"flange\"/>", "<include filename=\"flange.xacro\"/>"},
       "<include> is a macro; expand the file with 'xacro' first"},
      {{"axis xyz=\"0 1 0\"", "axis xyz=\"0 ${y} 0\""},
       "arm.urdf:9: <axis> xyz: \"${y}\" is not a number; expand the file with 'xacro' first"},
      {{"<?xml version=\"1.0\"?>", "<!DOCTYPE robot>"},
       "arm.urdf:1: document types are not supported"},
      {{"<robot name=\"arm\">", "<robot>"}, "arm.urdf:2: <robot> lacks name"},
      {{"size=\"2 2 1\"", "size=\"2 2 1"}, "is not closed"},
  };
  for (const auto& [change, error] : cases) {
    const std::string message = ErrorOf(Changed(change.first, change.second));
    EXPECT_THAT(message, StartsWith("arm.urdf:"));
    EXPECT_THAT(message, HasSubstr(error));
  }
  EXPECT_THAT(ErrorOf(""), HasSubstr("contains no element"));
  EXPECT_THAT(ErrorOf("<sdf/>"), HasSubstr("the outermost element is <sdf>, not <robot>"));
  EXPECT_THAT(ErrorOf(std::string("<robot name=\"\0\"/>", 17)), HasSubstr("a zero byte"));
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "<a>";
  EXPECT_THAT(ErrorOf(deep), HasSubstr("nested deeper"));
}

TEST(UrdfFile, TextMayBeLatin1) {
  const auto robot = ParseUrdf("<robot name=\"r\"><link name=\"K\xf6rper\"/></robot>", "arm.urdf");
  ASSERT_TRUE(robot.ok()) << robot.status();
  EXPECT_GE(robot->FindLink("K\xc3\xb6rper"), 0);
  EXPECT_THAT(ErrorOf("<!-- \xf6\xf6\xf6\xf6 -->\n<robot name=\"r\">\n<link/></robot>"),
              HasSubstr("arm.urdf:3: <link> lacks name"));
}

TEST(UrdfFile, JointsOfSeveralValuesAreNotMimicked) {
  EXPECT_THAT(
      ErrorOf(
          Changed("name=\"shoulder\" type=\"revolute\"", "name=\"shoulder\" type=\"floating\"")),
      HasSubstr(
          "joint \"shoulder\" is floating; a mimic joint and its leader must have one value each"));
  EXPECT_THAT(
      ErrorOf(Changed("name=\"follow\" type=\"revolute\"", "name=\"follow\" type=\"planar\"")),
      HasSubstr("joint \"follow\" is planar"));
  EXPECT_THAT(
      ErrorOf(Changed("type=\"prismatic\">\n    <parent link=\"lower\"/><child link=\"finger\"/>\n"
                      "    <origin xyz=\"0 0 2\"/><axis xyz=\"0 0 3\"/>",
                      "type=\"planar\"><parent link=\"lower\"/><child link=\"finger\"/>")),
      HasSubstr("joint \"slide\" lacks <axis xyz=\"0 0 1\"/>, the normal of its plane"));
}

TEST(UrdfFile, SecondRootIsNamed) {
  EXPECT_THAT(ErrorOf("<robot name=\"r\">\n<link name=\"a\"/>\n<link name=\"b\"/>\n</robot>"),
              HasSubstr("arm.urdf:3: link \"b\" has no parent joint, like \"a\""));
}

}  // namespace urdf_file_test
}  // namespace hulld
