// Interleavings in which a call arrives between two steps of another.
#include "tests/server/registry/registry_interleaving.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/registry/registry.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace registry_interleaving_test {

// A reader is cancelled while it waits in the store for the points of a hull, and for points of
// another hull that a third reader loads. Neither affects writers.
TEST_F(RegistryInterleaving, ACancelledReaderDelaysNoWriter) {
  const AppendSession a = Open("a", "w");
  const AppendSession b = Open("b", "w");
  ASSERT_TRUE(Append(a, 1, CubeCorners()).ok());
  ASSERT_TRUE(Append(b, 1, CubeCorners()).ok());
  DropAll();
  Gate gate;
  store_.before_load.Set([&] { gate.Stop(); });
  auto first = StartResolve({"a", "b"}, [] { return true; });
  gate.WaitUntilReached();
  EXPECT_TRUE(absl::IsCancelled(StartResolve({"a", "b"}, [] { return true; }).get().status()));
  EXPECT_TRUE(Append(b, 2, {{0, 0, 5000}}).ok());
  EXPECT_TRUE(Append(a, 2, {{0, 0, 5000}}).ok());
  gate.Open();
  EXPECT_TRUE(absl::IsCancelled(first.get().status()));
  EXPECT_TRUE(Append(a, 3, {{0, 0, 6000}}).ok());
  EXPECT_TRUE(Append(b, 3, {{0, 0, 6000}}).ok());
  const auto resolved = StartResolve({"a", "b"}, {}).get();
  ASSERT_TRUE(resolved.ok());
  for (const auto& hull : resolved->hulls) EXPECT_EQ(hull->served->high().z(), 6000);
  EXPECT_TRUE(Delete("a").ok());
  EXPECT_TRUE(Delete("b").ok());
}

TEST_F(RegistryInterleaving, AReaderThatWaitsForAnotherCanBeCancelled) {
  ASSERT_TRUE(Append(Open("h", "w"), 1, CubeCorners()).ok());
  DropAll();
  Gate gate;
  store_.before_load.Set([&] { gate.Stop(); });
  auto first = StartResolve({"h"}, {});
  gate.WaitUntilReached();
  EXPECT_TRUE(absl::IsCancelled(registry_.Resolve("h", [] { return true; }).status()));
  gate.Open();
  EXPECT_TRUE(first.get()->hulls[0].ok());
  EXPECT_EQ(store_.loads, 1);
}

TEST_F(RegistryInterleaving, ManyReadersOfOneHullReadItOnce) {
  ASSERT_TRUE(Append(Open("h", "w"), 1, CubeCorners()).ok());
  DropAll();
  Gate gate;
  store_.before_load.Set([&] { gate.Stop(); });
  std::vector<std::future<absl::StatusOr<Resolved>>> readers;
  readers.push_back(StartResolve({"h"}, {}));
  gate.WaitUntilReached();
  for (int i = 0; i < 3; ++i) readers.push_back(StartResolve({"h", "h"}, {}));
  EXPECT_FALSE(registry_.Resolve(std::vector<std::string>{"h"}, {}, {.may_wait = false}).ok());
  gate.Open();
  for (auto& reader : readers) {
    const auto resolved = reader.get();
    ASSERT_TRUE(resolved.ok());
    EXPECT_EQ(CanonicalOf(*resolved->hulls[0]).facet_count(), 6);
  }
  EXPECT_EQ(store_.loads, 1);
  EXPECT_EQ(registry_.Cache().loads, 1);
}

