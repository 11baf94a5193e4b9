// Tests of the events that a registry sends to its watches.
#include "server/registry/watch/change_feed.h"

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
  Watcher(Registry& registry, const WatchTarget& target, const WatchPosition& position = {})
      : feed_(registry.feed()) {
    watch_ = *feed_.Open(target, position, [this] {
      const std::lock_guard lock(mutex_);
      waits_ = false;
      changed_.notify_all();
    });
  }
  ~Watcher() {
    feed_.Nudge(watch_);
    AwaitTurn();
    feed_.Close(watch_);
  }

  // Waits for the next non-empty batch and returns it.
  WatchBatch Next() {
    while (true) {
      AwaitTurn();
      WatchBatch batch = Take();
      if (!batch.changes.empty() || batch.synced || batch.restarted) return batch;
    }
  }
  // Returns all pending events, batch by batch.
  std::vector<std::string> All() {
    std::vector<std::string> texts;
    bool waits = false;
    {
      const std::lock_guard lock(mutex_);
      waits = waits_;
    }
    // Earlier changes made it due; on_ready may still be in flight.
    if (waits) feed_.Nudge(watch_);
    AwaitTurn();
    while (true) {
      const WatchBatch batch = Take();
      if (batch.waits) return texts;
      if (batch.restarted) texts.push_back("restarted");
      for (const HullChange& change : batch.changes) texts.push_back(Text(change));
      if (batch.synced) texts.push_back("synced");
    }
  }
  // Waits until an event is pending or the watch is called for another reason.
  void Await() {
    AwaitTurn();
    Take();
  }
  absl::Status AwaitEnd() {
    AwaitTurn();
    return feed_.Next(watch_).status();
  }
  uint64_t revision() const { return revision_; }
  void ChangeIds(std::span<const std::string> added, std::span<const std::string> removed) {
    feed_.ChangeIds(*watch_, added, removed);
  }

 private:
  void AwaitTurn() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !waits_; });
  }
  WatchBatch Take() {
    {
      // on_ready may run before Next returns.
      const std::lock_guard lock(mutex_);
      waits_ = true;
    }
    WatchBatch batch = *feed_.Next(watch_);
    if (!batch.waits) {
      const std::lock_guard lock(mutex_);
      waits_ = false;
      revision_ = batch.revision;
    }
    return batch;
  }

  ChangeFeed& feed_;
  std::shared_ptr<Watch> watch_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool waits_ = false;
  uint64_t revision_ = 0;
};

WatchTarget Prefix(const std::string& prefix) { return {prefix, {}}; }
WatchTarget Hull(const std::string& id) { return {"", {id}}; }

using DurableChangeFeedTest = StoreTest;

class ChangeFeedTest : public ::testing::Test {
 protected:
  Registry& registry() { return hulls_->registry(); }
  // Resumes a watch that is at the store's current revision.
  WatchPosition Resume() { return {registry().Sizes().store_revision, registry().store().id()}; }
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
    registry().changes().PutBody({{id, 0, 0}, {"piece"}, {{0, Pose()}}}, std::nullopt,
                                 [&done](const auto& put) { done.set_value(put.status()); });
    ASSERT_TRUE(done.get_future().get().ok());
  }
  void DeleteBody(const std::string& id) {
    std::promise<absl::Status> done;
    registry().changes().Delete("body", id, std::nullopt,
                                [&done](const auto& deleted) { done.set_value(deleted.status()); });
    ASSERT_TRUE(done.get_future().get().ok());
  }

  std::unique_ptr<MemoryRegistry> hulls_ =
      std::make_unique<MemoryRegistry>(std::make_unique<MemoryStore>());
};

TEST_F(ChangeFeedTest, ReportsExistingHullsThenChanges) {
  ASSERT_TRUE(hulls_->Create("b").ok());
  ASSERT_TRUE(hulls_->Put("a", CubeCorners()).ok());
  Watcher watcher(registry(), Prefix(""));
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

TEST_F(ChangeFeedTest, AnEmptyStoreIsSyncedImmediately) {
  Watcher watcher(registry(), Prefix(""));
  EXPECT_THAT(watcher.All(), ElementsAre("synced"));
}

TEST_F(ChangeFeedTest, EachChangeWakesAWaitingWatch) {
  Watcher watcher(registry(), Prefix(""));
  EXPECT_THAT(watcher.All(), ElementsAre("synced"));
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(hulls_->Create("h" + std::to_string(i)).ok());
    const WatchBatch batch = watcher.Next();
    ASSERT_EQ(batch.changes.size(), 1);
    EXPECT_EQ(Text(batch.changes[0]), "created h" + std::to_string(i));
  }
}

