#include "server/registry/commit/committer.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/store/memory_store.h"

namespace hulld::server {
namespace committer_test {

using ::testing::ElementsAre;
using ::testing::SizeIs;

// Records the revisions of each batch. A test can block the next commit and choose its outcome.
class GatedStore : public MemoryStore {
 public:
  absl::Status Commit(std::span<Change* const> changes) override {
    std::vector<uint64_t> batch;
    for (const Change* change : changes) batch.push_back(change->revision);
    Gate* gate = nullptr;
    {
      const std::lock_guard lock(mutex_);
      gate = std::exchange(gate_, nullptr);
    }
    if (gate != nullptr) {
      gate->entered.set_value();
      const absl::Status status = gate->outcome.get_future().get();
      if (!status.ok()) return status;
    }
    const std::lock_guard lock(mutex_);
    batches_.push_back(std::move(batch));
    return absl::OkStatus();
  }
  absl::Status Recover() override {
    const std::lock_guard lock(mutex_);
    ++recoveries_;
    return recovery_;
  }

  struct Gate {
    std::promise<void> entered;
    std::promise<absl::Status> outcome;
  };
  // Blocks the next Commit.
  void Close(Gate& gate) {
    const std::lock_guard lock(mutex_);
    gate_ = &gate;
  }
  void SetRecovery(absl::Status status) {
    const std::lock_guard lock(mutex_);
    recovery_ = std::move(status);
  }
  int recoveries() {
    const std::lock_guard lock(mutex_);
    return recoveries_;
  }
  std::vector<std::vector<uint64_t>> batches() {
    const std::lock_guard lock(mutex_);
    return batches_;
  }

 private:
  std::mutex mutex_;
  Gate* gate_ = nullptr;
  absl::Status recovery_;
  int recoveries_ = 0;
  std::vector<std::vector<uint64_t>> batches_;
};

// A peer server changes some IDs at the next commit.
class SharedStore : public GatedStore, public PeerFeed {
 public:
  PeerFeed* peers() override { return this; }
  PeerChanges TakeChanges() override { return std::exchange(changes, {}); }
  void StartFetch() override {
    ++starts;
    if (on_start) on_start();
  }
  absl::Status Fetch() override {
    ++fetches;
    if (found_by_fetch.revision > 0) changes = std::exchange(found_by_fetch, {});
    return fetched;
  }

  std::vector<std::optional<std::vector<Vector>>> LoadGrowth(
      std::span<const HullGrowth> hulls) override {
    std::vector<std::optional<std::vector<Vector>>> growth;
    for (const HullGrowth& hull : hulls) {
      if (hull.after.record.hull_id == "unreadable") {
        growth.emplace_back();
      } else {
        growth.push_back(std::vector<Vector>{Vector(1, 2, 3)});
      }
    }
    return growth;
  }

  PeerChanges changes;
  PeerChanges found_by_fetch;
  std::atomic<int> fetches = 0;
  std::atomic<int> starts = 0;
  // Called while a request is sent; may be empty.
  std::function<void()> on_start;
  absl::Status fetched;
};

// Records what the committer reports.
class RecordedPeers : public Committer::Peers {
 public:
  explicit RecordedPeers(std::function<void(const PeerChanges&)> apply = {},
                         std::vector<HullGrowth> grown = {})
      : apply_(std::move(apply)), grown_(std::move(grown)) {}

  std::vector<HullGrowth> GrownHulls(const PeerChanges&) const override { return grown_; }
  void Apply(Locked& locked, const PeerChanges& changes) override {
    EXPECT_TRUE(order == nullptr || locked.Holds(*order));
    if (apply_) apply_(changes);
  }
  void NoteSynced(SteadyClock::time_point) override {}

  const FairMutex* order = nullptr;

 private:
  const std::function<void(const PeerChanges&)> apply_;
  const std::vector<HullGrowth> grown_;
};

class CommitterTest : public ::testing::Test {
 protected:
  using Outcome = std::pair<uint64_t, absl::StatusCode>;

  static Change ChangeOf(uint64_t revision) {
    Change change;
    change.revision = revision;
    return change;
  }
  // Records the outcome of the change.
  std::future<void> Submit(uint64_t revision) {
    Locked locked(order_);
    return SubmitLocked(locked, revision);
  }
  std::future<void> SubmitLocked(const Locked& locked, uint64_t revision) {
    const auto ended = std::make_shared<std::promise<void>>();
    committer_.Submit(
        locked, ChangeOf(revision),
        [this, revision, ended](Locked& later, const absl::Status& status, const Change&) {
          EXPECT_TRUE(later.Holds(order_));
          outcomes_.emplace_back(revision, status.code());
          later.Defer([ended] { ended->set_value(); });
        });
    return ended->get_future();
  }

