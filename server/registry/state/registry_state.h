#ifndef HULLD_SERVER_REGISTRY_STATE_REGISTRY_STATE_H_
#define HULLD_SERVER_REGISTRY_STATE_REGISTRY_STATE_H_

#include <absl/hash/hash.h>
#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/query/placed/live_hull.h"
#include "server/process/metrics.h"
#include "server/process/task_pool.h"
#include "server/registry/catalog/body.h"
#include "server/registry/catalog/hull_table.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/watch/change_feed.h"
#include "server/settings/config.h"
#include "server/store/store.h"

namespace hulld::server {

// Recent reader-visible changes of hulls, in order, each stored as a hash of the ID. Not
// thread-safe.
class RecentChanges {
 public:
  // Maximum number of changes: half a megabyte when full.
  static constexpr uint64_t kCapacity = 1 << 16;

  // Differs between processes, so that no client can craft a request of IDs with equal hashes.
  static uint64_t HashOf(std::string_view id) { return absl::HashOf(id); }

  void Note(std::string_view id) {
    if (end_ < kCapacity) {
      hashes_.push_back(HashOf(id));
    } else {
      hashes_[end_ % kCapacity] = HashOf(id);
    }
    ++end_;
  }
  // Position after the last change.
  uint64_t end() const { return end_; }
  // Returns true if all changes from this position on are retained.
  bool Knows(uint64_t change) const { return end_ - change <= kCapacity; }
  uint64_t at(uint64_t change) const { return hashes_[change % kCapacity]; }

 private:
  std::vector<uint64_t> hashes_;
  uint64_t end_ = 0;
};

// State shared by the parts of a registry, and its state machine. All parts read committed state
// here. The Apply functions are the only ones that change what readers see. Each applies one
// committed change and notes it in the feed, which keeps the revision. Never blocks.
//
// Invariants:
// - Revisions are applied in increasing order, and each change atomically, in one critical section.
// - No ID is in both tables. If the store supports record lookup, the tables are caches: an ID in
//   neither is unknown (IsKnown). The known absence of both a hull and a body is an entry of the
//   hull table.
// - The tables contain the last committed version of each known entry, of revision() or earlier.
//   They also contain entries being created: a hull in kCreating, a body without a committed
//   version.
// - Every reader-visible change of a hull is in recent_changes, regardless of its cause.
// - At most one thread prepares a hull, or is about to (RegisteredHull::is_preparing).
class RegistryState {
 public:
  // preparers: metrics of the queue of hulls to prepare.
  RegistryState(Store& store, const Limits& limits, std::optional<PoolMetrics> preparers);
  RegistryState(const RegistryState&) = delete;
  RegistryState& operator=(const RegistryState&) = delete;

  // True if the tables cache records that the store can find.
  bool is_cache() const { return is_cache_; }
  // Last committed and visible revision; 0 before ChangeFeed::Begin.
  uint64_t revision() const { return feed.revision(); }

  // Returns true if the ID's state is known, including absence. Cost: O(log n).
  bool IsKnown(const std::string& id) const { return hulls.Knows(id) || bodies.contains(id); }
  // Returns the hull as HullTable does; null if there is none. Requires IsKnown(id).
  HullPointer Find(const std::string& id);
  HullPointer FindVisible(const std::string& id);
  // Returns the committed body; null if there is none. Requires IsKnown(id) (not checked: a body
  // whose read failed is unknown).
  std::shared_ptr<const Body> FindBody(const std::string& id);
  // NOT_FOUND; if the ID belongs to the other kind, the message says so. kind: "hull" or "body".
  absl::Status NoSuch(const std::string& kind, const std::string& id);

  // Adds a stored hull, at rest or as damaged. Requires: the hull table has no hull with the ID.
  void AddStored(const std::string& id, const absl::StatusOr<StoredHull>& stored);
  // Replaces the known state of the body with the stored one. If a hull has the ID, which the
  // server never writes, logs that instead: the hull takes precedence, because its vertices could
  // not be restored.
  void AddBody(Locked& locked, const std::string& id, const absl::StatusOr<StoredBody>& stored);
  // Removes a body. Requires: the body table has it.
  void EraseBody(Locked& locked, const std::string& id);
  // Marks a hull as damaged. Idempotent, because several threads may find the same damage.
  void MarkDamaged(RegisteredHull& hull, const absl::Status& damage);

