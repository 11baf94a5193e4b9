#ifndef HULLD_SERVER_REGISTRY_STATE_REGISTRY_STATE_H_
#define HULLD_SERVER_REGISTRY_STATE_REGISTRY_STATE_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/query/placed/live_hull.h"
#include "server/process/metrics.h"
#include "server/registry/catalog/catalog.h"
#include "server/registry/catalog/preparer.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/watch/change_feed.h"
#include "server/settings/config.h"
#include "server/store/store.h"

namespace hulld::server {

// State shared by the parts of a registry, and its state machine: the Apply functions are the only
// ones that change what readers see. Each applies one committed change to the catalog, publishes
// its revision, and notes it in the feed.
//
// Invariant: revisions are applied in increasing order, and each change atomically, within one hold
// of the mutex.
struct RegistryState {
  // A committed chunk of a hull.
  struct CommittedChunk {
    // The hull with the chunk, and the prefix of its LiveHull.
    const StoredHull& hull;
    const LiveHull::Mark& mark;
    const WriterSequence& writer;
    // Number of points of the chunk that became vertices.
    uint64_t vertices = 0;
  };

  // preparers: metrics of the queue of hulls to prepare.
  RegistryState(Store& store, const Limits& limits, std::optional<PoolMetrics> preparers);

  // Apply a committed change of a hull. Requires: its HullState no longer counts the change as in
  // flight.
  // former: null if `hull` is in the catalog already; otherwise the hull that it replaces there.
  void ApplyCreation(Locked& locked, const HullPointer& former, const HullPointer& hull,
                     const StoredHull& stored);
  void ApplyDeletion(Locked& locked, const HullPointer& hull, uint64_t revision);
  void ApplyChunk(Locked& locked, const HullPointer& hull, const CommittedChunk& chunk);
  // body: null after a deletion. Requires an entry for the ID.
  void ApplyBody(Locked& locked, const std::string& id, const std::shared_ptr<const Body>& body,
                 uint64_t revision);
  // Applies a peer server's change. since: all earlier changes up to this revision were applied.
  // Requires: no change of the ID is in flight. Returns the known hull that the change updated or
  // ended, whose waiting tasks must resume; null if there is none.
  HullPointer ApplyPeerChange(Locked& locked, const std::string& id, const PeerChange& change,
                              uint64_t since);

  Store& store;
  // With the memory limit in force.
  const Limits limits;
  MemoryBudget memory;
  // Guards the members below, and every RegisteredHull except a builder owned by a thread.
  mutable FairMutex mutex;
  Catalog catalog;
  ChangeFeed feed;
  Preparer preparer;

 private:
  std::optional<Incarnation> FindFormer(const std::string& id, const PeerChange& change,
                                        uint64_t since);
  bool ApplyPeerVersion(Locked& locked, const HullPointer& hull, const PeerChange& change,
                        bool is_new);
  void EndFormer(Locked& locked, const HullPointer& former, const PeerChange& change);
  void ApplyPeerBody(Locked& locked, const std::string& id, const PeerChange& change);
  void Note(Locked& locked, const std::string& id, const PeerChange& change,
            const std::optional<Incarnation>& former);
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_STATE_REGISTRY_STATE_H_
