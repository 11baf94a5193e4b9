#include "server/shards/shards_watch.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>

#include "tests/server/shards/shards_fixture.h"

namespace hulld::server {
namespace {

// Takes what a watch tells, and waits where it has nothing to tell.
class Told {
 public:
  Told(Shards& shards, const WatchTarget& target, const ShardsWatchStart& start) {
    auto watch = shards.OpenWatch(target, start, [this] {
      const std::lock_guard lock(mutex_);
      is_due_ = true;
      due_.notify_all();
    });
    EXPECT_TRUE(watch.ok()) << watch.status();
    watch_ = *std::move(watch);
  }
  ~Told() { watch_->Close(); }

  // The next piece; waits for it.
  ShardsWatchPiece Next() {
    while (true) {
      auto piece = watch_->TakeChanges();
      if (!piece.ok()) {
        ADD_FAILURE() << piece.status();
        return {};
      }
      if (!piece->waits) {
        if (!piece->revisions.empty()) revisions = piece->revisions;
        return *std::move(piece);
      }
      std::unique_lock lock(mutex_);
      // A defect ends as a failure and not as a hang.
      EXPECT_TRUE(due_.wait_for(lock, std::chrono::seconds(60), [this] { return is_due_; }));
      is_due_ = false;
    }
  }
  // Notes events until one says `synced`, or until there are so many.
  void ReadUntilSynced() {
    while (true) {
      const ShardsWatchPiece piece = Next();
      Note(piece);
      if (piece.synced || ::testing::Test::HasFailure()) return;
    }
  }
  void Read(size_t count) {
    for (events = 0; events < count && !::testing::Test::HasFailure();) Note(Next());
  }

  std::map<std::string, std::pair<size_t, uint64_t>> state;
  std::vector<std::string> gone;
  size_t events = 0;
  int anew = 0;
  ShardRevisions revisions;

 private:
  void Note(const ShardsWatchPiece& piece) {
    if (piece.anew) {
      ++anew;
      state.clear();
    }
    for (const HullChange& change : piece.changes) {
      ++events;
      const std::string& id = change.record.hull_id;
      if (change.kind == ChangeKind::kDeleted) {
        state.erase(id);
        gone.push_back(id);
      } else {
        state[id] = {piece.shard, change.record.revision};
      }
    }
  }

