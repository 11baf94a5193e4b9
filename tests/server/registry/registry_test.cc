#include "server/registry/registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <memory>
#include <mutex>
#include <thread>

#include "core/hull/growth/hull_builder.h"
#include "server/store/memory_store.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace registry_test {

// Counts batches, and refuses them when set to.
class CountingStore : public MemoryStore {
 public:
  absl::Status Commit(std::span<Change* const> changes) override {
    commits += static_cast<int>(changes.size());
    return MemoryStore::Commit(changes);
  }
  std::atomic<int> commits = 0;
};

class RegistryTest : public ::testing::Test {
 protected:
  // Waits for the reply of a call.
  template <typename T, typename Call>
  static absl::StatusOr<T> Wait(const Call& call) {
    std::promise<absl::StatusOr<T>> promise;
    call([&](absl::StatusOr<T> result) { promise.set_value(std::move(result)); });
    return promise.get_future().get();
  }

  absl::StatusOr<ChunkResult> Append(const AppendSession& session, uint64_t sequence,
                                     std::vector<Vector> points,
                                     std::function<bool()> should_stop = {}) {
    return Wait<ChunkResult>([&](Reply<ChunkResult> done) {
      registry_.changes().Append(session, {sequence, std::move(points), std::nullopt},
                                 std::move(should_stop), {}, std::move(done));
    });
  }

  absl::StatusOr<OpenResult> OpenAppend(
      const std::string& id, const std::string& writer, std::function<void()> on_gone = [] {}) {
    return Wait<OpenResult>([&](Reply<OpenResult> done) {
      registry_.changes().OpenAppend(
          id, writer, true, [on_gone](const absl::Status&) { on_gone(); }, std::move(done));
    });
  }

  AppendSession Open(const std::string& id) { return OpenAppend(id, "w")->session; }

  absl::StatusOr<uint64_t> Delete(const std::string& id) {
    return Wait<uint64_t>([&](const Reply<uint64_t>& done) {
      registry_.changes().Delete("hull", id, std::nullopt, done);
    });
  }

  CountingStore store_;
  TaskPool writers_{2};
  Registry registry_{store_, Limits(), writers_};
};

TEST_F(RegistryTest, SnapshotsAreMadeOnceAndShared) {
  const AppendSession session = Open("h");
  ASSERT_TRUE(Append(session, 1, {{0, 0, 0}, {1, 0, 0}}).ok());
  const auto first = registry_.Resolve("h", {});
  ASSERT_TRUE(Append(session, 2, {{0.5, 0, 0}}).ok());
  const auto second = registry_.Resolve("h", {});
  EXPECT_EQ(first->second.served, second->second.served);
  EXPECT_EQ(second->second.record.counts.received, 3);
  ASSERT_TRUE(Append(session, 3, {{2, 0, 0}}).ok());
  const auto third = registry_.Resolve("h", {});
  EXPECT_NE(first->second.served, third->second.served);
  EXPECT_EQ(first->second.served->high(), Vector(1, 0, 0));
  EXPECT_EQ(third->second.served->high(), Vector(2, 0, 0));
  // In any order of requests.
  EXPECT_EQ(CanonicalOf(third->second).vertices()[1], Vector(2, 0, 0));
  EXPECT_EQ(CanonicalOf(first->second).vertices()[1], Vector(1, 0, 0));
}

TEST_F(RegistryTest, AnAcknowledgedChunkIsSeenAtOnce) {
  const std::vector<std::string> ids = {"h", "none"};
  const AppendSession session = Open("h");
  for (uint64_t i = 1; i <= 100; ++i) {
    ASSERT_TRUE(Append(session, i, {Vector(static_cast<double>(i), 0, 0)}).ok());
    const auto tried = registry_.Resolve(ids, {}, {.may_wait = false});
    ASSERT_TRUE(tried.ok());
    ASSERT_EQ(tried->hulls.size(), 2);
    EXPECT_EQ(tried->as_of.revision, registry_.Sizes().store_revision);
    EXPECT_EQ(tried->hulls[0]->record.counts.received, i);
    EXPECT_EQ(tried->hulls[0]->served->high(), Vector(static_cast<double>(i), 0, 0));
    EXPECT_EQ(tried->hulls[1].status().code(), absl::StatusCode::kNotFound);
    const auto waited = registry_.Resolve(ids, {});
    EXPECT_EQ(tried->as_of.revision, waited->as_of.revision);
    EXPECT_EQ(tried->hulls[0]->served, waited->hulls[0]->served);
    EXPECT_EQ(tried->hulls[1].status(), waited->hulls[1].status());
  }
}