// While a thread reads a part of a slice, another one reads the rest.
TEST_F(RegistryInterleaving, ManyHullsAreReadByManyThreads) {
  constexpr int kHulls = 300;
  constexpr int kSlice = static_cast<int>(kMaxLookupsPerHold) - 1;
  constexpr int kLost = 7;
  std::vector<std::string> ids;
  std::vector<AppendSession> sessions;
  for (int i = 0; i < kHulls; ++i) {
    ids.push_back(absl::StrCat(absl::Dec(i, absl::kZeroPad4)));
    sessions.push_back(Open(ids.back(), "w"));
    ASSERT_TRUE(Append(sessions.back(), 1, CubeCorners()).ok());
  }
  // Each eviction asks only a few hulls.
  for (int i = 0; i < kHulls; ++i) DropAll();
  store_.Lose(registry_.records().List(ids[kLost], "", 1)->entries[0].record);
  Gate gate;
  store_.before_load.Set([&] { gate.Stop(); });
  auto reader = StartResolve(ids, {});
  gate.WaitUntilReached();
  // Ends only if parts are read concurrently. The reader stopped at the first hull of its part.
  constexpr int kPart = kSlice / 8;
  while (store_.loads < kSlice - kPart + 1) std::this_thread::yield();
  // The points read are stale.
  for (int i = 0; i < kHulls; ++i) {
    ASSERT_EQ(Append(sessions[i], 2, {{100, 0, 0}}).ok(), i != kLost);
  }
  gate.Open();
  const auto resolved = reader.get();
  ASSERT_TRUE(resolved.ok());
  for (int i = 0; i < kHulls; ++i) {
    const absl::StatusOr<HullView>& hull = resolved->hulls[i];
    if (i == kLost) {
      EXPECT_TRUE(absl::IsDataLoss(hull.status()));
      continue;
    }
    ASSERT_TRUE(hull.ok()) << hull.status();
    EXPECT_EQ(hull->record.counts.received, 9);
    EXPECT_EQ(hull->served->high().x(), 100);
  }
  EXPECT_LE(registry_.Holds().max_lookups, kMaxLookupsPerHold);
}

// Hulls that are deleted while many are read are not found, and a reader that waits for one is not
// delayed by a cancelled reader.
TEST_F(RegistryInterleaving, HullsThatAreReadTogetherMayBeDeletedOrAwaited) {
  constexpr int kHulls = 300;
  std::vector<std::string> ids;
  for (int i = 0; i < kHulls; ++i) {
    ids.push_back(absl::StrCat(absl::Dec(i, absl::kZeroPad4)));
    ASSERT_TRUE(Append(Open(ids.back(), "w"), 1, CubeCorners()).ok());
  }
  for (const bool is_cancelled : {false, true}) {
    for (int i = 0; i < kHulls; ++i) DropAll();
    Gate gate;
    store_.before_load.Set([&] { gate.Stop(); });
    auto reader = StartResolve(ids, [=] { return is_cancelled; });
    gate.WaitUntilReached();
    auto other = StartResolve({ids.rbegin(), ids.rend()}, {});
    const std::vector<int> deleted =
        is_cancelled ? std::vector<int>{0, 1} : std::vector<int>{130, 200, 299};
    for (const int i : deleted) EXPECT_TRUE(Delete(ids[i]).ok());
    gate.Open();
    EXPECT_EQ(absl::IsCancelled(reader.get().status()), is_cancelled);
    ASSERT_TRUE(other.get().ok());
    const absl::StatusOr<Resolved> resolved = registry_.Resolve(ids, {});
    ASSERT_TRUE(resolved.ok());
    for (const int i : deleted) {
      EXPECT_TRUE(absl::IsNotFound(resolved->hulls[i].status()));
      ASSERT_TRUE(Append(Open(ids[i], "w"), 1, CubeCorners()).ok());
    }
  }
}

// Cancelled before it reads the next one.
TEST_F(RegistryInterleaving, AReaderOfAFewHullsCanBeCancelled) {
  // Too few for another thread to help.
  constexpr int kHulls = 7;
  std::vector<std::string> ids;
  for (int i = 0; i < kHulls; ++i) {
    ids.push_back(std::to_string(i));
    ASSERT_TRUE(Append(Open(ids.back(), "w"), 1, CubeCorners()).ok());
  }
  for (int i = 0; i < kHulls; ++i) DropAll();
  store_.loads = 0;
  EXPECT_TRUE(absl::IsCancelled(registry_.Resolve(ids, [] { return true; }).status()));
  EXPECT_EQ(store_.loads, 1);
  const absl::StatusOr<Resolved> resolved = registry_.Resolve(ids, {});
  for (const auto& hull : resolved->hulls) EXPECT_TRUE(hull.ok());
  EXPECT_EQ(store_.loads, kHulls);
}

