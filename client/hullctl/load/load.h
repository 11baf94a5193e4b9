#ifndef HULLD_CLIENT_HULLCTL_LOAD_LOAD_H_
#define HULLD_CLIENT_HULLCTL_LOAD_LOAD_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/hullctl/load/latency_histogram.h"

namespace hulld {

struct LoadPlan {
  // End of the run: no request starts after either limit. At least one limit is set.
  std::optional<std::chrono::milliseconds> duration;
  std::optional<uint64_t> requests;
  // Requests per second of all clients together. Absent: each client sends its next request after
  // its answer (closed loop).
  //
  // With a rate (open loop), request i is due at i / rate and its latency counts from then, even if
  // a client sends it late. This way, a stalled server cannot hide its latency (coordinated
  // omission, Tene).
  std::optional<double> rate;
};

// Requests that failed with one code.
struct LoadFailures {
  uint64_t count = 0;
  // Message of the first failure.
  std::string message;
};

struct LoadResult {
  std::chrono::nanoseconds elapsed{0};
  // Latencies of successful requests.
  LatencyHistogram latencies;
  // Total number of their items, such as pairs or points.
  uint64_t items = 0;
  std::map<absl::StatusCode, LoadFailures> failures;
  // Requests that were due during the run but never sent: the rate was not sustained, and their
  // latencies would have been the longest.
  uint64_t missed = 0;

  uint64_t failed() const;
};

// Performs request i and returns its number of items.
using LoadRequest = std::function<absl::StatusOr<uint64_t>(uint64_t i)>;

// Runs each client on its own thread. A client pauses for 10 ms after a failure. `stop` ends the
// run early. `progress` is called about ten times a second with the completed share of the plan, 0
// to 1, and the number of requests.
LoadResult RunLoad(const LoadPlan& plan, const std::vector<LoadRequest>& clients,
                   const std::atomic<bool>& stop,
                   const std::function<void(double share, uint64_t requests)>& progress);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_LOAD_LOAD_H_
