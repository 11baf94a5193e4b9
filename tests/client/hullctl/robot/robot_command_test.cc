// hullctl robot, against the real server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/point_reading.h"
#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace {

using testing::HasSubstr;
using testing::Not;

// Three boxes in a row on two joints; the last folds back onto the first.
constexpr char kUrdf[] = R"(<robot name="chain">
  <link name="a"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <joint name="i" type="prismatic"><parent link="a"/><child link="b"/><origin xyz="1 0 0"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="1"/></joint>
  <link name="b"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <joint name="j" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="1 0 0"/>
    <axis xyz="1 0 0"/><limit lower="-3" upper="1"/></joint>
  <link name="c"><collision><geometry><cylinder radius="0.5" length="1"/></geometry></collision></link>
</robot>)";

class HullctlRobot : public HullctlOnServer {
 protected:
  HullctlRobot() : urdf_("chain.urdf", kUrdf) {}

  Ran Robot(std::vector<std::string> more) {
    more.insert(more.begin(), {"robot", "check", urdf_.path()});
    return Ask(more);
  }
  std::string Hulls() { return Ask({"list", "--output", "name"}).out; }

  const TempFile urdf_;
};

TEST_F(HullctlRobot, OneConfigurationNamesEveryPairWithItsSeparation) {
  Ran ran = Robot({});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("# c: a cylinder within a polyhedron that reaches at most 0.002"));
  EXPECT_THAT(ran.out, HasSubstr("# 1 pairs; 2 left out by being adjacent\n"));
  EXPECT_THAT(ran.out, HasSubstr("a\tc\tSEPARATED\t0.9"));
  EXPECT_THAT(ran.out, HasSubstr("# separated 1 touching 0 overlapping 0 failed 0\n"));
  // The hulls are gone again.
  EXPECT_EQ(Hulls(), "");
  ran = Robot({"--adjacent"});
  EXPECT_THAT(ran.out, HasSubstr("a\tb\tTOUCHING\t0"));
  ran = Robot({"--joint", "j=-2"});
  EXPECT_THAT(ran.out, HasSubstr("a\tc\tOVERLAPPING\t-1"));
  EXPECT_EQ(ran.err, "");
  ran = Robot({"--joint", "j=5"});
  EXPECT_THAT(ran.err, HasSubstr("warning: j is at 5, beyond its limits -3 to 1"));
}

TEST_F(HullctlRobot, PrefixKeepsTheHulls) {
  EXPECT_EQ(Robot({"--prefix", "arm/"}).code, 0);
  EXPECT_EQ(Hulls(), "arm/a\narm/b\narm/c\n");
  EXPECT_EQ(Robot({"--prefix", "arm/"}).code, 0);
}

TEST_F(HullctlRobot, ATrajectoryTellsContactsAndTheFirst) {
  const TempFile path("path.csv", "j\n0\n-0.5\n-1.5\n-2\n0\n9\n");
  Ran ran = Robot({"--joints", path.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("\n3\tENTER\ta\tc\tOVERLAPPING\n5\tLEAVE\ta\tc\tSEPARATED\n"));
  EXPECT_THAT(ran.out, HasSubstr("# separated 4 touching 0 overlapping 2 failed 0\n"
                                 "# 2 of 6 waypoints in contact\n"));
  EXPECT_THAT(ran.out, HasSubstr("# first contact at waypoint 3 ("));
  EXPECT_THAT(ran.out, HasSubstr("path.csv:4): a with c, OVERLAPPING\n"));
  EXPECT_THAT(ran.err, HasSubstr("path.csv:7: j is at 9"));
  ran = Robot({"--joints", path.path(), "--first"});
  EXPECT_THAT(ran.out, HasSubstr("# separated 2 touching 0 overlapping 1 failed 0\n"));
  EXPECT_EQ(Hulls(), "");
}

// More waypoints than one message takes.
TEST_F(HullctlRobot, LongTrajectoriesGoInSeveralMessages) {
  std::string text = "j\n";
  for (int i = 0; i < 5000; ++i) text += i == 4321 ? "-2\n" : "0\n";
  const TempFile path("path.csv", text);
  const Ran ran = Robot({"--joints", path.path()});
  EXPECT_THAT(ran.out, HasSubstr("# separated 4999 touching 0 overlapping 1 failed 0\n"));
  EXPECT_THAT(ran.out, HasSubstr("4322\tENTER\ta\tc\tOVERLAPPING\n4323\tLEAVE"));
}

TEST_F(HullctlRobot, ASceneStandsAround) {
  Put("cube", server::Cube());
  const TempFile scene("cell.yaml", "place:\n  floor: {id: cube, at: [0, 0, 0.5]}\n");
  Ran ran = Robot({"--scene", scene.path(), "--base", "0,0,0"});
  EXPECT_THAT(ran.out, HasSubstr("a\tfloor\tTOUCHING\t0"));
  EXPECT_THAT(ran.out, HasSubstr("c\tfloor\tSEPARATED\t"));
  ran = Robot({"--scene", scene.path(), "--ignore", "a,floor"});
  EXPECT_THAT(ran.out, Not(HasSubstr("a\tfloor")));
  EXPECT_EQ(Robot({"--scene", scene.path(), "--ignore", "a,flor"}).code, 2);
  const TempFile lost("lost.yaml", "place:\n  floor: {id: nowhere}\n");
  ran = Robot({"--scene", lost.path()});
  EXPECT_EQ(ran.code, 4);
  EXPECT_THAT(ran.err, HasSubstr("hull \"nowhere\" not found"));
}

TEST_F(HullctlRobot, ABodyStandsAround) {
  Put("cube", server::Cube());
  ASSERT_EQ(Ask({"body", "put", "stand", "cube@9,9,9", "cube@0,0,0.5"}).code, 0);
  const TempFile scene("cell.yaml", "place:\n  stand: {id: stand}\n");
  const Ran ran = Robot({"--scene", scene.path(), "--base", "0,0,0"});
  EXPECT_THAT(ran.out, HasSubstr("a\tstand\tTOUCHING\t0"));
  EXPECT_THAT(ran.out, HasSubstr("\tpieces - 1\n"));
  EXPECT_THAT(ran.out, Not(HasSubstr("pieces - -")));
}

TEST_F(HullctlRobot, AcmWritesWhatCheckReads) {
  const Ran ran = Ask({"robot", "acm", urdf_.path(), "--samples", "500", "--seed", "7"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("link1=\"a\" link2=\"b\" reason=\"Adjacent\""));
  EXPECT_THAT(ran.out, Not(HasSubstr("link1=\"a\" link2=\"c\"")));
  EXPECT_EQ(Ask({"robot", "acm", urdf_.path(), "--samples", "500", "--seed", "7"}).out, ran.out);
  const TempFile srdf("chain.srdf", ran.out);
  EXPECT_THAT(Robot({"--srdf", srdf.path()}).out, HasSubstr("# 1 pairs; 2 left out by "));
  EXPECT_EQ(Hulls(), "");
}

TEST_F(HullctlRobot, ErrorsNameFileAndLine) {
  const TempFile mesh("m.urdf",
                      "<robot name=\"m\">\n<link name=\"l\">\n<collision><geometry><mesh "
                      "filename=\"package://p/a.stl\"/></geometry></collision></link></robot>");
  const Ran ran = Ask({"robot", "check", mesh.path()});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("m.urdf:3: link \"l\": no folder of the package \"p\""));
  EXPECT_EQ(Ask({"robot", "check", mesh.path(), "--package", "p"}).code, 2);
}

}  // namespace
}  // namespace hulld
