#include "server/registry/catalog/hull_table.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <memory>
#include <string>
#include <vector>

#include "server/registry/catalog/registered_hull.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace hull_table_test {

StoredHull Stored(const std::string& id, uint64_t revision) {
  StoredHull hull;
  hull.record.hull_id = id;
  hull.record.create_revision = revision;
  hull.record.revision = revision + 1;
  hull.record.dimension = 3;
  hull.record.vertex_count = 8;
  hull.record.counts = {10, 8, 1, 1};
  hull.writer_count = 2;
  hull.layout = {revision + 1, 8, 0, 0};
  return hull;
}

class HullTableTest : public ::testing::Test {
 protected:
  // One full turn and one more step.
  void GoRound() {
    for (size_t i = 0; i <= table_.size(); ++i) table_.RestSome(locked_);
  }
  bool IsAwake(const std::string& id) const {
    return table_.entries().find(id)->second.awake() != nullptr;
  }
  // The hull with the points of a unit cube.
  HullPointer Cube(const std::string& id) {
    table_.AddResting(Stored(id, 3));
    HullPointer hull = table_.Find(id);
    hull->SetLive(std::make_shared<LiveHull>(CubeCorners(), 3));
    hull->NoteUse();
    return hull;
  }
  static void RestIdle(Locked& locked, HullTable& table) {
    std::string cursor;
    while (table.RestIdle(locked, cursor)) {
      locked.Unlock();
      locked.Lock();
    }
  }
  // Long enough for unused hulls to be put to rest.
  void PassTime() {
    for (int i = 0; i < 2; ++i) RestIdle(locked_, table_);
  }

  FairMutex mutex_;
  Locked locked_{mutex_};
  MemoryBudget budget_{1 << 30, 1 << 29, mutex_};
  HullTable table_{true, budget_};
};

TEST_F(HullTableTest, AHullReturnsFromRestUnchanged) {
  const StoredHull stored = Stored("a", 7);
  table_.AddResting(stored);
  EXPECT_FALSE(IsAwake("a"));
  EXPECT_TRUE(table_.entries().find("a")->second.visible());
  EXPECT_EQ(table_.entries().find("a")->second.Describe("a").record, stored.record);
  EXPECT_EQ(table_.entries().find("a")->second.revision(), 8);
  {
    const auto hull = table_.Find("a");
    EXPECT_TRUE(IsAwake("a"));
    EXPECT_EQ(hull->committed(), stored);
    EXPECT_EQ(hull->head(), stored);
    EXPECT_EQ(table_.Find("a"), hull);
    hull->SetBox({{1, 2, 3}, {4, 5, 6}});
    GoRound();
    EXPECT_TRUE(IsAwake("a")) << "while it is in use";
  }
  GoRound();
  EXPECT_FALSE(IsAwake("a"));
  const HullChange described = table_.entries().find("a")->second.Describe("a");
  EXPECT_EQ(described.box.high, Vector(4, 5, 6));
  const auto again = table_.Find("a");
  EXPECT_EQ(again->committed(), stored);
  EXPECT_EQ(again->Describe().box.low, Vector(1, 2, 3));
}

// Putting it to rest would lose each of these.
TEST_F(HullTableTest, HullsInUseAreNotEvicted) {
  const auto expect_awake_while = [&](const char* what, auto begin, auto end) {
    table_.AddResting(Stored("x", 3));
    begin(*table_.Find("x"));
    GoRound();
    EXPECT_TRUE(IsAwake("x")) << what;
    end(*table_.Find("x"));
    GoRound();
    EXPECT_FALSE(IsAwake("x")) << what;
    table_.Erase(table_.Find("x"));
  };
  expect_awake_while(
      "a session", [](RegisteredHull& hull) { hull.watches[1] = {}; },
      [](RegisteredHull& hull) { hull.watches.clear(); });
  expect_awake_while(
      "a writer's sequence", [](RegisteredHull& hull) { hull.KeepSequence("w", 4); },
      [](RegisteredHull& hull) { hull.DropUnusedWriters(); });
  expect_awake_while(
      "a thread that reads one", [](RegisteredHull& hull) { hull.StartReadingSequence(); },
      [](RegisteredHull& hull) { hull.EndReadingSequence(); });
  expect_awake_while(
      "a thread that loads it", [](RegisteredHull& hull) { hull.StartLoading(); },
      [](RegisteredHull& hull) { hull.EndLoading(); });
  expect_awake_while(
      "a thread that prepares it", [](RegisteredHull& hull) { hull.SetPreparing(true); },
      [](RegisteredHull& hull) { hull.SetPreparing(false); });
  expect_awake_while(
      "a change that waits", [](RegisteredHull& hull) { hull.exclusive.emplace_back(); },
      [](RegisteredHull& hull) { hull.exclusive.clear(); });
  expect_awake_while(
      "points", [](RegisteredHull& hull) { hull.SetLive(std::make_shared<LiveHull>()); },
      [this](RegisteredHull& hull) { hull.DiscardAll(locked_); });
  expect_awake_while(
      "an end on its way", [](RegisteredHull& hull) { hull.state.StartEnding(); },
      [](RegisteredHull& hull) { hull.state.Refuse(); });
}

