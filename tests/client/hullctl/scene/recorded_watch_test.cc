#include "client/hullctl/scene/recorded_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace recorded_watch_test {

using testing::ElementsAre;
using testing::HasSubstr;

absl::StatusOr<RecordedWatch> Read(const std::string& content) {
  const TempFile file("watch.jsonl", content);
  return ReadRecordedWatch(file.path());
}

std::string Error(const std::string& content) {
  const auto watch = Read(content);
  return std::string(watch.status().message().data(), watch.status().message().size());
}

constexpr char kSynced[] = R"({"update":"0","synced":true})";
constexpr char kEnter[] =
    R"({"update":"0","events":[{"kind":"COLLISION_EVENT_KIND_ENTER","placementA":4,"placementB":7}]})";

TEST(RecordedWatch, KeepsMessagesWithEventsAndTheEndOfTheInitialState) {
  const auto watch =
      Read(std::string(kSynced) + "\n" + R"({"update":"0"})" + "\n\n" + kEnter + "\n");
  ASSERT_TRUE(watch.ok()) << watch.status();
  EXPECT_TRUE(watch->is_of_pairs);
  EXPECT_EQ(watch->placements, 8);
  EXPECT_THAT(watch->messages,
              ElementsAre(HasSubstr(R"("synced":true)"), HasSubstr(R"("placementB":7)")));
}

TEST(RecordedWatch, DistinguishesHullsFromPairs) {
  const auto watch = Read(
      R"({"events":[{"kind":"HULL_EVENT_KIND_PRESENT","hull":{"hullId":"arm"}}],"restarted":true})");
  ASSERT_TRUE(watch.ok()) << watch.status();
  EXPECT_FALSE(watch->is_of_pairs);
  EXPECT_THAT(watch->messages, ElementsAre(HasSubstr(R"("hullId":"arm")")));
}

TEST(RecordedWatch, NamesTheLineThatIsNotAMessage) {
  EXPECT_THAT(Error("{}"), HasSubstr("watch.jsonl: contains no event"));
  EXPECT_THAT(Error("ENTER\t0\t1\n"), HasSubstr("watch.jsonl:1: not a line of 'hullctl watch"));
  EXPECT_THAT(Error(std::string(kEnter) + "\n{\"restarted\":true}"),
              HasSubstr("watch.jsonl:2: not a line of"));
  EXPECT_THAT(Error(std::string(kEnter) + "\n{\"events\":[{"), HasSubstr("watch.jsonl:2: "));
}

}  // namespace recorded_watch_test
}  // namespace hulld
