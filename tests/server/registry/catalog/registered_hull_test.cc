// Tests of changes by a peer server to a hull in memory.
#include "server/registry/catalog/registered_hull.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace registered_hull_test {

using ::testing::ElementsAre;

class SupersededHull : public ::testing::Test {
 protected:
  // The unit cube at revision 5: a base of revision 3 with six corners, and two deltas.
  static StoredHull Cube() {
    StoredHull stored;
    stored.record.hull_id = "h";
    stored.record.create_revision = 2;
    stored.record.revision = 5;
    stored.record.dimension = 3;
    stored.record.vertex_count = 8;
    stored.layout = {.base_revision = 3, .base_vertices = 6, .delta_count = 2, .delta_vertices = 2};
    return stored;
  }
  // The cube with one more delta.
  static StoredHull Grown(uint64_t points = 1) {
    StoredHull stored = Cube();
    stored.record.revision = 9;
    stored.record.vertex_count += points;
    stored.layout.delta_count += 1;
    stored.layout.delta_vertices += points;
    return stored;
  }

  SupersededHull() { hull_.SetLive(std::make_shared<LiveHull>(CubeCorners(), 3)); }

  bool Supersede(const StoredHull& stored, const std::vector<Vector>* growth) {
    Locked locked(mutex_);
    return hull_.Supersede(locked, stored, growth);
  }
  size_t ServedPoints() { return hull_.Serve()->query_hull().point_count(); }

  const std::vector<Vector> growth_ = {{2, 2, 2}};
  FairMutex mutex_;
  MemoryBudget budget_{1 << 30, 1 << 29, mutex_};
  RegisteredHull hull_{Cube(), HullState::Present(), true, budget_};
};

TEST_F(SupersededHull, OnlyFewPointsInDeltasAfterTheSameBaseAreGrowth) {
  EXPECT_TRUE(hull_.GrewInto(Grown()));
  EXPECT_TRUE(hull_.GrewInto(Grown(RegisteredHull::kMaxGrowth)));
  EXPECT_FALSE(hull_.GrewInto(Grown(RegisteredHull::kMaxGrowth + 1)));
  const auto grew_with = [&](const std::function<void(StoredHull&)>& change) {
    StoredHull stored = Grown();
    change(stored);
    return hull_.GrewInto(stored);
  };
  EXPECT_FALSE(grew_with([](StoredHull& hull) { hull.record.create_revision = 6; }));
  EXPECT_FALSE(grew_with([](StoredHull& hull) { hull.record.revision = 5; }));
  EXPECT_FALSE(grew_with([](StoredHull& hull) { hull.record.dimension = 2; }));
  EXPECT_FALSE(grew_with([](StoredHull& hull) { hull.layout.base_revision = 7; }));
  EXPECT_FALSE(grew_with([](StoredHull& hull) { hull.layout.delta_count = 2; }));
  EXPECT_FALSE(grew_with([](StoredHull& hull) { hull.layout.delta_vertices = 2; }));
  Locked locked(mutex_);
  hull_.DiscardAll(locked);
  EXPECT_FALSE(hull_.GrewInto(Grown()));
}

TEST_F(SupersededHull, GrowthIsAddedAndReadersKeepTheirSnapshots) {
  const std::shared_ptr<const ServedHull> before = hull_.Serve();
  EXPECT_TRUE(Supersede(Grown(), &growth_));
  EXPECT_EQ(hull_.committed(), Grown());
  EXPECT_EQ(hull_.head(), Grown());
  EXPECT_EQ(before->query_hull().point_count(), 8);
  EXPECT_EQ(before->high(), Vector(1, 1, 1));
  EXPECT_EQ(ServedPoints(), 9);
  EXPECT_EQ(hull_.Serve()->high(), Vector(2, 2, 2));
  EXPECT_EQ(hull_.Describe().box.high, Vector(2, 2, 2));
  EXPECT_EQ(hull_.points_since_prepared(), 1);
}

TEST_F(SupersededHull, WithoutGrowthItIsDropped) {
  EXPECT_FALSE(Supersede(Grown(), nullptr));
  EXPECT_EQ(hull_.committed(), Grown());
  EXPECT_FALSE(hull_.IsReady());
  EXPECT_TRUE(hull_.Describe().box.IsEmpty());
  // The hull was deleted before its growth arrived.
  EXPECT_FALSE(Supersede(Grown(2), &growth_));
  EXPECT_FALSE(hull_.IsReady());
}

TEST_F(SupersededHull, WithoutNewVerticesEverythingIsKept) {
  hull_.SetBuilder(std::make_unique<HullBuilder>());
  StoredHull counted = Cube();
  counted.record.counts.received = 1;
  EXPECT_FALSE(Supersede(counted, nullptr));
  EXPECT_EQ(hull_.committed(), counted);
  EXPECT_EQ(ServedPoints(), 8);
  EXPECT_NE(hull_.builder(), nullptr);
  EXPECT_TRUE(hull_.builder_backlog().empty());
}

TEST_F(SupersededHull, ABuilderIsKeptUnlessItLacksMuch) {
  hull_.SetBuilder(std::make_unique<HullBuilder>());
  EXPECT_TRUE(Supersede(Grown(), &growth_));
  EXPECT_THAT(hull_.builder_backlog(), ElementsAre(growth_.front()));
  const std::vector<Vector> many = SpherePoints(RegisteredHull::kMaxGrowth, 10);
  StoredHull next = Grown(1 + many.size());
  next.record.revision = 10;
  EXPECT_TRUE(Supersede(next, &many));
  EXPECT_EQ(hull_.builder(), nullptr);
  EXPECT_TRUE(hull_.builder_backlog().empty());
  EXPECT_EQ(ServedPoints(), 9 + many.size());
}

// No reader receives a version that contains its appended points.
TEST_F(SupersededHull, AThreadThatBuildsLosesItsPoints) {
  hull_.state.Schedule();
  hull_.state.StartBuilding();
  hull_.LendBuilder();
  const std::shared_ptr<LiveHull> live = hull_.live();
  live->Append(std::vector<Vector>{{3, 3, 3}}, 3);
  EXPECT_TRUE(Supersede(Grown(), &growth_));
  EXPECT_EQ(hull_.state.work(), HullState::Work::kReverting);
  EXPECT_NE(hull_.live(), live);
  live->Append(std::vector<Vector>{{4, 4, 4}}, 3);
  EXPECT_EQ(ServedPoints(), 9);
  EXPECT_EQ(hull_.Serve()->high(), Vector(2, 2, 2));
}

TEST_F(SupersededHull, ReceivedGrowthIsCountedAndDoesNotPinTheHull) {
  RegisteredHull used_later(Cube(), HullState::Present(), true, budget_);
  used_later.SetLive(std::make_shared<LiveHull>(CubeCorners(), 3));
  hull_.NoteUse();
  used_later.NoteUse();
  const uint64_t before = budget_.Statistics().bytes;
  const std::vector<Vector> many = SpherePoints(1000, 2);
  EXPECT_TRUE(Supersede(Grown(many.size()), &many));
  EXPECT_GE(budget_.Statistics().bytes, before + many.size() * sizeof(Vector));
  // Leaves less room than the growth needs.
  const MemoryCharge charge(budget_, MemoryUse::kReading, (1 << 30) - (16 << 10));
  Locked locked(mutex_);
  budget_.Evict(locked);
  EXPECT_EQ(hull_.live(), nullptr);
  EXPECT_NE(used_later.live(), nullptr);
}

}  // namespace registered_hull_test
}  // namespace hulld::server
