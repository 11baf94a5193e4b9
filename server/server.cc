#include "server/server.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <grpcpp/health_check_service_interface.h>
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

// With those of gRPC's own protocols.
std::vector<std::string> AllServices() {
  std::vector<std::string> names = {
      "grpc.health.v1.Health", grpc::reflection::v1alpha::ServerReflection::service_full_name()};
  names.insert(names.begin(), std::begin(kServices), std::end(kServices));
  return names;
}

// At least two, so that one long task does not hold up all others.
int PoolThreads() { return std::max(2, DefaultThreads()); }

int AnswerThreads(const Config& config) {
  return config.threads > 0 ? config.threads : DefaultThreads();
}

// slots: which the database holds; empty: all.
absl::StatusOr<std::unique_ptr<Store>> OpenPostgres(const Config& config,
                                                    const std::string& conninfo_file,
                                                    const char* setting, const std::string& slots,
                                                    const std::function<bool()>& should_stop) {
  absl::StatusOr<std::string> conninfo = ReadSecretFile(conninfo_file, setting);
  if (!conninfo.ok()) return conninfo.status();
  PostgresOptions options;
  options.conninfo = *std::move(conninfo);
  options.setting = slots.empty() ? setting : absl::StrCat(setting, ", ", conninfo_file);
  options.take_over = config.take_over;
  options.shared = config.postgres_servers == "many";
  options.slots = slots;
  options.should_stop = should_stop;
  return PostgresStore::Open(std::move(options));
}

absl::StatusOr<std::unique_ptr<Store>> OpenStore(const Config& config,
                                                 const std::function<bool()>& should_stop) {
  if (config.store == "memory") return std::make_unique<MemoryStore>();
  if (config.store == "postgres") {
    return OpenPostgres(config, config.postgres_conninfo_file, "--postgres-conninfo-file", "",
                        should_stop);
  }
  RocksDbOptions options;
  options.data_dir = config.data_dir;
  options.durability = config.durability == "sync" ? Durability::kSync : Durability::kRelaxed;
  options.sync_interval = Config::kRelaxedSyncInterval;
  options.env = config.store_env;
  return RocksDbStore::Open(std::move(options));
}

}  // namespace

absl::StatusOr<Server::Stores> Server::OpenStores(const Config& config,
                                                  const std::function<bool()>& should_stop) {
  Stores opened;
  if (config.postgres_shards.empty()) {
    absl::StatusOr<std::unique_ptr<Store>> store = OpenStore(config, should_stop);
    if (!store.ok()) return store.status();
    opened.stores.push_back(*std::move(store));
    return opened;
  }
  const absl::StatusOr<ShardFile> file = ReadShardFile(config.postgres_shards, "--postgres-shards");
  if (!file.ok()) return file.status();
  opened.shard_of_slot = file->shard_of;
  for (const ShardFile::Shard& shard : file->shards) {
    absl::StatusOr<std::unique_ptr<Store>> store =
        OpenPostgres(config, shard.conninfo_file, "--postgres-shards", shard.slots, should_stop);
    if (!store.ok()) return store.status();
    for (const auto& other : opened.stores) {
      if (other->id() != (*store)->id()) continue;
      return absl::InvalidArgumentError(
          absl::StrCat("--postgres-shards: ", shard.conninfo_file,
                       " leads to the database of another line; each shard has one of its own"));
    }
    opened.stores.push_back(*std::move(store));
  }
  return opened;
}

namespace {

std::vector<Store*> Pointers(const std::vector<std::unique_ptr<Store>>& stores) {
  std::vector<Store*> pointers;
  pointers.reserve(stores.size());
  for (const auto& store : stores) pointers.push_back(store.get());
  return pointers;
}

}  // namespace

