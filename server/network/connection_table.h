#ifndef HULLD_SERVER_NETWORK_CONNECTION_TABLE_H_
#define HULLD_SERVER_NETWORK_CONNECTION_TABLE_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <optional>

#include "server/network/peer_address.h"

namespace hulld::server {

// Open connections, limited in total and per network. A connection is idle while no call runs on
// it. If a new connection exceeds a limit, the connection that has been idle longest is evicted;
// for the limit per network, the one of that network that has been idle longest. Connections of
// unix sockets belong to no network, and are never idle, because their calls cannot be attributed.
// Thread-safe.
class ConnectionTable {
 public:
  ConnectionTable(size_t max_connections, size_t max_per_network)
      : max_connections_(max_connections), max_per_network_(max_per_network) {}

  enum class Refusal { kNone, kTotal, kNetwork };
  struct Outcome {
    Refusal refusal = Refusal::kNone;
    // The evicted connection, to be closed by the caller; 0: none. It is no longer in the table.
    uint64_t evicted = 0;
  };
  // Adds a connection, or refuses it without effect. id: unique, not 0.
  Outcome Add(uint64_t id, const std::optional<PeerAddress>& peer);
  // Removes and returns the connection that has been idle longest; 0: none is idle.
  uint64_t Evict();
  // Returns false if the connection was evicted before.
  bool Remove(uint64_t id);

  // Returns the connection of a peer; 0: none.
  uint64_t Find(const std::optional<PeerAddress>& peer) const;
  // Records the start of a call on a peer's connection, and returns the connection; 0: none.
  uint64_t BeginCall(const std::optional<PeerAddress>& peer);
  void EndCall(uint64_t id);

  size_t size() const;
  // Limit on all connections.
  size_t max_connections() const { return max_connections_; }
  // Lowers the limit, for a process with fewer descriptors. Call before the first connection.
  void LowerLimit(size_t max_connections) {
    max_connections_ = std::min(max_connections_, max_connections);
  }

 private:
  // Idle connections, the one that has been idle longest first.
  using IdleList = std::list<uint64_t>;
  struct Network {
    size_t connections = 0;
    IdleList idle;
  };
  struct Connection {
    PeerAddress peer;
    // Null for a unix socket. Nodes of a map have stable addresses.
    Network* network = nullptr;
    size_t calls = 0;
    // Positions in `idle_` and in the list of its network, while calls == 0 and it has a network.
    IdleList::iterator idle = {};
    IdleList::iterator idle_in_network = {};
  };
  using Connections = std::map<uint64_t, Connection>;

  // Require the mutex.
  void BeginIdle(uint64_t id, Connection& connection);
  void EndIdle(Connection& connection);
  uint64_t EvictFirst(const IdleList& idle);
  void Erase(Connections::iterator connection);

  size_t max_connections_;
  const size_t max_per_network_;
  mutable std::mutex mutex_;
  Connections connections_;
  std::map<PeerAddress, uint64_t> by_peer_;
  std::map<std::array<uint8_t, 16>, Network> networks_;
  IdleList idle_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_NETWORK_CONNECTION_TABLE_H_
