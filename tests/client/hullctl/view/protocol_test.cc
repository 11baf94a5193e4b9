#include "client/hullctl/view/protocol.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>

namespace hulld {
namespace protocol_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

uint32_t LengthOf(const std::string& frame) {
  uint32_t length = 0;
  std::memcpy(&length, frame.data(), sizeof(length));
  return length;
}

std::string HeadOf(const std::string& frame) { return frame.substr(4, LengthOf(frame)); }

// Returns the body after the head, which starts at a multiple of eight bytes.
std::string BodyOf(const std::string& frame) {
  return frame.substr((4 + LengthOf(frame) + 7) / 8 * 8);
}

template <typename Number>
Number NumberAt(const std::string& bytes, size_t offset) {
  Number number;
  std::memcpy(&number, bytes.data() + offset, sizeof(number));
  return number;
}

std::string ErrorOf(const std::string& json) {
  const auto message = ParsePageMessage(json);
  return std::string(message.status().message());
}

TEST(Protocol, QueriesKeepEveryBitOfAPose) {
  const RigidPose pose = {0.1, -1e-308, 1e308, 5e-324, 1.0 / 3, -0.1, 12345678.900000001};
  const auto message =
      ParsePageMessage(R"({"type":"query","scene":2,"update":7,"objects":[3],"poses":)" +
                       NumbersJson(pose) + R"(,"pair":[3,1],"tolerance":0.25,"rest":true})");
  ASSERT_TRUE(message.ok()) << message.status();
  ASSERT_TRUE(message->query.has_value());
  const ViewQuery& query = *message->query;
  EXPECT_EQ(query.scene, 2);
  EXPECT_EQ(query.update, 7);
  EXPECT_THAT(query.objects, ElementsAre(3));
  ASSERT_EQ(query.poses.size(), 1);
  for (size_t i = 0; i < pose.size(); ++i) {
    EXPECT_EQ(query.poses[0][i], pose[i]) << i;
  }
  ASSERT_TRUE(query.pair.has_value());
  EXPECT_THAT(*query.pair, Pair(3, 1));
  EXPECT_EQ(query.tolerance, 0.25);
  EXPECT_TRUE(query.rest);
}

TEST(Protocol, AQueryMayNameNoPairs) {
  const auto message = ParsePageMessage(R"({"type":"query","update":1,"pair":[]})");
  ASSERT_TRUE(message.ok()) << message.status();
  EXPECT_FALSE(message->query->pair.has_value());
}

TEST(Protocol, GeometryRequestsAreRead) {
  const auto message = ParsePageMessage(R"({"type":"geometry","files":[0,2],"hullIds":["a/b"]})");
  ASSERT_TRUE(message.ok()) << message.status();
  ASSERT_EQ(message->geometry.size(), 3);
  EXPECT_EQ(message->geometry[1].file, 2);
  EXPECT_EQ(message->geometry[2].hull_id, "a/b");

  const auto simpler = ParsePageMessage(
      R"({"type":"simplify","hullId":"a","side":"outside","maxError":0.5,"maxVertices":8})");
  ASSERT_TRUE(simpler.ok()) << simpler.status();
  const auto& request = simpler->geometry.at(0).simplified;
  ASSERT_TRUE(request.has_value());
  EXPECT_EQ(request->simplification().side(), v1::SIMPLIFICATION_SIDE_OUTSIDE);
  EXPECT_EQ(request->simplification().max_error(), 0.5);
  EXPECT_EQ(request->simplification().max_vertices(), 8);
}

TEST(Protocol, MalformedMessagesAreRefused) {
  EXPECT_NE(ErrorOf("no json"), "");
  EXPECT_NE(ErrorOf("[]"), "");
  EXPECT_THAT(ErrorOf("{}"), HasSubstr("type"));
  EXPECT_THAT(ErrorOf(R"({"type":"delete"})"), HasSubstr("unknown to the bridge"));
  EXPECT_THAT(ErrorOf(R"({"type":"query","objects":[0],"poses":[1,2,3]})"),
              HasSubstr("seven numbers"));
  EXPECT_THAT(ErrorOf(R"({"type":"query","objects":[-1],"poses":[1,0,0,0,0,0,0]})"),
              HasSubstr("not an index"));
  EXPECT_THAT(ErrorOf(R"({"type":"query","objects":[0.5],"poses":[1,0,0,0,0,0,0]})"),
              HasSubstr("not an index"));
  EXPECT_THAT(ErrorOf(R"({"type":"query","pair":[4,4]})"), HasSubstr("does not name two objects"));
  EXPECT_THAT(ErrorOf(R"({"type":"query","update":-1})"), HasSubstr("whole number"));
  EXPECT_THAT(ErrorOf(R"({"type":"query","tolerance":"much"})"), HasSubstr("not a number"));
}

TEST(Protocol, FramesContainAHeadAndAlignedDoublesAndIndices) {
  HullMesh mesh;
  mesh.header.mutable_hull()->set_revision(42);
  mesh.xyz = {0, 0, 0, 1, 0, 0, 0, 1, 0.1};
  mesh.facet_sizes = {3};
  mesh.facet_indices = {0, 1, 2};
  // Heads of all lengths modulo eight.
  for (const char* id : {"a", "ab", "abc", "abcd", "abcde", "abcdef", "abcdefg", "abcdefgh"}) {
    const std::string frame = HullFrame(id, mesh);
    EXPECT_THAT(HeadOf(frame), HasSubstr(R"("kind":"hull","hullId":")" + std::string(id) + '"'));
    EXPECT_THAT(HeadOf(frame), HasSubstr(R"("vertices":3,"facets":1,"indices":3)"));
    EXPECT_THAT(HeadOf(frame), HasSubstr(R"("revision":"42")"));
    const std::string body = BodyOf(frame);
    ASSERT_EQ(body.size(), 9 * 8 + 4 * 4);
    EXPECT_EQ(NumberAt<double>(body, 8 * 8), 0.1);
    EXPECT_EQ(NumberAt<uint32_t>(body, 9 * 8), 3);
    EXPECT_EQ(NumberAt<uint32_t>(body, 9 * 8 + 3 * 4), 2);
  }
}

TEST(Protocol, ScenesNameObjectsAndTheirPoses) {
  ViewScene scene;
  scene.title = "two \"boxes\"";
  scene.objects = {{"box", "cell/box", -1, {1, 0, 0, 0, 0.1, 0, 0}}};
  const std::string json = SceneMessage(scene, 3);
  EXPECT_THAT(json, HasSubstr(R"("number":3)"));
  EXPECT_THAT(json, HasSubstr(R"("title":"two \"boxes\"")"));
  EXPECT_THAT(
      json,
      HasSubstr(
          R"({"name":"box","hullId":"cell/box","file":-1,"pose":[1,0,0,0,0.1,0,0],"radius":0,)"
          R"("isJointed":false,"endPose":null})"));
  EXPECT_THAT(json, HasSubstr(R"("joints":[],"waypoints":[],"contacts":[],"named":[])"));
}

TEST(Protocol, MotionsAreSentWithTheirEnd) {
  ViewScene scene;
  scene.objects = {{"box", "box", -1, {1, 0, 0, 0, 0.1, 0, 0}}};
  scene.objects[0].motion = {{1, 0, 0, 0, 0.1, 0, 0}, {0, 2, 0, 0, 1e-300, 0, 5}};
  EXPECT_THAT(SceneMessage(scene, 3), HasSubstr(R"("endPose":[0,2,0,0,1e-300,0,5]})"));
}

TEST(Protocol, JointsAreSentWithTheirTrajectory) {
  ViewScene scene;
  scene.joints.joints = {{"elbow", -1, 2, 0.5}};
  scene.joints.waypoints = {{0.5}, {1e-300}};
  scene.joints.contacts = {1};
  EXPECT_THAT(SceneMessage(scene, 1),
              HasSubstr(R"("joints":[{"name":"elbow","low":-1,"high":2,"value":0.5}],)"
                        R"("waypoints":[[0.5],[1e-300]],"contacts":[1])"));
  const auto message =
      ParsePageMessage(R"({"type":"joints","scene":4,"values":[0.25,-1],"waypoint":null})");
  ASSERT_TRUE(message.ok()) << message.status();
  EXPECT_EQ(message->joints->scene, 4);
  EXPECT_THAT(message->joints->values, ElementsAre(0.25, -1));
  EXPECT_THAT(ErrorOf(R"({"type":"joints","scene":4,"values":["Infinity"]})"),
              HasSubstr("\"values\" contains a value that is not a finite number"));
}

// Invalid UTF-8 would end the connection of the page.
TEST(Protocol, NamesOfFilesAreUtf8) {
  EXPECT_EQ(ShownName("/a/b/h\xc3\xbclle \xe2\x82\xac \xf0\x9f\x95\xb7.obj"),
            "h\xc3\xbclle \xe2\x82\xac \xf0\x9f\x95\xb7.obj");
  EXPECT_EQ(ShownName("h\xfclle.obj"), "h?lle.obj");
  // Overlong, half of a surrogate pair, beyond the last code point, truncated.
  EXPECT_EQ(ShownName("\xc0\xaf"), "??");
  EXPECT_EQ(ShownName("\xed\xa0\x80"), "???");
  EXPECT_EQ(ShownName("\xf5\x80\x80\x80"), "????");
  EXPECT_EQ(ShownName("\xe2\x82"), "??");
}

TEST(Protocol, NumbersThatJsonLacksBecomeNull) {
  const double numbers[] = {std::numeric_limits<double>::infinity(), std::nan(""), 2};
  EXPECT_EQ(NumbersJson(numbers), "[null,null,2]");
}

}  // namespace protocol_test
}  // namespace hulld
