// Tests of the events that a registry sends to its watches.
#include "server/registry/catalog/change_feed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <future>
#include <mutex>
#include <span>

#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace change_feed_test {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::string Text(const HullChange& change) {
  static const char* const kNames[] = {"present", "created", "changed", "replaced", "deleted"};
  return std::string(kNames[static_cast<int>(change.kind)]) + (change.is_body ? " body " : " ") +
         change.record.hull_id;
}

// A watch that collects events on request.
class Watcher {
 public:
  Watcher(Registry& registry, const WatchTarget& target, const WatchStart& start)
      : registry_(registry) {
    watch_ = *registry_.OpenWatch(target, start, [this] {
      const std::lock_guard lock(mutex_);
      waits_ = false;
      changed_.notify_all();
    });
  }
  ~Watcher() {
    registry_.NudgeWatch(watch_);
    AwaitTurn();
    registry_.CloseWatch(watch_);
  }

  // Waits for the next non-empty piece and returns it.
  WatchPiece Next() {
    while (true) {
      AwaitTurn();
      WatchPiece piece = Take();
      if (!piece.changes.empty() || piece.synced || piece.anew) return piece;
    }
  }
  // Returns all pending events, piece by piece.
  std::vector<std::string> All() {
    std::vector<std::string> texts;
    bool waits = false;
    {
      const std::lock_guard lock(mutex_);
      waits = waits_;
    }
    // Earlier changes made it due; on_ready may still be in flight.
    if (waits) registry_.NudgeWatch(watch_);
    AwaitTurn();
    while (true) {
      const WatchPiece piece = Take();
      if (piece.waits) return texts;
      if (piece.anew) texts.push_back("anew");
      for (const HullChange& change : piece.changes) texts.push_back(Text(change));
      if (piece.synced) texts.push_back("synced");
    }
  }
  // Waits until an event is pending or the watch is called for another reason.
  void Await() {
    AwaitTurn();
    Take();
  }
  absl::Status AwaitEnd() {
    AwaitTurn();
    return registry_.TakeChanges(*watch_).status();
  }
  uint64_t revision() const { return revision_; }
  void Also(std::span<const std::string> added, std::span<const std::string> dropped) {
    registry_.WatchAlso(*watch_, added, dropped);
  }

 private:
  void AwaitTurn() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !waits_; });
  }
  WatchPiece Take() {
    {
      // on_ready may run before TakeChanges returns.
      const std::lock_guard lock(mutex_);
      waits_ = true;
    }
    WatchPiece piece = *registry_.TakeChanges(*watch_);
    if (!piece.waits) {
      const std::lock_guard lock(mutex_);
      waits_ = false;
      revision_ = piece.revision;
    }
    return piece;
  }

  Registry& registry_;
  std::shared_ptr<ChangeWatch> watch_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool waits_ = false;
  uint64_t revision_ = 0;
};

const WatchStart kFromTheStart{true};

WatchTarget Prefix(const std::string& prefix) { return {prefix, {}}; }
WatchTarget Hull(const std::string& id) { return {"", {id}}; }

using DurableChangeFeedTest = StoreTest;

class ChangeFeedTest : public ::testing::Test {
 protected:
  Registry& registry() { return hulls_->registry(); }
  // Resumes a watch that is at the store's current revision.
  WatchStart Resume() { return {true, registry().Sizes().store_revision, registry().store().id()}; }
  void Replace(const std::string& id) {
    Replacement replacement;
    replacement.hull_id = id;
    replacement.builder = std::make_shared<HullBuilder>();
    ASSERT_TRUE(replacement.builder->Add(CubeCorners(0, 7)).ok());
    ASSERT_TRUE(hulls_->Replace(std::move(replacement)).ok());
  }
  // Puts a single-piece body; its hull need not exist.
  void PutBody(const std::string& id) {
    std::promise<absl::Status> done;
    registry().bodies().Put({{id, 0, 0}, {"piece"}, {{0, Pose()}}}, std::nullopt,
                            [&done](const auto& put) { done.set_value(put.status()); });
    ASSERT_TRUE(done.get_future().get().ok());
  }
  void DeleteBody(const std::string& id) {
    std::promise<absl::Status> done;
    registry().bodies().Delete(id, std::nullopt,
                               [&done](const auto& deleted) { done.set_value(deleted.status()); });
    ASSERT_TRUE(done.get_future().get().ok());
  }

