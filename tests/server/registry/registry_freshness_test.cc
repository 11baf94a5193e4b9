// Reads over a store with peer servers: which reads send a request to the store, and the revision
// that answers them. The store answers only when a test permits it, so nothing depends on a clock:
// a read states its start time.
#include <absl/status/status.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/contract/errors.h"
#include "server/store/memory_store.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace registry_freshness_test {

using std::chrono::hours;
using std::chrono::minutes;
using std::chrono::nanoseconds;

// A peer server commits on the test's request. Requests to the store may be held.
class SharedStore : public MemoryStore, public PeerFeed {
 public:
  PeerFeed* peers() override { return this; }
  // Keeps hulls without points only.
  bool keeps_hulls() const override { return true; }
  absl::StatusOr<std::vector<Vector>> LoadVertices(const StoredHull&) override {
    return std::vector<Vector>();
  }
  uint64_t revision() const override { return revision_; }

  // Tests change different hulls.
  absl::Status Commit(std::span<Change* const> changes) override {
    const std::lock_guard lock(mutex_);
    found_ = std::exchange(committed_, {});
    revision_ = NumberChanges(changes, std::max(revision_, found_.revision));
    return absl::OkStatus();
  }
  absl::Status Fetch() override {
    std::unique_lock lock(mutex_);
    ++query_count_;
    changed_.notify_all();
    // The answer may lack changes committed while the request is in flight.
    PeerChanges found = std::exchange(committed_, {});
    changed_.wait(lock, [this] { return !is_held_; });
    if (failure_.ok()) {
      found_ = std::move(found);
      revision_ = std::max(revision_, found_.revision);
    } else {
      committed_ = std::move(found);
    }
    return failure_;
  }
  PeerChanges TakeChanges() override {
    const std::lock_guard lock(mutex_);
    return std::exchange(found_, {});
  }

  // A peer server creates an empty hull.
  void CreateElsewhere(const std::string& id, uint64_t revision) {
    const std::lock_guard lock(mutex_);
    StoredHull hull;
    hull.record.hull_id = id;
    hull.record.create_revision = hull.record.revision = revision;
    hull.record.dimension = -1;
    PeerChange& change = committed_.by_id[id];
    change.revision = committed_.revision = revision;
    change.hull = hull;
  }
  // Block and unblock later requests.
  void Hold() { SetHeld(true); }
  void Release() { SetHeld(false); }
  void Fail(absl::Status failure) {
    const std::lock_guard lock(mutex_);
    failure_ = std::move(failure);
  }
  int query_count() {
    const std::lock_guard lock(mutex_);
    return query_count_;
  }
  void AwaitQuery(int number) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return query_count_ >= number; });
  }

 private:
  void SetHeld(bool is_held) {
    const std::lock_guard lock(mutex_);
    is_held_ = is_held;
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  int query_count_ = 0;
  bool is_held_ = false;
  absl::Status failure_;
  PeerChanges committed_;
  PeerChanges found_;
  uint64_t revision_ = 0;
};

class RegistryFreshnessTest : public ::testing::Test {
 protected:
  RegistryFreshnessTest() { EXPECT_TRUE(hulls_.loaded().ok()); }
  ~RegistryFreshnessTest() override { store_.Release(); }

  // Freshness of a read that begins this long after now.
  static Freshness AtMost(nanoseconds bound, nanoseconds later = nanoseconds(0)) {
    Freshness freshness;
    freshness.max_staleness = bound;
    freshness.began = SteadyClock::now() + later;
    return freshness;
  }
  static Freshness AtLeast(uint64_t revision) {
    Freshness freshness;
    freshness.at_least_revision = revision;
    freshness.max_staleness = std::nullopt;
    return freshness;
  }
  absl::StatusOr<AsOf> Read(const std::string& id, const Freshness& freshness) {
    const auto resolved = registry_.Resolve(id, {}, freshness);
    if (!resolved.ok()) return resolved.status();
    return resolved->first;
  }
  std::future<absl::StatusOr<AsOf>> ReadElsewhere(const std::string& id,
                                                  const Freshness& freshness) {
    return std::async(std::launch::async, [=, this] { return Read(id, freshness); });
  }
  // Returns true if gRPC's thread may answer.
  bool IsAnsweredAtOnce(const std::string& id, const Freshness& freshness) {
    return registry_.Resolve(std::span(&id, 1), {}, {.freshness = freshness, .may_wait = false})
        .ok();
  }

