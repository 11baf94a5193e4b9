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
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/query/terms/rung.h"
#include "server/contract/rpc.h"

namespace hulld::server {

// What the store and the cache of hulls report. Names as Prometheus shows them in the comments.
struct StoreMetrics {
  // hulld_store_commit_duration_seconds: from handing a change over until it is acknowledged.
  prometheus::Histogram& commit_seconds;
  // hulld_store_commit_changes: changes that one write to the store commits together.
  prometheus::Histogram& commit_changes;
  // hulld_store_failures_total{operation="write"|"sync"|"read"}.
  prometheus::Counter& write_failures;
  prometheus::Counter& sync_failures;
  prometheus::Counter& read_failures;
  // hulld_store_damaged_records_total: records whose checksum or content was wrong.
  prometheus::Counter& damaged_records;
  // hulld_store_read_only: 1 while changes are refused.
  prometheus::Gauge& read_only;
  // hulld_cache_lookups_total{result="hit"|"miss"}, hulld_cache_evictions_total.
  prometheus::Counter& cache_hits;
  prometheus::Counter& cache_misses;
  prometheus::Counter& cache_evictions;
  // hulld_cache_bytes: what counts against the limit, and hulld_cache_reading_bytes and
  // hulld_cache_writing_bytes, its parts; hulld_cache_limit_bytes: --memory-limit.
  prometheus::Gauge& cache_bytes;
  prometheus::Gauge& cache_reading_bytes;
  prometheus::Gauge& cache_writing_bytes;
  prometheus::Gauge& cache_limit_bytes;
  // hulld_snapshot_duration_seconds: making the canonical snapshot of a version.
  prometheus::Histogram& snapshot_seconds;
  // hulld_store_disk_bytes: all files. hulld_store_log_bytes: the log among them.
  // hulld_store_free_bytes: what the disk has left.
  prometheus::Gauge& disk_bytes;
  prometheus::Gauge& log_bytes;
  prometheus::Gauge& free_bytes;
  // hulld_store_stalls_total: how often the store slowed down or stopped changes, as it could not
  // keep up; hulld_store_stalled: 1 while it does.
  prometheus::Counter& stalls;
  prometheus::Gauge& stalled;
};

// What one pool of threads reports.
struct PoolMetrics {
  // hulld_queue_tasks{pool=...}: tasks that wait.
  prometheus::Gauge& waiting;
  // hulld_queue_wait_seconds{pool=...}: how long a task waited before a thread took it.
  prometheus::Histogram& wait_seconds;
};

// Everything that a running server counts and times, and its exposition to Prometheus. One per
// server; it outlives all that reports to it. Thread-safe; a report costs some tens of nanoseconds.
class Metrics : public prometheus::Collectable {
 public:
  Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  // hulld_requests_total{rpc,code}, hulld_request_duration_seconds{rpc}.
  void CountCall(Rpc rpc, absl::StatusCode code, std::chrono::steady_clock::duration duration);
  // hulld_message_duration_seconds{rpc}: one message of a stream that lasts as long as its client
  // likes, from its arrival until its answer is ready. rpc: AppendPoints, ReplaceHull or
  // StreamCollisions.
  void CountMessage(Rpc rpc, std::chrono::steady_clock::duration duration);
  // hulld_limits_hit_total: the limit is named like its flag, as in "max-hulls".
  void CountLimit(const std::string& limit);
  // hulld_auth_failures_total: the reason is "unauthenticated" or "permission_denied".
  void CountAuthFailure(const std::string& reason);
  // hulld_token_requests_total{token}: nothing is counted without a name. Beyond kMostTokens names
  // the rest are "other": a file may name any number of tokens.
  void CountToken(const std::string& token);
  static constexpr size_t kMostTokens = 100;
  // hulld_points_received_total, _kept_, _duplicate_ and _inside_total, of one committed chunk.
  void CountPoints(const PointCounts& counts);
  // hulld_pairs_total{rung}, hulld_exact_fallbacks_total.
  void CountPairs(const RungCounts& counts);

  StoreMetrics& store() { return store_; }
  // The pool is named once.
  PoolMetrics AddPool(const std::string& pool);

  // hulld_requests_running{rpc}: calls that run now, open streams included.
  prometheus::Gauge& RunningCalls(Rpc rpc) { return *running_[static_cast<size_t>(rpc)]; }

  // hulld_backup_saved_timestamp_seconds: when the last backup was read to its end, Unix time; 0
  // before the first.
  prometheus::Gauge& BackupSaved() { return backup_saved_; }

  // A gauge that others keep up to date.
  prometheus::Gauge& AddGauge(const std::string& name, const std::string& help);
  // A gauge that is read whenever Prometheus asks. What `read` uses must outlive the exposition.
  void AddGauge(const std::string& name, const std::string& help, std::function<double()> read);

  // Called before each exposition, to bring up to date what others count themselves. What it uses
  // must outlive the exposition.
  void AddRefresh(std::function<void()> refresh);

  // What Prometheus reads.
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
  prometheus::Counter& points_received_;
  prometheus::Counter& points_outside_;
  prometheus::Counter& points_duplicate_;
  prometheus::Counter& points_inside_;
  StoreMetrics store_;
  prometheus::Gauge& backup_saved_;
  // Bring up to date what is only read when asked for.
  mutable std::mutex refresh_mutex_;
  std::vector<std::function<void()>> refresh_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_METRICS_H_