TEST(RegistryTurns, ClientsTakeTurnsAtBuildingChunks) {
  MemoryStore store;
  TaskPool writers(1);
  Registry registry(store, Limits(), writers);
  const auto open = [&](const std::string& id, ClientId client) {
    std::promise<AppendSession> opened;
    registry.changes().OpenAppend(
        id, "w", true, [](const absl::Status&) {},
        [&](const absl::StatusOr<OpenResult>& result) { opened.set_value(result->session); },
        client);
    return opened.get_future().get();
  };
  std::vector<AppendSession> sessions = {open("a", {1}), open("b", {1}), open("c", {1}),
                                         open("d", {2})};
  // All of them wait for the only thread.
  std::promise<void> released;
  writers.Submit([&] { released.get_future().wait(); });
  std::mutex mutex;
  std::vector<size_t> built;
  std::vector<std::future<void>> ends;
  for (size_t i = 0; i < sessions.size(); ++i) {
    const auto building = std::make_shared<std::promise<void>>();
    const auto ended = std::make_shared<std::promise<void>>();
    ends.push_back(building->get_future());
    ends.push_back(ended->get_future());
    registry.changes().Append(
        sessions[i], {1, {{1, 2, 3}}, std::nullopt}, {},
        [&, i, building] {
          {
            const std::lock_guard lock(mutex);
            built.push_back(i);
          }
          building->set_value();
        },
        [ended](const absl::StatusOr<ChunkResult>&) { ended->set_value(); });
  }
  released.set_value();
  for (std::future<void>& end : ends) end.wait();
  const std::lock_guard lock(mutex);
  EXPECT_THAT(built, testing::ElementsAre(0, 3, 1, 2));
}

