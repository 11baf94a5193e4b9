// hullctl scene apply, diff, check and delete, against the real server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/point_reading.h"
#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace {

using testing::HasSubstr;

class HullctlScene : public HullctlOnServer {
 protected:
  HullctlScene()
      : points_("part.xyz", "0 0 0\n1000 0 0\n0 1000 0\n0 0 1000\n1 1 1\n"),
        cell_("cell.yaml",
              "prefix: cell/\nscale: mm\nhulls:\n  part: {file: " + points_.path() +
                  "}\n  table: {box: [2, 2, 1]}\nplace:\n  a: {hull: part}\n  b: "
                  "{hull: table, at: [0, 0, -0.5]}\n  c: {hull: part, at: [9, 0, 0]}\n") {}

  const TempFile points_;
  const TempFile cell_;
};

TEST_F(HullctlScene, ApplyMakesTheServerMatchTheFile) {
  Ran ran = Ask({"scene", "diff", cell_.path()});
  EXPECT_EQ(ran.code, 1);
  EXPECT_EQ(
      ran.out,
      "+ cell/part\tto create\n+ cell/table\tto create\n# 0 hulls are as the file has them\n");
  ran = Ask({"scene", "apply", cell_.path(), "--dry-run"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("+ cell/part\tto create\n"));
  EXPECT_EQ(Ask({"list", "--output", "name"}).out, "");
  ran = Ask({"scene", "apply", cell_.path()});
  EXPECT_EQ(ran.out,
            "+ cell/part\tcreated\n+ cell/table\tcreated\n# 0 hulls are as the file has them\n");
  // Again there is nothing to do; the hulls keep their revisions.
  const std::string before = Ask({"list"}).out;
  ran = Ask({"scene", "apply", cell_.path()});
  EXPECT_EQ(ran.out, "# 2 hulls are as the file has them\n");
  EXPECT_EQ(Ask({"list"}).out, before);
  EXPECT_EQ(Ask({"scene", "diff", cell_.path()}).code, 0);
}

TEST_F(HullctlScene, ApplyMendsWhatDiffersAndPrunes) {
  ASSERT_EQ(Ask({"scene", "apply", cell_.path()}).code, 0);
  const TempFile far("far.xyz", "5 5 5\n");
  ASSERT_EQ(Ask({"append", "cell/table", far.path()}).code, 0);
  ASSERT_EQ(Ask({"append", "cell/stray", far.path(), "--create"}).code, 0);
  Ran ran = Ask({"scene", "apply", cell_.path()});
  EXPECT_EQ(ran.out,
            "~ cell/table\treplaced\n? cell/stray\tnot in the file\n"
            "# 1 hulls are as the file has them\n");
  ran = Ask({"scene", "apply", cell_.path(), "--prune", "--dry-run"});
  EXPECT_THAT(ran.out, HasSubstr("- cell/stray\tto delete\n"));
  ran = Ask({"scene", "apply", cell_.path(), "--prune"});
  EXPECT_THAT(ran.out, HasSubstr("- cell/stray\tdeleted\n"));
  EXPECT_EQ(Ask({"list", "--output", "name"}).out, "cell/part\ncell/table\n");
}

TEST_F(HullctlScene, CheckAnswersWhatTheFileAsks) {
  ASSERT_EQ(Ask({"scene", "apply", cell_.path()}).code, 0);
  Ran ran = Ask({"scene", "check", cell_.path()});
  EXPECT_EQ(ran.out, "a\tb\tTOUCHING\n# touching 1 overlapping 0 failed 0\n");
  EXPECT_EQ(Ask({"scene", cell_.path()}).out, ran.out);
  const TempFile pairs("pairs.yaml",
                       "place: {a: {id: cell/part}, b: {id: cell/part, at: [2, 0, 0]}}\n"
                       "ask: {pairs: [[a, b]], separation: true}\n");
  ran = Ask({"scene", "check", pairs.path()});
  EXPECT_THAT(ran.out, HasSubstr("a\tb\tSEPARATED\t0.99"));
  EXPECT_EQ(Ask({"scene", pairs.path()}).code, 2);
  EXPECT_EQ(Ask({"scene"}).code, 2);
  for (const char* command : {"apply", "check"}) {
    ran = Ask({"scene", command, cell_.path(), pairs.path()});
    EXPECT_EQ(ran.code, 2);
    EXPECT_THAT(ran.err, HasSubstr("a scene is one file"));
  }
}

TEST_F(HullctlScene, DeleteRemovesWhatTheFileDefines) {
  ASSERT_EQ(Ask({"scene", "apply", cell_.path()}).code, 0);
  Put("other", server::Cube());
  EXPECT_EQ(Ask({"scene", "delete", cell_.path()}).code, 2);
  EXPECT_EQ(Ask({"scene", "delete", cell_.path(), "--yes"}).code, 0);
  EXPECT_EQ(Ask({"list", "--output", "name"}).out, "other\n");
  EXPECT_EQ(Ask({"scene", "delete", cell_.path(), "--yes"}).out, "# none of the hulls is there\n");
}

TEST_F(HullctlScene, AMissingFileNamesItsPlace) {
  const TempFile scene("s.yaml", "hulls:\n  a: {file: nowhere.stl}\n");
  const Ran ran = Ask({"scene", "apply", scene.path()});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("s.yaml:2:6: "));
  EXPECT_THAT(ran.err, HasSubstr("nowhere.stl"));
}

}  // namespace
}  // namespace hulld
