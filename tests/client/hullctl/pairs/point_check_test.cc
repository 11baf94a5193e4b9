// hullctl check HULL --points FILE.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/client/hullctl/pairs/cube_server.h"

namespace hulld {
namespace point_check_test {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class PointCheck : public CubeServer {};

TEST_F(PointCheck, DistinguishesInsideOnAndOutsideExactly) {
  const std::string points =
      Write("points.xyz", "0.5 0.5 0.5\n1 0.5 0.5\n1.0000000000000002 0.5 0.5\n1 1 1\n");
  const Ran ran = Run({"check", "cube", "--points", points});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out,
            "0.5 0.5 0.5\tinside\n1 0.5 0.5\ton\n1.0000000000000002 0.5 0.5\toutside\n1 1 1\ton\n"
            "# inside 1 on 2 outside 1 failed 0\n");
  EXPECT_EQ(Run({"check", "cube", "--points", points, "--output", "name"}).out,
            "inside\non\noutside\non\n");
  const Ran moved = Run({"check", "cube", "--points", points, "--pose-a", "-0.5,0,0"});
  EXPECT_THAT(moved.out, EndsWith("# inside 0 on 1 outside 3 failed 0\n"));
}

TEST_F(PointCheck, ReadsEveryFormatAndShowsTheDepth) {
  const std::string points = Write("points.obj", "v 0.5 0.5 0.25\nv 0.5 0.5 3\n");
  const Ran ran = Run({"check", "cube", "--points", points, "--max-error", "0"});
  EXPECT_THAT(ran.out, HasSubstr("0.5 0.5 0.25\tinside\t-0.25 within "));
  EXPECT_THAT(ran.out, HasSubstr("0.5 0.5 3\toutside\t2 within "));
  const Ran json = RunJson({"check", "cube", "--points", points, "--max-error", "0.1"});
  EXPECT_THAT(json.out, StartsWith("{\"point\":[0.5,0.5,0.25],\"side\":\"inside\","
                                   "\"relation\":\"RELATION_OVERLAPPING\""));
  EXPECT_THAT(json.out, HasSubstr("\"separation\":{\"value\":"));
}

TEST_F(PointCheck, AcceptsFilesAndBodies) {
  const std::string cube = Write("cube.xyz", "0 0 0\n2 0 0\n0 2 0\n0 0 2\n0 0 0\n");
  const std::string points = Write("points.csv", "x,y,z\n0.5,0.5,0.5\n0,0,0\n3,0.5,0.5\n");
  EXPECT_THAT(Run({"check", cube, "--points", points}).out,
              EndsWith("# inside 1 on 1 outside 1 failed 0\n"));
  ASSERT_EQ(Run({"body", "put", "row", "cube", "cube@2,0,0"}).code, 0);
  EXPECT_THAT(Run({"check", "row", "--points", points}).out,
              EndsWith("# inside 1 on 2 outside 0 failed 0\n"));
}

TEST_F(PointCheck, SendsPartsWithinTheLimits) {
  server::Config config = TestConfig();
  config.limits.max_pairs_per_batch = 70;
  config.limits.max_placements = 50;
  Restart(config);
  Put("cube", server::Cube());
  std::string text;
  for (int i = 0; i < 1000; ++i) text += std::to_string(i % 3) + " 0.5 0.5\n";
  const Ran ran = Run({"check", "cube", "--points", Write("points.xyz", text)});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, EndsWith("# inside 0 on 667 outside 333 failed 0\n"));
}

TEST_F(PointCheck, ErrorsNameTheDefect) {
  const std::string points = Write("points.xyz", "0 0 0\n");
  const Ran missing = Run({"check", "absent", "--points", points});
  EXPECT_EQ(missing.code, 1);
  EXPECT_THAT(missing.err, HasSubstr("hull \"absent\" not found"));
  EXPECT_EQ(missing.out, "");
  const auto usage = [this](std::vector<std::string> arguments, const std::string& what) {
    const Ran ran = Run(std::move(arguments));
    EXPECT_EQ(ran.code, 2);
    EXPECT_THAT(ran.err, HasSubstr(what));
  };
  usage({"check", "cube", "cube", "--points", points}, "remove B");
  usage({"check", "cube", "--points", points, "--axis"}, "remove --axis");
  usage({"check", "cube", "--points", points, "--verify"}, "remove --verify");
  usage({"check", "cube", "--points", points, "--tolerance", "1"}, "remove --tolerance");
  usage({"check", "cube"}, "B is required");
  usage({"check", "cube", "--points", Write("empty.xyz", "")}, "empty.xyz: contains no points");
  usage({"check", "cube", "--points", Write("nan.xyz", "0 nan 0\n")}, "nan.xyz:1");
  usage({"check", "cube", "--points", "none.xyz"}, "none.xyz");
}

TEST_F(PointCheck, NearestPairsOfAScene) {
  const std::string scene =
      Write("scene.yaml",
            "place:\n  a: {id: cube}\n  b: {id: cube, at: [0.5, 0, 0]}\n"
            "  c: {id: cube, at: [3, 0, 0]}\n  d: {id: cube, at: [9, 0, 0]}\n");
  for (const char* const command : {"scene", "check"}) {
    std::vector<std::string> arguments = {"scene", scene, "--nearest", "2", "--max-error", "0"};
    if (command[0] == 'c') arguments.insert(arguments.begin() + 1, "check");
    const Ran ran = Run(arguments);
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_THAT(ran.out, StartsWith("a\tb\tOVERLAPPING\t-0.5 within "));
    EXPECT_THAT(ran.out, HasSubstr("\nb\tc\tSEPARATED\t1.5 within "));
    EXPECT_THAT(ran.out, EndsWith("\n# touching 0 overlapping 1 separated 5 failed 0\n"));
  }
  EXPECT_EQ(Run({"scene", scene, "--nearest", "9", "--clearance", "2", "--output", "name"}).out,
            "a\tb\tOVERLAPPING\nb\tc\tSEPARATED\na\tc\tSEPARATED\n");
  EXPECT_EQ(Run({"scene", scene, "--nearest", "0"}).code, 2);
}

}  // namespace point_check_test
}  // namespace hulld