  std::mutex mutex_;
  std::condition_variable due_;
  bool is_due_ = false;
  std::shared_ptr<ShardsWatch> watch_;
};

using ShardsWatchTest = ShardsTest;

TEST_F(ShardsWatchTest, TellsOfAllShardsAndIsSyncedOnce) {
  std::map<std::string, std::pair<size_t, uint64_t>> expected;
  for (int i = 0; i < 30; ++i) {
    const std::string id = IdIn(static_cast<size_t>(i) % kShards, "w/", i);
    expected[id] = {i % kShards, Replace(id)};
  }
  Told told(*shards_, {"w/", {}}, {.tell_present = true});
  told.ReadUntilSynced();
  EXPECT_EQ(told.state, expected);
  EXPECT_EQ(told.revisions.size(), kShards);
  for (size_t shard = 0; shard < kShards; ++shard) {
    const std::string id = IdIn(shard, "w/", 100);
    expected[id] = {shard, Replace(id)};
    told.Read(1);
    EXPECT_EQ(told.state, expected);
  }
  const std::string gone = IdIn(1, "w/", 100);
  ASSERT_TRUE(Delete(gone).ok());
  told.Read(1);
  EXPECT_EQ(told.gone, std::vector<std::string>{gone});
  EXPECT_EQ(told.anew, 0);
}

TEST_F(ShardsWatchTest, ResumesAfterTheRevisionOfEachShard) {
  const std::string kept = IdIn(0, "w/");
  const std::string changed = IdIn(1, "w/");
  const std::string deleted = IdIn(2, "w/");
  for (const std::string& id : {kept, changed, deleted}) Replace(id);
  ShardsWatchStart start = {.tell_present = true};
  {
    Told told(*shards_, {"w/", {}}, start);
    told.ReadUntilSynced();
    for (const ShardRevision& at : told.revisions) {
      start.after.push_back({stores_[at.shard]->id(), at.revision});
    }
  }
  const uint64_t revision = Replace(changed);
  ASSERT_TRUE(Delete(deleted).ok());
  Told told(*shards_, {"w/", {}}, start);
  told.ReadUntilSynced();
  EXPECT_EQ(told.anew, 0);
  EXPECT_EQ(told.gone, std::vector<std::string>{deleted});
  EXPECT_EQ(told.state,
            (std::map<std::string, std::pair<size_t, uint64_t>>{{changed, {size_t{1}, revision}}}));
}

TEST_F(ShardsWatchTest, StartsAnewAsAWholeWhereOneShardCannotResume) {
  std::map<std::string, std::pair<size_t, uint64_t>> expected;
  for (size_t shard = 0; shard < kShards; ++shard) {
    const std::string id = IdIn(shard, "w/");
    expected[id] = {shard, Replace(id)};
  }
  const auto after = [this](size_t shard, uint64_t revision) {
    return ShardsWatchStart::After{stores_[shard]->id(), revision};
  };
  const ShardsWatchStart starts[] = {
      // A revision that is not there yet; a shard that is not named; another store.
      {true, {after(0, 1), after(1, 5), after(2, 1)}},    {true, {after(0, 1), after(2, 1)}},
      {true, {after(0, 1), after(1, 1), {"another", 1}}}, {true, {{"another", 1}}},
      {true, {after(0, 1), after(1, 0), after(2, 1)}},
  };
  for (const ShardsWatchStart& start : starts) {
    Told told(*shards_, {"w/", {}}, start);
    told.ReadUntilSynced();
    EXPECT_EQ(told.anew, 1);
    EXPECT_EQ(told.state, expected);
  }
}

TEST_F(ShardsWatchTest, OfOneHullIsThatOfItsShard) {
  const std::string id = IdIn(2);
  Told told(*shards_, {"", {id}}, {.tell_present = true});
  told.ReadUntilSynced();
  Replace(IdIn(0));
  const uint64_t revision = Replace(id);
  told.Read(1);
  EXPECT_EQ(told.state.at(id), (std::pair<size_t, uint64_t>(2, revision)));
  EXPECT_EQ(told.revisions, (ShardRevisions{{2, revision}}));
}

TEST_F(ShardsWatchTest, FollowsIdsThatComeAndGo) {
  const std::string ids[] = {IdIn(0), IdIn(1), IdIn(2)};
  WatchTarget target;
  target.varies = true;
  target.ids = {ids[0]};
  std::atomic<int> ready = 0;
  auto watch = shards_->OpenWatch(target, {}, [&] {
    ++ready;
    ready.notify_all();
  });
  ASSERT_TRUE(watch.ok());
  const std::vector<std::string> added = {ids[1], ids[2]};
  (*watch)->WatchAlso(added, {});
  const std::vector<std::string> dropped = {ids[1]};
  (*watch)->WatchAlso({}, dropped);
  for (const std::string& id : ids) Replace(id);
  std::set<std::string> told;
  while (true) {
    const auto piece = (*watch)->TakeChanges();
    ASSERT_TRUE(piece.ok());
    if (piece->waits) break;
    for (const HullChange& change : piece->changes) told.insert(change.record.hull_id);
  }
  EXPECT_EQ(told, (std::set<std::string>{ids[0], ids[2]}));
  // Nudged, it comes although nothing changed.
  const int before = ready;
  (*watch)->Nudge();
  ready.wait(before);
  const auto piece = (*watch)->TakeChanges();
  ASSERT_TRUE(piece.ok());
  EXPECT_FALSE(piece->waits);
  (*watch)->Close();
}

TEST_F(ShardsWatchTest, EndsWhenTheServerDrains) {
  Told told(*shards_, {"", {}}, {.tell_present = true});
  told.ReadUntilSynced();
  shards_->EndWatches();
  auto watch = shards_->OpenWatch({"", {}}, {.tell_present = true}, [] {});
  ASSERT_TRUE(watch.ok());
  EXPECT_TRUE(absl::IsUnavailable((*watch)->TakeChanges().status()));
  (*watch)->Close();
}

}  // namespace
}  // namespace hulld::server
