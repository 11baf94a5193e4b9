#include "client/hullctl/scene/yaml_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace yaml_scene_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

constexpr char kCell[] = R"(# a cell
prefix: cell/
scale: mm
hulls:
  table: {box: [2, 1, 0.5]}
  wedge: {points: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]}
  part: {file: part.xyz, scale: cm}
bodies:
  corner:
    - {hull: wedge, at: [1, 0, 0]}
    - {hull: wedge}
    - {id: spider, at: {xyz: [0, 0, 1], quaternion: [1, 0, 0, 1]}}
place:
  floor: {hull: table, at: [0, 0, -0.25], group: building}
  wall: {hull: table, group: building}
  left: {body: corner, at: [10, 0, 0]}
  right: {body: corner, at: {xyz: [20, 0, 0], rpy: [0, 0, 3]}}
ignore: [[left, building], [right, floor]]
ask: {separation: True, clearance: 0.01, tolerance: 0}
)";

SceneDescription Parse(const std::string& text) {
  const auto scene = ParseYamlScene(text, "folder/cell.yaml");
  EXPECT_TRUE(scene.ok()) << scene.status();
  return *scene;
}

std::string ErrorOf(const std::string& text) {
  const auto scene = ParseYamlScene(text, "cell.yaml");
  EXPECT_TRUE(absl::IsInvalidArgument(scene.status())) << text;
  return std::string(scene.status().message().data(), scene.status().message().size());
}

// Returns the names of the queried pairs.
std::vector<std::string> PairsIn(const std::string& text, BodyForm form = BodyForm::kPieces) {
  const auto scene = ToScene(Parse(text), "cell.yaml", form);
  EXPECT_TRUE(scene.ok()) << scene.status();
  const auto pairs = PairsOf(*scene, "cell.yaml");
  EXPECT_TRUE(pairs.ok()) << pairs.status();
  std::vector<std::string> names;
  for (size_t i = 0; i < pairs->size(); i += 2) {
    names.push_back(scene->NameOf((*pairs)[i]) + " " + scene->NameOf((*pairs)[i + 1]));
  }
  return names;
}

TEST(YamlScene, DefinitionsAreRead) {
  const SceneDescription scene = Parse(kCell);
  ASSERT_EQ(scene.hulls.size(), 3u);
  EXPECT_EQ(scene.hulls[0].hull_id, "cell/table");
  EXPECT_THAT(std::vector<double>(scene.hulls[0].xyz.begin(), scene.hulls[0].xyz.begin() + 3),
              ElementsAre(-1, -0.5, -0.25));
  EXPECT_EQ(scene.hulls[2].file, "folder/part.xyz");
  EXPECT_EQ(scene.hulls[2].scale.Apply(7), 0.07);
  EXPECT_EQ(scene.hulls[2].where, "folder/cell.yaml:7:9");
  ASSERT_EQ(scene.bodies.size(), 1u);
  EXPECT_EQ(scene.bodies[0].pieces[0].name, "wedge");
  EXPECT_EQ(scene.bodies[0].pieces[1].name, "wedge-2");
  EXPECT_EQ(scene.bodies[0].pieces[2].hull_id, "spider");
  EXPECT_TRUE(scene.wanted.separation());
  EXPECT_EQ(scene.wanted.clearance(), 0.01);
}

TEST(YamlScene, BodiesArePlacedAsAWhole) {
  const auto scene = ToScene(Parse(kCell), "cell.yaml", BodyForm::kWhole);
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_THAT(scene->names, ElementsAre("floor", "wall", "left", "right"));
  EXPECT_EQ(scene->PlacementOf(2).hull_id(), "cell/corner");
  EXPECT_EQ(scene->PlacementOf(2).pose().translation().x(), 10);
  EXPECT_THAT(PairsIn(kCell, BodyForm::kWhole), ElementsAre("wall right", "left right"));
  // The deciding piece is named as in the file; -1 and pieces unknown to the file are not.
  EXPECT_THAT(scene->NamesOfPieces(2, 3, {1, 2}), ElementsAre("wedge-2", "spider"));
  EXPECT_THAT(scene->NamesOfPieces(0, 3, {-1, 3}), ElementsAre("", ""));
}

