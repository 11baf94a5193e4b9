#include "client/hullctl/load/latency_histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace hulld {
namespace latency_histogram_test {

using std::chrono::nanoseconds;

TEST(LatencyHistogram, PercentilesAreAtMostOnePercentTooLarge) {
  constexpr uint32_t kSeed = 5;
  std::mt19937_64 random(kSeed);
  std::lognormal_distribution<double> latency(12, 3);
  LatencyHistogram histogram;
  std::vector<int64_t> all;
  for (int i = 0; i < 20000; ++i) {
    all.push_back(static_cast<int64_t>(latency(random)));
    histogram.Record(nanoseconds(all.back()));
  }
  std::sort(all.begin(), all.end());
  for (const double share : {0.0001, 0.01, 0.5, 0.9, 0.99, 0.999, 1.0}) {
    const auto rank = static_cast<size_t>(std::ceil(share * static_cast<double>(all.size())));
    const auto exact = static_cast<double>(all[rank - 1]);
    const auto found = static_cast<double>(histogram.Percentile(share).count());
    EXPECT_GE(found, exact) << share << ", seed " << kSeed;
    EXPECT_LE(found, 1.01 * exact) << share << ", seed " << kSeed;
  }
  EXPECT_EQ(histogram.max().count(), all.back());
  EXPECT_EQ(histogram.Percentile(1), histogram.max());
}

TEST(LatencyHistogram, MergingEqualsRecordingInOne) {
  LatencyHistogram one;
  LatencyHistogram parts[2];
  for (int64_t ns = 1; ns < (int64_t{1} << 40); ns = ns * 3 + 1) {
    one.Record(nanoseconds(ns));
    parts[ns % 2].Record(nanoseconds(ns));
  }
  parts[0].Merge(parts[1]);
  EXPECT_EQ(parts[0].count(), one.count());
  EXPECT_EQ(parts[0].max(), one.max());
  for (const double share : {0.1, 0.3, 0.5, 0.7, 1.0}) {
    EXPECT_EQ(parts[0].Percentile(share), one.Percentile(share));
  }
}

TEST(LatencyHistogram, RowsCoverEverythingOnce) {
  LatencyHistogram histogram;
  for (const int64_t ns : {150, 199, 201, 4999, 5100, 2000000}) histogram.Record(nanoseconds(ns));
  const std::vector<LatencyHistogram::Row> rows = histogram.Rows();
  ASSERT_EQ(rows.front().from, nanoseconds(100));
  EXPECT_EQ(rows.front().to, nanoseconds(200));
  EXPECT_EQ(rows.front().count, 2U);
  EXPECT_EQ(rows[1].count, 1U);
  EXPECT_EQ(rows.back().from, nanoseconds(1000000));
  EXPECT_EQ(rows.back().to, nanoseconds(2000000));
  uint64_t sum = 0;
  for (size_t i = 0; i < rows.size(); ++i) {
    sum += rows[i].count;
    if (i > 0) {
      EXPECT_EQ(rows[i].from, rows[i - 1].to);
    }
  }
  EXPECT_EQ(sum, histogram.count());
}

TEST(LatencyHistogram, EmptyHasNoRows) {
  EXPECT_TRUE(LatencyHistogram().Rows().empty());
  EXPECT_EQ(LatencyHistogram().Percentile(0.5).count(), 0);
}

}  // namespace latency_histogram_test
}  // namespace hulld