  std::unique_ptr<MemoryRegistry> hulls_ =
      std::make_unique<MemoryRegistry>(std::make_unique<MemoryStore>());
};

TEST_F(ChangeFeedTest, TellsWhatIsThereThenWhatChanges) {
  ASSERT_TRUE(hulls_->Create("b").ok());
  ASSERT_TRUE(hulls_->Put("a", CubeCorners()).ok());
  Watcher watcher(registry(), Prefix(""), kFromTheStart);
  EXPECT_THAT(watcher.All(), ElementsAre("present a", "present b", "synced"));
  EXPECT_EQ(watcher.revision(), registry().Sizes().store_revision);
  EXPECT_THAT(watcher.All(), IsEmpty());
  ASSERT_TRUE(hulls_->Put("b", CubeCorners()).ok());
  EXPECT_THAT(watcher.All(), ElementsAre("changed b"));
  ASSERT_TRUE(hulls_->Create("c").ok());
  EXPECT_THAT(watcher.All(), ElementsAre("created c"));
  Replace("a");
  EXPECT_THAT(watcher.All(), ElementsAre("replaced a"));
  ASSERT_TRUE(hulls_->Delete("a").ok());
  EXPECT_THAT(watcher.All(), ElementsAre("deleted a"));
  EXPECT_EQ(watcher.revision(), registry().Sizes().store_revision);
}

TEST_F(ChangeFeedTest, AnEmptyStoreIsSyncedAtOnce) {
  Watcher watcher(registry(), Prefix(""), kFromTheStart);
  EXPECT_THAT(watcher.All(), ElementsAre("synced"));
}

TEST_F(ChangeFeedTest, EachChangeWakesAWatchThatWaits) {
  Watcher watcher(registry(), Prefix(""), kFromTheStart);
  EXPECT_THAT(watcher.All(), ElementsAre("synced"));
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(hulls_->Create("h" + std::to_string(i)).ok());
    const WatchPiece piece = watcher.Next();
    ASSERT_EQ(piece.changes.size(), 1);
    EXPECT_EQ(Text(piece.changes[0]), "created h" + std::to_string(i));
  }
}

// All changes of a hull since its last event coalesce into one event.
TEST_F(ChangeFeedTest, CoalescesWhatHappenedToAHull) {
  for (const char* id : {"kept", "gone", "reborn", "replaced"}) {
    ASSERT_TRUE(hulls_->Create(id).ok());
  }
  Watcher watcher(registry(), Prefix(""), kFromTheStart);
  watcher.All();
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(hulls_->Put("kept", CubeCorners(0, i + 1)).ok());
  ASSERT_TRUE(hulls_->Put("gone", CubeCorners()).ok());
  ASSERT_TRUE(hulls_->Delete("gone").ok());
  ASSERT_TRUE(hulls_->Delete("reborn").ok());
  ASSERT_TRUE(hulls_->Create("reborn").ok());
  ASSERT_TRUE(hulls_->Put("reborn", CubeCorners()).ok());
  Replace("replaced");
  ASSERT_TRUE(hulls_->Put("replaced", CubeCorners(0, 99)).ok());
  ASSERT_TRUE(hulls_->Create("new").ok());
  ASSERT_TRUE(hulls_->Put("new", CubeCorners()).ok());
  ASSERT_TRUE(hulls_->Create("fleeting").ok());
  ASSERT_TRUE(hulls_->Delete("fleeting").ok());
  EXPECT_THAT(watcher.All(), ElementsAre("changed kept", "deleted gone", "replaced reborn",
                                         "replaced replaced", "created new"));
  EXPECT_THAT(watcher.All(), IsEmpty());
}

