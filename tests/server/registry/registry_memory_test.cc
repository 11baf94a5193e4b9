// Memory as a cache of the store.

#include <atomic>
#include <future>
#include <optional>
#include <thread>
#include <utility>

#include "server/store/memory_store.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace registry_memory_test {

using ::testing::HasSubstr;

class RegistryMemory : public StoreTest {};

TEST_F(RegistryMemory, HullsAreReadAtFirstUse) {
  Start();
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(hulls_->Put(std::to_string(i), CubeCorners()).ok());
  Start();
  EXPECT_EQ(hulls_->registry().Cache().bytes, 0);
  EXPECT_EQ(hulls_->registry().records().List("", "", 100)->entries.size(), 10);
  EXPECT_EQ(hulls_->registry().Cache().loads, 0);
  ASSERT_TRUE(hulls_->View("3").ok());
  EXPECT_EQ(hulls_->registry().Cache().loads, 1);
  EXPECT_EQ(hulls_->registry().Cache().misses, 1);
  EXPECT_GT(hulls_->registry().Cache().bytes, 0);
  ASSERT_TRUE(hulls_->View("3").ok());
  EXPECT_EQ(hulls_->registry().Cache().loads, 1);
  EXPECT_EQ(hulls_->registry().Cache().hits, 1);
}

TEST_F(RegistryMemory, EachOfManyHullsIsReadOnce) {
  Start();
  std::vector<std::string> ids;
  for (int i = 0; i < 500; ++i) {
    ids.push_back(std::to_string(i));
    ASSERT_TRUE(hulls_->Put(ids.back(), CubeCorners()).ok());
  }
  Start();
  Registry& registry = hulls_->registry();
  ASSERT_TRUE(registry.Resolve("250", {}).ok());
  ids.push_back("17");
  ids.push_back("missing");
  for (int round = 0; round < 2; ++round) {
    const absl::StatusOr<Resolved> resolved = registry.Resolve(ids, {});
    ASSERT_TRUE(resolved.ok());
    for (size_t i = 0; i < ids.size(); ++i) {
      ASSERT_EQ(resolved->hulls[i].ok(), ids[i] != "missing");
      if (!resolved->hulls[i].ok()) continue;
      EXPECT_EQ(resolved->hulls[i]->record.hull_id, ids[i]);
    }
    EXPECT_EQ(registry.Cache().loads, 500);
    EXPECT_EQ(registry.Cache().misses, 500);
    EXPECT_EQ(registry.Cache().hits, round == 0 ? 1 : 501);
  }
  EXPECT_LE(registry.Holds().max_lookups, kMaxLookupsPerHold);
}

TEST_F(RegistryMemory, AHullThatIsOnlyReadNeedsNoBuilder) {
  Start();
  const std::vector<Vector> sphere = SpherePoints(2000);
  ASSERT_TRUE(hulls_->Put("h", sphere).ok());
  HullBuilder builder;
  ASSERT_TRUE(builder.Add(sphere).ok());
  EXPECT_GT(hulls_->registry().Cache().bytes, builder.MemoryBytes());
  Start();
  const std::vector<std::string> ids = {"h"};
  EXPECT_FALSE(hulls_->registry().Resolve(ids, {}, {.may_wait = false}).ok());
  EXPECT_EQ(hulls_->registry().Cache().hits, 0);
  const HullView view = *hulls_->View("h");
  EXPECT_EQ(view.served->canonical(), nullptr);
  EXPECT_EQ(view.served->query_hull().point_count(), 2000);
  EXPECT_LT(hulls_->registry().Cache().bytes, builder.MemoryBytes() / 2);
  EXPECT_TRUE(hulls_->registry().Resolve(ids, {}, {.may_wait = false}).ok());
  // A writer continues with the points that the reader loaded.
  ASSERT_TRUE(hulls_->Put("h", {{2, 0, 0}}).ok());
  EXPECT_EQ(hulls_->registry().Cache().loads, 1);
  EXPECT_EQ(hulls_->View("h")->served->high(),
            Vector(2, view.served->high().y(), view.served->high().z()));
}

