#include "server/process/metrics.h"

#include <grpcpp/grpcpp.h>
#include <sys/resource.h>

#include <utility>

#include "core/base/check.h"
#include "server/process/descriptors.h"
#include "server/process/heap.h"

namespace hulld::server {
namespace {

using prometheus::Family;
using Buckets = prometheus::Histogram::BucketBoundaries;

// Names of the rungs, in the order of the enum.
constexpr std::array<const char*, kRungCount> kRungNames = {"bounds", "cached", "floating_point",
                                                            "exact"};
constexpr std::array<Rpc, 4> kStreamedRpcs = {Rpc::kAppendPoints, Rpc::kReplaceHull,
                                              Rpc::kStreamCollisions, Rpc::kWatchCollisions};

// Seconds: from a loopback round trip to the longest wait of a patient client.
Buckets LatencyBuckets() {
  return {50e-6,  100e-6, 200e-6, 500e-6, 1e-3, 2e-3, 5e-3, 10e-3, 20e-3, 50e-3,
          100e-3, 200e-3, 500e-3, 1,      2,    5,    10,   20,    60};
}

Buckets CountBuckets() { return {1, 2, 5, 10, 20, 50, 100, 200, 500, 1000}; }

Family<prometheus::Counter>& AddCounters(prometheus::Registry& registry, const char* name,
                                         const char* help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
}

Family<prometheus::Gauge>& AddGauges(prometheus::Registry& registry, const std::string& name,
                                     const std::string& help) {
  return prometheus::BuildGauge().Name(name).Help(help).Register(registry);
}

Family<prometheus::Histogram>& AddHistograms(prometheus::Registry& registry, const char* name,
                                             const char* help) {
  return prometheus::BuildHistogram().Name(name).Help(help).Register(registry);
}

StoreMetrics AddStore(prometheus::Registry& registry) {
  return {
      AddHistograms(registry, "hulld_store_commit_duration_seconds",
                    "Time from submitting a change to the store to its acknowledgement.")
          .Add({}, LatencyBuckets()),
      AddHistograms(registry, "hulld_store_commit_changes", "Changes per committed write.")
          .Add({}, CountBuckets()),
      AddHistograms(registry, "hulld_snapshot_duration_seconds",
                    "Time to build the canonical snapshot of a hull version.")
          .Add({}, LatencyBuckets()),
  };
}

double ProcessorSeconds() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double Seconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace

Metrics::Metrics()
    : calls_(AddCounters(registry_, "hulld_requests_total", "Finished calls, by rpc and code.")),
      limits_hit_(AddCounters(registry_, "hulld_limits_hit_total",
                              "Calls and pairs refused by a limit, by its flag.")),
      auth_failures_(AddCounters(registry_, "hulld_auth_failures_total",
                                 "Calls refused by authentication or authorization, by reason.")),
      queue_tasks_(AddGauges(registry_, "hulld_queue_tasks", "Tasks waiting for a thread.")),
      queue_wait_(AddHistograms(registry_, "hulld_queue_wait_seconds",
                                "Time that tasks waited for a thread.")),
      token_calls_(
          AddCounters(registry_, "hulld_token_requests_total", "Finished calls, by token name.")),
      exact_fallbacks_(AddCounters(registry_, "hulld_exact_fallbacks_total",
                                   "Pairs that required exact arithmetic.")
                           .Add({})),
      store_(AddStore(registry_)),
      backup_saved_(AddGauges(registry_, "hulld_backup_saved_timestamp_seconds",
                              "Unix time of the last complete backup; 0: never.")
                        .Add({})) {
  auto& running = AddGauges(registry_, "hulld_requests_running",
                            "Running calls, including open streams, by rpc.");
  auto& call_seconds = AddHistograms(registry_, "hulld_request_duration_seconds",
                                     "Duration of calls, from arrival to end.");
  for (size_t i = 0; i < kRpcCount; ++i) {
    const std::string rpc = RpcName(static_cast<Rpc>(i));
    running_[i] = &running.Add({{"rpc", rpc}});
    calls_ok_[i] = &calls_.Add({{"rpc", rpc}, {"code", "OK"}});
    call_seconds_[i] = &call_seconds.Add({{"rpc", rpc}}, LatencyBuckets());
    message_seconds_[i] = nullptr;
  }
  auto& message_seconds =
      AddHistograms(registry_, "hulld_message_duration_seconds",
                    "Duration of messages on open streams, from arrival to answer.");
  for (const Rpc rpc : kStreamedRpcs) {
    message_seconds_[static_cast<size_t>(rpc)] =
        &message_seconds.Add({{"rpc", RpcName(rpc)}}, LatencyBuckets());
  }
  points_ = {
      &AddCounter("hulld_points_received_total", "Points of committed chunks.", {}),
      &AddCounter("hulld_points_kept_total", "Points of committed chunks that became vertices.",
                  {}),
      &AddCounter("hulld_points_duplicate_total",
                  "Points of committed chunks that were vertices already.", {}),
      &AddCounter("hulld_points_inside_total", "Points of committed chunks inside the hull.", {})};
  auto& pairs = AddCounters(registry_, "hulld_pairs_total", "Pairs answered, by deciding stage.");
  for (size_t i = 0; i < kRungNames.size(); ++i) pairs_[i] = &pairs.Add({{"rung", kRungNames[i]}});
  // Exist from the start: the rate of a series does not include its first value.
  for (const char* const reason : {"unauthenticated", "permission_denied"}) {
    auth_failures_.Add({{"reason", reason}});
  }
  AddProcess();
}

void Metrics::AddProcess() {
  AddGauges(registry_, "hulld_build_info",
            "1, with the versions of hulld, its compiler and gRPC as labels.")
      .Add({{"version", HULLD_VERSION}, {"compiler", __VERSION__}, {"grpc", grpc::Version()}})
      .Set(1);
  AddGauges(registry_, "process_start_time_seconds", "Unix time of the server's start.")
      .Add({})
      .SetToCurrentTime();
  AddGauge("process_max_fds", "Maximum number of open file descriptors of the process.",
           [] { return static_cast<double>(MaxDescriptors()); });
  AddGauge("process_resident_memory_bytes", "Resident memory of the process.",
           [] { return static_cast<double>(ReadResidentMemory().bytes); });
  AddCounter("process_cpu_seconds_total", "Processor time of the process.", {}, ProcessorSeconds);
}

void Metrics::CountCall(Rpc rpc, absl::StatusCode code,
                        std::chrono::steady_clock::duration duration) {
  const auto i = static_cast<size_t>(rpc);
  if (code == absl::StatusCode::kOk) {
    calls_ok_[i]->Increment();
  } else {
    calls_.Add({{"rpc", RpcName(rpc)}, {"code", absl::StatusCodeToString(code)}}).Increment();
  }
  call_seconds_[i]->Observe(Seconds(duration));
}

void Metrics::CountMessage(Rpc rpc, std::chrono::steady_clock::duration duration) {
  prometheus::Histogram* const seconds = message_seconds_[static_cast<size_t>(rpc)];
  HULLD_CHECK(seconds != nullptr);
  seconds->Observe(Seconds(duration));
}

void Metrics::CountLimit(const std::string& limit) {
  limits_hit_.Add({{"limit", limit}}).Increment();
}

void Metrics::CountAuthFailure(const std::string& reason) {
  auth_failures_.Add({{"reason", reason}}).Increment();
}

void Metrics::CountToken(const std::string& token) {
  if (token.empty()) return;
  const std::lock_guard lock(tokens_mutex_);
  auto known = tokens_.find(token);
  if (known == tokens_.end()) {
    const std::string name = tokens_.size() < kMaxTokens ? token : "other";
    prometheus::Counter& counter = token_calls_.Add({{"token", name}});
    if (name != token) return counter.Increment();
    known = tokens_.emplace(token, &counter).first;
  }
  known->second->Increment();
}

void Metrics::CountPoints(const PointCounts& counts) {
  const uint64_t numbers[] = {counts.received, counts.outside, counts.duplicate, counts.inside};
  for (size_t i = 0; i < points_.size(); ++i) {
    if (numbers[i] > 0) points_[i]->Increment(static_cast<double>(numbers[i]));
  }
}

void Metrics::CountPairs(const RungCounts& counts) {
  for (size_t i = 0; i < pairs_.size(); ++i) {
    if (counts.by_rung[i] > 0) pairs_[i]->Increment(static_cast<double>(counts.by_rung[i]));
  }
  const uint64_t exact = counts.by_rung[static_cast<size_t>(Rung::kExact)];
  if (exact > 0) exact_fallbacks_.Increment(static_cast<double>(exact));
}

PoolMetrics Metrics::AddPool(const std::string& pool) {
  return {queue_tasks_.Add({{"pool", pool}}), queue_wait_.Add({{"pool", pool}}, LatencyBuckets())};
}

prometheus::Counter& Metrics::AddCounter(const std::string& name, const std::string& help,
                                         const std::map<std::string, std::string>& labels) {
  return AddCounters(registry_, name.c_str(), help.c_str()).Add(labels);
}

void Metrics::AddCounter(const std::string& name, const std::string& help,
                         const std::map<std::string, std::string>& labels,
                         std::function<double()> read) {
  prometheus::Counter& counter = AddCounter(name, help, labels);
  AddRefresh([&counter, read = std::move(read)] {
    const double passed = read() - counter.Value();
    if (passed > 0) counter.Increment(passed);
  });
}

void Metrics::AddGauge(const std::string& name, const std::string& help,
                       std::function<double()> read) {
  prometheus::Gauge& gauge = AddGauges(registry_, name, help).Add({});
  AddRefresh([&gauge, read = std::move(read)] { gauge.Set(read()); });
}

void Metrics::AddRefresh(std::function<void()> refresh) {
  const std::lock_guard lock(refresh_mutex_);
  refresh_.push_back(std::move(refresh));
}

std::vector<prometheus::MetricFamily> Metrics::Collect() const {
  {
    const std::lock_guard lock(refresh_mutex_);
    for (const std::function<void()>& refresh : refresh_) refresh();
  }
  return registry_.Collect();
}

}  // namespace hulld::server