  FairMutex order_;
  // Guarded by order_.
  std::vector<Outcome> outcomes_;
  GatedStore store_;
  Committer committer_{store_, order_};
};

TEST_F(CommitterTest, QueuedChangesFormOneBatchInOrderOfSubmission) {
  GatedStore::Gate gate;
  store_.Close(gate);
  Submit(1);
  gate.entered.get_future().wait();
  for (uint64_t revision = 2; revision <= 4; ++revision) Submit(revision);
  std::future<void> last = Submit(5);
  gate.outcome.set_value(absl::OkStatus());
  last.wait();
  EXPECT_THAT(store_.batches(), ElementsAre(ElementsAre(1), ElementsAre(2, 3, 4, 5)));
  const CommitStatistics statistics = committer_.Statistics();
  EXPECT_EQ(statistics.batches, 2);
  EXPECT_EQ(statistics.changes, 5);
  EXPECT_EQ(statistics.failed_batches, 0);
  const std::lock_guard lock(order_);
  ASSERT_THAT(outcomes_, SizeIs(5));
  for (uint64_t i = 0; i < 5; ++i) EXPECT_EQ(outcomes_[i], Outcome(i + 1, absl::StatusCode::kOk));
}

TEST_F(CommitterTest, ARefusedBatchAlsoRefusesQueuedChanges) {
  GatedStore::Gate gate;
  store_.Close(gate);
  Submit(1);
  gate.entered.get_future().wait();
  Submit(2);
  std::future<void> last = Submit(3);
  gate.outcome.set_value(absl::UnavailableError("no disk"));
  last.wait();
  EXPECT_THAT(store_.batches(), SizeIs(0));
  EXPECT_TRUE(committer_.Statistics().failing);
  EXPECT_EQ(committer_.Statistics().failed_batches, 1);
  EXPECT_EQ(store_.recoveries(), 0);
  const std::lock_guard lock(order_);
  ASSERT_THAT(outcomes_, SizeIs(3));
  for (uint64_t i = 0; i < 3; ++i) {
    EXPECT_EQ(outcomes_[i], Outcome(i + 1, absl::StatusCode::kUnavailable));
  }
}

// A waiting thread runs before the batch has ended, unless the batch is refused.
TEST_F(CommitterTest, ManyCompletionsYieldExceptBetweenRefusals) {
  for (const absl::Status& outcome : {absl::OkStatus(), absl::UnavailableError("no disk")}) {
    outcomes_.clear();
    GatedStore::Gate gate;
    store_.Close(gate);
    Submit(1);
    gate.entered.get_future().wait();
    size_t completed_by_then = 0;
    std::thread passer;
    {
      const Locked locked(order_);
      committer_.Submit(locked, ChangeOf(2), [&](Locked&, const absl::Status&, const Change&) {
        passer = std::thread([&] {
          const std::lock_guard lock(order_);
          completed_by_then = outcomes_.size();
        });
        while (!order_.is_wanted()) std::this_thread::yield();
      });
    }
    constexpr uint64_t kMany = 3 * Committer::kMaxPerHold;
    for (uint64_t revision = 3; revision < kMany; ++revision) Submit(revision);
    std::future<void> last = Submit(kMany);
    // A refusal ends all of them together; otherwise the first is a separate batch.
    gate.outcome.set_value(outcome);
    last.wait();
    passer.join();
    if (outcome.ok()) {
      EXPECT_LE(completed_by_then, Committer::kMaxPerHold);
    } else {
      EXPECT_EQ(completed_by_then, kMany - 1);
    }
  }
}

// Changes submitted after the rollback do not build on the refused ones.
TEST_F(CommitterTest, ChangesSubmittedByACompletionSurviveTheRefusalOfItsBatch) {
  GatedStore::Gate gate;
  store_.Close(gate);
  std::promise<std::future<void>> next;
  {
    const Locked locked(order_);
    committer_.Submit(locked, ChangeOf(1),
                      [&](Locked& later, const absl::Status& status, const Change&) {
                        EXPECT_TRUE(absl::IsUnavailable(status));
                        next.set_value(SubmitLocked(later, 2));
                      });
  }
  gate.outcome.set_value(absl::UnavailableError("no disk"));
  next.get_future().get().wait();
  EXPECT_THAT(store_.batches(), ElementsAre(ElementsAre(2)));
  EXPECT_EQ(store_.recoveries(), 1);
  EXPECT_FALSE(committer_.Statistics().failing);
}

TEST_F(CommitterTest, ARecoveredStoreNoLongerFails) {
  GatedStore::Gate gate;
  store_.Close(gate);
  gate.outcome.set_value(absl::UnavailableError("no disk"));
  Submit(1).wait();
  EXPECT_TRUE(committer_.Statistics().failing);
  std::promise<absl::Status> done;
  {
    const Locked locked(order_);
    committer_.AddBarrier([&](Locked&, const absl::Status& status) { done.set_value(status); });
  }
  EXPECT_TRUE(done.get_future().get().ok());
  EXPECT_FALSE(committer_.Statistics().failing);
  Submit(2).wait();
  EXPECT_EQ(store_.recoveries(), 1);
}

TEST_F(CommitterTest, TheStoreRecoversBeforeTheNextBatch) {
  GatedStore::Gate gate;
  store_.Close(gate);
  gate.outcome.set_value(absl::UnavailableError("no disk"));
  Submit(1).wait();
  store_.SetRecovery(absl::UnavailableError("still no disk"));
  Submit(2).wait();
  EXPECT_EQ(store_.recoveries(), 1);
  EXPECT_THAT(store_.batches(), SizeIs(0));
  store_.SetRecovery(absl::OkStatus());
  Submit(3).wait();
  Submit(4).wait();
  EXPECT_EQ(store_.recoveries(), 2);
  EXPECT_THAT(store_.batches(), ElementsAre(ElementsAre(3), ElementsAre(4)));
  EXPECT_EQ(committer_.Statistics().failed_batches, 2);
  EXPECT_FALSE(committer_.Statistics().failing);
}

TEST_F(CommitterTest, CommitsQueuedChangesBeforeItEnds) {
  GatedStore store;
  FairMutex order;
  int ended = 0;
  {
    Committer committer(store, order);
    const Locked locked(order);
    for (uint64_t revision = 1; revision <= 3; ++revision) {
      committer.Submit(locked, ChangeOf(revision),
                       [&](Locked&, const absl::Status&, const Change&) { ++ended; });
    }
  }
  EXPECT_EQ(ended, 3);
}

// Superseded changes of the batch and of the queue are refused, latest first, before the
// callback for peer changes runs; the kept ones follow.
TEST(Committer, ConflictingChangesAreRefusedAndTheRestIsKept) {
  SharedStore store;
  FairMutex order;
  std::vector<std::string> events;
  std::promise<void> ended;
  RecordedPeers peers([&](const PeerChanges& changes) {
    events.push_back(absl::StrCat("peers at ", changes.revision));
  });
  peers.order = &order;
  Committer committer(store, order);
  committer.SetPeers(peers);
  const auto submit = [&](const std::string& id, int number) {
    const Locked locked(order);
    Change change;
    change.hull.record.hull_id = id;
    committer.Submit(locked, std::move(change),
                     [&, id, number](Locked&, const absl::Status& status, const Change&) {
                       const char* how = status.ok()                       ? "kept"
                                         : Committer::IsSuperseded(status) ? "superseded"
                                                                           : "refused";
                       events.push_back(absl::StrCat(id, number, " ", how));
                       if (id == "last") ended.set_value();
                     });
  };
  GatedStore::Gate first;
  store.Close(first);
  submit("a", 1);
  first.entered.get_future().wait();
  submit("a", 2);
  submit("b", 1);
  submit("a", 3);
  store.changes.revision = 7;
  store.changes.by_id["a"];
  first.outcome.set_value(absl::OkStatus());
  submit("last", 1);
  ended.get_future().wait();
  const std::lock_guard lock(order);
  EXPECT_THAT(events, ElementsAre("a3 superseded", "a2 superseded", "a1 superseded", "peers at 7",
                                  "b1 kept", "last1 kept"));
}

// A change that may have been committed returns as a peer change: it was not superseded.
TEST(Committer, ABatchOfUnknownOutcomeIsRefusedBeforePeerChangesAreReported) {
  SharedStore store;
  FairMutex order;
  std::vector<std::string> events;
  std::promise<void> followed;
  RecordedPeers peers([&](const PeerChanges&) { events.emplace_back("peers"); });
  Committer committer(store, order);
  committer.SetPeers(peers);
  GatedStore::Gate gate;
  store.Close(gate);
  {
    const Locked locked(order);
    Change change;
    change.deleted = true;
    change.hull.record.hull_id = "h";
    committer.Submit(locked, std::move(change),
                     [&](Locked&, const absl::Status& status, const Change&) {
                       events.push_back(Committer::IsSuperseded(status) ? "superseded" : "refused");
                     });
    committer.AddBarrier([&](Locked&, const absl::Status&) { followed.set_value(); });
  }
  gate.entered.get_future().wait();
  store.found_by_fetch.revision = 7;
  store.found_by_fetch.by_id["h"];
  gate.outcome.set_value(absl::UnavailableError("lost the database connection during COMMIT"));
  followed.get_future().wait();
  const std::lock_guard lock(order);
  EXPECT_THAT(events, ElementsAre("refused", "peers"));
}

TEST(Committer, FollowersReceiveChangesFoundLater) {
  SharedStore store;
  FairMutex order;
  RecordedPeers peers;
  Committer committer(store, order);
  committer.SetPeers(peers);
  const auto follow = [&] {
    std::promise<absl::Status> done;
    {
      const Locked locked(order);
      committer.AddBarrier([&](Locked&, const absl::Status& status) { done.set_value(status); });
    }
    return done.get_future().get();
  };
  EXPECT_TRUE(follow().ok());
  EXPECT_EQ(store.fetches, 1);
  store.fetched = absl::UnavailableError("no database");
  EXPECT_TRUE(absl::IsUnavailable(follow()));
}

// A caller or a change that arrives while a request is in flight waits for the next one.
TEST(Committer, AReadBarrierIsSentByItsCallerAndNotSharedWithLaterOnes) {
  SharedStore store;
  FairMutex order;
  // Guarded by order.
  std::vector<std::string> events;
  std::promise<void> done_later;
  std::promise<void> committed;
  RecordedPeers peers;
  Committer committer(store, order);
  committer.SetPeers(peers);
  const auto note = [&](const std::string& event) {
    return [&, event](Locked&, const absl::Status& status) {
      EXPECT_TRUE(status.ok());
      events.push_back(absl::StrCat(event, " ", store.fetches.load()));
    };
  };
  const std::thread::id caller = std::this_thread::get_id();
  bool has_come = false;
  store.on_start = [&] {
    if (std::exchange(has_come, true)) return;
    EXPECT_EQ(std::this_thread::get_id(), caller);
    Locked locked(order);
    committer.StartBarrier(locked, [&, note](Locked& later, const absl::Status& status) {
      note("later")(later, status);
      done_later.set_value();
    });
    committer.Submit(locked, Change(), [&](Locked& later, const absl::Status& status, Change&) {
      note("committed")(later, status);
      committed.set_value();
    });
  };
  // The committer's thread may not be waiting yet: then it sends the request itself.
  constexpr int kMaxTries = 100'000;
  for (int i = 0; i < kMaxTries && store.starts == 0; ++i) {
    std::promise<void> done;
    {
      Locked locked(order);
      committer.StartBarrier(locked, [&](Locked& later, const absl::Status& status) {
        if (store.starts > 0) note("first")(later, status);
        done.set_value();
      });
    }
    done.get_future().wait();
  }
  ASSERT_GT(store.starts, 0);
  done_later.get_future().wait();
  committed.get_future().wait();
  const std::lock_guard lock(order);
  ASSERT_THAT(events, SizeIs(3));
  EXPECT_THAT(events[0], ::testing::StartsWith("first"));
  // A commit also sends a request.
  EXPECT_THAT(events[1], ::testing::StartsWith("committed"));
  EXPECT_THAT(events[2], ::testing::StartsWith("later"));
}

// The peer-change callback receives the growth of hulls where it was requested and available.
TEST(Committer, GrowthIsFetchedAfterPeerChangesAreKnown) {
  SharedStore store;
  FairMutex order;
  std::vector<std::string> events;
  std::vector<HullGrowth> grown(2);
  grown[0].after.record.hull_id = "wanted";
  grown[1].after.record.hull_id = "unreadable";
  RecordedPeers peers(
      [&](const PeerChanges& changes) {
        for (const auto& [id, change] : changes.by_id) {
          events.push_back(absl::StrCat(id, change.growth.has_value() ? " grew" : " changed"));
        }
      },
      grown);
  peers.order = &order;
  Committer committer(store, order);
  committer.SetPeers(peers);
  const auto follow = [&] {
    store.found_by_fetch.revision = 7;
    for (const char* id : {"wanted", "unreadable", "other"}) store.found_by_fetch.by_id[id];
    std::promise<void> done;
    {
      const Locked locked(order);
      committer.AddBarrier([&](Locked&, const absl::Status&) { done.set_value(); });
    }
    done.get_future().get();
    const std::lock_guard lock(order);
    return std::exchange(events, {});
  };
  EXPECT_THAT(follow(), ElementsAre("other changed", "unreadable changed", "wanted grew"));
  // A failed request is not immediately retried.
  store.fetched = absl::UnavailableError("no database");
  EXPECT_THAT(follow(), ElementsAre("other changed", "unreadable changed", "wanted changed"));
}

TEST(CommitterDeathTest, ASubmissionWithoutTheMutexOfTheOrderEndsTheProcess) {
  GatedStore store;
  FairMutex order;
  FairMutex another;
  EXPECT_DEATH(
      {
        Committer committer(store, order);
        const Locked locked(another);
        committer.Submit(locked, Change(), [](Locked&, const absl::Status&, const Change&) {});
      },
      "check failed");
}

}  // namespace committer_test
}  // namespace hulld::server
