// Readers of many hulls: the time they hold the mutex, and the consistency of their snapshot.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <future>
#include <thread>
#include <utility>

#include "server/store/memory_store.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace registry_lookup_test {

constexpr uint64_t kMax = kMaxLookupsPerHold;

class RegistryLookup : public ::testing::Test {
 protected:
  // Creates hulls "0000", "0001", ...
  std::vector<std::string> Create(int count) {
    std::vector<std::string> ids;
    for (int i = 0; i < count; ++i) {
      ids.push_back(absl::StrCat(absl::Dec(i, absl::kZeroPad4)));
      EXPECT_TRUE(hulls_.Create(ids.back()).ok());
    }
    return ids;
  }
  uint64_t Lookups() { return registry_.Cache().hits; }
  static uint64_t Received(const Resolved& resolved, size_t i) {
    return resolved.hulls[i]->record.counts.received;
  }

  MemoryRegistry hulls_{std::make_unique<MemoryStore>()};
  Registry& registry_ = hulls_.registry();
};

TEST_F(RegistryLookup, TheMutexIsHeldForAFewLookupsAtATime) {
  const std::vector<std::string> ids = Create(1000);
  ASSERT_TRUE(registry_.Resolve(ids, {}).ok());
  EXPECT_EQ(registry_.Holds().max_lookups, kMax);
  ASSERT_TRUE(registry_.Resolve(ids, {}, {.may_wait = false}).ok());
  EXPECT_EQ(registry_.Holds().max_lookups, kMax);
  EXPECT_GT(registry_.Holds().longest, std::chrono::nanoseconds(0));
}

