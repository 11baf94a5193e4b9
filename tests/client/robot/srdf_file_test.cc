#include "client/robot/srdf_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "client/robot/urdf_file.h"
#include "tests/client/robot/urdf_text.h"

namespace hulld {
namespace srdf_file_test {

using testing::HasSubstr;

class SrdfFile : public testing::Test {
 protected:
  LinkPair Pair(const char* a, const char* b) const {
    return MakeLinkPair(robot_.FindLink(a), robot_.FindLink(b));
  }
  absl::StatusOr<std::set<LinkPair>> Parse(const std::string& body) const {
    return ParseDisabledPairs("<robot name=\"arm\">\n" + body + "\n</robot>", "arm.srdf", robot_);
  }

  const Robot robot_ = *ParseUrdf(kArmUrdf, "arm.urdf");
};

TEST_F(SrdfFile, DisabledPairsAreRead) {
  const auto pairs = Parse(
      "<group name=\"g\"/>\n<disable_collisions link1=\"tool\" link2=\"base\" reason=\"Never\"/>\n"
      "<disable_default_collisions link=\"lower\"/>\n"
      "<enable_collisions link1=\"lower\" link2=\"base\"/>");
  ASSERT_TRUE(pairs.ok()) << pairs.status();
  EXPECT_TRUE(pairs->contains(Pair("base", "tool")));
  EXPECT_TRUE(pairs->contains(Pair("lower", "tool")));
  EXPECT_FALSE(pairs->contains(Pair("lower", "base")));
  EXPECT_FALSE(pairs->contains(Pair("base", "upper")));
}

TEST_F(SrdfFile, ErrorsNameLineAndLink) {
  EXPECT_THAT(Parse("<disable_collisions link1=\"base\" link2=\"bse\"/>").status().ToString(),
              HasSubstr("arm.srdf:2: <disable_collisions> names the link \"bse\""));
  EXPECT_THAT(Parse("<disable_collisions link1=\"base\"/>").status().ToString(),
              HasSubstr("arm.srdf:2: <disable_collisions> lacks link2"));
}

// The tool is attached to a bare flange, so its neighbor is the finger.
TEST_F(SrdfFile, NeighborsAreFoundThroughBareLinks) {
  const std::set<LinkPair> expected = {Pair("base", "upper"), Pair("upper", "lower"),
                                       Pair("lower", "finger"), Pair("finger", "tool")};
  EXPECT_EQ(AdjacentPairs(robot_), expected);
}

// A floating joint lets its links move into each other, so none of them is omitted.
TEST(AdjacentPairs, LooseJointsConnectNothing) {
  for (const char* type : {"floating", "planar"}) {
    std::string urdf = kArmUrdf;
    urdf.replace(urdf.find("type=\"continuous\""), 17, "type=\"" + std::string(type) + "\"");
    const Robot robot = *ParseUrdf(urdf, "arm.urdf");
    EXPECT_FALSE(AdjacentPairs(robot).contains(
        MakeLinkPair(robot.FindLink("upper"), robot.FindLink("lower"))));
    EXPECT_EQ(AdjacentPairs(robot).size(), 3u);
  }
}

// All links attached to a bare root are neighbors; branches of a link with shapes are not.
TEST(AdjacentPairs, BranchesOfABareRootAreNeighbors) {
  const auto robot = [](const char* root) {
    const std::string shape = "<collision><geometry><sphere radius=\"1\"/></geometry></collision>";
    return *ParseUrdf("<robot name=\"r\"><link name=\"root\">" + std::string(root) +
                          "</link><link name=\"a\">" + shape + "</link><link name=\"b\">" + shape +
                          "</link><joint name=\"i\" type=\"fixed\"><parent link=\"root\"/>"
                          "<child link=\"a\"/></joint><joint name=\"j\" type=\"fixed\">"
                          "<parent link=\"root\"/><child link=\"b\"/></joint></robot>",
                      "r.urdf");
  };
  EXPECT_EQ(AdjacentPairs(robot("")).size(), 1u);
  const Robot full = robot("<collision><geometry><sphere radius=\"1\"/></geometry></collision>");
  EXPECT_EQ(AdjacentPairs(full).size(), 2u);
  EXPECT_FALSE(AdjacentPairs(full).contains(MakeLinkPair(full.FindLink("a"), full.FindLink("b"))));
}

TEST_F(SrdfFile, RoundTrips) {
  std::ostringstream out;
  WriteSrdf(robot_, {{Pair("base", "tool"), "Never"}, {Pair("base", "upper"), "Adjacent"}}, "why",
            out);
  const auto pairs = ParseDisabledPairs(out.str(), "arm.srdf", robot_);
  ASSERT_TRUE(pairs.ok()) << pairs.status();
  EXPECT_EQ(*pairs, (std::set<LinkPair>{Pair("base", "tool"), Pair("base", "upper")}));
  EXPECT_THAT(out.str(), HasSubstr("reason=\"Never\""));
}

}  // namespace srdf_file_test
}  // namespace hulld
