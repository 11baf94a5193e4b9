#include "server/server.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <limits>
#include <thread>
#include <utility>

#include "server/access/secret_file.h"
#include "server/call/transport.h"
#include "server/config_check.h"
#include "server/contract/status_map.h"
#include "server/network/guarded_sockets.h"
#include "server/process/descriptors.h"
#include "server/process/listen_address.h"
#include "server/settings/cpu_limit.h"
#include "server/store/memory_store.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/rocksdb_store.h"

namespace hulld::server {
namespace {

constexpr const char* kServices[] = {
    v1::HullService::service_full_name(), v1::BodyService::service_full_name(),
    v1::CollisionService::service_full_name(), v1::StatusService::service_full_name(),
    v1::MaintenanceService::service_full_name()};

std::vector<std::string> OwnServices() { return {std::begin(kServices), std::end(kServices)}; }

// Includes services of gRPC's own protocols.
std::vector<std::string> AllServices() {
  std::vector<std::string> names = {
      grpc::health::v1::Health::service_full_name(),
      grpc::reflection::v1alpha::ServerReflection::service_full_name()};
  names.insert(names.begin(), std::begin(kServices), std::end(kServices));
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
  absl::StatusOr<std::string> conninfo =
      ReadSecretFile(config.postgres_conninfo_file, options.setting);
  if (!conninfo.ok()) return conninfo.status();
  options.conninfo = *std::move(conninfo);
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

}  // namespace

Server::Server(const Config& config, std::unique_ptr<Guard> guard, std::unique_ptr<Store> store)
    : guard_(std::move(guard)),
      connection_table_(config.limits.max_connections, config.limits.max_connections_per_address),
      admission_(config.limits, metrics_),
      store_(std::move(store)),
      writers_(PoolThreads(), metrics_.AddPool("writers")),
      registry_(*store_, config.limits, writers_, metrics_.AddPool("preparers"),
                metrics_.AddPool("loaders")),
      readers_(PoolThreads(), metrics_.AddPool("readers")),
      long_readers_(PoolThreads(), metrics_.AddPool("long_readers")),
      pool_(AnswerThreads(config), metrics_.AddPool("single_calls"), metrics_.AddPool("slices")),
      hull_service_(registry_, admission_, writers_, readers_, long_readers_),
      body_service_(registry_, admission_, readers_),
      collision_service_(registry_, admission_, readers_, long_readers_, pool_),
      status_service_(registry_, admission_),
      maintenance_service_(*store_, registry_, admission_, long_readers_),
      health_service_(admission_, OwnServices()),
      reflection_service_(admission_, AllServices()) {
  admission_.SetConnections(connection_table_);
  admission_.SetAuthenticator(guard_->authenticator());
  admission_.SetBacklog([this](Rpc rpc) {
    if (UsesWriters(rpc)) return writers_.waiting();
    return readers_.waiting() + long_readers_.waiting() + pool_.waiting() +
           collision_service_.waiting();
  });
  guard_->OnTokensChanged([this] {
    const size_t ended = admission_.EndRevoked(
        [this](const Caller& caller) { return guard_->authenticator().Knows(caller); });
    if (ended > 0) spdlog::info("ended {} calls whose tokens were revoked", ended);
  });
  AddSizesToMetrics();
}

void Server::AddSizesToMetrics() {
  registry_.SetMetrics(metrics_.store());
  metrics_.AddRefresh([this] {
    const auto advance = [](prometheus::Counter& counter, uint64_t now) {
      const double passed = static_cast<double>(now) - counter.Value();
      if (passed > 0) counter.Increment(passed);
    };
    const StoreMetrics& store = metrics_.store();
    const CacheStatistics cache = registry_.Cache();
    advance(store.cache_hits, cache.hits);
    advance(store.cache_misses, cache.misses);
    advance(store.cache_evictions, cache.evictions);
    advance(store.damaged_records, cache.damaged);
    const StoreFailures failures = store_->failures();
    advance(store.write_failures, failures.write);
    advance(store.sync_failures, failures.sync);
    advance(store.read_failures, failures.read);
    store.cache_bytes.Set(static_cast<double>(cache.bytes));
    store.cache_reading_bytes.Set(static_cast<double>(cache.reading_bytes));
    store.cache_writing_bytes.Set(static_cast<double>(cache.writing_bytes));
    store.cache_limit_bytes.Set(static_cast<double>(cache.limit_bytes));
    store.read_only.Set(registry_.Commits().failing ? 1 : 0);
    if (const std::optional<StoreDisk> disk = store_->disk(); disk.has_value()) {
      store.disk_bytes.Set(static_cast<double>(disk->bytes));
      store.log_bytes.Set(static_cast<double>(disk->log_bytes));
      // NaN compares less than no number, so no alert fires.
      store.free_bytes.Set(disk->free_bytes.has_value() ? static_cast<double>(*disk->free_bytes)
                                                        : std::numeric_limits<double>::quiet_NaN());
      store.stalled.Set(disk->is_stalled ? 1 : 0);
      advance(store.stalls, disk->stalls);
    }
  });
  metrics_.AddGauge("hulld_hulls", "Hulls in the store.",
                    [this] { return static_cast<double>(registry_.Sizes().hull_count); });
  metrics_.AddGauge("hulld_bodies", "Bodies in the store.",
                    [this] { return static_cast<double>(registry_.Sizes().body_count); });
  metrics_.AddGauge("hulld_registry_lock_hold_max_seconds",
                    "Longest hold of the registry's lock within the last one to two minutes.",
                    [this] {
                      const std::chrono::duration<double> longest = registry_.Holds().longest;
                      return longest.count();
                    });
  metrics_.AddGauge("hulld_vertices", "Vertices of all hulls.",
                    [this] { return static_cast<double>(registry_.Sizes().vertex_count); });
}

absl::StatusOr<std::unique_ptr<Server>> Server::Start(const Config& config,
                                                      std::function<bool()> should_stop) {
  absl::StatusOr<std::unique_ptr<Guard>> guard = Guard::Load(config);
  if (!guard.ok()) return guard.status();
  absl::StatusOr<std::unique_ptr<Store>> store = OpenStore(config, should_stop);
  if (!store.ok()) return store.status();
  std::unique_ptr<Server> server(new Server(config, *std::move(guard), *std::move(store)));
  if (absl::Status s = server->registry_.Load(); !s.ok()) return s;
  if (absl::Status s = server->Listen(config); !s.ok()) return s;
  return server;
}

absl::Status Server::Listen(const Config& config) {
  if (absl::Status s = CheckListening(config); !s.ok()) return s;
  const absl::StatusOr<ListenAddress> address = ParseListenAddress(config.listen);
  if (absl::Status s = CheckSocketFree(*address); !s.ok()) return s;

  grpc::ServerBuilder builder;
  auto acceptor = ConnectionAcceptor::Listen(*address, connection_table_, metrics_);
  if (!acceptor.ok()) return acceptor.status();
  acceptor_ = *std::move(acceptor);
  auto connections = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
      guard_->credentials());
  SetTransport(config, builder);
  builder.RegisterService(&hull_service_);
  builder.RegisterService(&body_service_);
  builder.RegisterService(&collision_service_);
  builder.RegisterService(&status_service_);
  builder.RegisterService(&maintenance_service_);
  builder.RegisterService(&health_service_);
  builder.RegisterService(&reflection_service_);
  grpc_server_ = builder.BuildAndStart();
  if (grpc_server_ == nullptr) return absl::InternalError("gRPC failed to start the server");
  address_ = address->Format(acceptor_->port());
  AddDescriptorsToMetrics();
  const FrameLimits frames;
  acceptor_->Start(std::move(connections), config.has_tls() ? nullptr : &frames);
  if (config.metrics_address.empty()) return absl::OkStatus();
  absl::StatusOr<std::unique_ptr<MetricsEndpoint>> endpoint =
      MetricsEndpoint::Start(config.metrics_address, config.metrics_insecure, metrics_);
  if (!endpoint.ok()) return endpoint.status();
  metrics_endpoint_ = *std::move(endpoint);
  return absl::OkStatus();
}

void Server::AddDescriptorsToMetrics() {
  prometheus::Gauge& descriptors =
      metrics_.AddGauge("process_open_fds", "Open file descriptors of the process.");
  prometheus::Gauge& connections =
      metrics_.AddGauge("hulld_connections", "Open client connections.");
  metrics_.AddRefresh([this, &descriptors, &connections] {
    descriptors.Set(static_cast<double>(CountDescriptors()));
    connections.Set(static_cast<double>(connection_table_.size()));
  });
  metrics_.AddGauge("hulld_half_open_streams",
                    "Streams with an incomplete first message, without TLS.",
                    [] { return static_cast<double>(HalfOpenStreams()); });
  std::vector<prometheus::Counter*> closed;
  for (size_t i = 1; i < FrameGuard::kVerdictCount; ++i) {
    closed.push_back(
        &metrics_.AddCounter("hulld_connections_closed_total", "",
                             {{"reason", FrameGuard::Name(static_cast<FrameGuard::Verdict>(i))}}));
  }
  metrics_.AddRefresh([closed] {
    const auto counts = ClosedByGuard();
    for (size_t i = 0; i < closed.size(); ++i) {
      closed[i]->Increment(static_cast<double>(counts[i + 1]) - closed[i]->Value());
    }
  });
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
