#include "client/hullctl/load/latency_histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace hulld {
namespace {

// Buckets per power of two, as a power of two.
constexpr int kBucketBits = 7;
constexpr uint64_t kBuckets = uint64_t{1} << kBucketBits;

size_t BucketOf(uint64_t value) {
  if (value < 2 * kBuckets) return value;
  const int shift = std::bit_width(value) - kBucketBits - 1;
  return static_cast<size_t>(shift) * kBuckets + (value >> shift);
}

// Returns the lowest value of a bucket.
uint64_t StartOf(size_t bucket) {
  if (bucket < 2 * kBuckets) return bucket;
  const size_t shift = bucket / kBuckets - 1;
  return (bucket - shift * kBuckets) << shift;
}

}  // namespace

void LatencyHistogram::Record(std::chrono::nanoseconds latency) {
  const size_t bucket =
      BucketOf(static_cast<uint64_t>(std::max<std::chrono::nanoseconds::rep>(latency.count(), 0)));
  if (bucket >= counts_.size()) counts_.resize(bucket + 1);
  ++counts_[bucket];
  ++count_;
  max_ = std::max(max_, latency);
}

void LatencyHistogram::Merge(const LatencyHistogram& other) {
  if (other.counts_.size() > counts_.size()) counts_.resize(other.counts_.size());
  for (size_t i = 0; i < other.counts_.size(); ++i) counts_[i] += other.counts_[i];
  count_ += other.count_;
  max_ = std::max(max_, other.max_);
}

std::chrono::nanoseconds LatencyHistogram::Percentile(double share) const {
  const auto wanted = static_cast<uint64_t>(std::ceil(share * static_cast<double>(count_)));
  uint64_t seen = 0;
  for (size_t i = 0; i < counts_.size(); ++i) {
    seen += counts_[i];
    if (seen < std::max<uint64_t>(wanted, 1)) continue;
    const auto last = static_cast<std::chrono::nanoseconds::rep>(StartOf(i + 1) - 1);
    return std::min(std::chrono::nanoseconds(last), max_);
  }
  return max_;
}

std::vector<LatencyHistogram::Row> LatencyHistogram::Rows() const {
  std::vector<Row> rows;
  uint64_t from = 0;
  uint64_t to = 1;
  constexpr uint64_t kSteps[] = {1, 2, 5};
  uint64_t power = 1;
  int step = 0;
  Row row{std::chrono::nanoseconds(from), std::chrono::nanoseconds(to)};
  const auto finish = [&] {
    if (!rows.empty() || row.count > 0) rows.push_back(row);
    from = to;
    if (++step == 3) {
      step = 0;
      power *= 10;
    }
    to = kSteps[step] * power;
    row = {std::chrono::nanoseconds(from), std::chrono::nanoseconds(to)};
  };
  for (size_t i = 0; i < counts_.size(); ++i) {
    while (StartOf(i) >= to) finish();
    row.count += counts_[i];
  }
  if (row.count > 0) rows.push_back(row);
  return rows;
}

}  // namespace hulld