// The server refuses ignore_same_group without groups.
TEST(YamlScene, WithoutPlacementsIsAnEmptyRequest) {
  const auto scene =
      ToScene(Parse("hulls: {a: {box: [1, 1, 1]}}\n"), "cell.yaml", BodyForm::kWhole);
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ(scene->size(), 0u);
  EXPECT_FALSE(scene->request.ignore_same_group());
}

TEST(YamlScene, BodiesArePutAsWritten) {
  const v1::PutBodyRequest request = BodyRequest(Parse(kCell).bodies[0]);
  EXPECT_EQ(request.body_id(), "cell/corner");
  ASSERT_EQ(request.pieces_size(), 3);
  EXPECT_EQ(request.pieces(0).hull_id(), "cell/wedge");
  EXPECT_EQ(request.pieces(0).pose().translation().x(), 1);
  EXPECT_FALSE(request.pieces(1).has_pose());
  EXPECT_EQ(request.pieces(2).hull_id(), "spider");
  EXPECT_EQ(request.pieces(2).pose().rotation().z(), 1);
}

TEST(YamlScene, BodiesBecomeTheirPieces) {
  const auto scene = ToScene(Parse(kCell), "cell.yaml", BodyForm::kPieces);
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_THAT(scene->names,
              ElementsAre("floor", "wall", "left/wedge", "left/wedge-2", "left/spider",
                          "right/wedge", "right/wedge-2", "right/spider"));
  EXPECT_EQ(scene->PlacementOf(2).pose().translation().x(), 11);
  EXPECT_EQ(scene->PlacementOf(2).hull_id(), "cell/wedge");
  EXPECT_EQ(scene->PlacementOf(4).pose().rotation().z(), 1);
  EXPECT_EQ(scene->PlacementOf(4).pose().translation().z(), 1);
}

TEST(YamlScene, PiecesAndPlacementsHaveRadii) {
  const std::string text =
      "hulls: {h: {points: [[0, 0, 0]]}}\nbodies: {b: [{hull: h, radius: 0.5}, {hull: h}]}\n"
      "place: {a: {hull: h, radius: 2}, b: {body: b, radius: 0.25}}";
  const SceneDescription scene = Parse(text);
  const v1::PutBodyRequest body = BodyRequest(scene.bodies[0]);
  EXPECT_EQ(body.pieces(0).radius(), 0.5);
  EXPECT_EQ(body.pieces(1).radius(), 0);
  const auto whole = ToScene(scene, "cell.yaml", BodyForm::kWhole);
  EXPECT_EQ(whole->PlacementOf(0).radius(), 2);
  EXPECT_EQ(whole->PlacementOf(1).radius(), 0.25);
  EXPECT_EQ(ToScene(scene, "cell.yaml", BodyForm::kPieces)->PlacementOf(1).radius(), 0.75);
}

TEST(YamlScene, PlacementsMoveOnTheShorterPath) {
  const std::string head = "hulls: {h: {box: [1, 1, 1]}}\nplace:\n  a: {hull: h}\n  b: {hull: h, ";
  const auto placement = [&](const std::string& poses) {
    return ToScene(Parse(head + poses + "}\n"), "cell.yaml", BodyForm::kWhole)->PlacementOf(1);
  };
  EXPECT_FALSE(placement("at: [1, 2, 3]").has_end_pose());
  // A translation keeps the rotation.
  const v1::Placement slides = placement("to: [4, 5, 6], at: [0, 0, 0, -1, 1, 2, 3]");
  EXPECT_EQ(slides.pose().translation().x(), 1);
  EXPECT_EQ(slides.end_pose().translation().z(), 6);
  EXPECT_EQ(slides.end_pose().rotation().z(), -1);
  EXPECT_EQ(slides.end_pose().rotation().w(), 0);
  const v1::Placement turns = placement("to: [-1, 0, 0, 0.5, 0, 0, 0]");
  EXPECT_EQ(turns.end_pose().rotation().w(), 1);
  EXPECT_EQ(turns.end_pose().rotation().z(), -0.5);
  EXPECT_EQ(ErrorOf(head + "to: [0, 0, 0, 0, 1, 2, 3]}\n"),
            "cell.yaml:4:20: to: the quaternion is zero; use 1, 0, 0, 0 for no rotation");
  EXPECT_THAT(ErrorOf(head + "to: [1, 2]}\n"), HasSubstr("to"));
}

