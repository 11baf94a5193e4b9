// hullctl scene apply, diff, check and delete, against the real server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/point_reading.h"
#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace scene_commands_test {

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
  Ran ran = Run({"scene", "diff", cell_.path()});
  EXPECT_EQ(ran.code, 1);
  EXPECT_EQ(ran.out, "+ cell/part\tto create\n+ cell/table\tto create\n# 0 hulls unchanged\n");
  ran = Run({"scene", "apply", cell_.path(), "--dry-run"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("+ cell/part\tto create\n"));
  EXPECT_EQ(Run({"list", "--output", "name"}).out, "");
  ran = Run({"scene", "apply", cell_.path()});
  EXPECT_EQ(ran.out, "+ cell/part\tcreated\n+ cell/table\tcreated\n# 0 hulls unchanged\n");
  // A repeated apply has nothing to do; the hulls keep their revisions.
  const std::string before = Run({"list"}).out;
  ran = Run({"scene", "apply", cell_.path()});
  EXPECT_EQ(ran.out, "# 2 hulls unchanged\n");
  EXPECT_EQ(Run({"list"}).out, before);
  EXPECT_EQ(Run({"scene", "diff", cell_.path()}).code, 0);
}

TEST_F(HullctlScene, AnErrorInTheSceneChangesNothing) {
  const std::string good = "prefix: part/\nhulls:\n  good: {box: [1, 1, 1]}\n";
  for (const std::string bad : {"  bad: {file: nothing.stl}\n", "  'b d': {box: [1, 1, 1]}\n",
                                "bodies:\n  'b d': [{hull: good}]\n"}) {
    const TempFile scene("bad.yaml", good + bad);
    EXPECT_NE(Run({"scene", "apply", scene.path()}).code, 0) << bad;
    EXPECT_EQ(Run({"list", "part/", "--output", "name"}).out, "") << bad;
  }
}

TEST_F(HullctlScene, ApplyRepairsDifferencesAndPrunes) {
  ASSERT_EQ(Run({"scene", "apply", cell_.path()}).code, 0);
  const TempFile far("far.xyz", "5 5 5\n");
  ASSERT_EQ(Run({"append", "cell/table", far.path()}).code, 0);
  ASSERT_EQ(Run({"append", "cell/stray", far.path(), "--create"}).code, 0);
  Ran ran = Run({"scene", "apply", cell_.path()});
  EXPECT_EQ(ran.out,
            "~ cell/table\treplaced\n? cell/stray\tnot in the file\n"
            "# 1 hull unchanged\n");
  ran = Run({"scene", "apply", cell_.path(), "--prune", "--dry-run"});
  EXPECT_THAT(ran.out, HasSubstr("- cell/stray\tto delete\n"));
  // Without a terminal, prompting is impossible.
  ASSERT_EQ(Run({"append", "cell/table", far.path()}).code, 0);
  const std::string before = Run({"list"}).out;
  ran = Run({"scene", "apply", cell_.path(), "--prune"});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err,
              HasSubstr("refusing to delete 1 hull (cell/stray) without confirmation; pass --yes"));
  EXPECT_EQ(Run({"list"}).out, before);
  ran = Run({"scene", "apply", cell_.path(), "--prune", "--yes"});
  EXPECT_EQ(ran.out,
            "~ cell/table\treplaced\n- cell/stray\tdeleted\n"
            "# 1 hull unchanged\n");
  EXPECT_EQ(Run({"list", "--output", "name"}).out, "cell/part\ncell/table\n");
  // Without deletions no prompt is needed.
  EXPECT_EQ(Run({"scene", "apply", cell_.path(), "--prune"}).code, 0);
}

// "cell-3" is a prefix of another cell's names, too.
TEST_F(HullctlScene, OnlyAPrefixThatEndsWithASlashOwnsItsIds) {
  for (const char* id : {"cell-3/stray", "cell-30/stray", "cell-3stray"}) Put(id, server::Cube());
  const std::string before = Run({"list", "--output", "name"}).out;
  for (const std::string prefix : {"prefix: cell-3\n", ""}) {
    const TempFile scene("s.yaml", prefix + "hulls:\n  table: {box: [2, 2, 1]}\n");
    Ran ran = Run({"scene", "apply", scene.path(), "--prune", "--yes"});
    EXPECT_EQ(ran.code, 2);
    EXPECT_THAT(ran.err, HasSubstr("--prune needs a prefix that ends in \"/\""));
    EXPECT_EQ(Run({"list", "--output", "name"}).out, before);
    EXPECT_THAT(Run({"scene", "diff", scene.path()}).out, testing::Not(HasSubstr("stray")));
  }
  const TempFile scene("s.yaml", "prefix: cell-3/\nhulls:\n  table: {box: [2, 2, 1]}\n");
  EXPECT_EQ(Run({"scene", "apply", scene.path(), "--prune", "--yes"}).out,
            "+ cell-3/table\tcreated\n- cell-3/stray\tdeleted\n"
            "# 0 hulls unchanged\n");
  EXPECT_EQ(Run({"list", "--output", "name"}).out, "cell-3/table\ncell-30/stray\ncell-3stray\n");
}

