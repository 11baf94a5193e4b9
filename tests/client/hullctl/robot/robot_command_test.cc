// hullctl robot, against the real server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/point_reading.h"
#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace robot_command_test {

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
    return Run(more);
  }
  std::string Hulls() { return Run({"list", "--output", "name"}).out; }

  const TempFile urdf_;
};

TEST_F(HullctlRobot, AConfigurationListsEveryPairWithItsSeparation) {
  Ran ran = Robot({});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("# c: a cylinder within a polyhedron that reaches at most 0.002"));
  EXPECT_THAT(ran.out, HasSubstr("# 1 pair; 2 excluded by adjacency\n"));
  EXPECT_THAT(ran.out, HasSubstr("a\tc\tSEPARATED\t0.9"));
  EXPECT_THAT(ran.out, HasSubstr("# separated 1 touching 0 overlapping 0 failed 0\n"));
  ran = Robot({"--adjacent"});
  EXPECT_THAT(ran.out, HasSubstr("a\tb\tTOUCHING\t0"));
  ran = Robot({"--joint", "j=-2"});
  EXPECT_THAT(ran.out, HasSubstr("a\tc\tOVERLAPPING\t-1"));
  EXPECT_EQ(ran.err, "");
  ran = Robot({"--joint", "j=5"});
  EXPECT_THAT(ran.err, HasSubstr("warning: j is at 5, beyond its limits -3 to 1"));
}

// A sphere and a capsule, lying along x: their surfaces meet at 3 - 0.5 - 0.25 - 1 = 1.25.
TEST_F(HullctlRobot, SpheresAndCapsulesAreExact) {
  const TempFile urdf("round.urdf", R"(<robot name="round">
  <link name="a"><collision><geometry><sphere radius="0.5"/></geometry></collision></link>
  <joint name="i" type="prismatic"><parent link="a"/><child link="b"/><origin xyz="3 0 0"/>
    <axis xyz="1 0 0"/><limit lower="-3" upper="1"/></joint>
  <link name="b"><collision><origin rpy="0 1.5707963267948966 0"/>
    <geometry><capsule radius="0.25" length="2"/></geometry></collision></link>
</robot>)");
  const auto relation = [&](const char* value) {
    return Run({"robot", "check", urdf.path(), "--adjacent", "--joint", std::string("i=") + value})
        .out;
  };
  EXPECT_THAT(relation("0"), HasSubstr("a\tb\tSEPARATED\t1.2499999999"));
  EXPECT_THAT(relation("0"), Not(HasSubstr("polyhedron")));
  EXPECT_THAT(relation("-1.2499999"), HasSubstr("SEPARATED"));
  EXPECT_THAT(relation("-1.2500001"), HasSubstr("OVERLAPPING"));
  const TempFile scene("scene.yaml",
                       "hulls: {p: {points: [[0, 0, 0]]}}\nplace: {ball: {hull: p, at: [0, 1, 0], "
                       "radius: 0.5}}\n");
  ASSERT_EQ(Run({"scene", "apply", scene.path()}).code, 0);
  const Ran around = Run({"robot", "check", urdf.path(), "--scene", scene.path()});
  EXPECT_THAT(around.out, HasSubstr("a\tball\tTOUCHING")) << around.err;
}

TEST_F(HullctlRobot, PrefixKeepsTheHulls) {
  EXPECT_EQ(Robot({"--prefix", "arm/"}).code, 0);
  EXPECT_EQ(Hulls(), "arm/a\narm/b\narm/c\n");
  EXPECT_EQ(Robot({"--prefix", "arm/"}).code, 0);
}

TEST_F(HullctlRobot, ATrajectoryReportsContactsAndTheFirstOfThem) {
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
}

// More waypoints than fit in one message.
TEST_F(HullctlRobot, LongTrajectoriesAreSentInSeveralMessages) {
  std::string text = "j\n";
  for (int i = 0; i < 5000; ++i) text += i == 4321 ? "-2\n" : "0\n";
  const TempFile path("path.csv", text);
  const Ran ran = Robot({"--joints", path.path()});
  EXPECT_THAT(ran.out, HasSubstr("# separated 4999 touching 0 overlapping 1 failed 0\n"));
  EXPECT_THAT(ran.out, HasSubstr("4322\tENTER\ta\tc\tOVERLAPPING\n4323\tLEAVE"));
}

