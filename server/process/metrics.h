#ifndef HULLD_SERVER_PROCESS_METRICS_H_
#define HULLD_SERVER_PROCESS_METRICS_H_

#include <absl/status/status.h>
#include <prometheus/collectable.h>
#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/query/terms/rung.h"
#include "server/contract/rpc.h"

namespace hulld::server {

// Timings of the store. Comments state the names in Prometheus.
struct StoreMetrics {
  // hulld_store_commit_duration_seconds: from submission of a change to its acknowledgement.
  prometheus::Histogram& commit_seconds;
  // hulld_store_commit_changes: changes per batch written to the store.
  prometheus::Histogram& commit_changes;
  // hulld_snapshot_duration_seconds: building the canonical snapshot of a version.
  prometheus::Histogram& snapshot_seconds;
};

// Metrics of a pool of threads.
struct PoolMetrics {
  // hulld_queue_tasks{pool=...}: queued tasks.
  prometheus::Gauge& waiting;
  // hulld_queue_wait_seconds{pool=...}: wait of a task for a thread.
  prometheus::Histogram& wait_seconds;
};

// All metrics of a running server, and their exposition to Prometheus. One per server; it outlives
// everything that updates it. Thread-safe; an update costs tens of nanoseconds.
class Metrics : public prometheus::Collectable {
 public:
  Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  // hulld_requests_total{rpc,code}, hulld_request_duration_seconds{rpc}.
  void CountCall(Rpc rpc, absl::StatusCode code, std::chrono::steady_clock::duration duration);
  // hulld_message_duration_seconds{rpc}: one message of a stream of unlimited duration, from its
  // arrival until its answer is ready. rpc: AppendPoints, ReplaceHull or StreamCollisions.
  void CountMessage(Rpc rpc, std::chrono::steady_clock::duration duration);
  // hulld_limits_hit_total: the limit has the name of its flag, as in "max-hulls".
  void CountLimit(const std::string& limit);
  // hulld_auth_failures_total: the reason is "unauthenticated" or "permission_denied".
  void CountAuthFailure(const std::string& reason);
  // hulld_token_requests_total{token}: ignores the empty name. Beyond kMaxTokens names, further
  // ones count as "other", because a file may contain any number of tokens.
  void CountToken(const std::string& token);
  static constexpr size_t kMaxTokens = 100;
  // hulld_points_received_total, _kept_, _duplicate_ and _inside_total, of a committed chunk.
  void CountPoints(const PointCounts& counts);
  // hulld_pairs_total{rung}, hulld_exact_fallbacks_total.
  void CountPairs(const RungCounts& counts);

  StoreMetrics& store() { return store_; }
  // Requires a new name.
  PoolMetrics AddPool(const std::string& pool);

  // hulld_requests_running{rpc}: running calls, including open streams.
  prometheus::Gauge& RunningCalls(Rpc rpc) { return *running_[static_cast<size_t>(rpc)]; }

  // hulld_backup_saved_timestamp_seconds: Unix time at which the last backup was read completely; 0
  // before the first.
  prometheus::Gauge& BackupSaved() { return backup_saved_; }

  // Adds a counter of a family. The family has the help text of its first counter.
  prometheus::Counter& AddCounter(const std::string& name, const std::string& help,
                                  const std::map<std::string, std::string>& labels);
  // Adds a counter read at each exposition, as below.
  void AddCounter(const std::string& name, const std::string& help,
                  const std::map<std::string, std::string>& labels, std::function<double()> read);
  // Adds a gauge read at each exposition. State used by `read` must outlive the exposition.
  void AddGauge(const std::string& name, const std::string& help, std::function<double()> read);

  // Adds a callback that runs at each exposition, before metrics that are added later are read.
  // Its state must outlive the exposition.
  void AddRefresh(std::function<void()> refresh);

  // Returns the metrics for Prometheus.
  std::vector<prometheus::MetricFamily> Collect() const override;

 private:
  void AddProcess();

  prometheus::Registry registry_;
  prometheus::Family<prometheus::Counter>& calls_;
  prometheus::Family<prometheus::Counter>& limits_hit_;
  prometheus::Family<prometheus::Counter>& auth_failures_;
  prometheus::Family<prometheus::Gauge>& queue_tasks_;
  prometheus::Family<prometheus::Histogram>& queue_wait_;
  prometheus::Family<prometheus::Counter>& token_calls_;
  std::mutex tokens_mutex_;
  // By name; guarded by the mutex.
  std::map<std::string, prometheus::Counter*> tokens_;
  std::array<prometheus::Gauge*, kRpcCount> running_;
  std::array<prometheus::Counter*, kRpcCount> calls_ok_;
  std::array<prometheus::Histogram*, kRpcCount> call_seconds_;
  std::array<prometheus::Histogram*, kRpcCount> message_seconds_;
  std::array<prometheus::Counter*, kRungCount> pairs_;
  prometheus::Counter& exact_fallbacks_;
  // Received, outside, duplicate, inside.
  std::array<prometheus::Counter*, 4> points_;
  StoreMetrics store_;
  prometheus::Gauge& backup_saved_;
  // Callbacks that update metrics at each exposition.
  mutable std::mutex refresh_mutex_;
  std::vector<std::function<void()>> refresh_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_METRICS_H_