// No version can be served yet, and the builder is busy with this chunk.
TEST_F(RegistryTest, AReaderDoesNotWaitForTheChunkInProgress) {
  const AppendSession session = Open("h");
  ASSERT_TRUE(Append(session, 1, {{0, 0, 0}}).ok());
  // The builder polls this while it processes a large chunk.
  int polls = 0;
  std::vector<Vector> points;
  points.reserve(20'000);
  for (int i = 0; i < 20'000; ++i) points.emplace_back(i, 0, 0);
  const auto result = Append(session, 2, std::move(points), [&] {
    ++polls;
    const auto view = registry_.Resolve("h", {});
    EXPECT_TRUE(view.ok());
    EXPECT_EQ(view->second.served->query_hull().point_count(), 1);
    EXPECT_EQ(CanonicalOf(view->second).vertices().size(), 1);
    EXPECT_EQ(registry_.records().List("", "", 10)->entries.size(), 1);
    return false;
  });
  EXPECT_TRUE(result.ok());
  EXPECT_GT(polls, 1);
  EXPECT_EQ(CanonicalOf(registry_.Resolve("h", {})->second).vertices().size(), 2);
}

TEST_F(RegistryTest, ACancelledChunkChangesNothingAndMayBeSentAgain) {
  const AppendSession session = Open("h");
  const std::vector<Vector> points(5000, Vector(1, 2, 3));
  EXPECT_EQ(Append(session, 1, points, [] { return true; }).status().code(),
            absl::StatusCode::kCancelled);
  EXPECT_EQ(registry_.Resolve("h", {})->second.record.counts.received, 0);
  EXPECT_TRUE(Append(session, 1, points).ok());
}

std::vector<Vector> Paraboloid() {
  std::vector<Vector> points;
  for (int i = -50; i <= 50; ++i) {
    for (int j = -50; j <= 50; ++j) points.emplace_back(i, j, i * i + j * j);
  }
  return points;
}

TEST_F(RegistryTest, AReaderThatMakesTheCanonicalSnapshotCanBeCancelled) {
  const std::vector<Vector> points = Paraboloid();
  ASSERT_TRUE(Append(Open("h"), 1, points).ok());
  const HullView view = registry_.Resolve("h", {})->second;
  for (const int last : {1, 2, 20}) {
    int polls = 0;
    EXPECT_TRUE(absl::IsCancelled(
        registry_.reader().Canonical(view, [&] { return ++polls >= last; }).status()));
    EXPECT_EQ(polls, last);
    EXPECT_EQ(view.served->canonical(), nullptr);
  }
  const auto made = registry_.reader().Canonical(view, {});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ((*made)->vertices().size(), points.size());
}

TEST_F(RegistryTest, TheCanonicalSnapshotIsMadeOnceAndOnDemand) {
  ASSERT_TRUE(Append(Open("h"), 1, Paraboloid()).ok());
  const HullView view = registry_.Resolve("h", {})->second;
  EXPECT_EQ(view.served->canonical(), nullptr);
  EXPECT_EQ(view.served->query_hull().canonical(), nullptr);
  std::vector<const Hull*> made(4);
  std::vector<std::thread> threads;
  threads.reserve(made.size());
  for (const Hull*& hull : made) {
    threads.emplace_back([&] { hull = *registry_.reader().Canonical(view, {}); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const Hull* hull : made) EXPECT_EQ(hull, view.served->canonical());
  EXPECT_FALSE(view.served->has_canonical_query_hull());
  EXPECT_EQ(view.served->canonical_query_hull().canonical(), made[0]);
  // From here on, it serves all queries.
  EXPECT_EQ(&view.served->query_hull(), &view.served->canonical_query_hull());
  ASSERT_TRUE(Append(OpenAppend("h", "other")->session, 1, {{0, 0, 9000}}).ok());
  EXPECT_EQ(registry_.Resolve("h", {})->second.served->canonical(), nullptr);
}

TEST_F(RegistryTest, AReaderThatWaitsForTheCanonicalSnapshotCanBeCancelled) {
  ASSERT_TRUE(Append(Open("h"), 1, Paraboloid()).ok());
  const HullView view = registry_.Resolve("h", {})->second;
  bool was_polled = false;
  const auto made = registry_.reader().Canonical(view, [&] {
    if (!std::exchange(was_polled, true)) {
      std::thread([&] {
        EXPECT_TRUE(
            absl::IsCancelled(registry_.reader().Canonical(view, [] { return true; }).status()));
      }).join();
    }
    return false;
  });
  EXPECT_TRUE(made.ok());
  EXPECT_TRUE(was_polled);
}

// The hull replaced the version long ago, and later preparations contain later points.
TEST_F(RegistryTest, ReadersKeepTheVersionThatTheyResolved) {
  const AppendSession session = Open("h");
  std::vector<HullView> views;
  const std::vector<Vector> points = Paraboloid();
  constexpr size_t kChunk = 500;
  for (uint64_t i = 1; i * kChunk <= points.size(); ++i) {
    const auto first = points.begin() + static_cast<ptrdiff_t>((i - 1) * kChunk);
    ASSERT_TRUE(Append(session, i, {first, first + kChunk}).ok());
    const std::vector<std::string> ids = {"h"};
    const auto resolved = registry_.Resolve(ids, {}, {i % 3 == 0 ? 1'000'000U : 0U, true});
    views.push_back(*resolved->hulls[0]);
  }
  for (size_t i = 0; i < views.size(); ++i) {
    HullBuilder builder;
    ASSERT_TRUE(builder.Add(std::span(points).first((i + 1) * kChunk)).ok());
    const Hull expected = builder.Snapshot();
    EXPECT_TRUE(std::ranges::equal(CanonicalOf(views[i]).vertices(), expected.vertices()));
  }
}

TEST_F(RegistryTest, PreparationPrecedesOnlyWaitingQueries) {
  const std::vector<std::string> ids = {"h"};
  ASSERT_TRUE(Append(Open("h"), 1, Paraboloid()).ok());
  const ReadPlan many = {1'000'000, true};
  const ReadPlan many_now = {1'000'000, true, {}, false};
  EXPECT_FALSE(registry_.Resolve(ids, {}, many_now).ok());
  const auto before = registry_.Resolve(ids, {}, {.may_wait = false});
  ASSERT_TRUE(before.ok());
  const auto prepared = registry_.Resolve(ids, {}, many);
  ASSERT_TRUE(prepared.ok());
  EXPECT_NE(prepared->hulls[0]->served, before->hulls[0]->served);
  const auto after = registry_.Resolve(ids, {}, many_now);
  ASSERT_TRUE(after.ok());
  EXPECT_EQ(after->hulls[0]->served, prepared->hulls[0]->served);
  // The snapshot is that of the revision, regardless of preparation.
  EXPECT_EQ(&CanonicalOf(*before->hulls[0]), &CanonicalOf(*after->hulls[0]));
}

// Each chunk covers all earlier points. No reader queries it.
TEST_F(RegistryTest, ReplacedVerticesAreFreed) {
  constexpr int kVertices = 100;
  constexpr uint64_t kChunks = 1000;
  const AppendSession session = Open("h");
  for (uint64_t i = 1; i <= kChunks; ++i) {
    const auto result = Append(session, i, SpherePoints(kVertices, static_cast<double>(i)));
    ASSERT_EQ(result->counts.outside, kVertices);
    ASSERT_EQ(result->vertex_count, kVertices);
  }
  // All of them would be 2.4 MB. Bounded by the test's time limit only.
  while (registry_.Cache().bytes > 2'000'000) std::this_thread::yield();
  const HullView view = registry_.Resolve("h", {})->second;
  EXPECT_LT(view.served->query_hull().point_count(), 30'000);
  EXPECT_EQ(CanonicalOf(view).vertices().size(), view.record.vertex_count);
}

// The preparing thread runs after the reader has continued.
TEST_F(RegistryTest, FrequentlyQueriedHullsArePrepared) {
  const std::vector<std::string> ids = {"h"};
  ASSERT_TRUE(Append(Open("h"), 1, Paraboloid()).ok());
  const auto first = registry_.Resolve(ids, {}, {1'000'000, false, {}, false});
  ASSERT_TRUE(first.ok());
  // Bounded by the test's time limit only.
  while (registry_.Resolve(ids, {}, {.may_wait = false})->hulls[0]->served ==
         first->hulls[0]->served) {
    std::this_thread::yield();
  }
  EXPECT_TRUE(registry_.Resolve(ids, {}, {1'000'000, true, {}, false}).ok());
}

TEST_F(RegistryTest, ADeletionWaitsForTheChunkInProgressAndRefusesTheNext) {
  const AppendSession session = Open("h");
  std::vector<Vector> points;
  points.reserve(20'000);
  for (int i = 0; i < 20'000; ++i) points.emplace_back(i, 0, 0);
  std::promise<absl::StatusOr<uint64_t>> deleted;
  std::promise<absl::StatusOr<ChunkResult>> next;
  bool was_polled = false;
  const auto result = Append(session, 1, std::move(points), [&] {
    if (!std::exchange(was_polled, true)) {
      registry_.changes().Delete("hull", "h", std::nullopt,
                                 [&](absl::StatusOr<uint64_t> reply) { deleted.set_value(reply); });
      registry_.changes().Append(session, {2, {{0, 1, 0}}, std::nullopt}, {}, {},
                                 [&](absl::StatusOr<ChunkResult> reply) { next.set_value(reply); });
      EXPECT_EQ(registry_.records().List("", "", 10)->entries.size(), 1);
    }
    return false;
  });
  EXPECT_TRUE(result.ok());
  EXPECT_TRUE(deleted.get_future().get().ok());
  EXPECT_EQ(next.get_future().get().status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(registry_.Sizes().vertex_count, 0);
  EXPECT_EQ(registry_.Sizes().hull_count, 0);
}

TEST_F(RegistryTest, AWatchIsCalledOnceOnDeletionAndNotAfterClosing) {
  std::atomic<int> closed = 0;
  std::atomic<int> open = 0;
  const auto first = OpenAppend("h", "1", [&] { ++closed; });
  const auto second = OpenAppend("h", "2", [&] { ++open; });
  registry_.changes().CloseAppend(first->session);
  ASSERT_TRUE(Delete("h").ok());
  EXPECT_EQ(closed, 0);
  EXPECT_EQ(open, 1);
  registry_.changes().CloseAppend(second->session);
}

TEST_F(RegistryTest, TheStoreSeesEveryChange) {
  const AppendSession session = Open("h");
  ASSERT_TRUE(Append(session, 1, {{0, 0, 0}}).ok());
  EXPECT_EQ(store_.commits, 2);
  ASSERT_TRUE(Append(session, 2, {{0, 0, 0}}).ok());
  EXPECT_EQ(store_.commits, 3);
  EXPECT_EQ(registry_.Sizes().store_revision, 2);
  EXPECT_EQ(registry_.Commits().changes, 3);
}

TEST_F(RegistryTest, ChunksOfOneSessionAreAnsweredInOrderThoughTheyOverlap) {
  const AppendSession session = Open("h");
  constexpr uint64_t kChunks = 500;
  std::vector<uint64_t> revisions;
  std::promise<void> all;
  for (uint64_t i = 1; i <= kChunks; ++i) {
    registry_.changes().Append(session, {i, {{static_cast<double>(i), 0, 0}}, std::nullopt}, {}, {},
                               [&](absl::StatusOr<ChunkResult> result) {
                                 revisions.push_back(result.ok() ? result->hull_revision : 0);
                                 if (revisions.size() == kChunks) all.set_value();
                               });
  }
  all.get_future().wait();
  for (uint64_t i = 0; i < kChunks; ++i) EXPECT_EQ(revisions[i], i + 2);
}

TEST_F(RegistryTest, ResolvesManyHullsAtOneRevision) {
  ASSERT_TRUE(Append(Open("a"), 1, {{0, 0, 0}}).ok());
  ASSERT_TRUE(Append(Open("b"), 1, {{1, 0, 0}}).ok());
  const std::vector<std::string> ids = {"b", "none", "a", "b"};
  const auto resolved = registry_.Resolve(ids, {});
  ASSERT_TRUE(resolved.ok());
  EXPECT_EQ(resolved->as_of.revision, registry_.Sizes().store_revision);
  EXPECT_EQ(resolved->hulls[0]->record.hull_id, "b");
  EXPECT_EQ(resolved->hulls[1].status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(resolved->hulls[2]->served->low(), Vector(0, 0, 0));
  EXPECT_EQ(resolved->hulls[0]->served, resolved->hulls[3]->served);
}

}  // namespace registry_test
}  // namespace hulld::server