TEST_F(RegistryLookup, AHullThatIsNamedOftenIsLookedUpOnce) {
  Create(2);
  std::vector<std::string> ids(200'000, "0001");
  ids[17] = "0000";
  ids[100'000] = "missing";
  const absl::StatusOr<Resolved> resolved = registry_.Resolve(ids, {});
  ASSERT_TRUE(resolved.ok());
  EXPECT_EQ(Lookups(), 2);
  for (size_t i = 0; i < ids.size(); ++i) {
    if (i == 100'000) {
      EXPECT_TRUE(absl::IsNotFound(resolved->hulls[i].status()));
    } else {
      ASSERT_EQ(resolved->hulls[i]->record.hull_id, ids[i]);
    }
  }
}

TEST_F(RegistryLookup, ChangesBetweenTwoSlicesAreLookedUpAgain) {
  const std::vector<std::string> ids = Create(1000);
  uint64_t round = 0;
  const auto change = [&] {
    // Hulls looked up first, last, and in between.
    if (round++ >= 5) return false;
    for (size_t i = 0; i < ids.size(); i += 100) {
      EXPECT_TRUE(hulls_.Put(ids[i], {{static_cast<double>(round), 0, 0}}).ok());
    }
    if (round == 2) {
      EXPECT_TRUE(hulls_.Delete(ids[250]).ok());
    }
    if (round == 3) {
      EXPECT_TRUE(hulls_.Create("new").ok());
    }
    return false;
  };
  std::vector<std::string> requested = ids;
  requested.push_back("new");
  const absl::StatusOr<Resolved> resolved = registry_.Resolve(requested, change);
  ASSERT_TRUE(resolved.ok());
  EXPECT_GE(round, 5);
  for (size_t i = 0; i < ids.size(); i += 100) EXPECT_EQ(Received(*resolved, i), 5);
  EXPECT_TRUE(absl::IsNotFound(resolved->hulls[250].status()));
  EXPECT_TRUE(resolved->hulls[1000].ok());
  EXPECT_EQ(resolved->as_of.revision, registry_.Sizes().store_revision);
  EXPECT_EQ(registry_.Holds().max_lookups, kMax);
}

// A writer appends to one hull, then to the next, and so on: no reader sees the second ahead of the
// first, nor two steps behind it, whatever lies between them.
TEST_F(RegistryLookup, ResultsBelongToOneRevision) {
  const std::vector<std::string> ids = Create(600);
  std::atomic<bool> ending = false;
  std::thread writer([&] {
    for (int i = 0; !ending; ++i) {
      ASSERT_TRUE(hulls_.Put(i % 2 == 0 ? ids.front() : ids.back(), {{1. * i, 0, 0}}).ok());
    }
  });
  KnownHulls known;
  uint64_t last = 0;
  for (int round = 0; round < 300 || last < 100; ++round) {
    const auto resolved =
        round % 2 == 0 ? registry_.Resolve(ids, {}) : registry_.reader().Refresh(ids, known, {});
    ASSERT_TRUE(resolved.ok());
    const uint64_t first = Received(*resolved, 0);
    const uint64_t second = Received(*resolved, ids.size() - 1);
    EXPECT_GE(first, second);
    EXPECT_LE(first, second + 1);
    EXPECT_GE(second + 1, last);
    last = first;
    const HullRecord& record = resolved->hulls[0]->record;
    EXPECT_LE(record.revision, resolved->as_of.revision);
  }
  ending = true;
  writer.join();
}

TEST_F(RegistryLookup, ARefreshLooksUpOnlyChangedHulls) {
  const std::vector<std::string> ids = Create(1000);
  KnownHulls known;
  ASSERT_TRUE(registry_.reader().Refresh(ids, known, {}).ok());
  EXPECT_EQ(Lookups(), 1000);
  ASSERT_TRUE(hulls_.Put(ids[3], CubeCorners()).ok());
  ASSERT_TRUE(hulls_.Put("another", CubeCorners()).ok());
  absl::StatusOr<Resolved> resolved = registry_.reader().Refresh(ids, known, {});
  EXPECT_EQ(Lookups(), 1001);
  EXPECT_EQ(resolved->hulls[3]->record.vertex_count, 8);
  EXPECT_EQ(resolved->as_of.revision, registry_.Sizes().store_revision);

  ASSERT_TRUE(hulls_.Delete(ids[3]).ok());
  Replacement replacement;
  replacement.hull_id = ids[4];
  replacement.builder = std::make_shared<HullBuilder>();
  replacement.counts = *replacement.builder->Add(CubeCorners(5, 1));
  ASSERT_TRUE(hulls_.Replace(std::move(replacement)).ok());
  resolved = registry_.reader().Refresh(ids, known, {});
  EXPECT_TRUE(absl::IsNotFound(resolved->hulls[3].status()));
  EXPECT_EQ(resolved->hulls[4]->served->low(), Vector(5, 5, 5));
  EXPECT_EQ(Lookups(), 1002);

  ASSERT_TRUE(hulls_.Create(ids[3]).ok());
  EXPECT_TRUE(registry_.reader().Refresh(ids, known, {})->hulls[3].ok());
  EXPECT_EQ(Lookups(), 1003);
}

// The record of changes is bounded; beyond it, all hulls are looked up.
TEST_F(RegistryLookup, ARefreshAfterMoreChangesThanAreKnownLooksUpAll) {
  const std::vector<std::string> ids = Create(300);
  KnownHulls known;
  ASSERT_TRUE(registry_.reader().Refresh(ids, known, {}).ok());
  ASSERT_TRUE(hulls_.Put(ids[7], CubeCorners()).ok());
  const AppendSession session = hulls_.Open("another")->session;
  std::promise<void> done;
  for (uint64_t sequence = 1; sequence <= RecentChanges::kCapacity; ++sequence) {
    registry_.changes().Append(session, {sequence, {{0, 0, 0}}, std::nullopt}, {}, {},
                               [&, sequence](const absl::StatusOr<ChunkResult>& result) {
                                 EXPECT_TRUE(result.ok());
                                 if (sequence == RecentChanges::kCapacity) done.set_value();
                               });
  }
  done.get_future().wait();
  const uint64_t before = Lookups();
  EXPECT_EQ(registry_.reader().Refresh(ids, known, {})->hulls[7]->record.vertex_count, 8);
  EXPECT_EQ(Lookups(), before + 300);
  EXPECT_LE(registry_.Holds().max_lookups, kMax);
}

TEST_F(RegistryLookup, ALookupCanBeCancelledBetweenSlices) {
  const std::vector<std::string> ids = Create(1000);
  EXPECT_TRUE(absl::IsCancelled(registry_.Resolve(ids, [] { return true; }).status()));
  EXPECT_LE(Lookups(), kMax);
}

// A waiting thread gets the mutex before the thread that releases it and locks it again.
TEST(FairMutexTest, WaitersGoFirst) {
  FairMutex mutex;
  for (int round = 0; round < 100; ++round) {
    bool is_first = false;
    Locked locked(mutex);
    std::promise<void> started;
    std::thread other([&] {
      started.set_value();
      const std::lock_guard lock(mutex);
      is_first = true;
    });
    started.get_future().wait();
    while (!mutex.is_wanted()) std::this_thread::yield();
    locked.Unlock();
    locked.Lock();
    EXPECT_TRUE(is_first);
    locked.Unlock();
    other.join();
  }
}

TEST(FairMutexTest, WaitingOnAConditionDoesNotCountAsHolding) {
  using Clock = std::chrono::steady_clock;
  FairMutex mutex;
  std::condition_variable condition;
  Clock::duration waited{0};
  const Clock::time_point begin = Clock::now();
  Locked locked(mutex);
  locked.WaitOn([&](auto& lock) {
    const Clock::time_point start = Clock::now();
    condition.wait_for(lock, std::chrono::milliseconds(1), [] { return false; });
    waited = Clock::now() - start;
  });
  locked.Unlock();
  const Clock::duration elapsed = Clock::now() - begin;
  const std::lock_guard lock(mutex);
  // Time spent waiting does not count as holding the mutex.
  EXPECT_LE(mutex.Statistics().longest, elapsed - waited);
}

}  // namespace registry_lookup_test
}  // namespace hulld::server