TEST_F(HullctlRobot, ASceneSurroundsTheRobot) {
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

TEST_F(HullctlRobot, ABodySurroundsTheRobot) {
  Put("cube", server::Cube());
  ASSERT_EQ(Run({"body", "put", "stand", "cube@9,9,9", "cube@0,0,0.5"}).code, 0);
  const TempFile scene("cell.yaml", "place:\n  stand: {id: stand}\n");
  const Ran ran = Robot({"--scene", scene.path(), "--base", "0,0,0"});
  EXPECT_THAT(ran.out, HasSubstr("a\tstand\tTOUCHING\t0"));
  EXPECT_THAT(ran.out, HasSubstr("\tpieces - 1\n"));
  EXPECT_THAT(ran.out, Not(HasSubstr("pieces - -")));
}

TEST_F(HullctlRobot, CheckReadsTheOutputOfAcm) {
  const Ran ran = Run({"robot", "acm", urdf_.path(), "--samples", "500", "--seed", "7"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("link1=\"a\" link2=\"b\" reason=\"Adjacent\""));
  EXPECT_THAT(ran.out, Not(HasSubstr("link1=\"a\" link2=\"c\"")));
  EXPECT_EQ(Run({"robot", "acm", urdf_.path(), "--samples", "500", "--seed", "7"}).out, ran.out);
  const TempFile srdf("chain.srdf", ran.out);
  EXPECT_THAT(Robot({"--srdf", srdf.path()}).out, HasSubstr("# 1 pair; 2 excluded by "));
}

// b is attached to a through a link without shapes.
constexpr char kBareUrdf[] = R"(<robot name="bare">
  <link name="a"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <link name="frame"/>
  <link name="b"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <link name="c"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <joint name="i" type="fixed"><parent link="a"/><child link="frame"/></joint>
  <joint name="j" type="fixed"><parent link="frame"/><child link="b"/><origin xyz="0.5 0 0"/></joint>
  <joint name="k" type="fixed"><parent link="b"/><child link="c"/><origin xyz="5 0 0"/></joint>
</robot>)";

TEST_F(HullctlRobot, PairsLeftOutThroughLinksWithoutShapesAreCounted) {
  const TempFile bare("bare.urdf", kBareUrdf);
  const Ran ran = Run({"robot", "check", bare.path()});
  EXPECT_THAT(ran.out, HasSubstr("# 1 pair; 2 excluded by adjacency, 1 of them joined "
                                 "through links without shapes\n"));
  EXPECT_THAT(Run({"robot", "check", bare.path(), "--adjacent"}).out,
              HasSubstr("# 3 pairs\na\tb\tOVERLAPPING"));
}

TEST_F(HullctlRobot, AdjacentIsSuggestedOnlyIfItHelps) {
  const std::string link =
      "<collision><geometry><box size=\"1 1 1\"/></geometry></collision></link>";
  const TempFile two("two.urdf", "<robot name=\"r\"><link name=\"a\">" + link +
                                     "<link name=\"b\">" + link +
                                     "<joint name=\"i\" type=\"fixed\"><parent link=\"a\"/><child "
                                     "link=\"b\"/></joint></robot>");
  const TempFile one("one.urdf", "<robot name=\"r\"><link name=\"a\">" + link + "</robot>");
  const TempFile srdf("two.srdf",
                      "<robot name=\"r\"><disable_collisions link1=\"a\" link2=\"b\"/></robot>");
  const auto error = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"robot", "check"});
    const Ran ran = Run(more);
    EXPECT_EQ(ran.code, 2);
    return ran.err;
  };
  EXPECT_THAT(error({two.path()}), HasSubstr("--adjacent includes adjacent links"));
  EXPECT_THAT(error({two.path(), "--srdf", srdf.path()}),
              HasSubstr("two.srdf disables all of them"));
  EXPECT_THAT(error({two.path(), "--srdf", srdf.path()}), Not(HasSubstr("--adjacent")));
  EXPECT_THAT(error({two.path(), "--adjacent", "--ignore", "a,b"}),
              HasSubstr("--ignore excludes all of them"));
  EXPECT_THAT(error({one.path()}), HasSubstr("a pair needs two links with shapes, or --scene"));
  EXPECT_THAT(error({one.path()}), Not(HasSubstr("--adjacent")));
}

// A box on wheels and a free-floating crate.
constexpr char kLooseUrdf[] = R"(<robot name="loose">
  <link name="world"/>
  <link name="cart"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <link name="crate"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <joint name="wheels" type="planar"><parent link="world"/><child link="cart"/><axis xyz="0 0 1"/></joint>
  <joint name="free" type="floating"><parent link="world"/><child link="crate"/></joint>
