#include "server/network/connection_table.h"

#include "core/base/check.h"

namespace hulld::server {

ConnectionTable::Outcome ConnectionTable::Add(uint64_t id, const std::optional<PeerAddress>& peer) {
  const std::lock_guard lock(mutex_);
  Outcome outcome;
  if (peer.has_value()) {
    const auto known = networks_.find(peer->Network());
    if (known != networks_.end() && known->second.connections >= max_per_network_) {
      outcome.evicted = EvictFirst(known->second.idle);
      if (outcome.evicted == 0) return {.refusal = Refusal::kNetwork};
    }
  }
  if (connections_.size() >= max_connections_) {
    outcome.evicted = EvictFirst(idle_);
    if (outcome.evicted == 0) return {.refusal = Refusal::kTotal};
  }
  Connection& added = connections_[id];
  if (!peer.has_value()) return outcome;
  added.peer = *peer;
  added.network = &networks_[peer->Network()];
  ++added.network->connections;
  by_peer_[*peer] = id;
  BeginIdle(id, added);
  return outcome;
}

uint64_t ConnectionTable::Evict() {
  const std::lock_guard lock(mutex_);
  return EvictFirst(idle_);
}

uint64_t ConnectionTable::EvictFirst(const IdleList& idle) {
  if (idle.empty()) return 0;
  const uint64_t id = idle.front();
  Erase(connections_.find(id));
  return id;
}

bool ConnectionTable::Remove(uint64_t id) {
  const std::lock_guard lock(mutex_);
  const auto found = connections_.find(id);
  if (found == connections_.end()) return false;
  Erase(found);
  return true;
}

void ConnectionTable::Erase(Connections::iterator connection) {
  Connection& gone = connection->second;
  if (gone.network != nullptr) {
    if (gone.calls == 0) EndIdle(gone);
    // A new connection may have reused the port.
    const auto known = by_peer_.find(gone.peer);
    if (known != by_peer_.end() && known->second == connection->first) by_peer_.erase(known);
    if (--gone.network->connections == 0) networks_.erase(gone.peer.Network());
  }
  connections_.erase(connection);
}

void ConnectionTable::BeginIdle(uint64_t id, Connection& connection) {
  IdleList& in_network = connection.network->idle;
  connection.idle = idle_.insert(idle_.end(), id);
  connection.idle_in_network = in_network.insert(in_network.end(), id);
}

void ConnectionTable::EndIdle(Connection& connection) {
  idle_.erase(connection.idle);
  connection.network->idle.erase(connection.idle_in_network);
}

uint64_t ConnectionTable::Find(const std::optional<PeerAddress>& peer) const {
  if (!peer.has_value()) return 0;
  const std::lock_guard lock(mutex_);
  const auto known = by_peer_.find(*peer);
  return known == by_peer_.end() ? 0 : known->second;
}

uint64_t ConnectionTable::BeginCall(const std::optional<PeerAddress>& peer) {
  if (!peer.has_value()) return 0;
  const std::lock_guard lock(mutex_);
  const auto known = by_peer_.find(*peer);
  if (known == by_peer_.end()) return 0;
  Connection& connection = connections_.at(known->second);
  if (connection.calls++ == 0) EndIdle(connection);
  return known->second;
}

void ConnectionTable::EndCall(uint64_t id) {
  const std::lock_guard lock(mutex_);
  const auto found = connections_.find(id);
  if (found == connections_.end()) return;
  HULLD_CHECK(found->second.calls > 0);
  if (--found->second.calls == 0) BeginIdle(id, found->second);
}

size_t ConnectionTable::size() const {
  const std::lock_guard lock(mutex_);
  return connections_.size();
}

}  // namespace hulld::server
