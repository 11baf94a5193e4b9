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
  // When no further request starts; at least one of both is set.
  std::optional<std::chrono::milliseconds> duration;
  std::optional<uint64_t> requests;
  // Requests a second, of all clients together. Absent: each client asks again when it is answered
  // (closed loop).
  //
  // With a rate (open loop), request i is due at i / rate and its latency counts from then, even if
  // a client sends it late. So a server that stalls cannot hide it (Tene calls that coordinated
  // omission).
  std::optional<double> rate;
};

// Requests that failed with one code.
struct LoadFailures {
  uint64_t count = 0;
  // The message of the first of them.
  std::string message;
};

struct LoadResult {
  std::chrono::nanoseconds elapsed{0};
  // The latencies of requests that succeeded.
  LatencyHistogram latencies;
  // How many items these did in all, such as pairs or points.
  uint64_t items = 0;
  std::map<absl::StatusCode, LoadFailures> failures;
  // Requests that were due while the run lasted but were never sent: the rate was not kept, and
  // their latencies would have been the longest.
  uint64_t missed = 0;

  uint64_t failed() const;
};

// Does request i and returns how many items it was.
using LoadRequest = std::function<absl::StatusOr<uint64_t>(uint64_t i)>;

// Runs each client on a thread of its own. After a failure a client pauses for 10 ms. `stop` ends
// the run early. `progress` is called about ten times a second with the share of the plan that is
// done, 0 to 1, and the number of requests.
LoadResult RunLoad(const LoadPlan& plan, const std::vector<LoadRequest>& clients,
                   const std::atomic<bool>& stop,
                   const std::function<void(double share, uint64_t requests)>& progress);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_LOAD_LOAD_H_
