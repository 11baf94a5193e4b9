// The registry with its committer, budget and feed, and a watch of collisions, under schedules
// chosen by a seed.
//
// HULLD_SCHEDULES: number of schedules, for manual runs. HULLD_TEST_SEED: the first seed.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <iostream>

#include "tests/server/schedules/explorer.h"
#include "tests/test_size.h"

namespace hulld::server {
namespace registry_schedules_test {

constexpr uint64_t kSchedules = TestSize(50'000, 10'000);

// Long runs report their progress after each block.
constexpr uint64_t kBlock = 200'000;

void ExpectAllReached(const Reached& reached) {
  EXPECT_GT(reached.refused, 100);
  EXPECT_GT(reached.aborted, 100);
  EXPECT_GT(reached.cancelled, 100);
  EXPECT_GT(reached.repeated, 20);
  EXPECT_GT(reached.gone, 100);
  EXPECT_GT(reached.gaps, 20);
  EXPECT_GT(reached.overloaded, 100);
  EXPECT_GT(reached.damaged, 20);
  EXPECT_GT(reached.reads, 1000);
  EXPECT_GT(reached.snapshots, 100);
  EXPECT_GT(reached.reported, 100);
  EXPECT_GT(reached.loads, 100);
  EXPECT_GT(reached.sequences, 100);
  EXPECT_GT(reached.lookups, 1000);
  EXPECT_GT(reached.bodies_put, 500);
  EXPECT_GT(reached.bodies_deleted, 50);
  EXPECT_GT(reached.bodies_found, 50);
  EXPECT_GT(reached.kinds_refused, 100);
  EXPECT_GT(reached.resolved, 1000);
  EXPECT_GT(reached.pieces_sent, 20);
  EXPECT_GT(reached.evictions, 100);
  EXPECT_GT(reached.recovered, 100);
  EXPECT_GT(reached.kills, 100);
  EXPECT_GT(reached.revived, 20);
  EXPECT_GT(reached.shared, 1000);
  EXPECT_GT(reached.superseded, 1000);
}

TEST(RegistrySchedules, EachEndsAndKeepsToTheSpecification) {
  const uint64_t count = NumberIn("HULLD_SCHEDULES", kSchedules);
  Reached reached;
  const uint64_t first = NumberIn("HULLD_TEST_SEED", 1);
  const auto start = std::chrono::steady_clock::now();
  while (reached.schedules < count) {
    const auto found =
        Explore(first + reached.schedules, std::min(kBlock, count - reached.schedules), reached);
    ASSERT_FALSE(found.has_value()) << Report(*found);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    std::cout << reached.schedules << " schedules, " << reached.steps << " steps, "
              << reached.answers << " answers in " << taken.count() << " s" << std::endl;
  }
  if (count >= kSchedules) ExpectAllReached(reached);
}

TEST(RegistrySchedules, TheSameSeedTakesTheSameSteps) {
  for (uint64_t seed = 1; seed <= 300; ++seed) {
    ASSERT_EQ(DigestOf(seed), DigestOf(seed)) << seed;
  }
}

}  // namespace registry_schedules_test
}  // namespace hulld::server
