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

TEST(SceneFile, TextHoldsPlacementsAndPairs) {
  const auto scene = Read(
      "# a scene\n\npair b a   # before they are placed\nplace a arm/1\n"
      "place b box 0.1 -2 3e-310\nplace c box 2 1 0 0 1 2 3\npair c c\n");
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

TEST(SceneFile, AllOrNoPairMeansEachTwoOfAllPlacements) {
  for (const char* text :
       {"place a h\nall\nplace b h\nplace c h\n", "place a h\nplace b h\nplace c h\n",
        "place a h\nplace b h\nplace c h\npair a b\nall\n",
        R"({"placements":[{"hullId":"h"},{"hullId":"h"},{"hullId":"h"}]})"}) {
    const auto scene = Read(text);
    ASSERT_TRUE(scene.ok()) << scene.status();
    EXPECT_FALSE(scene->pairs.has_value());
    EXPECT_THAT(Pairs(*scene), ElementsAre(0, 1, 0, 2, 1, 2)) << text;
  }
}

TEST(SceneFile, JsonIsOneOfThreeMessages) {
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
      "poses":[1,0,0,0, 0,0,0,  2,1,0,0, 5,6,7]},"pairs":[0,1]})");
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ(scene->size(), 2u);
  EXPECT_EQ(scene->NameOf(0), "0:b");
  EXPECT_EQ(scene->PlacementOf(1).hull_id(), "a");
  EXPECT_EQ(scene->PlacementOf(1).pose().rotation().x(), 1);
  EXPECT_EQ(scene->PlacementOf(1).pose().translation().z(), 7);
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
              HasSubstr("groups holds 1 groups for 4 placements"));
  const auto none = Read(placements + R"("movers":0})");
  ASSERT_TRUE(none.ok());
  EXPECT_THAT(std::string(PairsOf(*none, "FILE").status().message()), HasSubstr("no pair"));
}

TEST(SceneFile, ASceneIsReadToItsEndAndNoFurther) {
  const TempFile file("poses", "\n{\"placements\":\n[]}\n{\"refreshHulls\":true}\n");
  const auto source = ByteSource::Open(file.path());
  ASSERT_TRUE(ReadScene(source->get()).ok());
  EXPECT_THAT(std::string(RefuseUpdates(source->get(), "batch").message()),
              HasSubstr(":4: 'hullctl batch' takes nothing behind the scene"));
}

TEST(SceneFile, JsonThatIsNoSceneIsExplained) {
  const std::string placements = R"({"placements":[{"hullId":"a"}],)";
  EXPECT_THAT(Error(placements + R"("pairs":[0,1]})"), HasSubstr("pairs names placement 1"));
  EXPECT_THAT(Error(placements + R"("pairs":[0]})"), HasSubstr("a pair has two"));
  EXPECT_THAT(Error(placements + R"("pairs":[0,0],"groups":[1]})"),
              HasSubstr("\"pairs\" and \"groups\" do not go together"));
  EXPECT_THAT(Error(placements + R"("pares":[0,0]})"), HasSubstr("FILE:1: "));
  EXPECT_THAT(Error("{\"placements\":\n[}\n"), HasSubstr("FILE: "));
  EXPECT_THAT(Error(R"({"packedPlacements":{"hullIds":["a"],"hulls":[1],
      "poses":[1,0,0,0, 0,0,0]}})"),
              HasSubstr("names hull 1"));
  EXPECT_THAT(Error(R"({"packedPlacements":{"hullIds":["a"],"hulls":[0],"poses":[1]}})"),
              HasSubstr("holds 1 numbers for 1 placements"));
  EXPECT_THAT(Error(""), HasSubstr("there is no scene in it"));
}

TEST(SceneFile, ErrorsNameFileAndLine) {
  EXPECT_EQ(Error("place a h\npair a b\n"), "FILE:2: \"b\" is not placed; add: place NAME HULL");
  EXPECT_EQ(Error("place a h\nplace a h\n"), "FILE:2: the name \"a\" is taken already");
  EXPECT_EQ(Error("place a\n"), "FILE:1: a placement is: place NAME HULL [[w x y z] tx ty tz]");
  EXPECT_EQ(Error("place a h 1 2\n"),
            "FILE:1: a pose is 3 numbers tx ty tz or 7 numbers w x y z tx ty tz, here are 2");
  EXPECT_EQ(Error("place a h 1 2 x\n"), "FILE:1: \"x\" is not a number");
  EXPECT_EQ(Error("place a h 1 2 nan\n"), "FILE:1: \"nan\" is not a finite number");
  EXPECT_THAT(Error("place a h 0 0 0 0 1 2 3\n"), HasSubstr("FILE:1: the quaternion"));
  EXPECT_EQ(Error("pair a\n"), "FILE:1: a pair is: pair NAME NAME");
  EXPECT_EQ(Error("\nmove a b\n"), "FILE:2: \"move\" is no item; items are place, pair and all");
}

TEST(SceneFile, TooManyPairsAreRefusedBeforeTheyAreMade) {
  std::string text;
  for (int i = 0; i < 6000; ++i) text += "place n" + std::to_string(i) + " h\n";
  const auto scene = Read(text + "all\n");
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_THAT(std::string(PairsOf(*scene, "FILE").status().message()),
              HasSubstr("more than 16777216 pairs"));
}

}  // namespace scene_file_test
}  // namespace hulld
