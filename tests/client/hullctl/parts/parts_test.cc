// hullctl append --split, the excess volume of hulls, and cover, against the real server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/point_reading.h"
#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace parts_test {

using testing::HasSubstr;

// Returns a box as OBJ with vertices numbered from `first`.
std::string Box(const std::string& name, double x, double y, double dx, double dy, int first) {
  std::string text = "o " + name + "\n";
  for (int corner = 0; corner < 8; ++corner) {
    text += "v " + std::to_string(x + (corner % 2 == 0 ? 0 : dx)) + " " +
            std::to_string(y + (corner / 2 % 2 == 0 ? 0 : dy)) + " " + (corner < 4 ? "0" : "1") +
            "\n";
  }
  const int faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                           {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& face : faces) {
    text += "f";
    for (const int corner : face) text += " " + std::to_string(corner + first);
    text += "\n";
  }
  return text;
}

class HullctlParts : public HullctlOnServer {
 protected:
  // An L of two boxes: volume 4 + 3 in a hull of 11.5.
  HullctlParts() : bracket_("l.obj", Box("foot", 0, 0, 4, 1, 1) + Box("back", 0, 1, 1, 3, 9)) {}

  const TempFile bracket_;
};

TEST_F(HullctlParts, AppendReportsHowMuchLargerTheHullIs) {
  Ran ran = Run({"append", "l", bracket_.path(), "--create"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("volume     1.643 times that of the mesh\n"));
  EXPECT_THAT(ran.err, HasSubstr("warning: the hull l has 1.643 times the volume of its mesh"));
  // It now also contains points from elsewhere.
  ran = Run({"append", "l", bracket_.path()});
  EXPECT_THAT(ran.out, testing::Not(HasSubstr("volume")));
  const TempFile open("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n");
  EXPECT_THAT(Run({"append", "o", open.path(), "--create"}).out,
              HasSubstr("not compared: the mesh is not closed"));
  const TempFile points("p.xyz", "0 0 0\n");
  EXPECT_THAT(Run({"append", "p", points.path(), "--create"}).out,
              testing::Not(HasSubstr("volume")));
}

TEST_F(HullctlParts, SplitMakesAHullOfEachPart) {
  Ran ran = Run({"append", "l", bracket_.path(), "--split", "names", "--create"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("l/foot"));
  EXPECT_THAT(ran.out, HasSubstr("1 times that of the mesh"));
  EXPECT_EQ(ran.err, "");
  EXPECT_EQ(Run({"list", "--output", "name"}).out, "l/back\nl/foot\n");
  // The boxes share corners, so they are connected.
  ran = Run(
      {"append", "k", bracket_.path(), "--split", "components", "--create", "--output", "name"});
  EXPECT_EQ(ran.out, "k/component-1\nk\n");
  EXPECT_EQ(Run({"append", "n", bracket_.path(), "--split", "names"}).code, 1);
  EXPECT_EQ(Run({"append", "n", bracket_.path(), "--split", "names", "--writer", "w"}).code, 2);
}

TEST_F(HullctlParts, SplitMakesABodyOfTheParts) {
  const std::vector<std::string> split = {"append",  "l",     bracket_.path(),
                                          "--split", "names", "--create"};
  Ran ran = Run(split);
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("\nbody l created at revision "));
  EXPECT_THAT(ran.out, HasSubstr(", 2 pieces\n"));
  EXPECT_EQ(Run({"body", "get", "l", "--output", "name"}).out, "l/foot\nl/back\n");
  // Repeated: the body stays unchanged.
  const std::string before = Run({"body", "get", "l"}).out;
  ran = Run(split);
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("\nbody l already has all parts, at revision "));
  EXPECT_EQ(Run({"body", "get", "l"}).out, before);
  // A missing part is appended; a moved one keeps its pose.
  ASSERT_EQ(Run({"body", "put", "l", "l/back@0,0,9"}).code, 0);
  EXPECT_THAT(Run(split).out, HasSubstr("\nbody l extended at revision "));
  EXPECT_THAT(RunJson({"body", "get", "l"}).out, HasSubstr("\"z\":9"));
  EXPECT_EQ(Run({"body", "get", "l", "--output", "name"}).out, "l/back\nl/foot\n");
  ran = RunJson({"append", "j", bracket_.path(), "--split", "names", "--create"});
  EXPECT_THAT(ran.out, HasSubstr("{\"bodyId\":\"j\",\"pieces\":\"2\",\"added\":\"2\","));
}