TEST_F(RegistryMemory, ACanonicalSnapshotCountsAndIsDropped) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", SpherePoints(2000)).ok());
  Start();
  Registry& registry = hulls_->registry();
  {
    const HullView view = *hulls_->View("h");
    const uint64_t before = registry.Cache().bytes;
    ASSERT_TRUE(registry.reader().Canonical(view, {}).ok());
    EXPECT_GE(registry.Cache().bytes, before + view.served->canonical()->MemoryBytes());
    EXPECT_GE(registry.Cache().reading_bytes, view.served->canonical()->MemoryBytes());
    // Derived data that queries need is added.
    const uint64_t without = registry.Cache().reading_bytes;
    view.served->canonical_query_hull();
    EXPECT_GT(registry.Cache().reading_bytes, without);
  }
  EXPECT_EQ(registry.Cache().reading_bytes, 0);
  const MemoryCharge charge(registry.memory(), MemoryUse::kReading, registry.Cache().limit_bytes);
  EXPECT_TRUE(registry.CheckMemory(MemoryUse::kWriting).ok());
  EXPECT_EQ(registry.Cache().bytes, registry.Cache().limit_bytes);
}

// Two hulls do not fit together. Without this, a reader of both would load one after the other
// forever: each is prepared while the other is loaded, and so looked up again.
TEST_F(RegistryMemory, APinnedVersionIsNotReadAgain) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", SpherePoints(2000)).ok());
  Start();
  Registry& registry = hulls_->registry();
  const std::vector<std::string> ids = {"h"};
  const ReadPlan plan = {.expected_queries = 1'000'000};
  KnownHulls known;
  const absl::StatusOr<Resolved> first = registry.reader().Refresh(ids, known, {}, plan);
  ASSERT_TRUE(first.ok() && first->hulls[0].ok());
  const auto is_prepared = [&] { return hulls_->View("h")->served != first->hulls[0]->served; };
  for (int i = 0; i < 100'000 && !is_prepared(); ++i) std::this_thread::yield();
  ASSERT_TRUE(is_prepared());
  {
    const MemoryCharge charge(registry.memory(), MemoryUse::kReading, registry.Cache().limit_bytes);
    EXPECT_TRUE(registry.CheckMemory(MemoryUse::kWriting).ok());
  }
  ASSERT_FALSE(registry.Resolve(ids, {}, {.may_wait = false}).ok());
  const uint64_t loads = registry.Cache().loads;
  const absl::StatusOr<Resolved> second = registry.reader().Refresh(ids, known, {}, plan);
  ASSERT_TRUE(second.ok() && second->hulls[0].ok());
  EXPECT_EQ(registry.Cache().loads, loads);
  EXPECT_EQ(second->hulls[0]->served, first->hulls[0]->served);
  // A change causes a read.
  ASSERT_TRUE(hulls_->Put("h", {{2, 0, 0}}).ok());
  EXPECT_EQ(registry.reader().Refresh(ids, known, {}, plan)->hulls[0]->served->high().x(), 2);
}

TEST_F(RegistryMemory, TheLeastRecentlyUsedHullIsDropped) {
  Limits limits;
  limits.memory_limit = 3 << 20;
  Start(limits);
  const std::vector<Vector> sphere = SpherePoints(2000);
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(hulls_->Put(std::to_string(i), sphere).ok());
    EXPECT_LE(hulls_->registry().Cache().bytes, limits.memory_limit);
  }
  EXPECT_GT(hulls_->registry().Cache().evictions, 0);
  const uint64_t loads = hulls_->registry().Cache().loads;
  ASSERT_TRUE(hulls_->View("19").ok());
  EXPECT_EQ(hulls_->registry().Cache().loads, loads);
  ASSERT_TRUE(hulls_->View("0").ok());
  EXPECT_EQ(hulls_->registry().Cache().loads, loads + 1);
  // An evicted hull continues as if it had stayed.
  ASSERT_TRUE(hulls_->Put("1", {{3, 3, 3}}).ok());
  EXPECT_EQ(hulls_->View("1")->record.counts.received, 2001);
}

TEST_F(RegistryMemory, PinnedVersionsStay) {
  Limits limits;
  limits.memory_limit = 1 << 20;
  Start(limits);
  ASSERT_TRUE(hulls_->Put("held", SpherePoints(1000)).ok());
  const HullView held = *hulls_->View("held");
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(hulls_->Put(std::to_string(i), SpherePoints(1000)).ok());
  }
  const uint64_t loads = hulls_->registry().Cache().loads;
  EXPECT_EQ(hulls_->View("held")->served, held.served);
  EXPECT_EQ(hulls_->registry().Cache().loads, loads);
}

