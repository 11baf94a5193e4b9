#ifndef HULLD_SERVER_REGISTRY_REGISTRY_H_
#define HULLD_SERVER_REGISTRY_REGISTRY_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "server/process/metrics.h"
#include "server/process/task_pool.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/changes/local_changes.h"
#include "server/registry/commit/committer.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/peers/peer_sync.h"
#include "server/registry/read/hull_reader.h"
#include "server/registry/records/record_reader.h"
#include "server/registry/state/registry_state.h"
#include "server/registry/watch/change_feed.h"
#include "server/settings/config.h"
#include "server/store/store.h"

namespace hulld::server {

// Stores hulls and bodies by ID, in one namespace, and answers each request at one revision. This
// class owns the parts below:
//
//   RegistryState  the state that the parts share, and the only functions that apply a committed
//                  change to it
//   Committer      commits changes to the store in batches, in the order of submission
//   PeerSync       applies the commits of peer servers, if there are any; blocks a call until the
//                  registry satisfies its freshness
//   RecordReader   finds bodies; loads and lists records if the store supports record lookup
//   LocalChanges   creates, deletes, replaces, and grows hulls and bodies
//   HullReader     serves hulls of a single snapshot
//   ChangeFeed     sends the initial state and then every change to watches
//
// A change has two steps. It is validated or built, then submitted to the committer. After the
// store commits it, RegistryState applies it: the change becomes visible atomically, in the order
// of submission, and its caller receives the reply. Several chunks of a hull may be in flight, each
// built on its predecessors. Creation, deletion, replacement, and chunks with a condition on the
// revision wait until their hull has no change in flight, because they depend on its committed
// state. If a peer server committed a conflicting change first, the change is retried on the new
// state, transparently to the caller.
//
// Readers and writers never wait for each other. A writer appends to a LiveHull without holding the
// mutex; a mark records the committed prefix, and readers get the version at the mark. Evicted data
// is read back from the store when it is next used. If the store supports record lookup, a starting
// server loads no records: a call that depends on an ID loads its record first, and looks the ID up
// again after each wait.
//
// One mutex (RegistryState::mutex) guards the state of all parts and is held only briefly
// (kMaxLookupsPerHold). Passing a Locked proves that it is held.
//
// Lock order: this mutex first; then the mutex of the committer's queue, of the budget, of a pool,
// or of a LiveHull. No other lock is acquired while one of the latter is held. Callbacks run
// without locks. The committer completes each batch under the mutex (its header explains the
// reason). The budget evicts under it, because the evicted data belongs to hulls. A MemoryCharge
// acquires only the budget's mutex. Thread-safe.
class Registry {
 public:
  // Chunks are applied on `writers`. Store and pool must outlive this. Requires at destruction: no
  // call is running and no chunk is pending. preparers, loaders: metrics of the queues of hulls to
  // prepare and to read from the store.
  Registry(Store& store, const Limits& limits, TaskPool& writers,
           std::optional<PoolMetrics> preparers = std::nullopt,
           std::optional<PoolMetrics> loaders = std::nullopt);
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;
  ~Registry();

  // Loads the records of all hulls and bodies, unless the store supports record lookup. Must
  // precede all other calls. Damaged records are logged; later calls on them return DATA_LOSS.
  absl::Status Load();
  // Sets the number of unused hull records, and of small body records, that are kept in memory if
  // the store supports record lookup, instead of the default derived from --memory-limit. Call
  // before Load; for tests.
  void SetRecordCapacity(size_t capacity) {
    state_.hulls.SetCapacity(capacity);
    state_.bodies.SetCapacity(capacity * 2 * BodyTable::kBytesOfEntry);
  }

  const Store& store() const { return state_.store; }
  const Limits& limits() const { return state_.limits; }
  // Budget for memory that calls hold for a long time (MemoryCharge).
  MemoryBudget& memory() { return state_.memory; }

  // Creates, deletes, replaces, and grows hulls and bodies.
  LocalChanges& changes() { return changes_; }
  // Finds bodies, and lists hulls and bodies.
  RecordReader& records() { return records_; }
  // Serves hulls that are resolved repeatedly or without blocking, and their snapshots.
  HullReader& reader() { return reader_; }
  // Waits for freshness. Required before functions without a freshness parameter: those of
  // records().
  PeerSync& peers() { return peers_; }
  // True if peer servers commit to the same store, so that reads may wait for their changes.
  bool has_peers() const { return peers_.has_peers(); }
  // False if no body exists. Takes no lock.
  bool has_bodies() const { return state_.BodyCount() > 0; }

  // Puts small hulls to rest that have not been looked up since the previous call of this function
  // (HullTable). Call every few seconds. Cost: about 0.2 us per hull.
  void RestIdleHulls();

  RegistrySizes Sizes() const;
  // Times for which the registry's mutex was held, and the work done meanwhile.
  HoldStatistics Holds() const;
  CacheStatistics Cache() const;
  CommitStatistics Commits() const { return committer_.Statistics(); }
  // Sets the metrics of batches. Call before the first change; `metrics` must outlive this.
  void SetMetrics(StoreMetrics& metrics) {
    reader_.SetMetrics(metrics.snapshot_seconds);
    committer_.SetMetrics(metrics);
  }
  // RESOURCE_EXHAUSTED: this use exceeds its share of --memory-limit.
  absl::Status CheckMemory(MemoryUse use);

  // Returns the hulls, ready to be served, all at one revision of the store that satisfies the
  // plan's freshness. May read the store and prepare hulls, so it must not run on a gRPC thread.
  // CANCELLED: should_stop returned true. FAILED_PRECONDITION, UNAVAILABLE: see
  // PeerSync::AwaitFresh. RESOURCE_EXHAUSTED: hulls must be read from the store, or there are more
  // than kMaxLookupsPerHold, while readers exceed their share of --memory-limit; without a retry
  // delay if these hulls account for most of it. WouldWait: see ReadPlan::may_wait.
  absl::StatusOr<Resolved> Resolve(std::span<const std::string> ids,
                                   const std::function<bool()>& should_stop,
                                   const ReadPlan& plan = {});
  // Resolves one hull; NOT_FOUND and DATA_LOSS become the status.
  absl::StatusOr<std::pair<AsOf, HullView>> Resolve(const std::string& id,
                                                    const std::function<bool()>& should_stop,
                                                    const Freshness& freshness = {});

  // Watches of hulls and bodies.
  ChangeFeed& feed() { return state_.feed; }

 private:
  RegistryState state_;
  Committer committer_;
  // Threads that read records, and help readers that load many hulls.
  std::optional<TaskPool> loaders_;
  PeerSync peers_;
  RecordReader records_;
  HullReader reader_;
  LocalChanges changes_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_REGISTRY_H_
