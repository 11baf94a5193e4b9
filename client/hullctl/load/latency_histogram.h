#ifndef HULLD_CLIENT_HULLCTL_LOAD_LATENCY_HISTOGRAM_H_
#define HULLD_CLIENT_HULLCTL_LOAD_LATENCY_HISTOGRAM_H_

#include <chrono>
#include <cstdint>
#include <vector>

namespace hulld {

// Counts latencies in buckets that are exact below 256 ns and 1/128 of their value wide above, so
// that a percentile is at most 0.8 % too large. Source of the layout: Tene, HdrHistogram.
class LatencyHistogram {
 public:
  void Record(std::chrono::nanoseconds latency);
  void Merge(const LatencyHistogram& other);

  uint64_t count() const { return count_; }
  std::chrono::nanoseconds max() const { return max_; }
  // Returns the latency that this share, 0 to 1, of all requests does not exceed; 0 if empty.
  std::chrono::nanoseconds Percentile(double share) const;

  // A range of latencies: from <= latency < to.
  struct Row {
    std::chrono::nanoseconds from;
    std::chrono::nanoseconds to;
    uint64_t count = 0;
  };
  // Returns ranges with bounds 1, 2, and 5 times powers of ten, from the first nonempty one to the
  // last. A bucket counts in the range of its lower bound.
  std::vector<Row> Rows() const;

 private:
  std::vector<uint64_t> counts_;
  uint64_t count_ = 0;
  std::chrono::nanoseconds max_{0};
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_LOAD_LATENCY_HISTOGRAM_H_
