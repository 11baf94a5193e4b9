// A robot as a scene of the viewer, against the real server.
#include "client/hullctl/robot/robot_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "tests/client/formats/point_reading.h"
#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace robot_scene_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Optional;
using testing::SizeIs;

// A box, a tetrahedron that slides along x, and a ball on a turning arm.
constexpr char kUrdf[] = R"(<robot name="chain">
  <link name="a"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="a"/><child link="b"/><origin xyz="1 0 0"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="1"/></joint>
  <link name="b"><collision><geometry><mesh filename="part.obj"/></geometry></collision></link>
  <joint name="turn" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/></joint>
  <link name="c"><collision><origin xyz="1 0 0"/><geometry><sphere radius="0.25"/></geometry>
  </collision></link>
</robot>)";

class RobotScene : public HullctlOnServer {
 protected:
  RobotScene()
      : mesh_("part.obj",
              "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"),
        urdf_("chain.urdf", Replaced(kUrdf, "part.obj", mesh_.path())) {}
  void SetUp() override {
    HullctlOnServer::SetUp();
    ClientOptions options;
    options.server = server_->address();
    client_.emplace(options);
    temporary_.emplace(*client_);
    arguments_.robot.urdf = urdf_.path();
  }
  void TearDown() override {
    temporary_.reset();
    client_.reset();
    HullctlOnServer::TearDown();
  }

  static std::string Replaced(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  }
  absl::Status Add() { return AddRobot(arguments_, *client_, &*temporary_, &scene_); }
  // Adds the robot with a table of waypoints.
  absl::Status AddPath(const std::string& table) {
    const TempFile path("path.csv", table);
    arguments_.joints = path.path();
    return Add();
  }

  const TempFile mesh_;
  const TempFile urdf_;
  std::optional<Client> client_;
  std::optional<TemporaryHulls> temporary_;
  RobotSceneArguments arguments_;
  ViewScene scene_;
};

TEST_F(RobotScene, PartsAreObjectsThatJointsMove) {
  ASSERT_TRUE(Add().ok());
  ASSERT_THAT(scene_.objects, SizeIs(3));
  EXPECT_EQ(scene_.objects[2].name, "c");
  EXPECT_EQ(scene_.objects[2].radius, 0.25);
  EXPECT_THAT(scene_.objects[2].pose, ElementsAre(1, 0, 0, 0, 2, 0, 0));
  EXPECT_TRUE(scene_.objects[0].is_jointed);
  // The box and the ball have no file.
  EXPECT_EQ(scene_.objects[0].file, -1);
  ASSERT_EQ(scene_.objects[1].file, 0);
  EXPECT_THAT(scene_.files[0]->triangles, SizeIs(12));
  const ViewJoints& joints = scene_.joints;
  ASSERT_THAT(joints.joints, SizeIs(2));
  EXPECT_EQ(joints.joints[0].name, "slide");
  EXPECT_EQ(joints.joints[0].high, 1);
  EXPECT_NEAR(joints.joints[1].low, -3.1416, 1e-4);
  const auto poses = joints.poses({0.5, 0});
  ASSERT_TRUE(poses.ok());
  EXPECT_THAT((*poses)[0], ElementsAre(1, 0, 0, 0, 0, 0, 0));
  EXPECT_THAT((*poses)[2], ElementsAre(1, 0, 0, 0, 2.5, 0, 0));
}

TEST_F(RobotScene, ExcludesAdjacentLinksOrThePairsOfTheSrdf) {
  ASSERT_TRUE(Add().ok());
  EXPECT_THAT(scene_.pairs, Optional(ElementsAre(0, 2)));
  const TempFile srdf("chain.srdf",
                      R"(<robot name="chain"><disable_collisions link1="a" link2="c"/></robot>)");
  arguments_.srdf = srdf.path();
  scene_ = {};
  ASSERT_TRUE(Add().ok());
  EXPECT_THAT(scene_.pairs, Optional(ElementsAre(0, 1, 1, 2)));
}