// All changes of a hull since its last event coalesce into one event.
TEST_F(ChangeFeedTest, CoalescesTheChangesOfAHull) {
  for (const char* id : {"kept", "gone", "reborn", "replaced"}) {
    ASSERT_TRUE(hulls_->Create(id).ok());
  }
  Watcher watcher(registry(), Prefix(""));
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

TEST_F(ChangeFeedTest, ReportsInteriorPointsWithTheNextChange) {
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  Watcher watcher(registry(), Hull("h"));
  watcher.All();
  ASSERT_TRUE(hulls_->Put("h", {{0.5, 0.5, 0.5}}).ok());
  EXPECT_THAT(watcher.All(), IsEmpty());
  ASSERT_TRUE(hulls_->Put("h", {{2, 2, 2}}).ok());
  const WatchBatch batch = watcher.Next();
  ASSERT_EQ(batch.changes.size(), 1);
  EXPECT_EQ(batch.changes[0].record.counts.received, 10);
  EXPECT_EQ(batch.changes[0].box.high, Vector(2, 2, 2));
}

TEST_F(ChangeFeedTest, ReportsOnlyItsTarget) {
  Watcher all(registry(), Prefix(""));
  Watcher under(registry(), Prefix("a/"));
  Watcher other(registry(), Prefix("ab"));
  Watcher one(registry(), Hull("a/b"));
  Watcher two(registry(), {"", {"a/b", "ab"}, false, false});
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
  Watcher late(registry(), Hull("a/b"));
  EXPECT_THAT(late.All(), ElementsAre("present a/b", "synced"));
}

TEST_F(ChangeFeedTest, ReportsBodiesIfRequested) {
  ASSERT_TRUE(hulls_->Create("b").ok());
  PutBody("a");
  PutBody("c");
  ASSERT_TRUE(hulls_->Create("d").ok());
  Watcher hulls(registry(), Prefix(""));
  Watcher both(registry(), {"", {}, true});
  Watcher one(registry(), {"", {"c"}, true});
  EXPECT_THAT(hulls.All(), ElementsAre("present b", "present d", "synced"));
  EXPECT_THAT(both.All(),
              ElementsAre("present body a", "present b", "present body c", "present d", "synced"));
  EXPECT_THAT(one.All(), ElementsAre("present body c", "synced"));
  const WatchPosition resume = Resume();
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
  // The same in the opposite direction.
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

TEST_F(ChangeFeedTest, IdsAreAddedAndRemoved) {
  for (const char* const id : {"a", "b", "c"}) ASSERT_TRUE(hulls_->Create(id).ok());
  WatchTarget target = Hull("a");
  target.lists_existing = false;
  Watcher watch(registry(), target);
  // It does not share state with other watches of the same ID.
  Watcher other(registry(), {"", {"a"}, false, false});
  const std::vector<std::string> b = {"b"};
  watch.ChangeIds(b, {});
  for (const char* const id : {"a", "b", "c"}) ASSERT_TRUE(hulls_->Put(id, CubeCorners(0, 1)).ok());
  EXPECT_THAT(watch.All(), ElementsAre("changed a", "changed b"));
  EXPECT_THAT(other.All(), ElementsAre("changed a"));
  const std::vector<std::string> c = {"c"};
  watch.ChangeIds(c, b);
  for (const char* const id : {"a", "b", "c"}) ASSERT_TRUE(hulls_->Put(id, CubeCorners(0, 2)).ok());
  EXPECT_THAT(watch.All(), ElementsAre("changed a", "changed c"));
}

// The reader may have read the hull between its creation and its deletion.
TEST_F(ChangeFeedTest, ReportsEveryDeletionToAReaderThatReadsExistingHullsItself) {
  Watcher lists(registry(), Hull("a"));
  lists.All();
  Watcher reads(registry(), {"", {"a"}, false, false});
  ASSERT_TRUE(hulls_->Create("a").ok());
  ASSERT_TRUE(hulls_->Delete("a").ok());
  EXPECT_THAT(lists.All(), IsEmpty());
  EXPECT_THAT(reads.All(), ElementsAre("deleted a"));
}

TEST_F(ChangeFeedTest, ResumesWithDeletionsAndChanges) {
  for (const char* id : {"same", "grown", "gone", "reborn", "x"}) {
    ASSERT_TRUE(hulls_->Create(id).ok());
  }
  const WatchPosition resume = Resume();
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

TEST_F(ChangeFeedTest, ResumesWithOneDeletionOfEachId) {
  for (const char* id : {"a", "b"}) ASSERT_TRUE(hulls_->Create(id).ok());
  const WatchPosition resume = Resume();
  ASSERT_TRUE(hulls_->Delete("a").ok());
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(hulls_->Create("a").ok());
    ASSERT_TRUE(hulls_->Delete("a").ok());
  }
  // A hull, then bodies.
  ASSERT_TRUE(hulls_->Delete("b").ok());
  const uint64_t hull_deletion = registry().Sizes().store_revision;
  for (int i = 0; i < 2; ++i) {
    PutBody("b");
    DeleteBody("b");
  }
  Watcher hulls(registry(), Prefix(""), resume);
  const WatchBatch batch = hulls.Next();
  ASSERT_EQ(batch.changes.size(), 2);
  EXPECT_EQ(batch.changes[0].record.hull_id, "a");
  EXPECT_EQ(batch.changes[1].record.hull_id, "b");
  EXPECT_EQ(batch.changes[1].record.revision, hull_deletion);
  EXPECT_THAT(hulls.All(), ElementsAre("synced"));
  Watcher both(registry(), {"", {}, true}, resume);
  EXPECT_THAT(both.All(), ElementsAre("deleted a", "deleted body b", "synced"));
  Watcher one(registry(), Hull("a"), resume);
  EXPECT_THAT(one.All(), ElementsAre("deleted a", "synced"));
}

TEST_F(ChangeFeedTest, RestartsWithAnUnknownPosition) {
  ASSERT_TRUE(hulls_->Create("a").ok());
  ASSERT_TRUE(hulls_->Create("b").ok());
  const WatchPosition resume = Resume();
  ASSERT_TRUE(hulls_->Delete("b").ok());
  WatchPosition elsewhere = resume;
  elsewhere.store_id = "another";
  Watcher other_store(registry(), Prefix(""), elsewhere);
  EXPECT_THAT(other_store.All(), ElementsAre("restarted", "present a", "synced"));
  WatchPosition future = resume;
  future.after_revision += 100;
  Watcher from_future(registry(), Prefix(""), future);
  EXPECT_THAT(from_future.All(), ElementsAre("restarted", "present a", "synced"));
}

TEST_F(DurableChangeFeedTest, RestartsAfterAServerRestartUnlessNothingChanged) {
  DurableRegistry* hulls = &Start();
  const auto now = [&] {
    return WatchPosition{hulls->registry().Sizes().store_revision, hulls->store().id()};
  };
  ASSERT_TRUE(hulls->Put("a", CubeCorners()).ok());
  const WatchPosition before = now();
  ASSERT_TRUE(hulls->Create("b").ok());
  const WatchPosition last = now();
  hulls = &Start();
  Watcher late(hulls->registry(), Prefix(""), before);
  EXPECT_THAT(late.All(), ElementsAre("restarted", "present a", "present b", "synced"));
  Watcher watcher(hulls->registry(), Prefix(""), last);
  EXPECT_THAT(watcher.All(), ElementsAre("synced"));
}

// More hulls change at the same time than fit a batch: new hulls are not distinguished until the
// watch has caught up.
TEST_F(ChangeFeedTest, ReportsManyChangesInBatches) {
  Watcher watcher(registry(), Prefix(""));
  watcher.All();
  constexpr size_t kHulls = ChangeFeed::kMaxPerBatch + 10;
  std::vector<std::string> expected;
  for (size_t i = 0; i < kHulls; ++i) {
    const std::string id = "h" + std::to_string(i);
    ASSERT_TRUE(hulls_->Create(id, false).ok());
    expected.push_back((i < ChangeFeed::kMaxPerBatch ? "created " : "present ") + id);
  }
  EXPECT_EQ(watcher.All(), expected);
  Watcher late(registry(), Prefix(""));
  EXPECT_EQ(late.All().size(), kHulls + 1);
  ASSERT_TRUE(hulls_->Delete("h3").ok());
  EXPECT_THAT(watcher.All(), ElementsAre("deleted h3"));
  EXPECT_THAT(late.All(), ElementsAre("deleted h3"));
}

TEST_F(ChangeFeedTest, DropsChangesThatAllWatchesReported) {
  Watcher quick(registry(), Prefix(""));
  Watcher slow(registry(), Prefix(""));
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

TEST_F(ChangeFeedTest, RestartsWhenFarBehindInsteadOfKeepingAllDeletions) {
  ASSERT_TRUE(hulls_->Create("stays").ok());
  Watcher slow(registry(), Prefix(""));
  slow.All();
  const WatchPosition resume = Resume();
  for (size_t i = 0; i <= DeletionLog::kCapacity; ++i) {
    const std::string id = "h" + std::to_string(i);
    ASSERT_TRUE(hulls_->Create(id).ok());
    ASSERT_TRUE(hulls_->Delete(id).ok());
  }
  EXPECT_THAT(slow.All(), ElementsAre("restarted", "present stays", "synced"));
  Watcher resumed(registry(), Prefix(""), resume);
  EXPECT_THAT(resumed.All(), ElementsAre("restarted", "present stays", "synced"));
}

TEST_F(ChangeFeedTest, MarksReportTheCurrentRevision) {
  Watcher watcher(registry(), Prefix("a/"));
  EXPECT_THAT(watcher.All(), ElementsAre("synced"));
  ASSERT_TRUE(hulls_->Create("b").ok());
  const uint64_t revision = registry().Sizes().store_revision;
  while (watcher.revision() < revision) watcher.Await();
}

TEST_F(ChangeFeedTest, EndsWhenTheServerDrains) {
  Watcher waits(registry(), Prefix(""));
  waits.All();
  registry().feed().EndAll();
  EXPECT_TRUE(absl::IsUnavailable(waits.AwaitEnd()));
  Watcher late(registry(), Prefix(""));
  EXPECT_TRUE(absl::IsUnavailable(late.AwaitEnd()));
}

}  // namespace change_feed_test
}  // namespace hulld::server
