#include "server/registry/registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "server/store/memory_store.h"

namespace hulld::server {
namespace {

// Counts batches, and refuses them once told to.
class CountingStore : public MemoryStore {
 public:
  absl::Status Commit(std::span<const Change* const> changes) override {
    commits += static_cast<int>(changes.size());
    return absl::OkStatus();
  }
  std::atomic<int> commits = 0;
};

class RegistryTest : public ::testing::Test {
 protected:
  // Waits for the reply of one call.
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
      registry_.Append(session, {sequence, std::move(points), std::nullopt}, std::move(should_stop),
                       {}, std::move(done));
    });
  }

  absl::StatusOr<OpenResult> OpenAppend(
      const std::string& id, const std::string& writer, std::function<void()> on_gone = [] {}) {
    return Wait<OpenResult>([&](Reply<OpenResult> done) {
      registry_.OpenAppend(
          id, writer, true, [on_gone](const absl::Status&) { on_gone(); }, std::move(done));
    });
  }

  AppendSession Open(const std::string& id) { return OpenAppend(id, "w")->session; }

  absl::StatusOr<uint64_t> Delete(const std::string& id) {
    return Wait<uint64_t>(
        [&](Reply<uint64_t> done) { registry_.Delete(id, std::nullopt, std::move(done)); });
  }

  CountingStore store_;
  WorkerPool writers_{2};
  Registry registry_{store_, Limits(), writers_};
};

TEST_F(RegistryTest, WhatIsServedIsMadeOnceAndSharedUntilTheNextChange) {
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
  EXPECT_EQ(first->second.served->hull().vertices()[1], Vector(1, 0, 0));
  EXPECT_EQ(third->second.served->hull().vertices()[1], Vector(2, 0, 0));
}

TEST_F(RegistryTest, TryResolveGivesUpWhereAHullIsNotReady) {
  const std::vector<std::string> ids = {"h", "none"};
  const AppendSession session = Open("h");
  ASSERT_TRUE(Append(session, 1, {{0, 0, 0}}).ok());
  EXPECT_FALSE(registry_.TryResolve(ids).has_value());
  const auto waited = registry_.Resolve(ids, {});
  const auto tried = registry_.TryResolve(ids);
  ASSERT_TRUE(tried.has_value());
  EXPECT_EQ(tried->store_revision, waited->store_revision);
  ASSERT_EQ(tried->hulls.size(), 2);
  EXPECT_EQ(tried->hulls[0]->served, waited->hulls[0]->served);
  EXPECT_EQ(tried->hulls[0]->record.revision, waited->hulls[0]->record.revision);
  EXPECT_EQ(tried->hulls[1].status(), waited->hulls[1].status());
  ASSERT_TRUE(Append(session, 2, {{1, 0, 0}}).ok());
  EXPECT_FALSE(registry_.TryResolve(ids).has_value());
}

