// Watches of bodies: their creation, changes, deletion, and changing collisions.

#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/client/collision_round.h"
#include "tests/core/checks/point_sets.h"
#include "tests/server/hulls/body_fixture.h"

namespace hulld::server {
namespace body_watch_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string Text(const v1::HullEvent& event) {
  const std::string name(v1::HullEventKind_Name(event.kind()));
  return absl::StrCat(absl::StripPrefix(name, "HULL_EVENT_KIND_"), " ", event.hull().hull_id(),
                      event.is_body() ? absl::StrCat(" of ", event.piece_count()) : "");
}

std::string Text(const v1::CollisionEvent& event) {
  const std::string name(v1::CollisionEventKind_Name(event.kind()));
  std::string text = absl::StrCat(absl::StripPrefix(name, "COLLISION_EVENT_KIND_"), " ",
                                  event.placement_a(), " ", event.placement_b());
  const auto add = [&text](bool has, const v1::DecidingPiece& piece) {
    absl::StrAppend(&text, " ", has ? absl::StrCat(piece.index()) : "-");
  };
  add(event.has_piece_a(), event.piece_a());
  add(event.has_piece_b(), event.piece_b());
  return text;
}

template <typename Message>
std::vector<std::string> Texts(const Message& message) {
  std::vector<std::string> texts;
  for (const auto& event : message.events()) texts.push_back(Text(event));
  return texts;
}

class BodyWatches : public BodyTest {
 protected:
  void SetUp() override {
    BodyTest::SetUp();
    client_.emplace(MakeClient());
    Put("cube", Cube());
  }
  void Grow(const std::string& id, const Coordinates& xyz) {
    Appender appender(*hulls_, id, absl::StrCat("grow", ++growths_), true);
    ASSERT_TRUE(appender.Append(1, xyz).has_value());
    ASSERT_TRUE(appender.Finish().ok());
  }
  // Returns all messages up to the next with events or `synced`, merged.
  static v1::WatchHullsResponse NextMessage(HullWatch& watch) {
    while (true) {
      const auto message = watch.Next();
      EXPECT_TRUE(message.ok()) << message.status();
      if (!message.ok() || message->events_size() > 0 || message->synced()) {
        return message.ok() ? *message : v1::WatchHullsResponse();
      }
    }
  }
  // Rounds without events are marks.
  static v1::WatchCollisionsResponse Change(CollisionWatch& watch) {
    while (true) {
      v1::WatchCollisionsResponse round = Round(watch);
      const bool is_mark = round.hulls().empty() && round.placement_problems().empty();
      if (!is_mark || !round.synced()) return round;
    }
  }

