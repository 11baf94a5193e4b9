// Concurrent writers, readers, refusals, evictions, and deletions.
#include <absl/status/status.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/registry/registry.h"
#include "tests/server/harness/store_fixture.h"
#include "tests/server/registry/registry_interleaving.h"
#include "tests/test_size.h"

namespace hulld::server {
namespace registry_chaos_test {

// Chunk k of a hull is the point (k, k^2, k^3): the hull's extent along x shows which chunks it
// contains, in any interleaving of writers, readers, refusals, evictions, and deletions.
class RegistryChaos : public RegistryInterleaving {
 protected:
  // Appends this many times, and occasionally deletes the hull.
  void Write(const std::string& id, uint64_t seed, uint64_t times) {
    std::mt19937_64 random(seed);
    std::optional<AppendSession> session;
    uint64_t sequence = 0;
    for (uint64_t i = 0; i < times; ++i) {
      if (!session.has_value()) {
        const auto opened = DurableRegistry::Wait<OpenResult>([&](Reply<OpenResult> done) {
          registry_.changes().OpenAppend(
              id, "w", true, [](const absl::Status&) {}, std::move(done));
        });
        if (!opened.ok()) continue;
        session = opened->session;
        sequence = opened->last_sequence;
      }
      sequence += AppendSome(*session, sequence, 1 + random() % 4);
      const HullView view = registry_.Resolve(id, {})->second;
      EXPECT_EQ(view.record.counts.received, sequence);
      if (random() % 100 == 0 && Delete(id).ok()) {
        registry_.changes().CloseAppend(*session);
        session.reset();
      }
    }
  }

  // Reads all hulls, sometimes under memory pressure, until all writers end. Returns the number of
  // hulls read.
  uint64_t Read(uint64_t seed, const std::atomic<int>& writing) {
    std::mt19937_64 random(seed);
    const std::vector<std::string> ids = {"0", "1", "2"};
    uint64_t seen = 0;
    uint64_t store_revision = 0;
    while (writing > 0) {
      const ReadPlan plan = {random() % 20 == 0 ? 10'000U : 0U, random() % 2 == 0};
      const auto resolved = registry_.Resolve(ids, {}, plan);
      EXPECT_TRUE(resolved.ok());
      if (!resolved.ok()) break;
      EXPECT_GE(resolved->as_of.revision, store_revision);
      store_revision = resolved->as_of.revision;
      for (const auto& hull : resolved->hulls) {
        if (!hull.ok()) {
          EXPECT_TRUE(absl::IsNotFound(hull.status())) << hull.status();
          continue;
        }
        EXPECT_LE(hull->record.revision, store_revision);
        EXPECT_EQ(hull->record.vertex_count, hull->record.counts.received);
        if (hull->record.counts.received == 0) continue;
        CheckPoints(*hull, random() % 10 == 0);
        ++seen;
      }
      if (random() % 5 > 0) continue;
      // Evicts everything idle; chunks that arrive during this time are refused.
      const MemoryCharge charge(registry_.memory(), MemoryUse::kWriting,
                                registry_.Cache().limit_bytes);
      registry_.CheckMemory(MemoryUse::kWriting).IgnoreError();
    }
    return seen;
  }

 private:
  // Appends chunks in flight together, each built on its predecessors. Returns the number applied,
  // which are the first ones.
  uint64_t AppendSome(const AppendSession& session, uint64_t sequence, uint64_t count) {
    std::vector<std::future<absl::StatusOr<ChunkResult>>> chunks;
    for (uint64_t k = sequence + 1; k <= sequence + count; ++k) {
      const auto x = static_cast<double>(k);
      chunks.push_back(StartAppend(session, k, {{x, x * x, x * x * x}}));
    }
    uint64_t applied = 0;
    bool all_applied = true;
    for (auto& chunk : chunks) {
      const bool ok = chunk.get().ok();
      EXPECT_TRUE(all_applied || !ok);
      all_applied = all_applied && ok;
      if (all_applied) ++applied;
    }
    return applied;
  }

  void CheckPoints(const HullView& hull, bool also_canonical) {
    const uint64_t received = hull.record.counts.received;
    EXPECT_EQ(hull.served->high().x(), static_cast<double>(received));
    EXPECT_EQ(hull.served->query_hull().dimension(), hull.record.dimension);
    if (!also_canonical) return;
    const auto canonical = registry_.reader().Canonical(hull, {});
    ASSERT_TRUE(canonical.ok()) << canonical.status();
    EXPECT_EQ((*canonical)->vertices().size(), received);
    EXPECT_EQ((*canonical)->vertices().back(), hull.served->high());
  }
};

TEST_F(RegistryChaos, EveryVersionMatchesItsRecord) {
  constexpr uint64_t kChunks = TestSize(1500, 300);
  constexpr int kHulls = 3;
  store_.refused_of_1000 = 100;
  std::atomic<int> writing = kHulls;
  std::atomic<uint64_t> seen = 0;
  std::vector<std::thread> threads;
  for (int h = 0; h < kHulls; ++h) {
    threads.emplace_back([&, h] {
      Write(std::to_string(h), h, kChunks);
      --writing;
    });
  }
  for (int r = 0; r < 2; ++r) {
    threads.emplace_back([&, r] { seen += Read(100 + r, writing); });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_GT(seen, 0);
  EXPECT_EQ(registry_.Cache().damaged, 0);
  EXPECT_GT(registry_.Commits().failed_batches, 0);
}

}  // namespace registry_chaos_test
}  // namespace hulld::server
