#include "client/hullctl/command_line/batch_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

absl::StatusOr<BatchScene> Read(const std::string& content) {
  const TempFile file("scene", content);
  auto source = ByteSource::Open(file.path());
  auto scene = ReadBatchFile(source->get());
  if (scene.ok()) return scene;
  std::string error(scene.status().message().data(), scene.status().message().size());
  error.replace(error.find(file.path()), file.path().size(), "FILE");
  return absl::Status(scene.status().code(), error);
}

std::string Error(const std::string& content) {
  const auto scene = Read(content);
  return std::string(scene.status().message().data(), scene.status().message().size());
}

TEST(BatchFile, HoldsPlacementsAndPairs) {
  const auto scene = Read(
      "# a scene\n\npair b a   # before they are placed\nplace a arm/1\n"
      "place b box 0.1 -2 3e-310\nplace c box 2 1 0 0 1 2 3\npair c c\n");
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_THAT(scene->names, ElementsAre("a", "b", "c"));
  EXPECT_THAT(scene->pairs, ElementsAre(Pair(1, 0), Pair(2, 2)));
  EXPECT_EQ(scene->placements[0].hull_id(), "arm/1");
  EXPECT_FALSE(scene->placements[0].has_pose());
  EXPECT_EQ(scene->placements[1].pose().translation().z(), 3e-310);
  EXPECT_FALSE(scene->placements[1].pose().has_rotation());
  EXPECT_EQ(scene->placements[2].pose().rotation().w(), 2);
}

TEST(BatchFile, AllMeansEachTwoOfAllPlacements) {
  const auto scene = Read("place a h\nall\nplace b h\nplace c h\n");
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_THAT(scene->pairs, ElementsAre(Pair(0, 1), Pair(0, 2), Pair(1, 2)));
}

TEST(BatchFile, ErrorsNameFileAndLine) {
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

TEST(BatchFile, TooManyPairsAreRefusedBeforeTheyAreMade) {
  std::string text;
  for (int i = 0; i < 6000; ++i) text += "place n" + std::to_string(i) + " h\n";
  EXPECT_THAT(Error(text + "all\n"), HasSubstr("FILE:6001: more than 16777216 pairs"));
}

}  // namespace
}  // namespace hulld
