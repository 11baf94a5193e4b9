#include "client/hullctl/scene/scene_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace scene_file_test {

using testing::ElementsAre;
using testing::HasSubstr;

absl::StatusOr<Scene> Read(const std::string& content) {
  const TempFile file("scene", content);
  auto source = ByteSource::Open(file.path());
  auto scene = ReadScene(source->get());
  if (scene.ok()) return scene;
  std::string error(scene.status().message().data(), scene.status().message().size());
  error.replace(error.find(file.path()), file.path().size(), "FILE");
  return absl::Status(scene.status().code(), error);
}

std::string Error(const std::string& content) {
  const auto scene = Read(content);
  return std::string(scene.status().message().data(), scene.status().message().size());
}

// Returns the pairs of a scene; fails the test on an error.
std::vector<uint32_t> Pairs(const Scene& scene) {
  const auto pairs = PairsOf(scene, "FILE");
  EXPECT_TRUE(pairs.ok()) << pairs.status();
  return pairs.value_or(std::vector<uint32_t>());
}

TEST(SceneFile, JsonIsASubsetOfYaml) {
  for (const char* text :
       {"# a scene\n\nask:\n  pairs: [[b, a], [c, c]]   # before their placements\nplace:\n"
        "  a: {id: arm/1}\n  b: {id: box, at: [0.1, -2, 3e-310]}\n"
        "  c: {id: box, at: [2, 1, 0, 0, 1, 2, 3]}\n",
        "{place: {a: {id: arm/1}, b: {id: box, at: [0.1, -2, 3e-310]},\n"
        " c: {id: box, at: [2, 1, 0, 0, 1, 2, 3]}}, ask: {pairs: [[b, a], [c, c]]}}",
        R"({"ask": {"pairs": [["b", "a"], ["c", "c"]]}, "place": {"a": {"id": "arm/1"},
           "b": {"id": "box", "at": [0.1, -2, 3e-310]},
           "c": {"id": "box", "at": [2, 1, 0, 0, 1, 2, 3]}}})"}) {
    const auto scene = Read(text);
    ASSERT_TRUE(scene.ok()) << scene.status();
    EXPECT_THAT(scene->names, ElementsAre("a", "b", "c"));
    EXPECT_THAT(Pairs(*scene), ElementsAre(1, 0, 2, 2));
    EXPECT_EQ(*scene->HullOf(0), "arm/1");
    EXPECT_EQ(scene->HullOf(3), nullptr);
    EXPECT_FALSE(scene->PlacementOf(0).has_pose());
    EXPECT_EQ(scene->PlacementOf(1).pose().translation().z(), 3e-310);
    EXPECT_FALSE(scene->PlacementOf(1).pose().has_rotation());
    EXPECT_EQ(scene->PlacementOf(2).pose().rotation().w(), 2);
  }
}

TEST(SceneFile, WithoutPairsAllPairsOfPlacementsAreChecked) {
  for (const char* text : {"place: {a: {id: h}, b: {id: h}, c: {id: h}}\n",
                           R"({"placements":[{"hullId":"h"},{"hullId":"h"},{"hullId":"h"}]})"}) {
    const auto scene = Read(text);
    ASSERT_TRUE(scene.ok()) << scene.status();
    EXPECT_FALSE(scene->pairs.has_value());
    EXPECT_THAT(Pairs(*scene), ElementsAre(0, 1, 0, 2, 1, 2)) << text;
  }
}

TEST(SceneFile, TheOldLineFormatIsRefusedWithItsYamlEquivalent) {
  const auto refused = [](int line, const std::string& yaml) {
    return "FILE:" + std::to_string(line) +
           ": a scene is YAML, not lines of place and pair; write " + yaml +
           "; --help shows an example";
  };
  EXPECT_EQ(Error("place left cube\nplace right cube 2 0 0\n"),
            refused(1, "\"place: {left: {id: cube}}\""));
  EXPECT_EQ(Error("# c\n\nplace a arm/1 1 0 0 1 0 0 5 # d\n"),
            refused(3, "\"place: {a: {id: arm/1, at: [1, 0, 0, 1, 0, 0, 5]}}\""));
  EXPECT_EQ(Error("pair a b\nplace a h\nplace b h\n"), refused(1, "\"ask: {pairs: [[a, b]]}\""));
  EXPECT_EQ(Error("all\nplace a h\n"), refused(1, "no \"ask: {pairs: ...}\""));
}

TEST(SceneFile, JsonMayBeAnyOfThreeMessages) {
  const std::string placements = R"({"placements":[{"hullId":"a"},{"hullId":"b"}],)";
  const auto batch = Read(placements + R"("pairs":[1,0],"method":"METHOD_TEXTBOOK_SAT"})");
  ASSERT_TRUE(batch.ok()) << batch.status();
  EXPECT_THAT(Pairs(*batch), ElementsAre(1, 0));
  EXPECT_EQ(batch->method, v1::METHOD_TEXTBOOK_SAT);
  EXPECT_EQ(batch->NameOf(1), "1:b");
  const auto open = Read(placements + "\"pairs\":\n[0,1],\n\"onlyChanges\":true\n}\n");
  ASSERT_TRUE(open.ok()) << open.status();
  EXPECT_TRUE(open->only_changes);
  const auto find =
      Read(placements + R"("groups":[4,4],"wanted":{"clearance":0.5},"tolerance":2})");
  ASSERT_TRUE(find.ok()) << find.status();
  EXPECT_EQ(find->request.wanted().clearance(), 0.5);
  EXPECT_EQ(find->request.tolerance(), 2);
  // Braces and names inside strings are ignored.
  const auto odd = Read(R"({"placements":[{"hullId":"\"}{pairs\":["}]})");
  ASSERT_TRUE(odd.ok()) << odd.status();
  EXPECT_EQ(*odd->HullOf(0), "\"}{pairs\":[");
}