TEST_F(HullTableTest, DamagedHullsStayMarkedAsDamaged) {
  table_.AddResting(Stored("x", 3));
  table_.Find("x")->state.Damage(absl::DataLossError("as found"));
  GoRound();
  EXPECT_TRUE(table_.Find("x")->state.damaged());
}

TEST_F(HullTableTest, TheClockHandVisitsAnyNumberOfHulls) {
  for (int i = 0; i < 37; ++i) table_.AddResting(Stored("h" + std::to_string(i), i + 1));
  for (int i = 0; i < 37; ++i) ASSERT_NE(table_.Find("h" + std::to_string(i)), nullptr);
  for (size_t step = 0; step <= 37 / HullTable::kHullsPerStep + 1; ++step) table_.RestSome(locked_);
  for (int i = 0; i < 37; ++i) EXPECT_FALSE(IsAwake("h" + std::to_string(i))) << i;
}

TEST_F(HullTableTest, AnIdleSmallHullKeepsOnlyItsPoints) {
  Cube("a");
  RestIdle(locked_, table_);
  EXPECT_TRUE(IsAwake("a")) << "looked up since the last visit";
  RestIdle(locked_, table_);
  ASSERT_FALSE(IsAwake("a"));
  EXPECT_EQ(table_.entries().find("a")->second.compact()->points.size(), 8);
  EXPECT_EQ(budget_.Statistics().bytes, table_.compact_bytes());
  EXPECT_GE(table_.compact_bytes(), 8 * sizeof(Vector));
  EXPECT_FALSE(table_.entries().find("a")->second.Describe("a").box.IsEmpty());
  const auto hull = table_.Find("a");
  EXPECT_EQ(hull->committed(), Stored("a", 3));
  EXPECT_EQ(hull->builder(), nullptr);
  EXPECT_EQ(hull->Serve()->query_hull().point_count(), 8);
  EXPECT_EQ(hull->Serve()->high(), Vector(1, 1, 1));
  EXPECT_GE(budget_.Statistics().bytes, hull->live()->MemoryBytes() + table_.compact_bytes());
}

TEST_F(HullTableTest, IdleHullsInUseStayAwake) {
  const auto expect_awake_while = [&](const char* what, auto begin, auto end) {
    begin(*Cube("x"));
    PassTime();
    EXPECT_TRUE(IsAwake("x")) << what;
    end(*table_.Find("x"));
    PassTime();
    EXPECT_FALSE(IsAwake("x")) << what;
    table_.Erase(table_.Find("x"));
  };
  std::shared_ptr<const ServedHull> served;
  expect_awake_while(
      "a reader", [&](RegisteredHull& hull) { served = hull.Serve(); },
      [&](RegisteredHull&) { served = nullptr; });
  HullPointer held;
  expect_awake_while(
      "a call", [&](RegisteredHull&) { held = table_.Find("x"); },
      [&](RegisteredHull&) { held = nullptr; });
  expect_awake_while(
      "a session", [](RegisteredHull& hull) { hull.watches[1] = {}; },
      [](RegisteredHull& hull) { hull.watches.clear(); });
  expect_awake_while(
      "a thread that prepares it", [](RegisteredHull& hull) { hull.SetPreparing(true); },
      [](RegisteredHull& hull) { hull.SetPreparing(false); });
  expect_awake_while(
      "an end on its way", [](RegisteredHull& hull) { hull.state.StartEnding(); },
      [](RegisteredHull& hull) { hull.state.Refuse(); });
}

TEST_F(HullTableTest, AnIdleLargeHullStaysAwake) {
  StoredHull stored = Stored("x", 3);
  stored.record.vertex_count = 1000;
  table_.AddResting(stored);
  table_.Find("x")->SetLive(std::make_shared<LiveHull>(SpherePoints(1000), 3));
  PassTime();
  EXPECT_TRUE(IsAwake("x"));
}

TEST_F(HullTableTest, ManyIdleHullsComeToRestOverSeveralCriticalSections) {
  constexpr int kHulls = 300;
  for (int i = 0; i < kHulls; ++i) Cube("h" + std::to_string(i));
  PassTime();
  for (int i = 0; i < kHulls; ++i) EXPECT_FALSE(IsAwake("h" + std::to_string(i))) << i;
  EXPECT_LE(mutex_.Statistics().max_lookups, kMaxLookupsPerHold);
}

TEST_F(HullTableTest, AHullComesToRestAfterLongUse) {
  auto used = Cube("a");
  for (int i = 0; i < 3; ++i) PassTime();
  EXPECT_TRUE(IsAwake("a"));
  used = nullptr;
  PassTime();
  EXPECT_FALSE(IsAwake("a"));
}