  std::optional<Client> client_;
  int growths_ = 0;
};

TEST_F(BodyWatches, WatchHullsReportsBodiesOnRequest) {
  PutPair("pair");
  v1::WatchHullsRequest request;
  const auto hulls = client_->WatchHulls(request);
  request.set_bodies(true);
  const auto both = client_->WatchHulls(request);
  const v1::WatchHullsResponse there = NextMessage(*both);
  EXPECT_THAT(Texts(there), ElementsAre("PRESENT cube", "PRESENT pair of 2"));
  EXPECT_TRUE(there.events(0).has_box_min());
  EXPECT_FALSE(there.events(1).has_box_min());
  const v1::BodyInfo pair = client_->GetBody("pair")->body();
  EXPECT_EQ(there.events(1).hull().revision(), pair.revision());
  EXPECT_EQ(there.events(1).hull().create_revision(), pair.create_revision());
  EXPECT_THAT(Texts(NextMessage(*hulls)), ElementsAre("PRESENT cube"));
  while (!NextMessage(*both).synced()) {
  }
  while (!NextMessage(*hulls).synced()) {
  }

  const auto put = PutBody("pair", {PlacementOf("cube")});
  ASSERT_TRUE(put.ok());
  const v1::WatchHullsResponse again = NextMessage(*both);
  EXPECT_THAT(Texts(again), ElementsAre("CHANGED pair of 1"));
  EXPECT_EQ(again.events(0).hull().revision(), put->body().revision());
  EXPECT_EQ(again.events(0).hull().create_revision(), pair.create_revision());
  // A piece grows: the event is about the hull.
  Grow("cube", {3, 0, 0});
  EXPECT_THAT(Texts(NextMessage(*both)), ElementsAre("CHANGED cube"));
  EXPECT_THAT(Texts(NextMessage(*hulls)), ElementsAre("CHANGED cube"));
  const auto deleted = client_->DeleteBody("pair");
  ASSERT_TRUE(deleted.ok());
  const v1::WatchHullsResponse gone = NextMessage(*both);
  EXPECT_THAT(Texts(gone), ElementsAre("DELETED pair of 0"));
  EXPECT_EQ(gone.events(0).hull().revision(), deleted->header().revision());
  // Its ID may now be a hull's.
  Put("pair", Cube());
  EXPECT_EQ(Texts(NextMessage(*both)).front(), "CREATED pair");
  EXPECT_EQ(Texts(NextMessage(*hulls)).front(), "CREATED pair");
}

TEST_F(BodyWatches, OneBodyIsWatchedByItsId) {
  v1::WatchHullsRequest request;
  request.set_hull_id("pair");
  request.set_bodies(true);
  const auto watch = client_->WatchHulls(request);
  EXPECT_THAT(Texts(NextMessage(*watch)), IsEmpty());
  PutPair("other");
  PutPair("pair");
  EXPECT_THAT(Texts(NextMessage(*watch)), ElementsAre("CREATED pair of 2"));
}

TEST_F(BodyWatches, CollisionsFollowMotionPiecesAndTheirHulls) {
  PutPair("pair");
  v1::CollisionWatchOpen open;
  *open.add_placements() = PlacementOf("pair");
  *open.add_placements() = PlacementOf("probe", 5.5, 0, 0);
  const auto watch = client_->WatchCollisions(open);
  const v1::WatchCollisionsResponse first = Round(*watch);
  ASSERT_EQ(first.hulls_size(), 1);
  EXPECT_EQ(first.hulls(0).hull_id(), "pair");
  ASSERT_EQ(first.piece_hulls_size(), 1);
  EXPECT_EQ(first.piece_hulls(0).hull_id(), "cube");
  ASSERT_EQ(first.placement_problems_size(), 1);
  EXPECT_EQ(first.placement_problems(0).placement(), 1u);
  EXPECT_THAT(Texts(first), IsEmpty());

  Put("probe", Cube());
  v1::WatchCollisionsResponse message = Change(*watch);
  while (message.events().empty()) message = Change(*watch);
  EXPECT_THAT(Texts(message), ElementsAre("ENTER 0 1 1 -"));
  EXPECT_EQ(message.events(0).revision_a(), first.hulls(0).revision());
  EXPECT_EQ(message.events(0).piece_a().hull().revision(), first.piece_hulls(0).revision());
  v1::CollisionWatchUpdate update;
  update.add_placements(1);
  for (const double number : {1.0, 0.0, 0.0, 0.0, 2.5, 0.0, 0.0}) update.add_poses(number);
  ASSERT_TRUE(watch->Update(update).ok());
  message = Round(*watch);
  while (message.update() == 0) message = Round(*watch);
  EXPECT_THAT(Texts(message), ElementsAre("EXIT 0 1 - -"));

  // A piece grows up to the probe.
  Grow("cube", {2.5, 0.5, 0.5});
  message = Change(*watch);
  EXPECT_THAT(Texts(message), ElementsAre("TOUCH 0 1 0 -"));
  ASSERT_EQ(message.hulls_size(), 1);
  EXPECT_EQ(message.hulls(0).hull_id(), "pair");
  EXPECT_EQ(message.hulls(0).revision(), first.hulls(0).revision());
  ASSERT_EQ(message.piece_hulls_size(), 1);
  EXPECT_EQ(message.piece_hulls(0).revision(), Get("cube").hull().revision());
  EXPECT_EQ(message.events(0).piece_a().hull().revision(), Get("cube").hull().revision());
  EXPECT_GE(message.header().revision(), Get("cube").hull().revision());

  // Put again, with a hull not previously followed.
  Put("block", Cube());
  const auto put = PutBody("pair", {PlacementOf("block", 30, 0, 0), PlacementOf("block", 2, 0, 0)});
  ASSERT_TRUE(put.ok());
  message = Change(*watch);
  EXPECT_THAT(Texts(message), ElementsAre("ENTER 0 1 1 -"));
  EXPECT_EQ(message.events(0).revision_a(), put->body().revision());
  ASSERT_EQ(message.piece_hulls_size(), 1);
  EXPECT_EQ(message.piece_hulls(0).hull_id(), "block");
  // Pieces that were removed are no longer followed.
  Grow("cube", {9, 9, 9});
  Grow("block", {0.5, 0.5, 4});
  message = Change(*watch);
  EXPECT_THAT(Texts(message), IsEmpty());
  ASSERT_EQ(message.piece_hulls_size(), 1);
  EXPECT_EQ(message.piece_hulls(0).revision(), Get("block").hull().revision());

  ASSERT_TRUE(Delete("block").ok());
  message = Change(*watch);
  EXPECT_THAT(Texts(message), ElementsAre("LOST 0 1 - -"));
  ASSERT_EQ(message.placement_problems_size(), 1);
  EXPECT_EQ(message.placement_problems(0).reason(), v1::ERROR_REASON_PIECE_NOT_FOUND);
  EXPECT_THAT(message.placement_problems(0).message(), HasSubstr("hull \"block\" not found"));
  // It is created again and noticed, although the body lacked it.
  Put("block", Cube());
  message = Change(*watch);
  while (message.events().empty()) message = Change(*watch);
  EXPECT_THAT(Texts(message), ElementsAre("ENTER 0 1 1 -"));
  ASSERT_TRUE(client_->DeleteBody("pair").ok());
  message = Change(*watch);
  EXPECT_THAT(Texts(message), ElementsAre("LOST 0 1 - -"));
  EXPECT_EQ(message.placement_problems(0).reason(), v1::ERROR_REASON_HULL_NOT_FOUND);
  // The ID becomes a hull's, and the watch continues with it.
  Put("pair", {2.5, 0, 0, 3, 0, 0, 2.5, 1, 0, 2.5, 0, 1});
  message = Change(*watch);
  while (message.events().empty()) message = Change(*watch);
  EXPECT_THAT(Texts(message), ElementsAre("ENTER 0 1 - -"));
}

TEST_F(BodyWatches, ClearancesBelongToTheNearestPieces) {
  PutPair("pair");
  v1::CollisionWatchOpen open;
  *open.add_placements() = PlacementOf("pair");
  *open.add_placements() = PlacementOf("cube", 6.25, 0, 0);
  open.set_clearance(0.25);
  const auto watch = client_->WatchCollisions(open);
  const v1::WatchCollisionsResponse first = Round(*watch);
  EXPECT_THAT(Texts(first), ElementsAre("NEAR 0 1 1 -"));
  EXPECT_TRUE(first.events(0).within_clearance());
  ASSERT_TRUE(PutBody("pair", {PlacementOf("cube")}).ok());
  EXPECT_THAT(Texts(Change(*watch)), ElementsAre("FAR 0 1 - -"));
}

TEST_F(BodyWatches, ABodyIsWatchedBeforeItsHullsExist) {
  ASSERT_TRUE(PutBody("late", {PlacementOf("unborn")}).ok());
  v1::CollisionWatchOpen open;
  *open.add_placements() = PlacementOf("late");
  *open.add_placements() = PlacementOf("cube");
  const auto watch = client_->WatchCollisions(open);
  EXPECT_EQ(Round(*watch).placement_problems_size(), 1);
  Put("unborn", Cube());
  v1::WatchCollisionsResponse message = Change(*watch);
  while (message.events().empty()) message = Change(*watch);
  EXPECT_THAT(Texts(message), ElementsAre("ENTER 0 1 0 -"));
}

// A watch's events agree with a batch at all times.
TEST_F(BodyWatches, AgreeWithBatchesAfterEveryChange) {
  Random random(7);
  const std::vector<std::string> hulls = {"h0", "h1", "h2"};
  // The last two are far away, so that every change affects the watch and no progress mark is
  // needed.
  const std::vector<std::string> placed = {"b0", "b1", "h0", "b0", "h1", "h2"};
  const std::vector<double> places = {0, 1.5, 3, 6, 100, 200};
  v1::CollisionWatchOpen open;
  for (size_t i = 0; i < placed.size(); ++i) {
    *open.add_placements() = PlacementOf(placed[i], places[i], 0, 0);
  }
  for (const std::string& hull : hulls) Put(hull, Cube());
  const auto watch = client_->WatchCollisions(open);
  std::map<std::pair<uint32_t, uint32_t>, v1::Relation> reported;
  uint64_t told_revision = 0;
  int collisions = 0;
  for (int step = 0; step < 200; ++step) {
    const std::string body = random.Below(2) == 0 ? "b0" : "b1";
    const std::string hull = hulls[static_cast<size_t>(random.Below(3))];
    switch (random.Below(8)) {
      case 0:
      case 1:
      case 2:
      case 3:
      case 4: {
        std::vector<v1::Placement> pieces;
        for (int k = random.Between(1, 3); k > 0; --k) {
          pieces.push_back(PlacementOf(hulls[static_cast<size_t>(random.Below(3))],
                                       random.Between(-4, 4), 0.25 * random.Between(0, 5), 0));
        }
        ASSERT_TRUE(PutBody(body, pieces).ok());
        break;
      }
      case 5:
        if (Delete(hull).ok()) break;
        Put(hull, Cube());
        break;
      case 6:
        Grow(hull, {0.25 * random.Between(-6, 6), 0.25 * random.Between(-6, 6), 0.5});
        break;
      default:
        client_->DeleteBody(body).IgnoreError();
    }
    v1::BatchCheckCollisionsRequest batch;
    *batch.mutable_placements() = open.placements();
    for (uint32_t b = 0; b < placed.size(); ++b) {
      for (uint32_t a = 0; a < b; ++a) {
        batch.add_pairs(a);
        batch.add_pairs(b);
      }
    }
    std::map<std::pair<uint32_t, uint32_t>, v1::Relation> expected;
    uint64_t revision = 0;
    int row = 0;
    ASSERT_TRUE(client_
                    ->BatchCheckCollisions(batch,
                                           [&](const v1::BatchCheckCollisionsResponse& part) {
                                             if (part.has_header())
                                               revision = part.header().revision();
                                             for (const int relation : part.columns().relations()) {
                                               const std::pair pair(batch.pairs(2 * row),
                                                                    batch.pairs(2 * row + 1));
                                               ++row;
                                               if (relation != v1::RELATION_TOUCHING &&
                                                   relation != v1::RELATION_OVERLAPPING) {
                                                 continue;
                                               }
                                               expected[pair] = static_cast<v1::Relation>(relation);
                                             }
                                             return absl::OkStatus();
                                           })
                    .ok());
    while (told_revision < revision) {
      const v1::WatchCollisionsResponse round = Round(*watch);
      ASSERT_TRUE(round.synced());
      told_revision = round.header().revision();
      for (const v1::CollisionEvent& event : round.events()) {
        const std::pair pair(event.placement_a(), event.placement_b());
        reported.erase(pair);
        if (event.relation() == v1::RELATION_TOUCHING ||
            event.relation() == v1::RELATION_OVERLAPPING) {
          reported[pair] = event.relation();
        }
      }
    }
    ASSERT_EQ(reported, expected) << "step " << step;
    collisions += static_cast<int>(expected.size());
  }
  EXPECT_GT(collisions, 30);
}

}  // namespace body_watch_test
}  // namespace hulld::server