TEST_F(HullctlScene, CheckAnswersTheQueriesOfTheFile) {
  ASSERT_EQ(Run({"scene", "apply", cell_.path()}).code, 0);
  Ran ran = Run({"scene", "check", cell_.path()});
  EXPECT_EQ(ran.out, "a\tb\tTOUCHING\n# touching 1 overlapping 0 failed 0\n");
  EXPECT_EQ(Run({"scene", cell_.path()}).out, ran.out);
  const TempFile pairs("pairs.yaml",
                       "place: {a: {id: cell/part}, b: {id: cell/part, at: [2, 0, 0]}}\n"
                       "ask: {pairs: [[a, b]], separation: true}\n");
  ran = Run({"scene", "check", pairs.path()});
  EXPECT_THAT(ran.out, HasSubstr("a\tb\tSEPARATED\t0.99"));
  EXPECT_EQ(Run({"scene", pairs.path()}).code, 2);
  EXPECT_EQ(Run({"scene"}).code, 2);
  for (const char* command : {"apply", "check"}) {
    ran = Run({"scene", command, cell_.path(), pairs.path()});
    EXPECT_EQ(ran.code, 2);
    EXPECT_THAT(ran.err, HasSubstr("a scene is one file"));
  }
}

TEST_F(HullctlScene, PlacementsMoveAndTheFirstContactIsFound) {
  Put("cube", server::Cube());
  const TempFile moving("moving.yaml",
                        "place:\n  a: {id: cube}\n  b: {id: cube, at: [3, 0, 0], to: [-1, 0, 0]}\n"
                        "  c: {id: cube, at: [0, 5, 0], to: [0, 0, 0]}\n");
  Ran ran = Run({"scene", "check", moving.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out,
            "a\tb\tOVERLAPPING\tcontact at 0.5\na\tc\tOVERLAPPING\tcontact at 0.8\n"
            "b\tc\tOVERLAPPING\tcontact at 0.8\n# touching 0 overlapping 3 failed 0\n");
  ran = Run({"scene", moving.path(), "--first"});
  EXPECT_EQ(ran.out, "a\tb\tOVERLAPPING\tcontact at 0.5\n# touching 0 overlapping 1 failed 0\n");
  ran = Run({"scene", "check", cell_.path(), "--first"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(
      ran.err,
      HasSubstr("--first orders pairs by their first contact, but no placement has a \"to\""));
  const TempFile pairs("pairs.yaml",
                       "place: {a: {id: cube}, b: {id: cube, to: [1, 0, 0]}}\n"
                       "ask: {pairs: [[a, b]]}\n");
  for (const char* option : {"--first", "--every-piece"}) {
    ran = Run({"scene", "check", pairs.path(), option});
    EXPECT_EQ(ran.code, 2);
    EXPECT_THAT(ran.err, HasSubstr(std::string(option) + " finds pairs itself"));
  }
}

// Conflicts named fields of the contract, wanted.separation and end_pose.
TEST_F(HullctlScene, ConflictsNameTheKeysOfTheFile) {
  Put("cube", server::Cube());
  const std::string place =
      "place: {a: {id: cube}, b: {id: cube, at: [3, 0, 0], to: [2, 0, 0]}}\nask: {";
  const TempFile all("all.yaml", place + "separation: true}\n");
  const TempFile pairs("pairs.yaml", place + "separation: true, pairs: [[a, b]]}\n");
  const std::string conflict = "ask.separation cannot be combined with \"to\"; query the first";
  const std::string motion = "does not support motions; use 'hullctl batch' or 'hullctl scene'\n";
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{"scene", "check", all.path()}, conflict},
      {{"scene", "check", pairs.path()}, conflict},
      {{"batch", all.path()}, conflict},
      {{"stream", all.path()}, "placement b has a \"to\", but a stream " + motion},
      {{"watch", "--scene", all.path()}, "placement b has a \"to\", but a watch " + motion}};
  for (const auto& [command, text] : cases) {
    const Ran ran = Run(command);
    EXPECT_NE(ran.code, 0);
    EXPECT_THAT(ran.out + ran.err, HasSubstr(text)) << command[0];
  }
}

TEST_F(HullctlScene, CheckBeforeApplyNamesTheHullAndTheRemedy) {
  const std::string text = "hull \"cell/table\" not found; 'hullctl scene apply' creates it\n";
  Ran ran = Run({"scene", "check", cell_.path()});
  EXPECT_THAT(ran.err, HasSubstr("hullctl: placement b: " + text));
  ran = Run({"watch", "--scene", cell_.path(), "--until-synced"});
  EXPECT_THAT(ran.err, HasSubstr("hullctl: placement b: " + text));
  const TempFile pairs("pairs.yaml",
                       "hulls: {h: {box: [1, 1, 1]}}\nplace: {a: {hull: h}, b: {id: other}}\n"
                       "ask: {pairs: [[a, b], [b, b]]}\n");
  for (const char* command : {"batch", "stream"}) {
    ran = Run({command, pairs.path()});
    EXPECT_THAT(ran.out,
                HasSubstr("FAILED\thull \"h\" not found; 'hullctl scene apply' creates it\n"));
    EXPECT_THAT(ran.out, HasSubstr("FAILED\thull \"other\" not found\n"));
  }
}

TEST_F(HullctlScene, DeleteRemovesTheHullsAndBodiesOfTheFile) {
  ASSERT_EQ(Run({"scene", "apply", cell_.path()}).code, 0);
  Put("other", server::Cube());
  EXPECT_EQ(Run({"scene", "delete", cell_.path()}).code, 2);
  EXPECT_EQ(Run({"scene", "delete", cell_.path(), "--yes"}).code, 0);
  EXPECT_EQ(Run({"list", "--output", "name"}).out, "other\n");
  EXPECT_EQ(Run({"scene", "delete", cell_.path(), "--yes"}).out,
            "# none of the file's hulls and bodies exist\n");
}

class HullctlSceneBodies : public HullctlOnServer {
 protected:
  static std::string Cell(const std::string& second_pose) {
    return "prefix: cell/\nhulls:\n  bar: {box: [4, 1, 1]}\n  cube: {box: [1, 1, 1]}\nbodies:\n"
           "  ell:\n    - {hull: bar}\n    - {hull: cube, at: " +
           second_pose +
           "}\nplace:\n  ell: {body: ell}\n  turned: {body: ell, at: [0, 0, 0, 1, 9, 0, 0]}\n"
           "  probe: {hull: cube, at: [1.5, 1.75, 0]}\nask: {separation: true}\n";
  }

  const TempFile cell_{"cell.yaml", Cell("[1.5, 1, 0]")};
};

TEST_F(HullctlSceneBodies, ApplyPutsBodiesOnceAfterTheirHulls) {
  const std::string to_do =
      "+ cell/bar\tto create\n+ cell/cube\tto create\n+ cell/ell\tbody to create\n"
      "# 0 hulls and 0 bodies unchanged\n";
  EXPECT_EQ(Run({"scene", "diff", cell_.path()}).out, to_do);
  EXPECT_EQ(Run({"scene", "apply", cell_.path(), "--dry-run"}).out, to_do);
  EXPECT_EQ(Run({"body", "list", "--output", "name"}).out, "");
  Ran ran = Run({"scene", "apply", cell_.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("+ cell/cube\tcreated\n+ cell/ell\tbody created\n"));
  // A repeated apply puts nothing: the body keeps its revision.
  const std::string before = Run({"body", "get", "cell/ell"}).out;
  EXPECT_THAT(before, HasSubstr("cell/cube  1.5,1,0"));
  EXPECT_EQ(Run({"scene", "apply", cell_.path()}).out, "# 2 hulls and 1 body unchanged\n");
  EXPECT_EQ(Run({"body", "get", "cell/ell"}).out, before);
  EXPECT_EQ(Run({"scene", "diff", cell_.path()}).code, 0);
}

TEST_F(HullctlSceneBodies, APoseThatDiffersInOneBitIsPutAgain) {
  ASSERT_EQ(Run({"scene", "apply", cell_.path()}).code, 0);
  const TempFile moved("moved.yaml", Cell("[1.5000000000000002, 1, 0]"));
  const TempFile signed_zero("zero.yaml", Cell("[1.5, 1, -0.0]"));
  for (const TempFile* file : {&moved, &signed_zero}) {
    Ran ran = Run({"scene", "diff", file->path()});
    EXPECT_EQ(ran.code, 1);
    EXPECT_THAT(ran.out, HasSubstr("~ cell/ell\tbody to replace\n# 2 hulls and 0 bodies"));
    EXPECT_THAT(Run({"scene", "apply", file->path()}).out, HasSubstr("~ cell/ell\tbody replaced"));
    EXPECT_EQ(Run({"scene", "diff", file->path()}).code, 0);
    ASSERT_EQ(Run({"scene", "apply", cell_.path()}).code, 0);
  }
  ASSERT_EQ(Run({"body", "put", "cell/ell", "cell/cube@1.5,1,0", "cell/bar"}).code, 0);
  EXPECT_THAT(Run({"scene", "diff", cell_.path()}).out, HasSubstr("~ cell/ell\tbody to replace"));
}

TEST_F(HullctlSceneBodies, ARadiusThatDiffersIsPutAgain) {
  ASSERT_EQ(Run({"scene", "apply", cell_.path()}).code, 0);
  const TempFile grown("grown.yaml", Cell("[1.5, 1, 0], radius: 0.25"));
  EXPECT_THAT(Run({"scene", "apply", grown.path()}).out, HasSubstr("~ cell/ell\tbody replaced"));
  EXPECT_THAT(Run({"body", "get", "cell/ell"}).out, HasSubstr("cell/cube  1.5,1,0  0.25"));
  EXPECT_EQ(Run({"scene", "diff", grown.path()}).code, 0);
}

TEST_F(HullctlSceneBodies, CheckNamesBodiesAndThePiecesThatDecided) {
  Ran ran = Run({"scene", "check", cell_.path()});
  EXPECT_EQ(ran.code, 4);
  EXPECT_THAT(ran.err, HasSubstr("placement ell: "));
  ASSERT_EQ(Run({"scene", "apply", cell_.path()}).code, 0);
  ran = Run({"scene", "check", cell_.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, testing::StartsWith("ell\tprobe\tOVERLAPPING\t-0.25"));
  EXPECT_THAT(ran.out, HasSubstr("\tpieces cube -\n# touching 0 overlapping 1 failed 0\n"));
  EXPECT_EQ(Run({"scene", cell_.path()}).out, ran.out);
  EXPECT_EQ(Run({"batch", cell_.path(), "--output", "name"}).out,
            "ell\tturned\tSEPARATED\nell\tprobe\tOVERLAPPING\nturned\tprobe\tSEPARATED\n");
  EXPECT_THAT(Run({"batch", cell_.path()}).out, HasSubstr("\tpieces cube -\n"));
  // The answers of a stream have the same names.
  EXPECT_THAT(Run({"stream", cell_.path()}).out, HasSubstr("0\tell\tprobe\tOVERLAPPING"));
}

TEST_F(HullctlSceneBodies, EveryPieceThatIsFoundHasARow) {
  ASSERT_EQ(Run({"scene", "apply", cell_.path()}).code, 0);
  const Ran ran = Run({"scene", cell_.path(), "--every-piece", "--clearance", "1"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("ell\tprobe\tSEPARATED\t0.7"));
  EXPECT_THAT(ran.out, HasSubstr("\tpieces bar -\nell\tprobe\tOVERLAPPING\t-0.25"));
  EXPECT_THAT(ran.out, HasSubstr("\tpieces cube -\n# touching 0 overlapping 1 separated 1 "));
}

TEST_F(HullctlSceneBodies, BatchesProveBodiesAndWatchesReportThem) {
  ASSERT_EQ(Run({"scene", "apply", cell_.path()}).code, 0);
  Ran ran = Run({"batch", cell_.path(), "--verify"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("ell\tprobe\tOVERLAPPING"));
  EXPECT_THAT(ran.out, HasSubstr("\tpieces cube -\t1 certificate of pieces\tvalid\n"));
  EXPECT_THAT(RunJson({"batch", cell_.path(), "--certificate"}).out, HasSubstr("\"pieceProofs\":"));
  ran = Run({"watch", "--scene", cell_.path(), "--until-synced"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("ENTER\tell\tprobe\t"));
  EXPECT_THAT(ran.out, HasSubstr("\tpieces cube -\n"));
}

TEST_F(HullctlSceneBodies, TheTextbookMethodUsesPieces) {
  ASSERT_EQ(Run({"scene", "apply", cell_.path()}).code, 0);
  const Ran ran = Run({"batch", cell_.path(), "--textbook"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("ell/cube\tprobe\tOVERLAPPING"));
}

TEST_F(HullctlSceneBodies, PruneAndDeleteRemoveBodiesBeforeHulls) {
  ASSERT_EQ(Run({"scene", "apply", cell_.path()}).code, 0);
  ASSERT_EQ(Run({"body", "put", "cell/stray", "cell/cube"}).code, 0);
  ASSERT_EQ(Run({"body", "put", "other", "cell/cube"}).code, 0);
  ASSERT_EQ(Run({"create", "cell/a"}).code, 0);
  EXPECT_THAT(Run({"scene", "diff", cell_.path()}).out,
              HasSubstr("? cell/stray\tbody not in the file\n? cell/a\tnot in the file\n"));
  Ran ran = Run({"scene", "apply", cell_.path(), "--prune"});
  EXPECT_THAT(ran.err, HasSubstr("refusing to delete 2 bodies and hulls (cell/stray, cell/a)"));
  EXPECT_THAT(Run({"scene", "apply", cell_.path(), "--prune", "--yes"}).out,
              HasSubstr("- cell/stray\tbody deleted\n- cell/a\tdeleted\n"));
  ran = Run({"scene", "delete", cell_.path()});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("3 bodies and hulls (cell/ell, cell/bar, cell/cube)"));
  ran = Run({"scene", "delete", cell_.path(), "--yes", "--output", "name"});
  EXPECT_EQ(ran.out, "cell/ell\ncell/bar\ncell/cube\n");
  EXPECT_EQ(Run({"body", "list", "--output", "name"}).out, "other\n");
  EXPECT_EQ(Run({"list", "--output", "name"}).out, "");
}

TEST_F(HullctlSceneBodies, AHullWithTheSameNameIsRefused) {
  ASSERT_EQ(Run({"create", "cell/ell"}).code, 0);
  const Ran ran = Run({"scene", "apply", cell_.path()});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, HasSubstr("\"cell/ell\""));
}

TEST_F(HullctlScene, AMissingFileIsReportedWithItsLocation) {
  const TempFile scene("s.yaml", "hulls:\n  a: {file: nowhere.stl}\n");
  const Ran ran = Run({"scene", "apply", scene.path()});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("s.yaml:2:6: "));
  EXPECT_THAT(ran.err, HasSubstr("nowhere.stl"));
}

class SceneUnits : public HullctlOnServer {};

// Each coordinate is rounded only once: 3 in is the double nearest to 0.0762 m, just as the text
// 0.0762.
TEST_F(SceneUnits, LengthsInEveryUnitEqualTheirMetersExactly) {
  const struct {
    const char* unit;
    const char* length;
    const char* meters;
  } cases[] = {{"in", "3", "0.0762"},    {"in", "0.1", "0.00254"}, {"ft", "11", "3.3528"},
               {"ft", "0.7", "0.21336"}, {"mm", "0.3", "0.0003"},  {"cm", "2.3", "0.023"},
               {"0.0254", "3", "0.0762"}};
  for (const auto& [unit, length, meters] : cases) {
    const TempFile part("part.xyz", "0 0 0\n" + std::string(length) + " 0 0\n0 1 0\n0 0 1\n");
    const TempFile scene("cell.yaml", "prefix: cell/\nhulls:\n  part: {file: " + part.path() +
                                          ", scale: " + unit + "}\n  wall: {points: [[" + meters +
                                          ", 0, 0], [9, 0, 0], [9, 1, 0], [9, 0, 1]]}\n"
                                          "place:\n  part: {hull: part}\n  wall: {hull: wall}\n"
                                          "ask: {pairs: [[part, wall]]}\n");
    EXPECT_EQ(Run({"scene", "apply", scene.path()}).code, 0);
    EXPECT_THAT(Run({"scene", "check", scene.path()}).out, HasSubstr("part\twall\tTOUCHING"))
        << length << unit;
  }
}

}  // namespace scene_commands_test
}  // namespace hulld