// Two idle hulls lose their points, and a hull in use keeps its own.
TEST_F(HullTableTest, UnderPressureIdleHullsAreDroppedFirst) {
  Cube("a");
  Cube("b");
  PassTime();
  const auto used = Cube("c");
  const uint64_t all = budget_.Statistics().bytes;
  MemoryCharge charge(budget_, MemoryUse::kReading, (1 << 30) - all + 1);
  budget_.Evict(locked_);
  EXPECT_EQ(table_.compact_bytes(), 0);
  EXPECT_NE(used->live(), nullptr);
  EXPECT_FALSE(table_.Find("a")->IsReady());
  EXPECT_EQ(table_.Find("a")->committed(), Stored("a", 3));
}

TEST_F(HullTableTest, PointsOfAnUnchangedHullStayInPlace) {
  Cube("a");
  PassTime();
  const HullTable::Entry& entry = table_.entries().find("a")->second;
  const CompactHull* const compact = entry.compact();
  const uint64_t bytes = table_.compact_bytes();
  ASSERT_NE(compact, nullptr);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NE(table_.Find("a")->Serve(), nullptr);
    EXPECT_EQ(table_.compact_bytes(), bytes);
    PassTime();
    EXPECT_FALSE(IsAwake("a"));
    EXPECT_EQ(entry.compact(), compact);
  }
  // Points of a changed hull are new.
  StoredHull changed = Stored("a", 3);
  ++changed.record.revision;
  const std::vector<Vector> growth = {{2, 0, 0}};
  changed.layout = {4, 8, 1, 1};
  table_.Find("a")->Supersede(locked_, changed, &growth);
  PassTime();
  ASSERT_NE(entry.compact(), nullptr);
  EXPECT_EQ(entry.compact()->points.size(), 9);
  table_.Erase(table_.Find("a"));
  EXPECT_EQ(table_.compact_bytes(), 0);
}

TEST_F(HullTableTest, WithoutAStoreIdleHullsKeepPointsAndSequences) {
  HullTable table(false, budget_);
  const auto insert = [&](const std::string& id) {
    const auto hull = table.Insert(Stored(id, 3), HullState::Present());
    hull->SetLive(std::make_shared<LiveHull>(CubeCorners(), 3));
    hull->KeepSequence("w", 4);
    hull->NoteUse();
  };
  insert("x");
  for (int i = 0; i < 2; ++i) RestIdle(locked_, table);
  ASSERT_NE(table.entries().find("x")->second.compact(), nullptr);
  EXPECT_EQ(budget_.Statistics().writing_bytes, table.compact_bytes());
  MemoryCharge charge(budget_, MemoryUse::kReading, 1 << 30);
  budget_.Evict(locked_);
  const auto hull = table.Find("x");
  EXPECT_EQ(hull->Serve()->query_hull().point_count(), 8);
  EXPECT_EQ(hull->CommittedSequence("w"), 4);
  EXPECT_EQ(hull->HeadSequence("w"), 4);
}

// Sanitizers have their own allocators.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST_F(HullTableTest, AHullAtRestTakesLessThan300Bytes) {
  constexpr int kHulls = 20000;
  const size_t before = mallinfo2().uordblks;
  for (int i = 0; i < kHulls; ++i) table_.AddResting(Stored("part/" + std::to_string(i), i + 1));
  const size_t each = (mallinfo2().uordblks - before) / kHulls;
  RecordProperty("bytes", static_cast<int>(each));
  EXPECT_LT(each, 300);
}

TEST_F(HullTableTest, AnIdleBoxTakesLessThan600Bytes) {
  constexpr int kHulls = 20000;
  const size_t before = mallinfo2().uordblks;
  for (int i = 0; i < kHulls; ++i) Cube("part/" + std::to_string(i));
  PassTime();
  const size_t each = (mallinfo2().uordblks - before) / kHulls;
  RecordProperty("bytes", static_cast<int>(each));
  EXPECT_LT(each, 600);
}
#endif

TEST_F(HullTableTest, AChangedHullRestsAfterManyLaterOnesUnlessItIsLookedUp) {
  const auto change = [this](const std::string& id) { table_.RestSoon(locked_, *Cube(id)); };
  change("first");
  change("read");
  EXPECT_NE(table_.Find("read"), nullptr);
  for (size_t i = 0; i < HullTable::kMaxJustChanged; ++i) {
    EXPECT_TRUE(IsAwake("first") || i + 2 >= HullTable::kMaxJustChanged) << i;
    change("later/" + std::to_string(i));
  }
  EXPECT_FALSE(IsAwake("first"));
  EXPECT_TRUE(IsAwake("read"));
  EXPECT_TRUE(IsAwake("later/0"));
}

}  // namespace hull_table_test
}  // namespace hulld::server