TEST(SceneFile, PackedPlacementsAreTheSameScene) {
  const auto scene = Read(R"({"packedPlacements":{"hullIds":["a","b"],"hulls":[1,0],
      "poses":[1,0,0,0, 0,0,0,  2,1,0,0, 5,6,7],"radii":[0,0.5]},"pairs":[0,1]})");
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ(scene->size(), 2u);
  EXPECT_EQ(scene->NameOf(0), "0:b");
  EXPECT_EQ(scene->PlacementOf(1).hull_id(), "a");
  EXPECT_EQ(scene->PlacementOf(1).pose().rotation().x(), 1);
  EXPECT_EQ(scene->PlacementOf(1).pose().translation().z(), 7);
  EXPECT_EQ(scene->PlacementOf(0).radius(), 0);
  EXPECT_EQ(scene->PlacementOf(1).radius(), 0.5);
}

TEST(SceneFile, GroupsAndMoversLeaveOutPairs) {
  const std::string placements =
      R"({"placements":[{"hullId":"h"},{"hullId":"h"},{"hullId":"h"},{"hullId":"h"}],)";
  const auto same = Read(placements + R"("groups":[0,1,1,2],"ignoreSameGroup":true})");
  ASSERT_TRUE(same.ok()) << same.status();
  EXPECT_THAT(Pairs(*same), ElementsAre(0, 1, 0, 2, 0, 3, 1, 3, 2, 3));
  const auto ignored = Read(placements + R"("groups":[0,1,1,2],"ignoredGroupPairs":[2,1]})");
  ASSERT_TRUE(ignored.ok()) << ignored.status();
  EXPECT_THAT(Pairs(*ignored), ElementsAre(0, 1, 0, 2, 0, 3, 1, 2));
  const auto movers = Read(placements + R"("movers":1})");
  ASSERT_TRUE(movers.ok()) << movers.status();
  EXPECT_THAT(Pairs(*movers), ElementsAre(0, 1, 0, 2, 0, 3));
  const auto few = Read(placements + R"("groups":[0]})");
  ASSERT_TRUE(few.ok());
  EXPECT_THAT(std::string(PairsOf(*few, "FILE").status().message()),
              HasSubstr("groups has 1 groups for 4 placements"));
  const auto none = Read(placements + R"("movers":0})");
  ASSERT_TRUE(none.ok());
  EXPECT_THAT(std::string(PairsOf(*none, "FILE").status().message()), HasSubstr("no pairs"));
}

TEST(SceneFile, ASceneIsReadOnlyToItsEnd) {
  const TempFile file("poses", "\n{\"placements\":\n[]}\n{\"refreshHulls\":true}\n");
  const auto source = ByteSource::Open(file.path());
  ASSERT_TRUE(ReadScene(source->get()).ok());
  EXPECT_THAT(std::string(ReadWholeScene(file.path(), "batch").status().message()),
              HasSubstr(":4: 'hullctl batch' does not accept updates after the scene"));
}

TEST(SceneFile, JsonThatIsNotASceneIsExplained) {
  const std::string placements = R"({"placements":[{"hullId":"a"}],)";
  EXPECT_THAT(Error(placements + R"("pairs":[0,1]})"), HasSubstr("pairs names placement 1"));
  EXPECT_THAT(Error(placements + R"("pairs":[0]})"), HasSubstr("each pair needs two"));
  EXPECT_THAT(Error(placements + R"("pairs":[0,0],"groups":[1]})"),
              HasSubstr("\"pairs\" and \"groups\" cannot be combined"));
  EXPECT_THAT(Error(placements + R"("pares":[0,0]})"), HasSubstr("FILE:1: "));
  EXPECT_THAT(Error("{\"placements\":\n[}\n"), HasSubstr("FILE: "));
  EXPECT_THAT(Error(R"({"packedPlacements":{"hullIds":["a"],"hulls":[1],
      "poses":[1,0,0,0, 0,0,0]}})"),
              HasSubstr("names hull 1"));
  EXPECT_THAT(Error(R"({"packedPlacements":{"hullIds":["a"],"hulls":[0],"poses":[1]}})"),
              HasSubstr("has 1 numbers for 1 placements"));
  EXPECT_THAT(Error(""), HasSubstr("FILE contains no scene"));
}

TEST(SceneFile, ErrorsNameFileAndLine) {
  EXPECT_THAT(Error("\n{\"place\":\n {\"a\": {\"idd\": \"h\"}}}\n"), HasSubstr("FILE:3:9: "));
  EXPECT_THAT(Error("\nmove a b\n"), HasSubstr("FILE:2:1: "));
}

TEST(SceneFile, TooManyPairsAreRefusedBeforeTheyAreBuilt) {
  std::string text = "place:\n";
  for (int i = 0; i < 6000; ++i) text += "  n" + std::to_string(i) + ": {id: h}\n";
  const auto scene = Read(text);
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_THAT(std::string(PairsOf(*scene, "FILE").status().message()),
              HasSubstr("more than 16777216 pairs"));
}

}  // namespace scene_file_test
}  // namespace hulld