TEST_F(RegistryMemory, ReadersAndWritersContinueUnderASmallLimit) {
  Limits limits;
  limits.memory_limit = 2 << 20;
  Start(limits);
  constexpr int kHulls = 8;
  const std::vector<Vector> sphere = SpherePoints(1200);
  std::atomic<bool> ending = false;
  std::vector<std::thread> readers;
  readers.reserve(2);
  for (int r = 0; r < 2; ++r) {
    readers.emplace_back([&, r] {
      for (int i = r; !ending; ++i) {
        const auto view = hulls_->View(std::to_string(i % kHulls));
        if (!view.ok()) {
          EXPECT_EQ(view.status().code(), absl::StatusCode::kNotFound) << view.status();
          continue;
        }
        EXPECT_EQ(CanonicalOf(*view).vertices().size(), view->record.vertex_count);
      }
    });
  }
  for (int round = 0; round < 12; ++round) {
    for (int h = 0; h < kHulls; ++h) {
      const auto first = sphere.begin() + round * 100;
      const auto result = hulls_->Put(std::to_string(h), {first, first + 100});
      ASSERT_TRUE(result.ok()) << result.status();
    }
  }
  ending = true;
  for (std::thread& reader : readers) reader.join();
  for (int h = 0; h < kHulls; ++h) {
    EXPECT_EQ(hulls_->View(std::to_string(h))->record.vertex_count, 1200);
  }
  // All builders and served versions together exceed the limit.
  EXPECT_GT(hulls_->registry().Cache().evictions, 0);
}

TEST(RegistryOfMemoryStore, RefusesToGrowBeyondTheLimit) {
  MemoryStore store;
  TaskPool writers(2);
  Limits limits;
  limits.memory_limit = 100'000;
  Registry registry(store, limits, writers);
  const auto put = [&](const std::string& id) {
    const auto opened = DurableRegistry::Wait<OpenResult>([&](Reply<OpenResult> done) {
      registry.changes().OpenAppend(
          id, "w", true, [](const absl::Status&) {}, std::move(done));
    });
    return DurableRegistry::Wait<ChunkResult>([&](Reply<ChunkResult> done) {
      registry.changes().Append(opened->session, {1, SpherePoints(1000), std::nullopt}, {}, {},
                                std::move(done));
    });
  };
  ASSERT_TRUE(put("first").ok());
  const auto second = put("second");
  EXPECT_EQ(second.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr("--memory-limit"));
  EXPECT_EQ(CanonicalOf(registry.Resolve("first", {})->second).vertices().size(), 1000);
}