TEST_F(HullctlParts, SplitChangesNothingIfTheServerWouldRefuseTheBody) {
  server::Config config = TestConfig();
  config.limits.max_pieces_per_body = 1;
  Restart(config);
  Ran ran = Run({"append", "l", bracket_.path(), "--split", "names", "--create"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, HasSubstr("would have 2 pieces; the limit is 1 (--max-pieces-per-body)"));
  EXPECT_EQ(Run({"list", "--output", "name"}).out, "");
}

TEST_F(HullctlParts, SplitChangesNothingIfAHullHasTheName) {
  Put("l", server::Cube());
  const std::string before = Run({"list"}).out;
  Ran ran = Run({"append", "l", bracket_.path(), "--split", "names", "--create"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, HasSubstr("hull \"l\" already exists"));
  EXPECT_EQ(Run({"list"}).out, before);
  ran = Run({"append", "n", bracket_.path(), "--split", "names"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, HasSubstr("body \"n\" not found"));
  EXPECT_EQ(Run({"list"}).out, before);
}

TEST_F(HullctlParts, CoverUsesThePosesOfTheBody) {
  ASSERT_EQ(Run({"append", "l", bracket_.path(), "--split", "names", "--create"}).code, 0);
  Ran ran = Run({"cover", "l", bracket_.path()});
  EXPECT_EQ(ran.out, "ENCLOSED: each of the 24 triangles is in the hulls together (exact)\n");
  // Moved by the smallest step, it no longer encloses the mesh.
  ASSERT_EQ(Run({"body", "put", "moved", "l/foot@0,0,5e-324", "l/back"}).code, 0);
  EXPECT_EQ(Run({"cover", "moved", bracket_.path(), "--output", "name"}).out, "OUTSIDE\n");
  ASSERT_EQ(Run({"body", "put", "half", "l/foot", "nail"}).code, 0);
  ran = Run({"cover", "half", bracket_.path()});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, HasSubstr("body \"half\": piece 1: hull \"nail\" not found"));
}

TEST_F(HullctlParts, CoverReportsProtrudingPoints) {
  ASSERT_EQ(Run({"append", "l", bracket_.path(), "--split", "names", "--create"}).code, 0);
  Ran ran = Run({"cover", "l/foot", "l/back", bracket_.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out, "ENCLOSED: each of the 24 triangles is in the hulls together (exact)\n");
  EXPECT_EQ(Run({"cover", "l/", bracket_.path()}).out, ran.out);
  ran = Run({"cover", "l/foot", bracket_.path(), "--limit", "1"});
  EXPECT_THAT(ran.out, HasSubstr("OUTSIDE: 10 of 24 triangles stick out (exact), by 3, with an "));
  EXPECT_THAT(ran.out, HasSubstr("triangle 12\tby 3\tat 0 4 1\n# 9 more; raise --limit"));
  ran = Run({"cover", "l/foot", bracket_.path(), "--output", "name"});
  EXPECT_EQ(ran.out, "OUTSIDE\n");
  EXPECT_THAT(RunJson({"cover", "l/", bracket_.path()}).out, HasSubstr("\"enclosed\":true"));
  EXPECT_EQ(Run({"cover", "l/foot"}).code, 2);
  EXPECT_EQ(Run({"cover", "nowhere", bracket_.path()}).code, 1);
}

}  // namespace parts_test
}  // namespace hulld
