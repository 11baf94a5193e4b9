#include "server/shards/slots.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <set>
#include <string>

namespace hulld::server {
namespace {

using ::testing::HasSubstr;

TEST(Slots, OfAnIdAreWhatClientsInOtherLanguagesCompute) {
  // By a program in Python, from the text in slots.h.
  EXPECT_EQ(SlotOf(""), 961);
  EXPECT_EQ(SlotOf("a"), 192);
  EXPECT_EQ(SlotOf("cell-1/gripper"), 604);
}

TEST(Slots, AreTakenAboutEvenly) {
  constexpr int kEach = 64;
  std::vector<int> count(kSlots);
  for (int i = 0; i < static_cast<int>(kSlots) * kEach; ++i)
    ++count[SlotOf(absl::StrCat("arm/", i))];
  // Each is binomial with a deviation of 8.
  for (const int n : count) {
    EXPECT_GT(n, kEach / 4);
    EXPECT_LT(n, kEach * 2);
  }
}

TEST(ShardFile, NamesTheShardOfEachSlot) {
  const auto file = ParseShardFile(
      "# which database has what\n"
      "\n"
      "0-99,512 a.conninfo  # the first\n"
      "\t100-511,513-1022\t/etc/hulld/b.conninfo\r\n"
      "1023 c d.conninfo",
      "/srv");
  ASSERT_TRUE(file.ok()) << file.status();
  ASSERT_EQ(file->shards.size(), 3);
  EXPECT_EQ(file->shards[0].conninfo_file, "/srv/a.conninfo");
  EXPECT_EQ(file->shards[0].slots, "0-99,512");
  EXPECT_EQ(file->shards[1].conninfo_file, "/etc/hulld/b.conninfo");
  EXPECT_EQ(file->shards[1].slots, "100-511,513-1022");
  EXPECT_EQ(file->shards[2].conninfo_file, "/srv/c d.conninfo");
  EXPECT_EQ(file->shard_of[99], 0);
  EXPECT_EQ(file->shard_of[100], 1);
  EXPECT_EQ(file->shard_of[512], 0);
  EXPECT_EQ(file->shard_of[1023], 2);
}

TEST(ShardFile, ErrorsNameTheLineAndTheSlot) {
  const struct {
    const char* text;
    const char* error;
  } kCases[] = {
      {"", "it names no shard"},
      {"# nothing\n", "it names no shard"},
      {"0-1023", "line 1: it is SLOTS CONNINFO_FILE"},
      {"0-1022 a\n", "no line names slot 1023;"},
      {"0-9,20-1000 a\n", "no line names slot 10-19,1001-1023;"},
      {"0-1024 a\n", "line 1: \"0-1024\" is no slot from 0 to 1023"},
      {"\n1-0 a\n", "line 2: \"1-0\" is no slot"},
      {"0-1023, a\n", "line 1: \"\" is no slot"},
      {"0--1 a\n", "line 1: \"0--1\" is no slot"},
      {"-1 a\n", "line 1: \"-1\" is no slot"},
      {"+1 a\n", "line 1: \"+1\" is no slot"},
      {"x a\n", "line 1: \"x\" is no slot"},
      {"0-1e3 a\n", "line 1: \"0-1e3\" is no slot"},
      {"99999999999999999999 a\n", "line 1: \"99999999999999999999\" is no slot"},
      {"0-1023 a\n\n7 b\n", "line 3: slot 7 is named already, in line 1"},
      {"0-9,9 a\n", "line 1: slot 9 is named already, in line 1"},
      {"0-511 a\n512-1023 ./../srv/a\n512 a\n", "line 3: slot 512 is named already, in line 2"},
      {"0-511 a\n512-1023 a\n", "line 2: a is named already, in line 1"},
  };
  for (const auto& one : kCases) {
    const auto file = ParseShardFile(one.text, "/srv");
    EXPECT_EQ(file.status().code(), absl::StatusCode::kInvalidArgument) << one.text;
    EXPECT_THAT(std::string(file.status().message()), HasSubstr(one.error)) << one.text;
  }
}

// Whatever a file holds, it is refused or gives every slot to a shard that is there.
TEST(ShardFile, AnyTextIsRefusedOrGivesEverySlotAShard) {
  const std::string pieces[] = {"0",  "1023", "511",  "512",       "-",
                                ",",  " ",    "\n",   "a b",       "#",
                                "\r", "\0x",  "1024", "0-511 a\n", "512-1023 b\n"};
  std::mt19937_64 random(1);
  int taken = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string text;
    for (uint64_t k = random() % 8; k > 0; --k) text += pieces[random() % std::size(pieces)];
    const auto file = ParseShardFile(text, "");
    if (!file.ok()) continue;
    ++taken;
    for (const uint16_t shard : file->shard_of) ASSERT_LT(shard, file->shards.size()) << text;
  }
  EXPECT_GT(taken, 10);
}

}  // namespace
}  // namespace hulld::server
