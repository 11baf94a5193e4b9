#ifndef HULLD_CLIENT_HULLCTL_LOAD_LATENCY_HISTOGRAM_H_
#define HULLD_CLIENT_HULLCTL_LOAD_LATENCY_HISTOGRAM_H_

#include <chrono>
#include <cstdint>
#include <vector>

namespace hulld {

// Counts of latencies in buckets that are exact below 256 ns and 1/128 of their value wide above,
// so that a percentile is at most 0.8 % too large. Source of the layout: Tene, HdrHistogram.
class LatencyHistogram {
 public:
  void Record(std::chrono::nanoseconds latency);
  void Merge(const LatencyHistogram& other);

  uint64_t count() const { return count_; }
  std::chrono::nanoseconds max() const { return max_; }
  // The latency that this share, 0 to 1, of all do not exceed; 0 when there are none.
  std::chrono::nanoseconds Percentile(double share) const;

  // A range of latencies, from <= latency < to.
  struct Row {
    std::chrono::nanoseconds from;
    std::chrono::nanoseconds to;
    uint64_t count = 0;
  };
  // Ranges with bounds 1, 2 and 5 times powers of ten, from the first that holds any to the last. A
  // bucket counts where it starts.
  std::vector<Row> Rows() const;

 private:
  std::vector<uint64_t> counts_;
  uint64_t count_ = 0;
  std::chrono::nanoseconds max_{0};
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_LOAD_LATENCY_HISTOGRAM_H_