// The points that the reader loaded become stale.
TEST_F(RegistryInterleaving, AWriterDoesNotWaitForAReader) {
  const AppendSession session = Open("h", "w");
  ASSERT_TRUE(Append(session, 1, CubeCorners()).ok());
  for (const bool drop : {false, true}) {
    DropAll();
    Gate gate;
    store_.before_load.Set([&] { gate.Stop(); });
    auto reader = StartResolve({"h"}, {});
    gate.WaitUntilReached();
    const double x = drop ? 200 : 100;
    const uint64_t sequence = drop ? 3 : 2;
    ASSERT_TRUE(Append(session, sequence, {{x, 0, 0}}).ok());
    // The hull is as cold as when the reader found it, but another version.
    if (drop) DropAll();
    gate.Open();
    const auto resolved = reader.get();
    ASSERT_TRUE(resolved.ok());
    EXPECT_EQ(resolved->hulls[0]->record.counts.received, 7 + sequence);
    EXPECT_EQ(resolved->hulls[0]->served->high().x(), x);
    EXPECT_EQ(CanonicalOf(*resolved->hulls[0]).vertices().size(),
              resolved->hulls[0]->record.vertex_count);
  }
}

TEST_F(RegistryInterleaving, AReaderDoesNotWaitForAWriterThatReads) {
  const AppendSession session = Open("h", "w");
  ASSERT_TRUE(Append(session, 1, CubeCorners()).ok());
  DropAll();
  Gate gate;
  store_.before_load.Set([&] { gate.Stop(); });
  auto chunk = StartAppend(session, 2, {{100, 0, 0}});
  gate.WaitUntilReached();
  const auto resolved = StartResolve({"h"}, {}).get();
  ASSERT_TRUE(resolved.ok());
  EXPECT_EQ(resolved->hulls[0]->served->high().x(), 1);
  gate.Open();
  ASSERT_TRUE(chunk.get().ok());
  EXPECT_EQ(registry_.Resolve("h", {})->second.served->high().x(), 100);
}

TEST_F(RegistryInterleaving, UncommittedChangesAreInvisible) {
  const AppendSession session = Open("h", "w");
  ASSERT_TRUE(Append(session, 1, CubeCorners()).ok());
  uint64_t sequence = 2;
  for (const bool fails : {true, false, true, true, false}) {
    const HullView before = registry_.Resolve("h", {})->second;
    Gate gate;
    store_.before_commit.Set([&]() -> absl::Status {
      gate.Stop();
      return fails ? absl::UnavailableError("the disk is temporarily unavailable")
                   : absl::OkStatus();
    });
    const auto x = static_cast<double>(sequence);
    // Two are in flight, the second built on the first.
    auto first = StartAppend(session, sequence, {{x, 0, 0}});
    gate.WaitUntilReached();
    std::promise<void> built;
    auto second = StartAppend(session, sequence + 1, {{x + 1, 0, 0}}, [&] { built.set_value(); });
    built.get_future().wait();
    for (const bool canonical : {false, true}) {
      const HullView now = registry_.Resolve("h", {})->second;
      EXPECT_EQ(now.record, before.record);
      EXPECT_EQ(now.served->high(), before.served->high());
      if (!canonical) continue;
      EXPECT_EQ(CanonicalOf(now).vertices().size(), now.record.vertex_count);
    }
    gate.Open();
    EXPECT_EQ(first.get().ok(), !fails);
    EXPECT_EQ(second.get().ok(), !fails);
    const HullView after = registry_.Resolve("h", {})->second;
    EXPECT_EQ(after.served->high().x(), fails ? before.served->high().x() : x + 1);
    EXPECT_EQ(CanonicalOf(after).vertices().size(), after.record.vertex_count);
    if (!fails) sequence += 2;
  }
}

TEST_F(RegistryInterleaving, AHullThatIsDeletedWhileItIsReadIsNotFound) {
  ASSERT_TRUE(Append(Open("h", "w"), 1, CubeCorners()).ok());
  DropAll();
  Gate gate;
  store_.before_load.Set([&] { gate.Stop(); });
  auto reader = StartResolve({"h"}, {});
  gate.WaitUntilReached();
  ASSERT_TRUE(Delete("h").ok());
  gate.Open();
  EXPECT_TRUE(absl::IsNotFound(reader.get()->hulls[0].status()));
  EXPECT_EQ(registry_.Cache().damaged, 0);
}

