#include "server/server.h"

#include <absl/status/status.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "core/base/status_macros.h"
#include "grpc/reflection/v1alpha/reflection.grpc.pb.h"
#include "hulld/v1/body.grpc.pb.h"
#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "hulld/v1/maintenance.grpc.pb.h"
#include "hulld/v1/status.grpc.pb.h"
#include "server/access/secret_file.h"
#include "server/admin/admin_services.h"
#include "server/call/transport.h"
#include "server/collisions/collision_service.h"
#include "server/config_check.h"
#include "server/hulls/hull_service.h"
#include "server/network/guarded_sockets.h"
#include "server/process/descriptors.h"
#include "server/process/listen_address.h"
#include "server/settings/resource_limits.h"
#include "server/store/memory_store.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/rocksdb_store.h"

namespace hulld::server {
namespace {

// Names of the services of hulld, without those of gRPC's own protocols.
std::vector<std::string> OwnServices() {
  return {v1::HullService::service_full_name(), v1::BodyService::service_full_name(),
          v1::CollisionService::service_full_name(), v1::StatusService::service_full_name(),
          v1::MaintenanceService::service_full_name()};
}

std::vector<std::string> AllServices() {
  std::vector<std::string> names = OwnServices();
  names.emplace_back(grpc::health::v1::Health::service_full_name());
  names.emplace_back(grpc::reflection::v1alpha::ServerReflection::service_full_name());
  return names;
}

// At least two, so that one long task does not delay all other tasks.
int PoolThreads() { return std::max(2, DefaultThreads()); }

int AnswerThreads(const Config& config) {
  return config.threads > 0 ? config.threads : DefaultThreads();
}

absl::StatusOr<std::unique_ptr<Store>> OpenPostgres(const Config& config,
                                                    const std::function<bool()>& should_stop) {
  PostgresOptions options;
  HULLD_ASSIGN_OR_RETURN(std::string conninfo,
                         ReadSecretFile(config.postgres_conninfo_file, PostgresOptions::kSetting));
  options.conninfo = std::move(conninfo);
  options.take_over = config.take_over;
  options.shared = config.postgres_servers == "many";
  options.should_stop = should_stop;
  return PostgresStore::Open(std::move(options));
}

absl::StatusOr<std::unique_ptr<Store>> OpenStore(const Config& config,
                                                 const std::function<bool()>& should_stop) {
  if (config.store == "memory") return std::make_unique<MemoryStore>();
  if (config.store == "postgres") return OpenPostgres(config, should_stop);
  RocksDbOptions options;
  options.data_dir = config.data_dir;
  options.durability = config.durability == "sync" ? Durability::kSync : Durability::kRelaxed;
  options.sync_interval = Config::kRelaxedSyncInterval;
  options.env = config.store_env;
  return RocksDbStore::Open(std::move(options));
}

// State of the registry and the store at an exposition of metrics.
struct Measured {
  CacheStatistics cache;
  RegistrySizes sizes;
  CommitStatistics commits;
  std::chrono::nanoseconds longest_hold{0};
  StoreFailures failures;
  StoreDisk disk;
};

template <auto kPart, auto kField>
double Get(const Measured& now) {
  return static_cast<double>((now.*kPart).*kField);
}

// A metric read from that state.
struct Reading {
  const char* name;
  const char* help;
  double (*read)(const Measured& now);
  // Name and value of its label; null: none.
  const char* label = nullptr;
  const char* value = nullptr;
};

constexpr Reading kGauges[] = {
    {"hulld_hulls", "Hulls in the store.", Get<&Measured::sizes, &RegistrySizes::hull_count>},
    {"hulld_bodies", "Bodies in the store.", Get<&Measured::sizes, &RegistrySizes::body_count>},
    {"hulld_vertices", "Vertices of all hulls.",
     Get<&Measured::sizes, &RegistrySizes::vertex_count>},
    {"hulld_registry_lock_hold_max_seconds",
     "Longest time that the registry's lock was held within the last one to two minutes.",
     [](const Measured& now) { return std::chrono::duration<double>(now.longest_hold).count(); }},
    {"hulld_store_read_only", "1 while the store refuses changes, else 0.",
     Get<&Measured::commits, &CommitStatistics::failing>},
    {"hulld_cache_bytes",
     "Estimated bytes charged against the memory limit: hulls in memory, points in flight, "
     "streams.",
     Get<&Measured::cache, &CacheStatistics::bytes>},
    {"hulld_cache_reading_bytes",
     "Part of hulld_cache_bytes held by readers: requested versions and long answers.",
     Get<&Measured::cache, &CacheStatistics::reading_bytes>},
    {"hulld_cache_writing_bytes",
     "Part of hulld_cache_bytes held by writers: growing hulls, points in flight, streams.",
     Get<&Measured::cache, &CacheStatistics::writing_bytes>},
    {"hulld_cache_limit_bytes", "Limit of hulld_cache_bytes (--memory-limit).",
     Get<&Measured::cache, &CacheStatistics::limit_bytes>},
    {"hulld_store_disk_bytes", "Bytes of the store's files.",
     Get<&Measured::disk, &StoreDisk::bytes>},
    {"hulld_store_log_bytes", "Part of hulld_store_disk_bytes taken by the log.",
     Get<&Measured::disk, &StoreDisk::log_bytes>},
    {"hulld_store_free_bytes", "Free bytes on the store's disk.",
     [](const Measured& now) {
       // NaN is never less than a number, so no alert fires.
       return now.disk.free_bytes.has_value() ? static_cast<double>(*now.disk.free_bytes)
                                              : std::numeric_limits<double>::quiet_NaN();
     }},
    {"hulld_store_stalled", "1 while the store throttles or stops writes, else 0.",
     Get<&Measured::disk, &StoreDisk::is_stalled>},
};
constexpr char kLookups[] = "hulld_cache_lookups_total";
constexpr char kLookupsHelp[] = "Hull lookups, by cache hit or miss.";
constexpr char kFailures[] = "hulld_store_failures_total";
constexpr char kFailuresHelp[] = "Failed store operations, by operation.";
constexpr Reading kCounters[] = {
    {kLookups, kLookupsHelp, Get<&Measured::cache, &CacheStatistics::hits>, "result", "hit"},
    {kLookups, kLookupsHelp, Get<&Measured::cache, &CacheStatistics::misses>, "result", "miss"},
    {"hulld_cache_evictions_total", "Hulls evicted from memory.",
     Get<&Measured::cache, &CacheStatistics::evictions>},
    {"hulld_store_damaged_records_total", "Stored records with a wrong checksum or content.",
     Get<&Measured::cache, &CacheStatistics::damaged>},
    {kFailures, kFailuresHelp, Get<&Measured::failures, &StoreFailures::write>, "operation",
     "write"},
    {kFailures, kFailuresHelp, Get<&Measured::failures, &StoreFailures::sync>, "operation", "sync"},
    {kFailures, kFailuresHelp, Get<&Measured::failures, &StoreFailures::read>, "operation", "read"},
    {"hulld_store_stalls_total", "Times that the store throttled or stopped writes to catch up.",
     Get<&Measured::disk, &StoreDisk::stalls>},
};

// Binds the addresses and releases them, so that a wrong one fails before RocksDB creates its
// directory. Over PostgreSQL, a standby may wait for the address of the active server.
absl::Status CheckAddresses(const Config& config) {
  HULLD_RETURN_IF_ERROR(CheckListening(config));
  if (config.store != "rocksdb") return absl::OkStatus();
  HULLD_ASSIGN_OR_RETURN(const ListenAddress address, ParseListenAddress(config.listen));
  HULLD_RETURN_IF_ERROR(CheckSocketFree(address));
  ConnectionTable table(1, 1);
  Metrics metrics;
  HULLD_ASSIGN_OR_RETURN(const auto acceptor, ConnectionAcceptor::Listen(address, table, metrics));
  if (config.metrics_address.empty()) return absl::OkStatus();
  return MetricsEndpoint::Start(config.metrics_address, config.metrics_insecure, metrics).status();
}

}  // namespace

Server::Server(const Config& config, std::unique_ptr<Guard> guard, std::unique_ptr<Store> store)
    : guard_(std::move(guard)),
      connection_table_(config.limits.max_connections, config.limits.max_connections_per_address),
      admission_(config.limits, metrics_, connection_table_, guard_.get()),
      store_(std::move(store)),
      writers_(PoolThreads(), metrics_.AddPool("writers")),
      registry_(*store_, config.limits, writers_, metrics_.AddPool("preparers"),
                metrics_.AddPool("loaders")),
      readers_(PoolThreads(), metrics_.AddPool("readers")),
      long_readers_(PoolThreads(), metrics_.AddPool("long_readers")),
      pool_(AnswerThreads(config), metrics_.AddPool("single_calls"), metrics_.AddPool("slices")),
      parts_{*store_, registry_, admission_, writers_, readers_, long_readers_, pool_, waiting_},
      health_service_(admission_, OwnServices()) {
  services_.push_back(MakeHullService(parts_));
  services_.push_back(MakeBodyService(parts_));
  services_.push_back(MakeCollisionService(parts_));
  services_.push_back(MakeStatusService(parts_));
  services_.push_back(MakeMaintenanceService(parts_));
  services_.push_back(MakeReflectionService(admission_, AllServices()));
  admission_.SetBacklog([this](Rpc rpc) {
    if (UsesWriters(rpc)) return writers_.waiting();
    return readers_.waiting() + long_readers_.waiting() + pool_.waiting() + waiting_.count();
  });
  guard_->OnTokensChanged([this] {
    const size_t ended = admission_.EndRevoked();
    if (ended > 0) spdlog::info("ended {} calls whose tokens were revoked", ended);
  });
  AddSizesToMetrics();
}

void Server::AddSizesToMetrics() {
  registry_.SetMetrics(metrics_.store());
  const auto measured = std::make_shared<Measured>();
  metrics_.AddRefresh([this, measured] {
    *measured = {registry_.Cache(),   registry_.Sizes(),
                 registry_.Commits(), registry_.Holds().longest,
                 store_->failures(),  store_->disk().value_or(StoreDisk{.free_bytes = 0})};
  });
  for (const Reading& each : kGauges) {
    metrics_.AddGauge(each.name, each.help, [&each, measured] { return each.read(*measured); });
  }
  for (const Reading& each : kCounters) {
    std::map<std::string, std::string> labels;
    if (each.label != nullptr) labels[each.label] = each.value;
    metrics_.AddCounter(each.name, each.help, labels,
                        [&each, measured] { return each.read(*measured); });
  }
}

absl::StatusOr<std::unique_ptr<Server>> Server::Start(const Config& config,
                                                      std::function<bool()> should_stop) {
  HULLD_RETURN_IF_ERROR(CheckAddresses(config));
  HULLD_ASSIGN_OR_RETURN(std::unique_ptr<Guard> guard, Guard::Load(config));
  HULLD_ASSIGN_OR_RETURN(std::unique_ptr<Store> store, OpenStore(config, should_stop));
  std::unique_ptr<Server> server(new Server(config, std::move(guard), std::move(store)));
  HULLD_RETURN_IF_ERROR(server->registry_.Load());
  HULLD_RETURN_IF_ERROR(server->Listen(config));
  return server;
}

absl::Status Server::Listen(const Config& config) {
  const absl::StatusOr<ListenAddress> address = ParseListenAddress(config.listen);
  HULLD_RETURN_IF_ERROR(CheckSocketFree(*address));

  grpc::ServerBuilder builder;
  HULLD_ASSIGN_OR_RETURN(acceptor_,
                         ConnectionAcceptor::Listen(*address, connection_table_, metrics_));
  auto connections = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
      guard_->credentials());
  SetTransport(config, builder);
  builder.RegisterService(&health_service_);
  for (const auto& service : services_) builder.RegisterService(service.get());
  grpc_server_ = builder.BuildAndStart();
  if (grpc_server_ == nullptr) return absl::InternalError("gRPC failed to start the server");
  address_ = address->Format(acceptor_->port());
  AddDescriptorsToMetrics();
  FrameLimits frames;
  frames.all_half_open_bytes = MaxHalfOpenBytes(config);
  acceptor_->Start(std::move(connections), config.has_tls() ? nullptr : &frames);
  if (config.metrics_address.empty()) return absl::OkStatus();
  HULLD_ASSIGN_OR_RETURN(
      metrics_endpoint_,
      MetricsEndpoint::Start(config.metrics_address, config.metrics_insecure, metrics_));
  return absl::OkStatus();
}

