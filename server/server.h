#ifndef HULLD_SERVER_SERVER_H_
#define HULLD_SERVER_SERVER_H_

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/access/guard.h"
#include "server/admin/maintenance_service.h"
#include "server/admin/reflection_service.h"
#include "server/admin/status_service.h"
#include "server/bodies/body_service.h"
#include "server/call/admission.h"
#include "server/collisions/collision_service.h"
#include "server/hulls/hull_service.h"
#include "server/process/executor.h"
#include "server/process/metrics.h"
#include "server/process/metrics_endpoint.h"
#include "server/process/task_pool.h"
#include "server/settings/config.h"
#include "server/shards/shard_pools.h"
#include "server/shards/shards.h"
#include "server/store/store.h"

namespace hulld::server {

// A running server: stores -> registries -> services -> gRPC.
class Server {
 public:
  // Opens the store and listens as `config` says. INVALID_ARGUMENT: --listen is malformed or needs
  // TLS or --insecure, or a file of certificates or tokens is wrong. UNAVAILABLE: the address
  // cannot be bound. Errors of RocksDbStore::Open or
  // PostgresStore::Open.
  // With --store=postgres this waits while another server is active, until should_stop, which may
  // be empty, says so: CANCELLED.
  static absl::StatusOr<std::unique_ptr<Server>> Start(const Config& config,
                                                       std::function<bool()> should_stop = {});

  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  // Cancels what runs and ends.
  ~Server();

  // Where it listens, with the port that was chosen.
  const std::string& address() const { return address_; }
  // Where Prometheus reads metrics; empty when nowhere.
  std::string metrics_address() const {
    return metrics_endpoint_ == nullptr ? "" : metrics_endpoint_->address();
  }
  const Metrics& metrics() const { return metrics_; }

  // Looks at the files of certificates and tokens now, rather than within the next interval.
  void ReloadFiles() { guard_->Reload(); }

  // Store::OnEnded: this server is to end, without draining.
  void OnStoreEnded(const std::function<void()>& ended) {
    for (const auto& store : stores_) store->OnEnded(ended);
  }

  // Turns health to NOT_SERVING and refuses new calls with UNAVAILABLE; running ones go on.
  void BeginDrain();

  // After BeginDrain: waits for the running calls; false when some still run at the end.
  bool WaitIdle(std::chrono::milliseconds timeout);

  // The end: BeginDrain; stops listening; tells clients to make their next calls over another
  // connection (HTTP/2's GOAWAY), so that those that know other servers go there; waits for the
  // running calls, and cancels them after `timeout`. Returns whether none was cancelled.
  bool Drain(std::chrono::milliseconds timeout);

 private:
  // The stores of a server, by shard, and which of them has which slot.
  struct Stores {
    std::vector<std::unique_ptr<Store>> stores;
    Shards::ShardOfSlot shard_of_slot{};
  };
  static absl::StatusOr<Stores> OpenStores(const Config& config,
                                           const std::function<bool()>& should_stop);

  Server(const Config& config, std::unique_ptr<Guard> guard, Stores stores);

  absl::Status Listen(const Config& config);
  void AddSizesToMetrics();
  void AddDescriptorsToMetrics();

  const std::unique_ptr<Guard> guard_;
  // All others report to it.
  Metrics metrics_;
  // Calls leave their ticket last of all, hence before what they use.
  Admission admission_;
  std::vector<std::unique_ptr<Store>> stores_;
  // Chunks and replacements, and what may wait for the store. Three kinds of pools, so that readers
  // never wait for writers, and reads of microseconds never wait for reads of seconds.
  ShardPools writers_;
  Shards shards_;
  ShardPools readers_;
  ShardPools long_readers_;
  // Answers.
  TaskPool pool_;
  Executor executor_;
  HullService hull_service_;
  BodyService body_service_;
  CollisionService collision_service_;
  StatusService status_service_;
  MaintenanceService maintenance_service_;
  ReflectionService reflection_service_;
  std::string address_;
  std::unique_ptr<grpc::Server> grpc_server_;
  // Reads from all of the above.
  std::unique_ptr<MetricsEndpoint> metrics_endpoint_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_SERVER_H_