// The store has deleted the points, and the registry has not applied the deletion yet.
TEST_F(RegistryInterleaving, AHullBeingDeletedIsNotReportedDamaged) {
  ASSERT_TRUE(Append(Open("h", "w"), 1, CubeCorners()).ok());
  DropAll();
  Gate gate;
  store_.after_commit.Set([&] { gate.Stop(); });
  auto deleted = std::async(std::launch::async, [&] { return Delete("h"); });
  gate.WaitUntilReached();
  EXPECT_TRUE(absl::IsCancelled(registry_.Resolve("h", [] { return true; }).status()));
  const int loads = store_.loads;
  auto reader = StartResolve({"h"}, {});
  while (store_.loads == loads) std::this_thread::yield();
  gate.Open();
  EXPECT_TRUE(deleted.get().ok());
  EXPECT_TRUE(absl::IsNotFound(reader.get()->hulls[0].status()));
  EXPECT_EQ(registry_.Cache().damaged, 0);
}

TEST_F(RegistryInterleaving, AHullThatIsReplacedWhileItIsReadIsTheNewOne) {
  ASSERT_TRUE(Append(Open("h", "w"), 1, CubeCorners()).ok());
  DropAll();
  Gate gate;
  store_.before_load.Set([&] { gate.Stop(); });
  auto reader = StartResolve({"h"}, {});
  gate.WaitUntilReached();
  Replacement replacement;
  replacement.hull_id = "h";
  replacement.builder = std::make_shared<HullBuilder>();
  replacement.counts = *replacement.builder->Add(CubeCorners(5, 1));
  ASSERT_TRUE(DurableRegistry::Wait<PutHullResult>([&](const Reply<PutHullResult>& done) {
                registry_.changes().Replace(std::move(replacement), done);
              }).ok());
  gate.Open();
  const auto resolved = reader.get();
  ASSERT_TRUE(resolved->hulls[0].ok()) << resolved->hulls[0].status();
  EXPECT_EQ(resolved->hulls[0]->served->low(), Vector(5, 5, 5));
}

TEST_F(RegistryInterleaving, PointsThatTheStoreLostAreDamageForReadersAndWriters) {
  const AppendSession session = Open("h", "w");
  ASSERT_TRUE(Append(session, 1, CubeCorners()).ok());
  DropAll();
  store_.Lose(registry_.records().List("", "", 1)->entries[0].record);
  EXPECT_TRUE(absl::IsDataLoss(registry_.Resolve("h", {}).status()));
  EXPECT_TRUE(absl::IsDataLoss(Append(session, 2, {{9, 9, 9}}).status()));
  EXPECT_EQ(registry_.Cache().damaged, 1);
  EXPECT_TRUE(Delete("h").ok());
}

// All are in one plane.
TEST_F(RegistryInterleaving, PointsOfAnotherDimensionAreDamage) {
  const AppendSession session = Open("h", "w");
  ASSERT_TRUE(Append(session, 1, CubeCorners()).ok());
  DropAll();
  store_.Flatten(registry_.records().List("", "", 1)->entries[0].record);
  EXPECT_TRUE(absl::IsDataLoss(registry_.Resolve("h", {}).status()));
  EXPECT_TRUE(absl::IsDataLoss(Append(session, 2, {{9, 9, 9}}).status()));
}

// The loaded points form a different hull than recorded, which the builder detects.
TEST_F(RegistryInterleaving, PointsThatMakeAnotherHullAreDamage) {
  for (const bool by_writer : {false, true}) {
    const std::string id = by_writer ? "writer" : "reader";
    const AppendSession session = Open(id, "w");
    ASSERT_TRUE(Append(session, 1, CubeCorners()).ok());
    DropAll();
    store_.Dent(registry_.Resolve(id, {})->second.record);
    DropAll();
    const HullView view = registry_.Resolve(id, {})->second;
    const absl::Status found = by_writer ? Append(session, 2, {{9, 9, 9}}).status()
                                         : registry_.reader().Canonical(view, {}).status();
    EXPECT_TRUE(absl::IsDataLoss(found)) << found;
    EXPECT_TRUE(absl::IsDataLoss(registry_.Resolve(id, {}).status()));
    EXPECT_TRUE(absl::IsDataLoss(Append(session, 2, {{9, 9, 9}}).status()));
    EXPECT_TRUE(Delete(id).ok());
  }
}

