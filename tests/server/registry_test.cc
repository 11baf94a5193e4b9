#include "server/registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "server/memory_store.h"

namespace hulld::server {
namespace {

using ::testing::HasSubstr;

// Refuses chunks once told to.
class FullStore : public MemoryStore {
 public:
  absl::Status Commit(const Change& change) override {
    if (full && std::holds_alternative<ChunkApplied>(change)) {
      return absl::ResourceExhaustedError("no space left");
    }
    ++commits;
    return absl::OkStatus();
  }
  bool full = false;
  int commits = 0;
};

class RegistryTest : public ::testing::Test {
 protected:
  absl::StatusOr<ChunkResult> Append(const AppendSession& session, uint64_t sequence,
                                     std::vector<Vector> points,
                                     std::function<bool()> should_stop = {}) {
    std::promise<absl::StatusOr<ChunkResult>> promise;
    registry_.Append(session, {sequence, std::move(points), std::nullopt}, std::move(should_stop),
                     [&](absl::StatusOr<ChunkResult> result) { promise.set_value(result); });
    return promise.get_future().get();
  }

  AppendSession Open(const std::string& id) {
    return registry_.OpenAppend(id, "w", true, [] {})->session;
  }

  FullStore store_;
  WorkerPool writers_{2};
  Registry registry_{store_, Limits(), writers_};
};

TEST_F(RegistryTest, ASnapshotIsMadeOnceAndSharedUntilTheNextChange) {
  const AppendSession session = Open("h");
  ASSERT_TRUE(Append(session, 1, {{0, 0, 0}, {1, 0, 0}}).ok());
  const auto first = registry_.Resolve("h", {});
  ASSERT_TRUE(Append(session, 2, {{0.5, 0, 0}}).ok());
  const auto second = registry_.Resolve("h", {});
  EXPECT_EQ(first->second.snapshot, second->second.snapshot);
  EXPECT_EQ(second->second.record.counts.received, 3);
  ASSERT_TRUE(Append(session, 3, {{2, 0, 0}}).ok());
  const auto third = registry_.Resolve("h", {});
  EXPECT_NE(first->second.snapshot, third->second.snapshot);
  EXPECT_EQ(first->second.snapshot->hull().vertices()[1], Vector(1, 0, 0));
  EXPECT_EQ(third->second.snapshot->hull().vertices()[1], Vector(2, 0, 0));
}

TEST_F(RegistryTest, TryResolveGivesUpWhereASnapshotIsMissing) {
  const std::vector<std::string> ids = {"h", "none"};
  const AppendSession session = Open("h");
  ASSERT_TRUE(Append(session, 1, {{0, 0, 0}}).ok());
  EXPECT_FALSE(registry_.TryResolve(ids).has_value());
  const auto waited = registry_.Resolve(ids, {});
  const auto tried = registry_.TryResolve(ids);
  ASSERT_TRUE(tried.has_value());
  EXPECT_EQ(tried->store_revision, waited->store_revision);
  ASSERT_EQ(tried->hulls.size(), 2);
  EXPECT_EQ(tried->hulls[0]->snapshot, waited->hulls[0]->snapshot);
  EXPECT_EQ(tried->hulls[0]->record.revision, waited->hulls[0]->record.revision);
  EXPECT_EQ(tried->hulls[1].status(), waited->hulls[1].status());
  ASSERT_TRUE(Append(session, 2, {{1, 0, 0}}).ok());
  EXPECT_FALSE(registry_.TryResolve(ids).has_value());
}

TEST_F(RegistryTest, ACurrentSnapshotIsReadWhileAChunkIsInProgress) {
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
    EXPECT_EQ(view->second.snapshot->hull().vertices().size(), 1);
    EXPECT_EQ(registry_.List("", "", 10).hulls.size(), 1);
    return false;
  });
  EXPECT_TRUE(result.ok());
  EXPECT_GT(polls, 1);
  EXPECT_EQ(registry_.Resolve("h", {})->second.snapshot->hull().vertices().size(), 2);
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
                // No snapshot is current and the builder is busy with this very chunk.
                if (!std::exchange(asked, true)) {
                  EXPECT_EQ(registry_.Resolve("h", [] { return true; }).status().code(),
                            absl::StatusCode::kCancelled);
                }
                return false;
              }).ok());
  EXPECT_TRUE(asked);
}

TEST_F(RegistryTest, AChunkInProgressWhenItsHullIsDeletedIsRefused) {
  const AppendSession session = Open("h");
  std::vector<Vector> points;
  for (int i = 0; i < 20'000; ++i) points.emplace_back(i, 0, 0);
  bool deleted = false;
  const auto result = Append(session, 1, std::move(points), [&] {
    if (!std::exchange(deleted, true)) {
      EXPECT_TRUE(registry_.Delete("h", std::nullopt).ok());
      EXPECT_TRUE(registry_.Create("h", false).ok());
    }
    return false;
  });
  EXPECT_EQ(result.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(registry_.Resolve("h", {})->second.record.vertex_count, 0);
  EXPECT_EQ(registry_.Sizes().vertex_count, 0);
}

TEST_F(RegistryTest, AWatchIsCalledOnceOnDeletionAndNotAfterClosing) {
  int closed = 0;
  int open = 0;
  const auto first = registry_.OpenAppend("h", "1", true, [&] { ++closed; });
  const auto second = registry_.OpenAppend("h", "2", false, [&] { ++open; });
  registry_.CloseAppend(first->session);
  ASSERT_TRUE(registry_.Delete("h", std::nullopt).ok());
  EXPECT_EQ(closed, 0);
  EXPECT_EQ(open, 1);
  registry_.CloseAppend(second->session);
}

TEST_F(RegistryTest, TheStoreSeesEveryChangeAndCanRefuseIt) {
  const AppendSession session = Open("h");
  ASSERT_TRUE(Append(session, 1, {{0, 0, 0}}).ok());
  EXPECT_EQ(store_.commits, 2);
  const uint64_t revision = registry_.Sizes().store_revision;
  store_.full = true;
  const auto refused = Append(session, 2, {{1, 0, 0}});
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("no space left"));
  // Nobody sees the points that were not stored.
  EXPECT_FALSE(registry_.Resolve("h", {}).ok());
  EXPECT_EQ(registry_.Sizes().store_revision, revision);
  EXPECT_TRUE(registry_.Delete("h", std::nullopt).ok());
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
  EXPECT_EQ(resolved->hulls[2]->snapshot->hull().vertices()[0], Vector(0, 0, 0));
  EXPECT_EQ(resolved->hulls[0]->snapshot, resolved->hulls[3]->snapshot);
}

}  // namespace
}  // namespace hulld::server