TEST_F(RobotScene, SurroundingsAreCheckedAgainstPartsOnly) {
  const TempFile cell("cell.yaml",
                      "place: {post: {id: cube, at: [4, 0, 0]}, floor: {id: cube, radius: 0.5}}\n");
  arguments_.scene = cell.path();
  arguments_.ignored = {"floor,a", "c,post"};
  ASSERT_TRUE(Add().ok());
  ASSERT_THAT(scene_.objects, SizeIs(5));
  EXPECT_FALSE(scene_.objects[3].is_jointed);
  EXPECT_EQ(scene_.objects[3].name, "post");
  EXPECT_EQ(scene_.objects[3].pose[4], 4);
  EXPECT_EQ(scene_.objects[4].radius, 0.5);
  EXPECT_THAT(scene_.pairs, Optional(ElementsAre(0, 2, 0, 3, 1, 3, 1, 4, 2, 4)));
  arguments_.ignored = {"post,floor"};
  scene_ = {};
  EXPECT_THAT(std::string(Add().message()),
              HasSubstr("--ignore: \"post,floor\" is not a checked pair"));
  const TempFile moving("moving.yaml", "place: {cart: {id: cube, to: [4, 0, 0]}}\n");
  arguments_.scene = moving.path();
  scene_ = {};
  EXPECT_THAT(std::string(Add().message()), HasSubstr(moving.path() + ": cart moves"));
}

// At turn = pi the ball is at the origin, inside the box, and 1 + slide away along x otherwise.
TEST_F(RobotScene, WaypointsInContactAreMarked) {
  const absl::Status added =
      AddPath("turn,slide\n3.14159265,0\n0,0\n3.14159265,0.5\n-9,0\n0.5,3\n");
  ASSERT_TRUE(added.ok()) << added;
  const ViewJoints& joints = scene_.joints;
  EXPECT_THAT(joints.waypoints, SizeIs(5));
  EXPECT_THAT(joints.waypoints[2], ElementsAre(0.5, 3.14159265));
  EXPECT_THAT(joints.contacts, ElementsAre(0, 2, 3));
  // The scene starts at the first waypoint; sliders reach every one.
  EXPECT_EQ(joints.joints[1].value, 3.14159265);
  EXPECT_EQ(joints.joints[1].low, -9);
  EXPECT_EQ(joints.joints[0].high, 3);
  EXPECT_NEAR(scene_.objects[2].pose[4], 0, 1e-8);
}

TEST_F(RobotScene, MistakesNameTheFile) {
  EXPECT_THAT(std::string(AddPath("turn,slid\n0,0\n").message()), HasSubstr("path.csv:1: "));
  EXPECT_THAT(std::string(AddPath("turn\n").message()), HasSubstr("contains no waypoint"));
  std::string table = "turn\n";
  for (size_t i = 0; i <= kMaxShownWaypoints; ++i) table += "0\n";
  EXPECT_THAT(std::string(AddPath(table).message()),
              HasSubstr("path.csv:10002: the viewer shows up to 10000 waypoints"));
  arguments_.joints.clear();
  arguments_.srdf = "/no/such.srdf";
  EXPECT_THAT(std::string(Add().message()), HasSubstr("/no/such.srdf"));
  // A refused robot leaves no hull.
  EXPECT_EQ(Run({"list", "--output", "name"}).out, "");
}

TEST_F(RobotScene, AFloatingJointNeedsARotation) {
  const TempFile urdf("float.urdf", R"(<robot name="loose">
  <link name="a"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <joint name="free" type="floating"><parent link="a"/><child link="b"/></joint>
  <link name="b"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
</robot>)");
  arguments_.robot.urdf = urdf.path();
  ASSERT_TRUE(Add().ok());
  const std::vector<double> zeros(scene_.joints.joints.size());
  EXPECT_THAT(std::string(scene_.joints.poses(zeros).status().message()),
              HasSubstr("The quaternion of free is zero"));
}

}  // namespace robot_scene_test
}  // namespace hulld
