#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/calls/grpc_status.h"
#include "core/hull/growth/hull_builder.h"
#include "core/query/collision.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace watch_collisions_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

std::string Text(const v1::CollisionEvent& event) {
  return absl::StrCat(
      absl::StripPrefix(v1::CollisionEventKind_Name(event.kind()), "COLLISION_EVENT_KIND_"), " ",
      event.placement_a(), " ", event.placement_b());
}

// One WatchCollisions call.
class Watch {
 public:
  explicit Watch(v1::CollisionService::Stub& stub) : stream_(stub.WatchCollisions(&context_)) {}
  Watch(v1::CollisionService::Stub& stub, const v1::CollisionWatchOpen& open) : Watch(stub) {
    v1::WatchCollisionsRequest request;
    *request.mutable_open() = open;
    stream_->Write(request);
  }
  ~Watch() {
    if (stream_ == nullptr) return;
    context_.TryCancel();
    Finish();
  }

  // Moves a placement along x.
  void Move(uint32_t placement, double x) { Move(placement, {1, 0, 0, 0, x, 0, 0}); }
  void Move(uint32_t placement, const std::vector<double>& pose) {
    v1::WatchCollisionsRequest request;
    request.mutable_update()->add_placements(placement);
    for (const double number : pose) request.mutable_update()->add_poses(number);
    stream_->Write(request);
  }
  bool Write(const v1::WatchCollisionsRequest& request) { return stream_->Write(request); }
  bool Read(v1::WatchCollisionsResponse* message) { return stream_->Read(message); }

  // Returns all messages up to the end of the round, merged.
  v1::WatchCollisionsResponse Round() {
    v1::WatchCollisionsResponse all;
    v1::WatchCollisionsResponse message;
    while (!message.synced() && stream_->Read(&message)) all.MergeFrom(message);
    EXPECT_TRUE(message.synced());
    return all;
  }
  std::vector<std::string> Events() {
    std::vector<std::string> texts;
    const v1::WatchCollisionsResponse round = Round();
    for (const v1::CollisionEvent& event : round.events()) texts.push_back(Text(event));
    return texts;
  }

  void HalfClose() { stream_->WritesDone(); }
  grpc::Status Finish() {
    v1::WatchCollisionsResponse message;
    while (stream_->Read(&message)) {
    }
    const grpc::Status status = stream_->Finish();
    stream_.reset();
    return status;
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::WatchCollisionsRequest, v1::WatchCollisionsResponse>>
      stream_;
};

class WatchCollisions : public ServerTest {
 protected:
  void SetUp() override {
    ServerTest::SetUp();
    Put("cube", Cube());
  }