TEST_F(ChangeFeedTest, TellsPointsThatChangeNoVertexWithTheNextChange) {
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  Watcher watcher(registry(), Hull("h"), kFromTheStart);
  watcher.All();
  ASSERT_TRUE(hulls_->Put("h", {{0.5, 0.5, 0.5}}).ok());
  EXPECT_THAT(watcher.All(), IsEmpty());
  ASSERT_TRUE(hulls_->Put("h", {{2, 2, 2}}).ok());
  const WatchPiece piece = watcher.Next();
  ASSERT_EQ(piece.changes.size(), 1);
  EXPECT_EQ(piece.changes[0].record.counts.received, 10);
  EXPECT_TRUE(piece.changes[0].has_box);
  EXPECT_EQ(piece.changes[0].high, Vector(2, 2, 2));
}

TEST_F(ChangeFeedTest, TellsOnlyWhatIsWatched) {
  Watcher all(registry(), Prefix(""), kFromTheStart);
  Watcher under(registry(), Prefix("a/"), kFromTheStart);
  Watcher other(registry(), Prefix("ab"), kFromTheStart);
  Watcher one(registry(), Hull("a/b"), kFromTheStart);
  Watcher two(registry(), {"", {"a/b", "ab"}}, WatchStart{});
  for (Watcher* watcher : {&all, &under, &other, &one}) {
    EXPECT_THAT(watcher->All(), ElementsAre("synced"));
  }
  for (const char* id : {"a", "a/b", "a/bc", "ab", "b"}) ASSERT_TRUE(hulls_->Create(id).ok());
  EXPECT_THAT(all.All(),
              ElementsAre("created a", "created a/b", "created a/bc", "created ab", "created b"));
  EXPECT_THAT(under.All(), ElementsAre("created a/b", "created a/bc"));
  EXPECT_THAT(other.All(), ElementsAre("created ab"));
  EXPECT_THAT(one.All(), ElementsAre("created a/b"));
  EXPECT_THAT(two.All(), ElementsAre("created a/b", "created ab"));
  Watcher late(registry(), Hull("a/b"), kFromTheStart);
  EXPECT_THAT(late.All(), ElementsAre("present a/b", "synced"));
}

TEST_F(ChangeFeedTest, TellsOfBodiesWhereTheyAreAskedFor) {
  ASSERT_TRUE(hulls_->Create("b").ok());
  PutBody("a");
  PutBody("c");
  ASSERT_TRUE(hulls_->Create("d").ok());
  Watcher hulls(registry(), Prefix(""), kFromTheStart);
  Watcher both(registry(), {"", {}, true}, kFromTheStart);
  Watcher one(registry(), {"", {"c"}, true}, kFromTheStart);
  EXPECT_THAT(hulls.All(), ElementsAre("present b", "present d", "synced"));
  EXPECT_THAT(both.All(),
              ElementsAre("present body a", "present b", "present body c", "present d", "synced"));
  EXPECT_THAT(one.All(), ElementsAre("present body c", "synced"));
  const WatchStart resume = Resume();
  PutBody("c");
  DeleteBody("a");
  EXPECT_THAT(hulls.All(), IsEmpty());
  EXPECT_THAT(both.All(), ElementsAre("changed body c", "deleted body a"));
  EXPECT_THAT(one.All(), ElementsAre("changed body c"));
  // A body created and deleted between two events sends none. A hull in the place of a body is
  // another incarnation.
  PutBody("e");
  DeleteBody("e");
  DeleteBody("c");
  ASSERT_TRUE(hulls_->Create("c").ok());
  EXPECT_THAT(hulls.All(), ElementsAre("created c"));
  EXPECT_THAT(both.All(), ElementsAre("replaced c"));
  EXPECT_THAT(one.All(), ElementsAre("replaced c"));
  // And in the opposite direction.
  ASSERT_TRUE(hulls_->Delete("d").ok());
  PutBody("d");
  EXPECT_THAT(hulls.All(), ElementsAre("deleted d"));
  EXPECT_THAT(both.All(), ElementsAre("replaced body d"));
  Watcher resumed_hulls(registry(), Prefix(""), resume);
  Watcher resumed_both(registry(), {"", {}, true}, resume);
  EXPECT_THAT(resumed_hulls.All(), ElementsAre("deleted d", "present c", "synced"));
  EXPECT_THAT(resumed_both.All(), ElementsAre("deleted body a", "deleted body e", "present c",
                                              "present body d", "synced"));
}

