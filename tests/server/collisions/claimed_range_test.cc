#include "server/collisions/claimed_range.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace hulld::server {
namespace claimed_range_test {

TEST(ClaimedRange, BlocksAreDisjointAndTheLastReturnIsReported) {
  ClaimedRange range;
  EXPECT_TRUE(range.Claim(4).empty());
  range.Begin(10);
  const ClaimedRange::Block first = range.Claim(4);
  const ClaimedRange::Block second = range.Claim(4);
  const ClaimedRange::Block third = range.Claim(4);
  EXPECT_EQ(first.begin, 6U);
  EXPECT_EQ(first.end, 10U);
  EXPECT_EQ(second.begin, 2U);
  EXPECT_EQ(second.end, 6U);
  EXPECT_EQ(third.begin, 0U);
  EXPECT_EQ(third.end, 2U);
  EXPECT_TRUE(range.Claim(4).empty());
  EXPECT_FALSE(range.Complete(second));
  EXPECT_FALSE(range.Complete(first));
  EXPECT_TRUE(range.Complete(third));
  range.Begin(1);
  EXPECT_TRUE(range.Complete(range.Claim(4)));
}

// Models the steps of a stream: the thread that ends one range begins the next, while other threads
// still claim.
TEST(ClaimedRange, RangesThatFollowEachOtherAreEachDoneOnce) {
  constexpr uint32_t kCount = 100;
  constexpr int kRanges = 20'000;
  ClaimedRange range;
  // Written by the single thread that claimed the index or ended the range.
  std::vector<int> done(kCount, 0);
  int ended = 0;
  std::atomic<bool> is_over = false;
  std::atomic<int> wrong = 0;
  const auto work = [&] {
    while (!is_over) {
      const ClaimedRange::Block block = range.Claim(7);
      for (uint32_t i = block.begin; i < block.end; ++i) ++done[i];
      if (block.empty() || !range.Complete(block)) continue;
      ++ended;
      for (const int times : done) wrong += times == ended ? 0 : 1;
      if (ended == kRanges) {
        is_over = true;
      } else {
        range.Begin(kCount);
      }
    }
  };
  range.Begin(kCount);
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i) threads.emplace_back(work);
  }
  EXPECT_EQ(ended, kRanges);
  EXPECT_EQ(wrong, 0);
}

}  // namespace claimed_range_test
}  // namespace hulld::server