TEST_F(RegistryTest, WhatIsServedIsReadWhileAChunkIsInProgress) {
  const AppendSession session = Open("h");
  ASSERT_TRUE(Append(session, 1, {{0, 0, 0}}).ok());
  ASSERT_TRUE(registry_.Resolve("h", {}).ok());
  // The builder polls this in the midst of a large chunk; readers go on meanwhile.
  int polls = 0;
  std::vector<Vector> points;
  for (int i = 0; i < 20'000; ++i) points.emplace_back(i, 0, 0);
  const auto result = Append(session, 2, std::move(points), [&] {
    ++polls;
    const auto view = registry_.Resolve("h", {});
    EXPECT_TRUE(view.ok());
    EXPECT_EQ(view->second.served->hull().vertices().size(), 1);
    EXPECT_EQ(registry_.List("", "", 10).hulls.size(), 1);
    return false;
  });
  EXPECT_TRUE(result.ok());
  EXPECT_GT(polls, 1);
  EXPECT_EQ(registry_.Resolve("h", {})->second.served->hull().vertices().size(), 2);
}

TEST_F(RegistryTest, ACancelledChunkChangesNothingAndMayBeSentAgain) {
  const AppendSession session = Open("h");
  const std::vector<Vector> points(5000, Vector(1, 2, 3));
  EXPECT_EQ(Append(session, 1, points, [] { return true; }).status().code(),
            absl::StatusCode::kCancelled);
  EXPECT_EQ(registry_.Resolve("h", {})->second.record.counts.received, 0);
  EXPECT_TRUE(Append(session, 1, points).ok());
}

TEST_F(RegistryTest, AReaderThatWaitsForAChunkCanBeCancelled) {
  const AppendSession session = Open("h");
  ASSERT_TRUE(Append(session, 1, {{0, 0, 0}}).ok());
  std::vector<Vector> points;
  for (int i = 0; i < 20'000; ++i) points.emplace_back(i, 0, 0);
  bool asked = false;
  ASSERT_TRUE(Append(session, 2, std::move(points), [&] {
                // Nothing is ready to be served, and the builder is busy with this very chunk.
                if (!std::exchange(asked, true)) {
                  EXPECT_EQ(registry_.Resolve("h", [] { return true; }).status().code(),
                            absl::StatusCode::kCancelled);
                }
                return false;
              }).ok());
  EXPECT_TRUE(asked);
}

TEST_F(RegistryTest, AReaderThatMakesWhatIsServedCanBeCancelled) {
  std::vector<Vector> points;
  for (int i = -50; i <= 50; ++i) {
    for (int j = -50; j <= 50; ++j) points.emplace_back(i, j, i * i + j * j);
  }
  ASSERT_TRUE(Append(Open("h"), 1, points).ok());
  int stopped = 0;
  for (const int last : {1, 2, 20}) {
    int polls = 0;
    stopped += absl::IsCancelled(registry_.Resolve("h", [&] { return ++polls >= last; }).status());
    // Once more than it was told to stop, when the work has ended.
    EXPECT_EQ(polls, last + 1);
  }
  EXPECT_EQ(stopped, 3);
  const auto made = registry_.Resolve("h", {});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->second.served->hull().vertices().size(), points.size());
}

TEST_F(RegistryTest, ADeletionWaitsForTheChunkInProgressAndRefusesTheNext) {
  const AppendSession session = Open("h");
  std::vector<Vector> points;
  for (int i = 0; i < 20'000; ++i) points.emplace_back(i, 0, 0);
  std::promise<absl::StatusOr<uint64_t>> deleted;
  std::promise<absl::StatusOr<ChunkResult>> next;
  bool asked = false;
  const auto result = Append(session, 1, std::move(points), [&] {
    if (!std::exchange(asked, true)) {
      registry_.Delete("h", std::nullopt,
                       [&](absl::StatusOr<uint64_t> reply) { deleted.set_value(reply); });
      registry_.Append(session, {2, {{0, 1, 0}}, std::nullopt}, {}, {},
                       [&](absl::StatusOr<ChunkResult> reply) { next.set_value(reply); });
      EXPECT_EQ(registry_.List("", "", 10).hulls.size(), 1);
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
  registry_.CloseAppend(first->session);
  ASSERT_TRUE(Delete("h").ok());
  EXPECT_EQ(closed, 0);
  EXPECT_EQ(open, 1);
  registry_.CloseAppend(second->session);
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
    registry_.Append(session, {i, {{static_cast<double>(i), 0, 0}}, std::nullopt}, {}, {},
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
  EXPECT_EQ(resolved->store_revision, registry_.Sizes().store_revision);
  EXPECT_EQ(resolved->hulls[0]->record.hull_id, "b");
  EXPECT_EQ(resolved->hulls[1].status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(resolved->hulls[2]->served->hull().vertices()[0], Vector(0, 0, 0));
  EXPECT_EQ(resolved->hulls[0]->served, resolved->hulls[3]->served);
}

}  // namespace
}  // namespace hulld::server