  TestRegistry<SharedStore> hulls_{std::make_unique<SharedStore>()};
  SharedStore& store_ = hulls_.store();
  Registry& registry_ = hulls_.registry();
};

TEST_F(RegistryFreshnessTest, ALinearizableReadSeesPeerChanges) {
  store_.CreateElsewhere("h", 1);
  EXPECT_FALSE(IsAnsweredAtOnce("h", {}));
  const int before = store_.query_count();
  const auto read = Read("h", {});
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->revision, 1);
  EXPECT_EQ(read->staleness, nanoseconds(0));
  EXPECT_EQ(store_.query_count(), before + 1);
}

TEST_F(RegistryFreshnessTest, AReadWithinItsBoundIsAnsweredAtOnceWithItsStaleness) {
  ASSERT_TRUE(hulls_.Create("h").ok());
  store_.CreateElsewhere("i", 2);
  const int before = store_.query_count();
  store_.Hold();
  const auto read = Read("h", AtMost(hours(1)));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->revision, 1);
  EXPECT_GE(read->staleness, nanoseconds(0));
  EXPECT_LE(read->staleness, hours(1));
  EXPECT_TRUE(IsAnsweredAtOnce("h", AtMost(hours(1))));
  // As a read twenty minutes later receives it.
  const auto later = Read("h", AtMost(hours(1), minutes(20)));
  ASSERT_TRUE(later.ok());
  EXPECT_GE(later->staleness, minutes(20));
  EXPECT_EQ(store_.query_count(), before);
}

TEST_F(RegistryFreshnessTest, AReadBeyondItsBoundQueriesTheStore) {
  store_.CreateElsewhere("h", 1);
  const Freshness freshness = AtMost(hours(1), hours(2));
  EXPECT_FALSE(IsAnsweredAtOnce("h", freshness));
  EXPECT_FALSE(registry_.peers().TryFresh(freshness).has_value());
  const int before = store_.query_count();
  const auto read = Read("h", freshness);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->revision, 1);
  EXPECT_EQ(read->staleness, nanoseconds(0));
  EXPECT_EQ(store_.query_count(), before + 1);
}

TEST_F(RegistryFreshnessTest, AHalfExpiredBoundQueriesTheStoreOnceForLaterReads) {
  ASSERT_TRUE(hulls_.Create("h").ok());
  const int before = store_.query_count();
  store_.Hold();
  for (int i = 0; i < 3; ++i) {
    const auto read = Read("h", AtMost(hours(1), minutes(40)));
    ASSERT_TRUE(read.ok());
    EXPECT_GE(read->staleness, minutes(40));
  }
  store_.AwaitQuery(before + 1);
  store_.Release();
  // A read that joined the request of earlier reads: no other request was sent in between.
  ASSERT_TRUE(registry_.peers().AwaitPeers({}).ok());
  EXPECT_EQ(store_.query_count(), before + 2);
}

TEST_F(RegistryFreshnessTest, ABoundIsMeasuredFromTheQueryAndNotFromItsAnswer) {
  store_.Hold();
  const int before = store_.query_count();
  auto first = ReadElsewhere("h", {});
  store_.AwaitQuery(before + 1);
  // Acknowledged before the second read begins, after the request was sent.
  store_.CreateElsewhere("h", 1);
  Freshness after_the_query;
  after_the_query.began = SteadyClock::now();
  store_.Release();
  EXPECT_TRUE(absl::IsNotFound(first.get().status()));
  const auto second = Read("h", after_the_query);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(second->revision, 1);
  EXPECT_EQ(store_.query_count(), before + 2);
}

TEST_F(RegistryFreshnessTest, ALinearizableReadThatBeganBeforeAQueryNeedsNoOther) {
  Freshness began_before;
  began_before.began = SteadyClock::now();
  ASSERT_TRUE(registry_.peers().AwaitPeers({}).ok());
  const int before = store_.query_count();
  EXPECT_TRUE(IsAnsweredAtOnce("h", began_before));
  EXPECT_TRUE(absl::IsNotFound(Read("h", began_before).status()));
  EXPECT_EQ(store_.query_count(), before);
}