  // Cubes of size 1 at these places along x; all pairs.
  static v1::CollisionWatchOpen Cubes(const std::vector<double>& places) {
    v1::CollisionWatchOpen open;
    for (const double x : places) *open.add_placements() = PlacementOf("cube", x);
    return open;
  }
  static v1::CollisionWatchOpen Pair(const v1::CollisionWatchOpen& scene, uint32_t a, uint32_t b) {
    v1::CollisionWatchOpen open = scene;
    open.add_pairs(a);
    open.add_pairs(b);
    return open;
  }
  grpc::Status Refused(const v1::CollisionWatchOpen& open) {
    return Watch(*collisions_, open).Finish();
  }
  void Append(const std::string& id, uint64_t sequence, const Coordinates& xyz) {
    Appender appender(*hulls_, id, "grow", true);
    ASSERT_TRUE(appender.Append(sequence, xyz).has_value());
    ASSERT_TRUE(appender.Finish().ok());
  }
};

TEST_F(WatchCollisions, ReportsCollisionsAndChangesByMotion) {
  for (const bool is_scene : {false, true}) {
    const v1::CollisionWatchOpen scene = Cubes({0, 0.5, 9});
    v1::CollisionWatchOpen pairs = Pair(Pair(Pair(scene, 0, 1), 0, 2), 1, 2);
    Watch watch(*collisions_, is_scene ? scene : pairs);
    const v1::WatchCollisionsResponse first = watch.Round();
    EXPECT_EQ(first.update(), 0);
    ASSERT_EQ(first.hulls_size(), 1);
    EXPECT_EQ(first.hulls(0).hull_id(), "cube");
    EXPECT_EQ(first.hulls(0).revision(), first.header().revision());
    ASSERT_EQ(first.events_size(), 1);
    EXPECT_EQ(Text(first.events(0)), "ENTER 0 1");
    EXPECT_EQ(first.events(0).relation(), v1::RELATION_OVERLAPPING);
    EXPECT_EQ(first.events(0).revision_a(), first.hulls(0).revision());
    EXPECT_FALSE(first.events(0).has_within_clearance());
    watch.Move(1, 1);
    EXPECT_THAT(watch.Events(), ElementsAre("TOUCH 0 1"));
    watch.Move(1, 1.5);
    EXPECT_THAT(watch.Events(), ElementsAre("EXIT 0 1"));
    watch.Move(1, 1.25);
    EXPECT_THAT(watch.Events(), IsEmpty());
    watch.Move(1, 8.25);
    EXPECT_THAT(watch.Events(), ElementsAre("ENTER 1 2"));
    watch.Move(1, 8.5);
    const v1::WatchCollisionsResponse last = watch.Round();
    EXPECT_EQ(last.events_size(), 0);
    EXPECT_EQ(last.update(), 5);
    watch.HalfClose();
    EXPECT_TRUE(watch.Finish().ok());
  }
}

TEST_F(WatchCollisions, ReportsAHullThatGrows) {
  Append("growing", 1, Cube());
  v1::CollisionWatchOpen open = Cubes({2});
  *open.add_placements() = PlacementOf("growing");
  *open.add_placements() = PlacementOf("cube", 99);
  Watch watch(*collisions_, Pair(Pair(open, 0, 1), 1, 2));
  EXPECT_THAT(watch.Events(), IsEmpty());
  Append("growing", 2, {2, 0.5, 0.5});
  const v1::WatchCollisionsResponse round = watch.Round();
  ASSERT_EQ(round.events_size(), 1);
  EXPECT_EQ(Text(round.events(0)), "TOUCH 0 1");
  const v1::HullInfo hull = Get("growing").hull();
  EXPECT_EQ(round.events(0).revision_b(), hull.revision());
  ASSERT_EQ(round.hulls_size(), 1);
  EXPECT_EQ(round.hulls(0).revision(), hull.revision());
  EXPECT_EQ(round.update(), 0);
  Append("growing", 3, {2.5, 0.5, 0.5});
  EXPECT_THAT(watch.Events(), ElementsAre("ENTER 0 1"));
}

TEST_F(WatchCollisions, FindsPairsThatComeTogetherByGrowthInAScene) {
  Append("growing", 1, Cube());
  v1::CollisionWatchOpen open = Cubes({20, 40});
  *open.add_placements() = PlacementOf("growing");
  Watch watch(*collisions_, open);
  EXPECT_THAT(watch.Events(), IsEmpty());
  Append("growing", 2, {30, 0.5, 0.5});
  EXPECT_THAT(watch.Events(), ElementsAre("ENTER 0 2"));
  Append("growing", 3, {40, 0.5, 0.5});
  EXPECT_THAT(watch.Events(), ElementsAre("TOUCH 1 2"));
  watch.Move(2, -1);
  EXPECT_THAT(watch.Events(), ElementsAre("EXIT 1 2"));
  watch.Move(2, 1000);
  EXPECT_THAT(watch.Events(), ElementsAre("EXIT 0 2"));
}

TEST_F(WatchCollisions, AHullMayAppearAndDisappear) {
  v1::CollisionWatchOpen open = Cubes({0});
  *open.add_placements() = PlacementOf("later", 0.5);
  *open.add_placements() = PlacementOf("bad//id");
  Watch watch(*collisions_, open);
  const v1::WatchCollisionsResponse first = watch.Round();
  EXPECT_EQ(first.events_size(), 0);
  ASSERT_EQ(first.placement_problems_size(), 2);
  EXPECT_EQ(first.placement_problems(0).placement(), 1);
  EXPECT_EQ(first.placement_problems(0).reason(), v1::ERROR_REASON_HULL_NOT_FOUND);
  EXPECT_EQ(first.placement_problems(1).code(), grpc::INVALID_ARGUMENT);
  Create("later");
  const v1::WatchCollisionsResponse created = watch.Round();
  EXPECT_EQ(created.events_size(), 0);
  ASSERT_EQ(created.hulls_size(), 1);
  EXPECT_EQ(created.hulls(0).hull_id(), "later");
  Append("later", 1, Cube());
  EXPECT_THAT(watch.Events(), ElementsAre("ENTER 0 1"));
  ASSERT_TRUE(Delete("later").ok());
  const v1::WatchCollisionsResponse deleted = watch.Round();
  ASSERT_EQ(deleted.events_size(), 1);
  EXPECT_EQ(Text(deleted.events(0)), "LOST 0 1");
  EXPECT_EQ(deleted.events(0).relation(), v1::RELATION_UNSPECIFIED);
  ASSERT_EQ(deleted.placement_problems_size(), 1);
  EXPECT_EQ(deleted.placement_problems(0).reason(), v1::ERROR_REASON_HULL_NOT_FOUND);
  Put("later", Cube());
  v1::WatchCollisionsResponse again = watch.Round();
  while (again.events_size() == 0) again = watch.Round();
  EXPECT_EQ(Text(again.events(0)), "ENTER 0 1");
}

TEST_F(WatchCollisions, ReportsNearPairs) {
  v1::CollisionWatchOpen open = Cubes({0, 9});
  open.set_clearance(1);
  Watch watch(*collisions_, open);
  EXPECT_THAT(watch.Events(), IsEmpty());
  watch.Move(1, 2);
  const v1::WatchCollisionsResponse near = watch.Round();
  ASSERT_EQ(near.events_size(), 1);
  EXPECT_EQ(Text(near.events(0)), "NEAR 0 1");
  EXPECT_EQ(near.events(0).relation(), v1::RELATION_SEPARATED);
  EXPECT_TRUE(near.events(0).within_clearance());
  watch.Move(1, 0.5);
  EXPECT_THAT(watch.Events(), ElementsAre("ENTER 0 1"));
  watch.Move(1, 1.5);
  const v1::WatchCollisionsResponse exit = watch.Round();
  ASSERT_EQ(exit.events_size(), 1);
  EXPECT_EQ(Text(exit.events(0)), "EXIT 0 1");
  EXPECT_TRUE(exit.events(0).within_clearance());
  watch.Move(1, 2.5);
  EXPECT_THAT(watch.Events(), ElementsAre("FAR 0 1"));
  watch.Move(1, 0);
  EXPECT_THAT(watch.Events(), ElementsAre("ENTER 0 1"));
  watch.Move(1, 50);
  const v1::WatchCollisionsResponse gone = watch.Round();
  ASSERT_EQ(gone.events_size(), 1);
  EXPECT_EQ(Text(gone.events(0)), "EXIT 0 1");
  EXPECT_TRUE(gone.events(0).has_within_clearance());
  EXPECT_FALSE(gone.events(0).within_clearance());
}

TEST_F(WatchCollisions, GroupsAndMoversLeaveOutPairs) {
  v1::CollisionWatchOpen groups = Cubes({0, 0.1, 0.2, 0.3});
  for (const uint32_t group : {0, 0, 1, 2}) groups.add_groups(group);
  groups.set_ignore_same_group(true);
  groups.add_ignored_group_pairs(2);
  groups.add_ignored_group_pairs(1);
  EXPECT_THAT(Watch(*collisions_, groups).Events(),
              UnorderedElementsAre("ENTER 0 2", "ENTER 0 3", "ENTER 1 2", "ENTER 1 3"));
  v1::CollisionWatchOpen movers = Cubes({0, 0.1, 0.2});
  movers.set_movers(1);
  EXPECT_THAT(Watch(*collisions_, movers).Events(), UnorderedElementsAre("ENTER 0 1", "ENTER 0 2"));
}

TEST_F(WatchCollisions, RefusesMalformedRequests) {
  const auto expect = [](const grpc::Status& status, const std::string& text) {
    EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), HasSubstr(text));
  };
  v1::CollisionWatchOpen open = Cubes({0, 1});
  expect(Refused(Pair(open, 0, 2)), "open: pairs[1] is 2");
  v1::CollisionWatchOpen both = Pair(open, 0, 1);
  both.set_movers(1);
  expect(Refused(both), "pairs cannot be combined with groups or movers");
  v1::CollisionWatchOpen clearance = open;
  clearance.set_clearance(-1);
  expect(Refused(clearance), "open: clearance is -1");
  v1::CollisionWatchOpen groups = open;
  groups.add_groups(1);
  expect(Refused(groups), "groups has 1 groups for 2 placements");
  {
    Watch watch(*collisions_, open);
    watch.Move(2, 0);
    expect(watch.Finish(), "update 1: placements[0] is 2");
  }
  {
    Watch watch(*collisions_, open);
    watch.Move(0, {0, 0, 0, 0, 0, 0, 0});
    expect(watch.Finish(), "update 1: poses[0].");
  }
  {
    Watch watch(*collisions_);
    watch.Move(0, 0);
    expect(watch.Finish(), "the first message must be open");
  }
  {
    Watch watch(*collisions_);
    watch.Write({});
    expect(watch.Finish(), "the message is empty");
  }
  Config config = TestConfig();
  config.limits.max_pairs_per_batch = 2;
  Restart(config);
  Put("cube", Cube());
  const grpc::Status many = Refused(Cubes({0, 0.1, 0.2}));
  EXPECT_EQ(many.error_code(), grpc::RESOURCE_EXHAUSTED);
  EXPECT_THAT(many.error_message(), HasSubstr("--max-pairs-per-batch"));
}