TEST_F(ChangeFeedTest, WhatIsWatchedAlsoComesAndGoes) {
  for (const char* const id : {"a", "b", "c"}) ASSERT_TRUE(hulls_->Create(id).ok());
  WatchTarget target = Hull("a");
  target.varies = true;
  Watcher watch(registry(), target, {});
  // It does not share state with other watches of the same ID.
  Watcher other(registry(), Hull("a"), {});
  const std::vector<std::string> b = {"b"};
  watch.Also(b, {});
  for (const char* const id : {"a", "b", "c"}) ASSERT_TRUE(hulls_->Put(id, CubeCorners(0, 1)).ok());
  EXPECT_THAT(watch.All(), ElementsAre("changed a", "changed b"));
  EXPECT_THAT(other.All(), ElementsAre("changed a"));
  const std::vector<std::string> c = {"c"};
  watch.Also(c, b);
  for (const char* const id : {"a", "b", "c"}) ASSERT_TRUE(hulls_->Put(id, CubeCorners(0, 2)).ok());
  EXPECT_THAT(watch.All(), ElementsAre("changed a", "changed c"));
}

TEST_F(ChangeFeedTest, ResumesWithWhatChangedAndWhatWent) {
  for (const char* id : {"same", "grown", "gone", "reborn", "x"}) {
    ASSERT_TRUE(hulls_->Create(id).ok());
  }
  const WatchStart resume = Resume();
  ASSERT_TRUE(hulls_->Put("grown", CubeCorners()).ok());
  ASSERT_TRUE(hulls_->Delete("gone").ok());
  ASSERT_TRUE(hulls_->Delete("reborn").ok());
  ASSERT_TRUE(hulls_->Create("reborn").ok());
  ASSERT_TRUE(hulls_->Create("new").ok());
  Watcher watcher(registry(), Prefix(""), resume);
  EXPECT_THAT(watcher.All(), ElementsAre("deleted gone", "present grown", "present new",
                                         "present reborn", "synced"));
  Watcher now(registry(), Prefix(""), Resume());
  EXPECT_THAT(now.All(), ElementsAre("synced"));
  Watcher under(registry(), Prefix("g"), resume);
  EXPECT_THAT(under.All(), ElementsAre("deleted gone", "present grown", "synced"));
}

TEST_F(ChangeFeedTest, StartsAnewWhereItCannotKnow) {
  ASSERT_TRUE(hulls_->Create("a").ok());
  ASSERT_TRUE(hulls_->Create("b").ok());
  const WatchStart resume = Resume();
  ASSERT_TRUE(hulls_->Delete("b").ok());
  WatchStart elsewhere = resume;
  elsewhere.store_id = "another";
  Watcher other_store(registry(), Prefix(""), elsewhere);
  EXPECT_THAT(other_store.All(), ElementsAre("anew", "present a", "synced"));
  WatchStart future = resume;
  future.after_revision += 100;
  Watcher from_future(registry(), Prefix(""), future);
  EXPECT_THAT(from_future.All(), ElementsAre("anew", "present a", "synced"));
}

TEST_F(DurableChangeFeedTest, StartsAnewAfterARestartUnlessNothingHadChanged) {
  DurableRegistry* hulls = &Start();
  const auto now = [&] {
    return WatchStart{true, hulls->registry().Sizes().store_revision, hulls->store().id()};
  };
  ASSERT_TRUE(hulls->Put("a", CubeCorners()).ok());
  const WatchStart before = now();
  ASSERT_TRUE(hulls->Create("b").ok());
  const WatchStart last = now();
  hulls = &Start();
  Watcher late(hulls->registry(), Prefix(""), before);
  EXPECT_THAT(late.All(), ElementsAre("anew", "present a", "present b", "synced"));
  Watcher watcher(hulls->registry(), Prefix(""), last);
  EXPECT_THAT(watcher.All(), ElementsAre("synced"));
}