TEST_F(RegistryInterleaving, ASequenceReadDuringACommitIsTheNewerOne) {
  const AppendSession first = Open("h", "w");
  ASSERT_TRUE(Append(first, 1, {{0, 0, 0}}).ok());
  registry_.changes().CloseAppend(first);
  store_.after_load_sequence.Set([this] {
    const OpenResult other = OpenResultOf("h", "w");
    EXPECT_EQ(other.last_sequence, 1);
    EXPECT_TRUE(Append(other.session, 2, {{1, 0, 0}}).ok());
    registry_.changes().CloseAppend(other.session);
  });
  const OpenResult opened = OpenResultOf("h", "w");
  EXPECT_EQ(opened.last_sequence, 2);
  const absl::StatusOr<ChunkResult> repeated = Append(opened.session, 2, {{1, 0, 0}});
  ASSERT_TRUE(repeated.ok()) << repeated.status();
  EXPECT_TRUE(repeated->already_applied);
  registry_.changes().CloseAppend(opened.session);
}

// The chunk is queued on a thread, not yet started, when the batch before it fails. The store has
// the deletion before the registry: a writer's sequence read at that point belongs to no hull.
TEST_F(RegistryInterleaving, ASequenceReadDuringADeletionIsNotThatOfTheHull) {
  const OpenResult first = OpenResultOf("h", "w");
  ASSERT_TRUE(Append(first.session, 1, CubeCorners()).ok());
  registry_.changes().CloseAppend(first.session);
  // One of two threads is busy, so tasks submitted after the opening run after it.
  Gate busy, reads, committed;
  writers_.Submit([&] { busy.Stop(); });
  busy.WaitUntilReached();
  store_.before_load_sequence.Set([&] { reads.Stop(); });
  std::promise<absl::StatusOr<OpenResult>> opened;
  registry_.changes().OpenAppend(
      "h", "w", true, [](const absl::Status&) {},
      [&](absl::StatusOr<OpenResult> result) { opened.set_value(std::move(result)); });
  reads.WaitUntilReached();
  store_.after_commit.Set([&] { committed.Stop(); });
  auto deleted = std::async(std::launch::async, [&] { return Delete("h"); });
  committed.WaitUntilReached();
  reads.Open();
  std::promise<void> went_on;
  writers_.Submit([&] { went_on.set_value(); });
  went_on.get_future().wait();
  committed.Open();
  busy.Open();
  EXPECT_TRUE(deleted.get().ok());
  const absl::StatusOr<OpenResult> second = opened.get_future().get();
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(second->last_sequence, 0);
  EXPECT_GT(second->hull.create_revision, first.hull.create_revision);
}

TEST_F(RegistryInterleaving, AChunkIsNotBuiltOnOneThatWasRefused) {
  const AppendSession refused = Open("h", "refused");
  const AppendSession kept = Open("h", "kept");
  std::promise<void> committing;
  std::promise<void> fail;
  store_.before_commit.Set([&]() -> absl::Status {
    committing.set_value();
    fail.get_future().wait();
    return absl::UnavailableError("the disk is temporarily unavailable");
  });
  auto first = StartAppend(refused, 1, {{0, 0, 0}});
  committing.get_future().wait();
  std::promise<void> go;
  const std::shared_future<void> gone = go.get_future().share();
  for (int thread = 0; thread < 2; ++thread) writers_.Submit([gone] { gone.wait(); });
  auto second = StartAppend(kept, 1, {{1, 0, 0}});
  fail.set_value();
  EXPECT_TRUE(absl::IsUnavailable(first.get().status()));
  go.set_value();
  const absl::StatusOr<ChunkResult> result = second.get();
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->vertex_count, 1);
  EXPECT_EQ(registry_.Resolve("h", {})->second.record.counts.received, 1);
}

}  // namespace registry_interleaving_test
}  // namespace hulld::server