Server::Server(const Config& config, std::unique_ptr<Guard> guard, Stores stores)
    : guard_(std::move(guard)),
      admission_(config.limits, metrics_),
      stores_(std::move(stores.stores)),
      writers_(stores_.size(), PoolThreads(), metrics_.AddPool("writers")),
      shards_(Pointers(stores_), stores.shard_of_slot, config.limits, writers_.all(),
              metrics_.AddPool("preparers"), metrics_.AddPool("loaders")),
      readers_(stores_.size(), PoolThreads(), metrics_.AddPool("readers")),
      long_readers_(stores_.size(), PoolThreads(), metrics_.AddPool("long_readers")),
      pool_(AnswerThreads(config), metrics_.AddPool("single_calls"), metrics_.AddPool("slices")),
      executor_(pool_.threads(), metrics_.AddPool("executor")),
      hull_service_(shards_, admission_, writers_, readers_, long_readers_),
      body_service_(shards_, admission_, readers_),
      collision_service_(shards_, admission_, readers_, long_readers_, pool_, executor_),
      status_service_(shards_, admission_),
      maintenance_service_(*stores_.front(), shards_, admission_, long_readers_.of_several()),
      reflection_service_(admission_, AllServices()) {
  admission_.SetAuthenticator(guard_->authenticator());
  admission_.SetBacklog([this](Rpc rpc) {
    if (UsesWriters(rpc)) return writers_.waiting();
    return readers_.waiting() + long_readers_.waiting() + pool_.waiting() +
           collision_service_.waiting();
  });
  guard_->OnTokensChanged([this] {
    const size_t ended = admission_.EndRevoked(
        [this](const Caller& caller) { return guard_->authenticator().Knows(caller); });
    if (ended > 0) spdlog::info("{} calls ended, as their tokens are no longer valid", ended);
  });
  AddSizesToMetrics();
}

void Server::AddSizesToMetrics() {
  shards_.SetMetrics(metrics_.store());
  metrics_.AddRefresh([this] {
    const auto advance = [](prometheus::Counter& counter, uint64_t now) {
      const double passed = static_cast<double>(now) - counter.Value();
      if (passed > 0) counter.Increment(passed);
    };
    const StoreMetrics& store = metrics_.store();
    const CacheStatistics cache = shards_.Cache();
    advance(store.cache_hits, cache.hits);
    advance(store.cache_misses, cache.misses);
    advance(store.cache_evictions, cache.evictions);
    advance(store.damaged_records, cache.damaged);
    const StoreFailures failures = shards_.failures();
    advance(store.write_failures, failures.write);
    advance(store.sync_failures, failures.sync);
    advance(store.read_failures, failures.read);
    store.cache_bytes.Set(static_cast<double>(cache.bytes));
    store.cache_reading_bytes.Set(static_cast<double>(cache.reading_bytes));
    store.cache_writing_bytes.Set(static_cast<double>(cache.writing_bytes));
    store.cache_limit_bytes.Set(static_cast<double>(cache.limit_bytes));
    store.read_only.Set(shards_.Commits().failing ? 1 : 0);
    if (const std::optional<StoreDisk> disk = shards_.disk(); disk.has_value()) {
      store.disk_bytes.Set(static_cast<double>(disk->bytes));
      store.log_bytes.Set(static_cast<double>(disk->log_bytes));
      // NaN is not less than any number, so that no alert fires.
      store.free_bytes.Set(disk->free_bytes.has_value() ? static_cast<double>(*disk->free_bytes)
                                                        : std::numeric_limits<double>::quiet_NaN());
      store.stalled.Set(disk->is_stalled ? 1 : 0);
      advance(store.stalls, disk->stalls);
    }
  });
  metrics_.AddGauge("hulld_hulls", "Hulls in the store.",
                    [this] { return static_cast<double>(shards_.Sizes().hull_count); });
  metrics_.AddGauge("hulld_bodies", "Bodies in the store.",
                    [this] { return static_cast<double>(shards_.Sizes().body_count); });
  metrics_.AddGauge("hulld_registry_lock_hold_max_seconds",
                    "Longest hold of the registry's lock within the last one to two minutes.",
                    [this] {
                      const std::chrono::duration<double> longest = shards_.Holds().longest;
                      return longest.count();
                    });
  metrics_.AddGauge("hulld_vertices", "Vertices of all hulls.",
                    [this] { return static_cast<double>(shards_.Sizes().vertex_count); });
}