TEST(YamlScene, GroupsPiecesAndIgnoredPairsAreNotQueried) {
  const std::string head = "hulls: {h: {box: [1, 1, 1]}}\nbodies: {b: [{hull: h}, {hull: h}]}\n";
  EXPECT_THAT(PairsIn(head + "place: {a: {hull: h}, b: {body: b}}"),
              ElementsAre("a b/h", "a b/h-2"));
  EXPECT_THAT(PairsIn(head + "place: {a: {hull: h, group: g}, b: {hull: h, group: g}, "
                             "c: {hull: h}}"),
              ElementsAre("a c", "b c"));
  // A member excluded by name still belongs to its group.
  EXPECT_THAT(PairsIn(head + "place: {a: {hull: h, group: g}, b: {hull: h, group: g}, "
                             "c: {hull: h}}\nignore: [[a, c]]"),
              ElementsAre("b c"));
  EXPECT_THAT(PairsIn(head + "place: {a: {hull: h, group: g}, b: {hull: h}, c: {hull: h}}\n"
                             "ignore: [[g, c]]"),
              ElementsAre("a b", "b c"));
  EXPECT_THAT(PairsIn(kCell).size(), 3u + 9u);
}

TEST(YamlScene, PairsAndMoversAreRead) {
  const std::string head =
      "hulls: {h: {box: [1, 1, 1]}}\nbodies: {b: [{hull: h}, {hull: h}]}\n"
      "place: {a: {hull: h}, b: {body: b}, c: {hull: h}}\n";
  EXPECT_THAT(PairsIn(head + "ask: {pairs: [[c, b], [a, c]]}"),
              ElementsAre("c b/h", "c b/h-2", "a c"));
  EXPECT_THAT(PairsIn(head + "ask: {movers: [c]}"), ElementsAre("c a", "c b/h", "c b/h-2"));
}

TEST(YamlScene, AliasesResolveToTheirAnchors) {
  EXPECT_THAT(PairsIn("hulls: {h: {box: &size [1, 1, 1]}, i: {box: *size}}\n"
                      "place: {a: {hull: h, at: &pose [1, 2, 3]}, b: {hull: i, at: *pose}}"),
              ElementsAre("a b"));
}

TEST(YamlScene, EveryEscapeOfJsonIsRead) {
  EXPECT_THAT(PairsIn(R"( {"hulls": {"h": {"box": [1, 1, 1]}}, "place":
                           {"\ud83d\ude00\u00e9\/": {"hull": "h"}, "\\ud83d\\ude00": {"hull": "h"}}})"),
              ElementsAre("\xF0\x9F\x98\x80\xC3\xA9/ \\ud83d\\ude00"));
  EXPECT_THAT(ErrorOf(R"({"hulls": {"\ud83d": {"box": [1, 1, 1]}}})"),
              HasSubstr("invalid unicode"));
}

