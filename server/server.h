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
#include "server/admin/health_service.h"
#include "server/call/admission.h"
#include "server/call/service_parts.h"
#include "server/network/connection_acceptor.h"
#include "server/network/connection_table.h"
#include "server/process/metrics.h"
#include "server/process/metrics_endpoint.h"
#include "server/process/task_pool.h"
#include "server/registry/registry.h"
#include "server/settings/config.h"
#include "server/store/store.h"

namespace hulld::server {

// A running server: store -> registry -> services -> gRPC.
class Server {
 public:
  // Opens the store and listens according to `config`. INVALID_ARGUMENT: --listen is malformed or
  // needs TLS or --insecure, or a file of certificates or tokens is wrong. UNAVAILABLE: the address
  // cannot be bound. Errors of RocksDbStore::Open or PostgresStore::Open. With --store=postgres,
  // blocks while another server is active; CANCELLED: should_stop, which may be empty, returned
  // true.
  static absl::StatusOr<std::unique_ptr<Server>> Start(const Config& config,
                                                       std::function<bool()> should_stop = {});

  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  // Cancels the running calls and ends.
  ~Server();

  // The address with the chosen port.
  const std::string& address() const { return address_; }
  // Address of the metrics endpoint; empty if disabled.
  std::string metrics_address() const {
    return metrics_endpoint_ == nullptr ? "" : metrics_endpoint_->address();
  }
  const Metrics& metrics() const { return metrics_; }

  // Checks the files of certificates and tokens now instead of at the next interval.
  void ReloadFiles() { guard_->Reload(); }

  // Registry::RestIdleHulls.
  void RestIdleHulls() { registry_.RestIdleHulls(); }

  // Registers a callback as Store::OnEnded does: this server must then end without draining.
  void OnStoreEnded(std::function<void()> ended) { store_->OnEnded(std::move(ended)); }

  // Sets health to NOT_SERVING and refuses new calls with UNAVAILABLE; running calls continue.
  void BeginDrain();

  // After BeginDrain: waits for the running calls. Returns false if calls still run after
  // `timeout`.
  bool WaitIdle(std::chrono::milliseconds timeout);

  // Shuts down gracefully: calls BeginDrain, stops listening, asks clients to use another
  // connection for their next calls (GOAWAY of HTTP/2, so that clients with several servers go
  // elsewhere), waits for the running calls, and cancels them after `timeout`. Returns true if none
  // was cancelled.
  bool Drain(std::chrono::milliseconds timeout);

 private:
  Server(const Config& config, std::unique_ptr<Guard> guard, std::unique_ptr<Store> store);

  absl::Status Listen(const Config& config);
  void AddSizesToMetrics();
  void AddDescriptorsToMetrics();

  const std::unique_ptr<Guard> guard_;
  // All other members report to it.
  Metrics metrics_;
  // Outlives the calls that it counts.
  ConnectionTable connection_table_;
  // Calls release their ticket last, and thus before the objects that they use are destroyed.
  Admission admission_;
  std::unique_ptr<Store> store_;
  // Pools for chunks and replacements, and for work that may wait for the store. Three kinds, so
  // that readers never wait for writers, and reads of microseconds never wait for reads of seconds.
  TaskPool writers_;
  Registry registry_;
  TaskPool readers_;
  TaskPool long_readers_;
  // Compute answers.
  TaskPool pool_;
  // Calls that wait for the store without occupying a thread.
  WaitingCalls waiting_;
  const ServiceParts parts_;
  HealthService health_service_;
  // All other services.
  std::vector<std::unique_ptr<grpc::Service>> services_;
  std::string address_;
  std::unique_ptr<ConnectionAcceptor> acceptor_;
  std::unique_ptr<grpc::Server> grpc_server_;
  // Reads from all of the above.
  std::unique_ptr<MetricsEndpoint> metrics_endpoint_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_SERVER_H_