void Server::AddDescriptorsToMetrics() {
  metrics_.AddGauge("process_open_fds", "Open file descriptors of the process.",
                    [] { return static_cast<double>(CountDescriptors()); });
  metrics_.AddGauge("hulld_connections", "Open client connections.",
                    [this] { return static_cast<double>(connection_table_.size()); });
  metrics_.AddGauge("hulld_half_open_streams",
                    "Streams with an incomplete first message, without TLS.",
                    [] { return static_cast<double>(HalfOpenStreams()); });
  for (size_t i = 1; i < FrameGuard::kVerdictCount; ++i) {
    metrics_.AddCounter("hulld_connections_closed_total", "",
                        {{"reason", FrameGuard::Name(static_cast<FrameGuard::Verdict>(i))}},
                        [i] { return static_cast<double>(ClosedByGuard()[i]); });
  }
}

void Server::BeginDrain() {
  health_service_.EndServing();
  admission_.BeginDrain();
  registry_.feed().EndAll();
}

bool Server::WaitIdle(std::chrono::milliseconds timeout) {
  return admission_.WaitIdle(std::chrono::steady_clock::now() + timeout);
}

bool Server::Drain(std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  BeginDrain();
  acceptor_->Stop();
  std::thread closing([this, deadline] {
    const auto left = deadline - std::chrono::steady_clock::now();
    grpc_server_->Shutdown(std::chrono::system_clock::now() + left);
  });
  // A server that became idle only after the deadline has cancelled calls, even if this thread
  // notices late.
  const bool is_idle = admission_.WaitIdle(deadline) && std::chrono::steady_clock::now() < deadline;
  closing.join();
  return is_idle;
}

Server::~Server() {
  guard_->OnTokensChanged(nullptr);
  if (grpc_server_ == nullptr) return;
  acceptor_->Stop();
  admission_.BeginDrain();
  registry_.feed().EndAll();
  // Cancels the running calls; core polls for cancellation, so they end soon.
  grpc_server_->Shutdown(std::chrono::system_clock::now());
  admission_.WaitIdle(std::chrono::steady_clock::time_point::max());
}

}  // namespace hulld::server