TEST(YamlScene, ErrorsNameLineColumnAndKey) {
  const std::pair<const char*, const char*> cases[] = {
      {"hulls: {h: {box: [1, 1]}}", "cell.yaml:1:18: box must have 3 numbers, got 2"},
      {"hulls:\n  h: {fil: a.stl}",
       "cell.yaml:2:7: hull \"h\" has no key \"fil\"; did you mean \"file\"?"},
      {"hulls:\n  h: {file: a.stl, box: [1, 1, 1]}",
       "cell.yaml:2:6: hull \"h\" needs exactly one of"},
      {"hulls: {h: {points: [[0, 0, x]]}}", "cell.yaml:1:29: a point: \"x\" is not a number"},
      {"hulls: {h: {points: [[0, 0, .inf]]}}", "\".inf\" is not a number"},
      {"scale: inch", "cell.yaml:1:8: scale: \"inch\" is not a unit"},
      {"scale: 0", "is not a unit or a nonzero number"},
      {"places: {}", "cell.yaml:1:1: the scene has no key \"places\"; did you mean \"place\"?"},
      {"hulls: {h: {box: [1, 1, 1]}}\nplace: {a: {hull: j}}",
       "cell.yaml:2:19: hull \"j\" is not defined under hulls"},
      {"hulls: {bracket: {box: [1, 1, 1]}}\nplace: {a: {hull: braket}}",
       "did you mean \"bracket\"?"},
      {"place: {a: {body: b}}", "cell.yaml:1:19: body \"b\" is not defined under bodies"},
      {"place: {a: {id: x, at: [0, 0]}}", "cell.yaml:1:24: at must have 3 or 7 numbers, got 2"},
      {"place: {a: {id: x, at: {rpy: [0, 0, 0], quaternion: [1, 0, 0, 0]}}}", "not both"},
      {"place: {a: {id: x, at: [0, 0, 0, 0, 0, 0, 0]}}", "the quaternion is zero"},
      {"place: {a: {id: x}, a: {id: y}}", "cell.yaml:1:21: place has the key \"a\" twice"},
      {"place: {a: {id: x}}\nignore: [[a, b]]", "cell.yaml:2:14: ignore: \"b\" is not a placement"},
      {"place: {a: {id: x}}\nignore: [[a]]", "cell.yaml:2:10: ignore must be pairs of names"},
      {"place: {a: {id: x}}\nask: {pairs: [[a, a]], movers: [a]}", "cannot be combined"},
      {"place: {a: &a {id: x}, b: {<<: *a}}",
       "cell.yaml:1:28: merge keys (<<) are not supported; write out the merged keys"},
      {"ask: {separation: yes}", "cell.yaml:1:19: separation must be true or false"},
      {"ask: {clearance: -1}", "clearance must be at least 0"},
      {"place: {a: {id: x, radius: -1}}", "cell.yaml:1:28: radius must be at least 0"},
      {"place: {a: {id: x, radius: wide}}", "radius: \"wide\" is not a number"},
      {"hulls: {h: {box: [1, 1, 1]}}\nbodies: {h: [{hull: h}]}",
       "names of hulls and bodies must differ"},
      {"a: [", "cell.yaml:"},
      {"--- {}\n--- {}", "a second document"},
      // yaml-cpp finds documents without end here.
      {",", "a second document"},
      {"[1, 2]", "the scene is not a mapping"},
      {"&a [*a]", "the scene is not a mapping"},
      {"hulls: {\xE9: {box: [1, 1, 1]}}", "cell.yaml: is not UTF-8 text; convert it first: iconv"},
  };
  for (const auto& [text, error] : cases) {
    EXPECT_THAT(ErrorOf(text), StartsWith("cell.yaml:")) << text;
    EXPECT_THAT(ErrorOf(text), HasSubstr(error)) << text;
  }
  EXPECT_THAT(ErrorOf(std::string(100000, '[')), HasSubstr("nested too deeply"));
  EXPECT_THAT(ErrorOf("place:\n  a: {id: x}\n\tb: {id: x}\n"),
              HasSubstr("; line 3 starts with a tab; indent with spaces"));
}

TEST(YamlScene, IsReadByReadScene) {
  const TempFile file("cell.yaml",
                      "# comment\n\nplace:\n  a: {id: x}\n  b: {id: x, at: [1, 0, 0]}\n");
  const auto source = ByteSource::Open(file.path());
  const auto scene = ReadScene(source->get());
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_THAT(scene->names, ElementsAre("a", "b"));
  const TempFile bad("cell.yaml", "# comment\n\nplace:\n  a: {idd: x}\n");
  const auto bad_source = ByteSource::Open(bad.path());
  EXPECT_THAT(ReadScene(bad_source->get()).status().ToString(), HasSubstr("cell.yaml:4:7: "));
}

}  // namespace yaml_scene_test
}  // namespace hulld