TEST_F(WatchCollisions, EndsWhenTheServerDrains) {
  Watch watch(*collisions_, Cubes({0, 1}));
  watch.Round();
  server_->BeginDrain();
  const grpc::Status status = watch.Finish();
  EXPECT_EQ(status.error_code(), grpc::UNAVAILABLE);
  EXPECT_EQ(ReasonOf(FromGrpcStatus(status)), v1::ERROR_REASON_DRAINING);
  EXPECT_TRUE(server_->WaitIdle(std::chrono::hours(1)));
}

// Hulls by revision and poses by update, to check a watch's events against core.
class Truth {
 public:
  void Grow(const std::string& id, uint64_t revision, const std::vector<Vector>& points) {
    const std::lock_guard lock(mutex_);
    hulls_[{id, revision}] = points;
  }

  v1::Relation Relate(const std::string& a, uint64_t revision_a, const Pose& X_WA,
                      const std::string& b, uint64_t revision_b, const Pose& X_WB) const {
    const Hull hull_a = HullOf(a, revision_a);
    const Hull hull_b = HullOf(b, revision_b);
    const QueryHull query_a(hull_a);
    const QueryHull query_b(hull_b);
    const auto answer = CheckCollision(PlacedHull(query_a, X_WA), PlacedHull(query_b, X_WB), {});
    EXPECT_TRUE(answer.ok());
    switch (answer->relation) {
      case Relation::kOverlapping:
        return v1::RELATION_OVERLAPPING;
      case Relation::kTouching:
        return v1::RELATION_TOUCHING;
      default:
        return v1::RELATION_SEPARATED;
    }
  }