absl::StatusOr<std::unique_ptr<Server>> Server::Start(const Config& config,
                                                      std::function<bool()> should_stop) {
  absl::StatusOr<std::unique_ptr<Guard>> guard = Guard::Load(config);
  if (!guard.ok()) return guard.status();
  absl::StatusOr<Stores> stores = OpenStores(config, should_stop);
  if (!stores.ok()) return stores.status();
  std::unique_ptr<Server> server(new Server(config, *std::move(guard), *std::move(stores)));
  if (absl::Status s = server->shards_.Load(); !s.ok()) return s;
  if (absl::Status s = server->Listen(config); !s.ok()) return s;
  return server;
}

absl::Status Server::Listen(const Config& config) {
  if (absl::Status s = CheckListening(config); !s.ok()) return s;
  const absl::StatusOr<ListenAddress> address = ParseListenAddress(config.listen);
  if (absl::Status s = CheckSocketFree(*address); !s.ok()) return s;

  grpc::EnableDefaultHealthCheckService(true);
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(config.listen, guard_->credentials(), &port);
  SetTransport(config, builder);
  builder.RegisterService(&hull_service_);
  builder.RegisterService(&body_service_);
  builder.RegisterService(&collision_service_);
  builder.RegisterService(&status_service_);
  builder.RegisterService(&maintenance_service_);
  builder.RegisterService(&reflection_service_);
  grpc_server_ = builder.BuildAndStart();
  if (grpc_server_ == nullptr || (port == 0 && !address->is_unix())) {
    return ExplainBindFailure(*address);
  }
  address_ = address->Format(port);
  AddDescriptorsToMetrics();
  grpc::HealthCheckServiceInterface* health = grpc_server_->GetHealthCheckService();
  for (const char* const service : kServices) {
    health->SetServingStatus(service, true);
  }
  if (config.metrics_address.empty()) return absl::OkStatus();
  absl::StatusOr<std::unique_ptr<MetricsEndpoint>> endpoint =
      MetricsEndpoint::Start(config.metrics_address, config.metrics_insecure, metrics_);
  if (!endpoint.ok()) return endpoint.status();
  metrics_endpoint_ = *std::move(endpoint);
  return absl::OkStatus();
}

void Server::AddDescriptorsToMetrics() {
  prometheus::Gauge& descriptors =
      metrics_.AddGauge("process_open_fds", "Descriptors that the process has open.");
  prometheus::Gauge& connections =
      metrics_.AddGauge("hulld_connections", "Connections that clients have open.");
  metrics_.AddRefresh([this, &descriptors, &connections] {
    const OpenDescriptors open = CountDescriptors(address_);
    descriptors.Set(static_cast<double>(open.count));
    connections.Set(static_cast<double>(open.connections));
  });
}

void Server::BeginDrain() {
  grpc_server_->GetHealthCheckService()->SetServingStatus(false);
  admission_.BeginDrain();
  shards_.EndWatches();
}

bool Server::WaitIdle(std::chrono::milliseconds timeout) {
  return admission_.WaitIdle(std::chrono::steady_clock::now() + timeout);
}

bool Server::Drain(std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  BeginDrain();
  std::thread closing([this, deadline] {
    const auto left = deadline - std::chrono::steady_clock::now();
    grpc_server_->Shutdown(std::chrono::system_clock::now() + left);
  });
  // A server that is idle only after the deadline has cancelled calls, however late this thread
  // notices.
  const bool is_idle = admission_.WaitIdle(deadline) && std::chrono::steady_clock::now() < deadline;
  closing.join();
  return is_idle;
}

Server::~Server() {
  guard_->OnTokensChanged(nullptr);
  if (grpc_server_ == nullptr) return;
  admission_.BeginDrain();
  shards_.EndWatches();
  // Cancels what still runs; core polls for that, so the calls end soon.
  grpc_server_->Shutdown(std::chrono::system_clock::now());
  admission_.WaitIdle(std::chrono::steady_clock::time_point::max());
}

}  // namespace hulld::server