// Points waiting for their turn, and their size after building.
TEST(RegistryOfMemoryStore, WaitingPointsCount) {
  MemoryStore store;
  TaskPool writers(2);
  Registry registry(store, Limits(), writers);
  const auto opened = DurableRegistry::Wait<OpenResult>([&](Reply<OpenResult> done) {
    registry.changes().OpenAppend(
        "h", "w", true, [](const absl::Status&) {}, std::move(done));
  });
  std::vector<Vector> line;
  line.reserve(20'000);
  for (int i = 0; i < 20'000; ++i) line.emplace_back(i, 0, 0);
  const uint64_t line_bytes = line.size() * sizeof(Vector);
  const std::vector<Vector> waiting(3000, Vector(1, 2, 3));
  std::promise<absl::StatusOr<ChunkResult>> next;
  bool was_polled = false;
  // While the first chunk is built.
  const auto should_stop = [&] {
    if (std::exchange(was_polled, true)) return false;
    const uint64_t before = registry.Cache().bytes;
    EXPECT_EQ(before, line_bytes);
    registry.changes().Append(
        opened->session, {2, waiting, std::nullopt}, {}, {},
        [&](absl::StatusOr<ChunkResult> result) { next.set_value(std::move(result)); });
    EXPECT_EQ(registry.Cache().bytes, before + waiting.size() * sizeof(Vector));
    return false;
  };
  const auto first = DurableRegistry::Wait<ChunkResult>([&](Reply<ChunkResult> done) {
    registry.changes().Append(opened->session, {1, line, std::nullopt}, should_stop, {},
                              std::move(done));
  });
  EXPECT_TRUE(first.ok());
  EXPECT_TRUE(was_polled);
  EXPECT_TRUE(next.get_future().get().ok());
  // Only the builder, with the points that became vertices, remains.
  HullBuilder builder;
  LiveHull live;
  for (const std::vector<Vector>& points : {line, waiting}) {
    ASSERT_TRUE(builder.Add(points).ok());
    live.Append(builder.NewVertices(), builder.dimension());
  }
  EXPECT_EQ(registry.Cache().bytes, builder.MemoryBytes() + live.MemoryBytes());
}

TEST(RegistryOfMemoryStore, RefusedPointsNoLongerCount) {
  MemoryStore store;
  TaskPool writers(2);
  Limits limits;
  limits.memory_limit = 10'000;
  Registry registry(store, limits, writers);
  const auto opened = DurableRegistry::Wait<OpenResult>([&](Reply<OpenResult> done) {
    registry.changes().OpenAppend(
        "h", "w", true, [](const absl::Status&) {}, std::move(done));
  });
  const auto append = [&](size_t points) {
    return DurableRegistry::Wait<ChunkResult>([&](Reply<ChunkResult> done) {
      registry.changes().Append(opened->session,
                                {1, std::vector<Vector>(points, Vector(1, 2, 3)), {}}, {}, {},
                                std::move(done));
    });
  };
  EXPECT_EQ(append(1000).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(registry.Cache().bytes, 0);
  EXPECT_TRUE(append(100).ok());
}

TEST(RegistryOfMemoryStore, MemoryHeldByCallsCountsUntilTheyEnd) {
  MemoryStore store;
  TaskPool writers(2);
  Limits limits;
  limits.memory_limit = 100'000;
  Registry registry(store, limits, writers);
  {
    MemoryCharge charge(registry.memory(), MemoryUse::kWriting);
    charge.Set(75'000);
    EXPECT_TRUE(registry.CheckMemory(MemoryUse::kWriting).ok());
    charge.Set(75'001);
    EXPECT_EQ(registry.CheckMemory(MemoryUse::kWriting).code(),
              absl::StatusCode::kResourceExhausted);
    EXPECT_TRUE(registry.CheckMemory(MemoryUse::kReading).ok());
    charge.Set(60'000);
    EXPECT_TRUE(registry.CheckMemory(MemoryUse::kWriting).ok());
    EXPECT_EQ(registry.Cache().bytes, 60'000);
    MemoryCharge other(registry.memory(), MemoryUse::kReading);
    other.Set(25'001);
    EXPECT_THAT(std::string(registry.CheckMemory(MemoryUse::kReading).message()),
                HasSubstr("--memory-limit"));
    EXPECT_TRUE(registry.CheckMemory(MemoryUse::kWriting).ok());
  }
  EXPECT_EQ(registry.Cache().bytes, 0);
}

// A batch that names every hull, although only some fit into the readers' share.
TEST_F(RegistryMemory, MoreColdHullsThanReadersMayHoldAreRefusedWhileAppendsContinue) {
  Limits limits;
  limits.memory_limit = 2 << 20;
  Start(limits);
  const std::vector<Vector> sphere = SpherePoints(2000);
  std::vector<std::string> ids;
  for (int i = 0; i < 40; ++i) {
    ids.push_back(std::to_string(i));
    ASSERT_TRUE(hulls_->Put(ids.back(), sphere).ok());
  }
  Start(limits);
  Registry& registry = hulls_->registry();
  const std::vector<std::string> few(ids.begin(), ids.begin() + 5);
  const absl::StatusOr<Resolved> held = registry.Resolve(few, {});
  ASSERT_TRUE(held.ok()) << held.status();
  EXPECT_GT(registry.Cache().reading_bytes, 5 * 2000 * sizeof(Vector));
  const absl::Status refused = registry.Resolve(ids, {}).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("--memory-limit"));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("request fewer hulls"));
  EXPECT_LT(registry.Cache().loads, 30);
  EXPECT_LE(registry.Cache().bytes, limits.memory_limit);
  // The hulls that were refused are free again; held ones are served, and writers continue.
  EXPECT_TRUE(registry.Resolve(few, {}).ok());
  EXPECT_TRUE(hulls_->Put("39", {{5, 5, 5}}).ok());
  EXPECT_TRUE(hulls_->Put("0", {{5, 5, 5}}).ok());
  EXPECT_TRUE(hulls_->Put("new", sphere).ok());
  EXPECT_TRUE(hulls_->View("38").ok());
}

// A stream, for example, that never refreshes: its versions count until released, whatever happens
// to the hull.
TEST_F(RegistryMemory, AVersionThatAReaderHoldsCountsUntilItIsReleased) {
  Start();
  Registry& registry = hulls_->registry();
  const std::vector<Vector> sphere = SpherePoints(2000);
  for (const bool deleted : {false, true}) {
    SCOPED_TRACE(deleted);
    ASSERT_TRUE(hulls_->Put("h", sphere).ok());
    std::optional<HullView> view = *hulls_->View("h");
    ASSERT_TRUE(registry.reader().Canonical(*view, {}).ok());
    const uint64_t held = registry.Cache().reading_bytes;
    EXPECT_GT(held, view->record.vertex_count * sizeof(Vector) +
                        view->served->canonical()->MemoryBytes());
    // Another version, then another LiveHull, then neither.
    ASSERT_TRUE(hulls_->Put("h", {{3. + deleted, 0, 0}}).ok());
    EXPECT_EQ(registry.Cache().reading_bytes, held);
    if (deleted) {
      ASSERT_TRUE(hulls_->Delete("h").ok());
      EXPECT_EQ(registry.Cache().bytes, held);
    } else {
      Replacement replacement;
      replacement.hull_id = "h";
      replacement.builder = std::make_shared<HullBuilder>();
      replacement.counts = *replacement.builder->Add(CubeCorners());
      ASSERT_TRUE(hulls_->Replace(std::move(replacement)).ok());
    }
    EXPECT_EQ(registry.Cache().reading_bytes, held);
    view.reset();
    EXPECT_EQ(registry.Cache().reading_bytes, 0);
  }
  EXPECT_EQ(registry.Cache().bytes, 0);
}

// Versions of a hull share most of their data, which is counted only once.
TEST_F(RegistryMemory, SharedMemoryOfVersionsCountsOnce) {
  Start();
  Registry& registry = hulls_->registry();
  ASSERT_TRUE(hulls_->Put("h", SpherePoints(2000)).ok());
  std::vector<HullView> views = {*hulls_->View("h")};
  const uint64_t one = registry.Cache().reading_bytes;
  for (int i = 1; i <= 50; ++i) {
    ASSERT_TRUE(hulls_->Put("h", {{1. + i, 0, 0}}).ok());
    views.push_back(*hulls_->View("h"));
  }
  EXPECT_LT(registry.Cache().reading_bytes, one + one / 2);
  views.clear();
  EXPECT_EQ(registry.Cache().reading_bytes, 0);
}

// A view may outlive the registry.
TEST_F(RegistryMemory, AVersionMayOutliveTheRegistry) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  const HullView view = *hulls_->View("h");
  hulls_ = nullptr;
  EXPECT_EQ(CanonicalOf(view).vertices().size(), 8);
}

TEST_F(RegistryMemory, IdleStreamsRefuseNoAppendsAndWritersNoStreams) {
  Limits limits;
  limits.memory_limit = 2 << 20;
  Start(limits);
  Registry& registry = hulls_->registry();
  {
    const MemoryCharge idle(registry.memory(), MemoryUse::kReading, 100 << 20);
    EXPECT_EQ(registry.CheckMemory(MemoryUse::kReading).code(),
              absl::StatusCode::kResourceExhausted);
    for (int i = 0; i < 20; ++i) {
      const auto put = hulls_->Put(std::to_string(i), SpherePoints(500));
      EXPECT_TRUE(put.ok()) << put.status();
    }
    // Cold hulls are refused; hulls in memory are served.
    EXPECT_TRUE(hulls_->Create("empty").ok());
    EXPECT_TRUE(hulls_->View("empty").ok());
    const absl::Status refused = hulls_->View("0").status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
    EXPECT_THAT(std::string(refused.message()), HasSubstr("readers use"));
  }
  const MemoryCharge busy(registry.memory(), MemoryUse::kWriting, 100 << 20);
  EXPECT_EQ(hulls_->Put("0", CubeCorners()).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(registry.CheckMemory(MemoryUse::kReading).ok());
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(hulls_->View(std::to_string(i)).ok());
}

TEST_F(RegistryMemory, AReplacementCountsWhileItIsStoredAndAsAHullAfterwards) {
  Start();
  Replacement replacement;
  replacement.hull_id = "h";
  replacement.create_if_absent = true;
  replacement.builder = std::make_shared<HullBuilder>();
  replacement.counts = *replacement.builder->Add(SpherePoints(1000));
  const LiveHull live(replacement.builder->Vertices(), 3);
  const uint64_t bytes = replacement.builder->MemoryBytes() + live.MemoryBytes();
  ASSERT_TRUE(hulls_->Replace(std::move(replacement)).ok());
  EXPECT_EQ(hulls_->registry().Cache().bytes, bytes);
}

TEST(RegistryOfMemoryStore, ASmallHullHasABuilderOnlyWhileASessionIsOpen) {
  MemoryRegistry hulls(std::make_unique<MemoryStore>());
  const auto bytes = [&] { return hulls.registry().Cache().bytes; };
  Replacement replacement;
  replacement.hull_id = "h";
  replacement.create_if_absent = true;
  replacement.builder = std::make_shared<HullBuilder>();
  replacement.counts = *replacement.builder->Add(CubeCorners());
  ASSERT_TRUE(hulls.Replace(std::move(replacement)).ok());
  LiveHull live(CubeCorners(), 3);
  EXPECT_EQ(bytes(), live.MemoryBytes());
  const absl::StatusOr<OpenResult> opened = hulls.Open("h");
  ASSERT_TRUE(opened.ok());
  ASSERT_TRUE(hulls.Append(opened->session, 1, {{2, 0, 0}}).ok());
  live.Append(std::vector<Vector>{{2, 0, 0}}, 3);
  EXPECT_GT(bytes(), live.MemoryBytes() + HullBuilder().MemoryBytes());
  hulls.registry().changes().CloseAppend(opened->session);
  EXPECT_EQ(bytes(), live.MemoryBytes());
  // The next session continues from there.
  EXPECT_EQ(hulls.Put("h", {{3, 0, 0}, {0, 0, 0}})->counts, (PointCounts{2, 1, 1, 0}));
}

TEST(RegistryOfMemoryStore, AnIdleHullReturnsUnchanged) {
  MemoryRegistry hulls(std::make_unique<MemoryStore>());
  Registry& registry = hulls.registry();
  ASSERT_TRUE(hulls.Put("h", CubeCorners()).ok());
  ASSERT_TRUE(hulls.Put("h", {{2, 0, 0}}).ok());
  const HullRecord record = hulls.View("h")->record;
  const uint64_t awake = registry.Cache().bytes;
  // Threads of the last change may hold the hull a little longer.
  while (registry.Cache().bytes >= awake / 2) registry.RestIdleHulls();
  EXPECT_GE(registry.Cache().writing_bytes, 9 * sizeof(Vector));
  EXPECT_EQ(registry.records().List("", "", 10)->entries.front().record, record);
  const HullView view = *hulls.View("h");
  EXPECT_EQ(view.record, record);
  EXPECT_EQ(CanonicalOf(view).vertices().size(), record.vertex_count);
  for (int i = 0; i < 2; ++i) registry.RestIdleHulls();
  // The writer's sequence is still known, and so is the hull.
  EXPECT_EQ(hulls.Open("h")->last_sequence, 2);
  EXPECT_EQ(hulls.Put("h", {{0.5, 0.5, 0.5}})->counts, (PointCounts{1, 0, 0, 1}));
}

TEST_F(RegistryMemory, AnIdleHullIsNotReadAgain) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  Registry& registry = hulls_->registry();
  for (int i = 0; i < 2; ++i) registry.RestIdleHulls();
  EXPECT_GT(registry.Cache().bytes, 0);
  const std::vector<std::string> ids = {"h"};
  EXPECT_TRUE(registry.Resolve(ids, {}, {.may_wait = false}).ok());
  EXPECT_EQ(registry.Cache().loads, 0);
  EXPECT_EQ(hulls_->View("h")->record.vertex_count, 8);
}

}  // namespace registry_memory_test
}  // namespace hulld::server