  // Counts of hulls and bodies. Creations count from submission on, to enforce --max-hulls. These
  // functions take no lock.
  uint64_t HullCount() const {
    return kept_hulls_.load(std::memory_order_relaxed) +
           creating_hulls_.load(std::memory_order_relaxed);
  }
  uint64_t BodyCount() const {
    return kept_bodies_.load(std::memory_order_relaxed) +
           creating_bodies_.load(std::memory_order_relaxed);
  }
  // RESOURCE_EXHAUSTED: --max-hulls is reached.
  absl::Status CheckHullCount() const;
  // Returns the counts, excluding creations in flight.
  RegistrySizes Sizes() const;
  // Sets the totals of the store at revision().
  void SetTotals(const StoreTotals& totals);

  // Count a creation at its submission, and at its commit or refusal. A refused hull is forgotten.
  void BeginCreatingHull() { ++creating_hulls_; }
  void EndCreatingHull(Locked& locked, const HullPointer& hull, const absl::Status& status);
  void BeginCreatingBody() { ++creating_bodies_; }
  void EndCreatingBody(bool is_committed);

  // Apply a committed change of a hull. Requires: its HullState no longer counts the change as in
  // flight.
  // previous: null if `hull` is in the table already; otherwise the hull that it replaces there.
  void ApplyCreation(Locked& locked, const HullPointer& previous, const HullPointer& hull,
                     const StoredHull& stored);
  void ApplyDeletion(Locked& locked, const HullPointer& hull, uint64_t revision);
  // mark, points: as for RegisteredHull::Commit.
  void ApplyChunk(Locked& locked, const HullPointer& hull, const Change& chunk,
                  const LiveHull::Mark& mark, uint64_t points);
  // body: null after a deletion. Requires an entry for the ID.
  void ApplyBody(Locked& locked, const std::string& id, const std::shared_ptr<const Body>& body,
                 uint64_t revision);
  // Applies a peer server's change. since: all earlier changes up to this revision were applied.
  // Requires: no change of the ID is in flight. Returns the known hull that the change updated or
  // ended, whose waiting tasks must resume; null if there is none.
  HullPointer ApplyPeerChange(Locked& locked, const std::string& id, const PeerChange& change,
                              uint64_t since);

  // Prepares the committed state of a hull, after queries have paid for it (WantsPreparing), on
  // this thread. Releases the mutex. Requires: the hull has points in memory, and no thread
  // prepares it.
  void Prepare(Locked& locked, RegisteredHull& hull);
  // Prepares the hull on a thread that no call waits for. Requires: no thread prepares it.
  void SchedulePreparing(const HullPointer& hull);
  // Ends preparation. Requires that the caller does not hold the mutex.
  void EndPreparing();

  Store& store;
  // With the memory limit in force.
  const Limits limits;
  MemoryBudget memory;
  // Guards the members below, and every RegisteredHull except a builder owned by a thread. Required
  // by every function unless its comment says otherwise.
  mutable FairMutex mutex;
  HullTable hulls;
  BodyTable bodies;
  RecentChanges recent_changes;
  // Hits, misses, loads, growth and damage; the budget counts the rest.
  CacheStatistics statistics;
  ChangeFeed feed;

 private:
  // Records a reader-visible change of the hull.
  void NoteChange(const RegisteredHull& hull);
  // Updates the vertex total after a hull's count changed.
  void NoteVertices(uint64_t before, uint64_t now) { vertex_count_ += now - before; }
  // Removes a hull that is gone, discards its memory, and ends its sessions with `reason`.
  void Forget(Locked& locked, const HullPointer& hull, const absl::Status& reason);
  // Prepares the hull before it contains too many points that are no longer vertices.
  void PrepareIfWorn(const HullPointer& hull);

  StoreTotals TotalsOf(const std::string& id);
  std::optional<Incarnation> FindPrevious(const std::string& id, const PeerChange& change,
                                          uint64_t since);
  bool ApplyPeerVersion(Locked& locked, const HullPointer& hull, const PeerChange& change);
  void EndPrevious(Locked& locked, const HullPointer& previous, const PeerChange& change);
  void ApplyPeerBody(Locked& locked, const std::string& id, const PeerChange& change);
  void Note(Locked& locked, const std::string& id, const PeerChange& change,
            const std::optional<Incarnation>& previous);

  const bool is_cache_;
  uint64_t vertex_count_ = 0;
  // Numbers of hulls and bodies in the store at revision(), and of uncommitted creations. Changed
  // under the mutex.
  std::atomic<uint64_t> kept_hulls_ = 0;
  std::atomic<uint64_t> creating_hulls_ = 0;
  std::atomic<uint64_t> kept_bodies_ = 0;
  std::atomic<uint64_t> creating_bodies_ = 0;
  bool has_ended_preparing_ = false;
  // One thread, to leave the CPUs to calls. Ends before the members that it uses.
  std::optional<TaskPool> preparer_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_STATE_REGISTRY_STATE_H_