</robot>)";

TEST_F(HullctlRobot, PlanarAndFloatingJointsAcceptValues) {
  const TempFile loose("loose.urdf", kLooseUrdf);
  Ran ran = Run({"robot", "check", loose.path(), "--joint", "free=1,0,0"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("# 1 pair\ncrate\tcart\tTOUCHING\t0"));
  ran = Run({"robot", "check", loose.path(), "--joint", "wheels=3,0,1.5707963267948966", "--joint",
             "free=1,0,0,0,5.5,0,0"});
  EXPECT_THAT(ran.out, HasSubstr("crate\tcart\tSEPARATED\t1."));
  ran = Run({"robot", "check", loose.path(), "--joint", "wheels/x=-1", "--joint", "free/rot_z=1"});
  EXPECT_THAT(ran.out, HasSubstr("crate\tcart\tTOUCHING\t0"));
  const TempFile path("path.csv", "wheels/x,free/trans_z\n0,3\n0,1\n4,0\n");
  ran = Run({"robot", "check", loose.path(), "--joints", path.path()});
  EXPECT_THAT(ran.out, HasSubstr("2\tENTER\tcrate\tcart\tTOUCHING"));
  for (const char* wrong :
       {"wheels=1,2", "free=1", "free=0,0,0,0,1,2,3", "free/rot_w=0", "fre=1"}) {
    ran = Run({"robot", "check", loose.path(), "--joint", wrong});
    EXPECT_EQ(ran.code, 2) << wrong;
    EXPECT_THAT(ran.err, HasSubstr("--joint: ")) << wrong;
  }
  // The crate's position is unbounded, so samples cannot show that it never collides.
  ran = Run({"robot", "acm", loose.path(), "--samples", "5"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, Not(HasSubstr("disable_collisions")));
}

// Returns a box from `x` to x + 1 as OBJ with vertices numbered from `first`.
std::string BoxObj(const std::string& keyword, double x, int first) {
  std::string text = keyword + "\n";
  for (int corner = 0; corner < 8; ++corner) {
    text += "v " + std::to_string(x + corner % 2) + " " + std::to_string(corner / 2 % 2) + " " +
            std::to_string(corner / 4) + "\n";
  }
  for (const char* face : {"0462", "1375", "0154", "2673", "0231", "4576"}) {
    text += "f";
    for (const char* corner = face; *corner != '\0'; ++corner) {
      text += " " + std::to_string(*corner - '0' + first);
    }
    text += "\n";
  }
  return text;
}

class MeshRobot : public HullctlRobot {
 protected:
  // A post between two boxes of a single mesh, scaled by 1/2.
  Ran Check(const std::string& obj, std::vector<std::string> more = {}) {
    const TempFile mesh("gap.obj", obj);
    const TempFile urdf(
        "gap.urdf",
        "<robot name=\"r\"><link name=\"gap\"><collision><geometry><mesh filename=\"" +
            mesh.path() +
            "\" scale=\"0.5 0.5 0.5\"/></geometry></collision></link><link "
            "name=\"post\"><collision>"
            "<origin xyz=\"1.5 0 0\"/><geometry><box size=\"0.5 9 "
            "9\"/></geometry></collision></link>"
            "<joint name=\"j\" type=\"fixed\"><parent link=\"gap\"/><child link=\"post\"/></joint>"
            "</robot>");
    more.insert(more.begin(), {"robot", "check", urdf.path(), "--adjacent"});
    return Run(more);
  }
};

TEST_F(MeshRobot, ConvexPartsOfAFileArePieces) {
  for (const char* keyword : {"o convex_", "g hull_"}) {
    const std::string obj =
        BoxObj(keyword + std::string("0"), 0, 1) + BoxObj(keyword + std::string("1"), 5, 9);
    Ran ran = Check(obj);
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(ran.err, "");
    EXPECT_THAT(ran.out, HasSubstr("# gap: 2 pieces of "));
    EXPECT_THAT(ran.out, HasSubstr("gap/1\tpost\tSEPARATED\t0.7"));
    EXPECT_THAT(ran.out, HasSubstr("gap/2\tpost\tSEPARATED\t0.7"));
    ran = Check(obj, {"--split", "none"});
    EXPECT_THAT(ran.out, HasSubstr("gap\tpost\tOVERLAPPING"));
    EXPECT_THAT(ran.err, HasSubstr("warning: the hull of gap has 3 times the volume of its mesh"));
  }
}

TEST_F(MeshRobot, OtherPartsArePiecesIfRequested) {
  // An object with two components, and another object.
  const std::string obj =
      BoxObj("o both", 0, 1) + BoxObj("# still both", 5, 9) + BoxObj("o far", 20, 17);
  Ran ran = Check(obj);
  EXPECT_THAT(ran.out, HasSubstr("gap\tpost\tOVERLAPPING"));
  EXPECT_THAT(ran.err, HasSubstr("use a convex decomposition of the mesh, or --split"));
  ran = Check(obj, {"--split", "names"});
  EXPECT_THAT(ran.out, HasSubstr("# gap: 2 pieces of "));
  EXPECT_THAT(ran.out, HasSubstr("gap/1\tpost\tOVERLAPPING"));
  ran = Check(obj, {"--split", "components"});
  EXPECT_THAT(ran.out, HasSubstr("# gap: 3 pieces of "));
  EXPECT_THAT(ran.out, Not(HasSubstr("OVERLAPPING\t")));
}

class StoredHulls : public MeshRobot {
 protected:
  // Returns the revision of the store, which every change raises.
  uint64_t Revision() {
    grpc::ClientContext context;
    v1::ListHullsResponse list;
    EXPECT_TRUE(hulls_->ListHulls(&context, {}, &list).ok());
    return list.header().revision();
  }
};

TEST_F(StoredHulls, ChecksStoreNothing) {
  Put("cube", server::Cube());
  const uint64_t before = Revision();
  const TempFile path("path.csv", "j\n0\n-2\n");
  EXPECT_EQ(Robot({}).code, 0);
  EXPECT_EQ(Robot({"--joints", path.path()}).code, 0);
  EXPECT_EQ(Robot({"--joints", path.path(), "--continuous"}).code, 0);
  EXPECT_EQ(Run({"robot", "acm", urdf_.path(), "--samples", "5"}).code, 0);
  EXPECT_EQ(Check(BoxObj("o box", 0, 1)).code, 0);
  EXPECT_EQ(Revision(), before);
  EXPECT_EQ(Hulls(), "cube\n");
  EXPECT_EQ(Robot({"--prefix", "arm/"}).code, 0);
  EXPECT_GT(Revision(), before);
}

// Returns points as OBJ.
std::string PointObj(const server::Coordinates& xyz) {
  std::string text;
  for (size_t i = 0; i < xyz.size(); i += 3) {
    text += "v " + std::to_string(xyz[i]) + " " + std::to_string(xyz[i + 1]) + " " +
            std::to_string(xyz[i + 2]) + "\n";
  }
  return text;
}

TEST_F(StoredHulls, MeshesOfManyPointsSendTheVerticesOfTheirHull) {
  const std::string many = PointObj(server::Sphere(5000));
  const std::string inside = BoxObj("o box", 0, 1) + PointObj([] {
                               server::Coordinates xyz = server::Sphere(5000, 2);
                               for (double& x : xyz) x = 0.5 + x / 8;
                               return xyz;
                             }());
  Ran ran = Check(inside);
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("gap\tpost\tSEPARATED\t0.7"));
  ran = Check(many);
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err,
              HasSubstr("gap: its hull has 5000 vertices, but a query can carry at most 4096; "
                        "use --local, or register the hulls with --prefix"));
  EXPECT_EQ(Check(many, {"--prefix", "arm/"}).code, 0);
  setenv("HULLD_BINARY", "/nonexistent/hulld", 1);
  ran = Check(inside);
  const Ran few = Check(BoxObj("o box", 0, 1));
  unsetenv("HULLD_BINARY");
  EXPECT_THAT(ran.err,
              HasSubstr("gap has more than 4096 points, and the local server that would reduce"));
  EXPECT_EQ(few.code, 0) << few.err;
}

TEST_F(HullctlRobot, ErrorsNameFileAndLine) {
  const TempFile mesh("m.urdf",
                      "<robot name=\"m\">\n<link name=\"l\">\n<collision><geometry><mesh "
                      "filename=\"package://p/a.stl\"/></geometry></collision></link></robot>");
  const Ran ran = Run({"robot", "check", mesh.path()});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("m.urdf:3: link \"l\": no folder of the package \"p\""));
  EXPECT_EQ(Run({"robot", "check", mesh.path(), "--package", "p"}).code, 2);
}

}  // namespace robot_command_test
}  // namespace hulld
