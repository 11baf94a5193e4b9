#ifndef HULLD_SERVER_NETWORK_CONNECTION_ACCEPTOR_H_
#define HULLD_SERVER_NETWORK_CONNECTION_ACCEPTOR_H_

#include <absl/status/statusor.h>
#include <grpcpp/server_builder.h>
#include <prometheus/counter.h>

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <vector>

#include "server/network/connection_table.h"
#include "server/network/frame_guard.h"
#include "server/process/descriptors.h"
#include "server/process/listen_address.h"
#include "server/process/metrics.h"

namespace hulld::server {

// Accepts connections within the limits of a table and passes them to gRPC. gRPC's own listener
// stops accepting permanently after descriptors run out (CVE-2023-4785). Runs one thread that never
// stops accepting: connections above a limit are accepted and closed immediately, so that the
// backlog drains.
//
// An idle connection is evicted to make room for a new one. gRPC closes evicted connections shortly
// after. Until then they occupy reserved descriptors; if they occupy too many, new connections stay
// in the backlog.
class ConnectionAcceptor {
 public:
  // Listens at the address; port 0 picks a free one. TCP: on every address of the host name; a
  // wildcard means IPv4 and IPv6. Accepts nothing before Start. The table and the metrics must
  // outlive this. UNAVAILABLE: it cannot be bound.
  static absl::StatusOr<std::unique_ptr<ConnectionAcceptor>> Listen(const ListenAddress& address,
                                                                    ConnectionTable& table,
                                                                    Metrics& metrics);
  ConnectionAcceptor(const ConnectionAcceptor&) = delete;
  ConnectionAcceptor& operator=(const ConnectionAcceptor&) = delete;
  ~ConnectionAcceptor();

  // The bound port; 0 for a unix socket.
  int port() const { return port_; }

  // frames: limits of unencrypted connections; null if connections are encrypted.
  void Start(std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> grpc,
             const FrameLimits* frames);

  // Stops listening; returns when no more connections will be passed to gRPC. Open connections
  // continue.
  void Stop();

 private:
  ConnectionAcceptor(const ListenAddress& address, ConnectionTable& table, Metrics& metrics);

  absl::Status Bind();
  absl::Status BindUnix();
  void Run();
  // Blocks while evicted connections occupy too many descriptors. Returns false after Stop.
  bool AwaitRoom();
  // Accepts pending connections, a few per call. Returns false to pause.
  bool AcceptFrom(int listener);
  // Accepts a connection with the reserve descriptor and closes it.
  bool RefuseWithReserve(int listener);
  void Admit(Descriptor socket, const sockaddr_storage& name);
  // Shuts down a connection that the table evicted; id 0: none.
  void Evict(uint64_t id);
  // Called by the thread that has closed the connection.
  void OnClosed(uint64_t id);

  const ListenAddress address_;
  ConnectionTable& table_;
  int port_ = 0;
  // First descriptor number reserved for everything except connections. The system assigns the
  // lowest free number, so receiving a reserved one shows that all lower ones are in use.
  int first_reserved_;
  // Maximum number of evicted connections that gRPC has not closed yet.
  int64_t max_closing_;
  std::vector<Descriptor> listeners_;
  Descriptor wake_;
  Descriptor reserve_;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> grpc_;
  std::optional<FrameLimits> frames_;
  // Used by the acceptor's thread.
  BurstShares shares_;
  // The ID of a connection is its number, followed by its descriptor, which gRPC owns.
  uint64_t last_number_ = 0;
  std::mutex mutex_;
  // The mutex guards the members below. It is never held during calls of gRPC or of
  // guarded_sockets.h, which call OnClosed.
  std::set<uint64_t> connections_;
  // Number of evicted connections among them.
  int64_t closing_ = 0;
  bool stopping_ = false;
  std::condition_variable room_;
  std::thread thread_;

  prometheus::Counter& accepted_;
  prometheus::Counter& failures_;
  prometheus::Counter& refused_descriptors_;
  prometheus::Counter& refused_total_;
  prometheus::Counter& refused_network_;
  prometheus::Counter& closed_idle_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_NETWORK_CONNECTION_ACCEPTOR_H_