// More hulls change at the same time than fit a piece: new hulls are not distinguished until the
// watch has caught up.
TEST_F(ChangeFeedTest, TellsManyChangesInPieces) {
  Watcher watcher(registry(), Prefix(""), kFromTheStart);
  watcher.All();
  constexpr size_t kHulls = ChangeFeed::kMostPerPiece + 10;
  std::vector<std::string> expected;
  for (size_t i = 0; i < kHulls; ++i) {
    const std::string id = "h" + std::to_string(i);
    ASSERT_TRUE(hulls_->Create(id, false).ok());
    expected.push_back((i < ChangeFeed::kMostPerPiece ? "created " : "present ") + id);
  }
  EXPECT_EQ(watcher.All(), expected);
  Watcher late(registry(), Prefix(""), kFromTheStart);
  EXPECT_EQ(late.All().size(), kHulls + 1);
  ASSERT_TRUE(hulls_->Delete("h3").ok());
  EXPECT_THAT(watcher.All(), ElementsAre("deleted h3"));
  EXPECT_THAT(late.All(), ElementsAre("deleted h3"));
}

TEST_F(ChangeFeedTest, KeepsNothingOfWhatAllWereTold) {
  Watcher quick(registry(), Prefix(""), kFromTheStart);
  Watcher slow(registry(), Prefix(""), kFromTheStart);
  quick.All();
  slow.All();
  const uint64_t before = registry().Cache().bytes;
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(hulls_->Create("h" + std::to_string(i)).ok());
  quick.All();
  const uint64_t held = registry().Cache().bytes;
  EXPECT_GE(held, before + 1000 * 100);
  // The limit counts hulls, not changes.
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(hulls_->Put("h7", {Vector(i, 0, 0), Vector(0, i, 1)}).ok());
  }
  ASSERT_TRUE(hulls_->Delete("h7").ok());
  quick.All();
  const uint64_t later = registry().Cache().bytes;
  EXPECT_LT(later, held + 1000);
  slow.All();
  EXPECT_LT(registry().Cache().bytes, before + 1000);
}

TEST_F(ChangeFeedTest, FarBehindStartsAnewRatherThanKeepAllThatWent) {
  ASSERT_TRUE(hulls_->Create("stays").ok());
  Watcher slow(registry(), Prefix(""), kFromTheStart);
  slow.All();
  const WatchStart resume = Resume();
  for (size_t i = 0; i <= ChangeFeed::kMostDeletions; ++i) {
    const std::string id = "h" + std::to_string(i);
    ASSERT_TRUE(hulls_->Create(id).ok());
    ASSERT_TRUE(hulls_->Delete(id).ok());
  }
  EXPECT_THAT(slow.All(), ElementsAre("anew", "present stays", "synced"));
  Watcher resumed(registry(), Prefix(""), resume);
  EXPECT_THAT(resumed.All(), ElementsAre("anew", "present stays", "synced"));
}

TEST_F(ChangeFeedTest, MarksTellThatTheRevisionMovedOn) {
  Watcher watcher(registry(), Prefix("a/"), kFromTheStart);
  EXPECT_THAT(watcher.All(), ElementsAre("synced"));
  ASSERT_TRUE(hulls_->Create("b").ok());
  const uint64_t revision = registry().Sizes().store_revision;
  while (watcher.revision() < revision) watcher.Await();
}

TEST_F(ChangeFeedTest, EndsWhenTheServerDrains) {
  Watcher waits(registry(), Prefix(""), kFromTheStart);
  waits.All();
  registry().EndWatches();
  EXPECT_TRUE(absl::IsUnavailable(waits.AwaitEnd()));
  Watcher late(registry(), Prefix(""), kFromTheStart);
  EXPECT_TRUE(absl::IsUnavailable(late.AwaitEnd()));
}

}  // namespace change_feed_test
}  // namespace hulld::server
