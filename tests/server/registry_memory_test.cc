// Memory as a cache of the store.

#include <atomic>
#include <thread>

#include "server/memory_store.h"
#include "tests/server/store_fixture.h"

namespace hulld::server {
namespace {

using ::testing::HasSubstr;

class RegistryMemory : public StoreTest {};

TEST_F(RegistryMemory, HullsAreReadAtFirstUse) {
  Start();
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(hulls_->Put(std::to_string(i), CubeCorners()).ok());
  Start();
  EXPECT_EQ(hulls_->registry().Cache().bytes, 0);
  EXPECT_EQ(hulls_->registry().List("", "", 100).hulls.size(), 10);
  EXPECT_EQ(hulls_->registry().Cache().loads, 0);
  ASSERT_TRUE(hulls_->View("3").ok());
  EXPECT_EQ(hulls_->registry().Cache().loads, 1);
  EXPECT_EQ(hulls_->registry().Cache().misses, 1);
  EXPECT_GT(hulls_->registry().Cache().bytes, 0);
  ASSERT_TRUE(hulls_->View("3").ok());
  EXPECT_EQ(hulls_->registry().Cache().loads, 1);
  EXPECT_EQ(hulls_->registry().Cache().hits, 1);
}

TEST_F(RegistryMemory, TheHullNotUsedForLongestIsDropped) {
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
  // A dropped hull goes on as if it had stayed.
  ASSERT_TRUE(hulls_->Put("1", {{3, 3, 3}}).ok());
  EXPECT_EQ(hulls_->View("1")->record.counts.received, 2001);
}

TEST_F(RegistryMemory, WhatAReaderHoldsStays) {
  Limits limits;
  limits.memory_limit = 1 << 20;
  Start(limits);
  ASSERT_TRUE(hulls_->Put("held", SpherePoints(1000)).ok());
  const HullView held = *hulls_->View("held");
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(hulls_->Put(std::to_string(i), SpherePoints(1000)).ok());
  }
  const uint64_t loads = hulls_->registry().Cache().loads;
  EXPECT_EQ(hulls_->View("held")->snapshot, held.snapshot);
  EXPECT_EQ(hulls_->registry().Cache().loads, loads);
}

TEST_F(RegistryMemory, ReadersAndWritersGoOnUnderASmallLimit) {
  Limits limits;
  limits.memory_limit = 2 << 20;
  Start(limits);
  constexpr int kHulls = 8;
  const std::vector<Vector> sphere = SpherePoints(1200);
  std::atomic<bool> ending = false;
  std::vector<std::thread> readers;
  for (int r = 0; r < 2; ++r) {
    readers.emplace_back([&, r] {
      for (int i = r; !ending; ++i) {
        const auto view = hulls_->View(std::to_string(i % kHulls));
        if (!view.ok()) {
          EXPECT_EQ(view.status().code(), absl::StatusCode::kNotFound) << view.status();
          continue;
        }
        EXPECT_EQ(view->snapshot->hull().vertices().size(), view->record.vertex_count);
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
  // Builders and snapshots of all of them together are beyond the limit.
  EXPECT_GT(hulls_->registry().Cache().evictions, 0);
}

TEST(RegistryOfMemoryStore, RefusesToGrowBeyondTheLimit) {
  MemoryStore store;
  WorkerPool writers(2);
  Limits limits;
  limits.memory_limit = 100'000;
  Registry registry(store, limits, writers);
  const auto put = [&](const std::string& id) {
    const auto opened = DurableRegistry::Wait<OpenResult>([&](Reply<OpenResult> done) {
      registry.OpenAppend(
          id, "w", true, [](const absl::Status&) {}, std::move(done));
    });
    return DurableRegistry::Wait<ChunkResult>([&](Reply<ChunkResult> done) {
      registry.Append(opened->session, {1, SpherePoints(1000), std::nullopt}, {}, {},
                      std::move(done));
    });
  };
  ASSERT_TRUE(put("first").ok());
  const auto second = put("second");
  EXPECT_EQ(second.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr("--memory-limit"));
  EXPECT_EQ(registry.Resolve("first", {})->second.snapshot->hull().vertices().size(), 1000);
}

}  // namespace
}  // namespace hulld::server