TEST_F(RegistryFreshnessTest, AnAppliedRevisionIsAnsweredHoweverOld) {
  ASSERT_TRUE(hulls_.Create("h").ok());
  const int before = store_.query_count();
  store_.Hold();
  Freshness freshness = AtLeast(1);
  freshness.began = SteadyClock::now() + hours(1000);
  EXPECT_TRUE(IsAnsweredAtOnce("h", freshness));
  const auto read = Read("h", freshness);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->revision, 1);
  EXPECT_GE(read->staleness, hours(1000));
  EXPECT_EQ(store_.query_count(), before);
}

TEST_F(RegistryFreshnessTest, AnUnappliedRevisionIsAwaited) {
  store_.CreateElsewhere("h", 7);
  ASSERT_FALSE(IsAnsweredAtOnce("h", AtLeast(7)));
  store_.Hold();
  const int before = store_.query_count();
  auto read = ReadElsewhere("h", AtLeast(7));
  store_.AwaitQuery(before + 1);
  store_.Release();
  const absl::StatusOr<AsOf> answer = read.get();
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->revision, 7);
}

TEST_F(RegistryFreshnessTest, AnUnassignedRevisionIsRefused) {
  store_.CreateElsewhere("h", 7);
  const absl::Status refused = Read("h", AtLeast(8)).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(refused)) << refused;
  EXPECT_EQ(ReasonOf(refused), v1::ERROR_REASON_FUTURE_REVISION);
  EXPECT_EQ(MetadataOf(refused, "at_least_revision"), "8");
  EXPECT_EQ(MetadataOf(refused, "current_revision"), "7");
}

TEST_F(RegistryFreshnessTest, BothConditionsHoldIfBothAreGiven) {
  ASSERT_TRUE(hulls_.Create("h").ok());
  Freshness freshness = AtMost(hours(1));
  freshness.at_least_revision = 1;
  EXPECT_TRUE(IsAnsweredAtOnce("h", freshness));
  freshness.at_least_revision = 2;
  EXPECT_FALSE(IsAnsweredAtOnce("h", freshness));
  freshness = AtMost(hours(1), hours(2));
  freshness.at_least_revision = 1;
  EXPECT_FALSE(IsAnsweredAtOnce("h", freshness));
}

// Reads that accept the local state continue; the rest return the reason for their failure.
TEST_F(RegistryFreshnessTest, AnUnreachableStoreFailsOnlyReadsThatNeedIt) {
  ASSERT_TRUE(hulls_.Create("h").ok());
  store_.Fail(absl::UnavailableError("no database"));
  EXPECT_TRUE(absl::IsUnavailable(Read("h", {}).status()));
  EXPECT_TRUE(absl::IsUnavailable(Read("h", AtMost(hours(1), hours(2))).status()));
  EXPECT_TRUE(absl::IsUnavailable(Read("h", AtLeast(2)).status()));
  EXPECT_TRUE(Read("h", AtMost(hours(1))).ok());
  EXPECT_TRUE(Read("h", AtLeast(1)).ok());
  // An unanswered request does not improve freshness.
  EXPECT_FALSE(IsAnsweredAtOnce("h", AtMost(hours(1), hours(2))));
}

TEST_F(RegistryFreshnessTest, AChangeSatisfiesReadsThatBeganBeforeIt) {
  Freshness began_before;
  began_before.began = SteadyClock::now();
  store_.CreateElsewhere("i", 1);
  ASSERT_TRUE(hulls_.Create("h").ok());
  EXPECT_TRUE(IsAnsweredAtOnce("h", began_before));
}

TEST(RegistryFreshness, AStoreOfOneServerIsAlwaysFresh) {
  MemoryRegistry hulls(std::make_unique<MemoryStore>());
  ASSERT_TRUE(hulls.Create("h").ok());
  Freshness freshness;
  freshness.at_least_revision = 1;
  freshness.began = SteadyClock::now() + hours(1000);
  for (const std::optional<nanoseconds>& bound :
       {std::optional(nanoseconds(0)), std::optional<nanoseconds>(hours(1)),
        std::optional<nanoseconds>()}) {
    freshness.max_staleness = bound;
    const auto read = hulls.registry().Resolve("h", {}, freshness);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->first.staleness, nanoseconds(0));
    EXPECT_EQ(hulls.registry().peers().TryFresh(freshness), nanoseconds(0));
  }
  freshness.at_least_revision = 2;
  const absl::Status refused = hulls.registry().Resolve("h", {}, freshness).status();
  EXPECT_EQ(ReasonOf(refused), v1::ERROR_REASON_FUTURE_REVISION) << refused;
}

}  // namespace registry_freshness_test
}  // namespace hulld::server