 private:
  Hull HullOf(const std::string& id, uint64_t revision) const {
    HullBuilder builder;
    const std::lock_guard lock(mutex_);
    const auto found = hulls_.find({id, revision});
    EXPECT_NE(found, hulls_.end()) << id << " at " << revision;
    if (found != hulls_.end()) {
      EXPECT_TRUE(builder.Add(found->second).ok());
    }
    return builder.Snapshot();
  }

  mutable std::mutex mutex_;
  std::map<std::pair<std::string, uint64_t>, std::vector<Vector>> hulls_;
};

// Hulls grow and placements move at random, on a coarse lattice so that many pairs touch. Each
// event is exact for its stated poses and revisions, and the watch's final state equals a batch's
// answer.
TEST_F(WatchCollisions, EachEventIsExactAtItsRevisions) {
  constexpr int kHulls = 6;
  constexpr int kUpdates = 150;
  constexpr int kChunks = 25;
  for (const bool is_scene : {false, true}) {
    SCOPED_TRACE(is_scene);
    Truth truth;
    const Coordinates start = Cube(-1, 2);
    std::vector<Vector> start_points;
    for (size_t i = 0; i < start.size(); i += 3) {
      start_points.emplace_back(start[i], start[i + 1], start[i + 2]);
    }
    v1::CollisionWatchOpen open;
    std::vector<std::string> ids;
    std::mt19937 random(is_scene ? 7 : 8);
    const auto coordinate = [](std::mt19937& source) { return static_cast<int>(source() % 7) - 3; };
    for (int h = 0; h < kHulls; ++h) {
      ids.push_back(absl::StrCat(is_scene ? "s" : "p", h));
      // Large enough to collide before they grow.
      Append(ids.back(), 1, start);
      truth.Grow(ids.back(), Get(ids.back()).hull().revision(), start_points);
      *open.add_placements() = PlacementOf(ids.back(), coordinate(random) * 2);
    }
    if (!is_scene) {
      for (uint32_t a = 0; a < kHulls; ++a) {
        for (uint32_t b = a + 1; b < kHulls; ++b) open = Pair(open, a, b);
      }
    }
    // Pose of each placement after each update.
    std::vector<std::vector<Pose>> poses(1);
    for (const v1::Placement& placement : open.placements()) {
      poses[0].push_back(Pose());
      poses[0].back().t = Vector(placement.pose().translation().x(), 0, 0);
    }
    std::vector<v1::WatchCollisionsRequest> updates(kUpdates);
    for (v1::WatchCollisionsRequest& update : updates) {
      const uint32_t moved = random() % kHulls;
      poses.push_back(poses.back());
      Pose& pose = poses.back()[moved];
      pose.t = Vector(coordinate(random), coordinate(random), coordinate(random));
      update.mutable_update()->add_placements(moved);
      for (const double number : {1.0, 0.0, 0.0, 0.0, pose.t[0], pose.t[1], pose.t[2]}) {
        update.mutable_update()->add_poses(number);
      }
    }

    Watch watch(*collisions_, open);
    std::vector<std::thread> writers;
    for (int h = 0; h < kHulls; ++h) {
      writers.emplace_back([&, h] {
        std::mt19937 own(100 + h);
        std::vector<Vector> points = start_points;
        Appender appender(*hulls_, ids[h], "w");
        for (uint64_t i = 1; i <= kChunks; ++i) {
          Coordinates xyz;
          for (int k = 0; k < 3; ++k) xyz.push_back(coordinate(own) * (1 + 0.1 * double(i)));
          points.emplace_back(xyz[0], xyz[1], xyz[2]);
          const auto ack = appender.Append(i, xyz);
          ASSERT_TRUE(ack.has_value());
          truth.Grow(ids[h], ack->hull_revision(), points);
        }
        appender.Finish();
      });
    }
    // Checked after all revisions are known.
    std::vector<std::pair<uint64_t, v1::CollisionEvent>> events;
    std::map<std::pair<uint32_t, uint32_t>, v1::Relation> known;
    uint64_t revision = 0;
    uint64_t updated = 0;
    const auto read = [&] {
      v1::WatchCollisionsResponse message;
      ASSERT_TRUE(watch.Read(&message));
      for (const v1::CollisionEvent& event : message.events()) {
        events.emplace_back(message.update(), event);
        known[{event.placement_a(), event.placement_b()}] = event.relation();
      }
      if (!message.synced()) return;
      EXPECT_GE(message.update(), updated);
      updated = message.update();
      revision = message.header().revision();
    };
    // Keeps a few updates in flight, so that hulls grow between them.
    for (size_t sent = 0; updated < kUpdates && !HasFatalFailure(); read()) {
      while (sent < kUpdates && sent < updated + 3) watch.Write(updates[sent++]);
    }
    for (std::thread& writer : writers) writer.join();
    uint64_t last = 0;
    for (const std::string& id : ids) last = std::max(last, Get(id).hull().revision());
    while (revision < last && !HasFatalFailure()) read();

    // The number depends on the reading speed: two changes between reads are reported as one.
    ASSERT_GT(events.size(), 5);
    for (const auto& [update, event] : events) {
      const uint32_t a = event.placement_a();
      const uint32_t b = event.placement_b();
      ASSERT_EQ(event.relation(), truth.Relate(ids[a], event.revision_a(), poses[update][a], ids[b],
                                               event.revision_b(), poses[update][b]))
          << update << ": " << event.ShortDebugString();
    }
    for (uint32_t a = 0; a < kHulls; ++a) {
      for (uint32_t b = a + 1; b < kHulls; ++b) {
        const v1::Relation now =
            truth.Relate(ids[a], Get(ids[a]).hull().revision(), poses.back()[a], ids[b],
                         Get(ids[b]).hull().revision(), poses.back()[b]);
        const auto reported = known.find({a, b});
        EXPECT_EQ(reported == known.end() ? v1::RELATION_SEPARATED : reported->second, now)
            << a << " " << b;
      }
    }
  }
}

}  // namespace watch_collisions_test
}  // namespace hulld::server
