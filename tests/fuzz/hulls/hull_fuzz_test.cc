#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "core/numeric/orientation.h"
#include "tests/core/checks/point_sets.h"
#include "tests/fuzz/hulls/fuzz_cloud.h"
#include "tests/fuzz/hulls/hull_check.h"
#include "tests/test_size.h"

namespace hulld::fuzz {
namespace hull_fuzz_test {

// Runs the fuzz target without the fuzzer: a fixed number of inputs from a fixed seed.
constexpr int kInputs = TestSize(1500, 150);

std::vector<uint8_t> RandomBytes(Random& random) {
  std::vector<uint8_t> bytes(static_cast<size_t>(random.Between(0, 160)));
  for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random.Below(256));
  return bytes;
}

TEST(HullFuzz, RandomProgramsPassEveryCheck) {
  const uint64_t seed = TestSeed(501);
  Random random(seed);
  std::array<int, 5> dimensions = {};
  int refused = 0;
  int compared = 0;
  int large = 0;
  const OrientationCounts before = ThreadOrientationCounts();
  for (int i = 0; i < kInputs; ++i) {
    const FuzzCloud cloud = DecodeFuzzCloud(RandomBytes(random));
    const Verdict verdict = CheckHullOf(cloud);
    ASSERT_EQ(verdict.finding, "")
        << "seed " << seed << " input " << i << " points " << testing::PrintToString(cloud.points);
    ++dimensions[static_cast<size_t>(verdict.dimension + 1)];
    refused += verdict.refused > 0;
    compared += verdict.compared_with_brute_force;
    large += verdict.vertices > 100;
  }
  // The programs cover the intended cases.
  for (const int count : dimensions) EXPECT_GT(count, kInputs / 200);
  EXPECT_GT(refused, kInputs / 200);
  EXPECT_GT(compared, kInputs / 50);
  EXPECT_GT(large, kInputs / 50);
  const OrientationCounts after = ThreadOrientationCounts();
  EXPECT_GT(after.filter - before.filter, static_cast<uint64_t>(kInputs));
  EXPECT_GT(after.expansion - before.expansion, static_cast<uint64_t>(kInputs));
  EXPECT_GT(after.integer - before.integer, static_cast<uint64_t>(kInputs));
}

TEST(HullFuzz, AnyBytesDecodeToBlocksThatCoverThePoints) {
  const uint64_t seed = TestSeed(502);
  Random random(seed);
  for (int i = 0; i < 1000; ++i) {
    const FuzzCloud cloud = DecodeFuzzCloud(RandomBytes(random));
    size_t sum = 0;
    for (const size_t n : cloud.block_sizes) sum += n;
    ASSERT_EQ(sum, cloud.points.size()) << "seed " << seed << " input " << i;
    ASSERT_LE(sum, kMaxPoints);
  }
}

}  // namespace hull_fuzz_test
}  // namespace hulld::fuzz
