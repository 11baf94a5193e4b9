#ifndef HULLD_SERVER_REGISTRY_REGISTRY_H_
#define HULLD_SERVER_REGISTRY_REGISTRY_H_

#include <absl/status/statusor.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "server/process/metrics.h"
#include "server/process/worker_pool.h"
#include "server/registry/bodies/body_registry.h"
#include "server/registry/catalog/catalog.h"
#include "server/registry/catalog/change_feed.h"
#include "server/registry/catalog/known_hulls.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/changes/hull_appender.h"
#include "server/registry/changes/hull_changes.h"
#include "server/registry/changes/hull_lifecycle.h"
#include "server/registry/changes/takeover.h"
#include "server/registry/commit/committer.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/others/after_others.h"
#include "server/registry/others/freshness_gate.h"
#include "server/registry/read/hull_reader.h"
#include "server/registry/read/preparer.h"
#include "server/registry/records/record_gate.h"
#include "server/registry/records/record_lister.h"
#include "server/registry/records/record_reader.h"
#include "server/registry/watch/watches.h"
#include "server/settings/config.h"
#include "server/store/store.h"

namespace hulld::server {

// Stores hulls and bodies by ID, in one namespace, and answers each request at one revision. This
// class owns the parts below and forwards each call to the part that handles it:
//
//   Catalog        in-memory tables of hulls and bodies, the revision, and the counts
//   RecordReader   loads records into the catalog if the store finds records; RecordLister
//                  lists records that are not loaded; RecordGate keeps revisions from mixing
//   FreshnessGate  blocks a call until the catalog satisfies its freshness
//   HullReader     serves hulls of a single snapshot; Preparer speeds up frequent reads
//   HullLifecycle  creates, deletes and replaces hulls; HullAppender appends points; HullChanges
//                  submits both
//   Committer      commits changes to the store in batches, in the order of submission
//   BodyRegistry   puts, deletes, finds and lists bodies
//   Takeover       applies changes committed by peer servers to the catalog
//   Watches        sends the initial state and then every change, as noted by ChangeFeed
//   MemoryBudget   decides evictions
//
// A change has two steps. It is validated or built, then submitted to the committer. After the
// store has committed it, it becomes visible atomically and in the order of submission, and its
// caller is answered. Several chunks of a hull may be in flight, each built on its predecessors.
// Creation, deletion, replacement, and chunks with a condition on the revision wait until their
// hull has no change in flight, because they depend on its committed state. If a peer server
// committed a conflicting change first, the change is retried on the new state, transparently to
// the caller.
//
// Readers and writers never wait for each other. A writer appends to a LiveHull without holding the
// mutex; a mark records the committed prefix, and readers get the version at the mark. Evicted data
// is read back from the store at first use. If the store finds records, a starting server does not
// load them: a call that depends on an ID loads its record first, and looks again after each wait.
//
// One mutex, owned by this class, guards the state of all parts and is held only briefly
// (kMostLookupsPerHold). Passing a Locked proves that it is held.
//
// Lock order: this mutex first; then the mutex of the committer's queue, of the budget, of a pool,
// or of a LiveHull. No other lock is taken while one of the latter is held. Callbacks run without
// locks. The committer completes each batch under the mutex (its header explains the reason). The
// budget evicts under it, because the evicted data belongs to hulls. A MemoryCharge takes only the
// budget's mutex. Thread-safe.
class Registry {
 public:
  // Chunks are applied on `writers`. Store and pool must outlive this. Requires at destruction: no
  // call is running and no chunk is pending. preparers, loaders: metrics of the queues of hulls to
  // prepare and to read from the store.
  Registry(Store& store, const Limits& limits, WorkerPool& writers,
           std::optional<PoolMetrics> preparers = std::nullopt,
           std::optional<PoolMetrics> loaders = std::nullopt);
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;
  ~Registry();

  // Loads the records of all hulls and bodies, unless the store finds records. Must precede all
  // other calls. Damaged records are logged; later calls on them get DATA_LOSS.
  absl::Status Load();
  // Maximum number of unused hull records, and of small body records, kept in memory over a store
  // that finds records. Replaces the default derived from --memory-limit. Call before Load; for
  // tests.
  void KeepRecords(size_t most) {
    catalog_.hulls().KeepAtMost(most);
    catalog_.bodies().KeepAtMost(most * 2 * BodyTable::kBytesOfEntry);
  }

  const Store& store() const { return store_; }
  const Limits& limits() const { return limits_; }
  // Budget for memory that calls hold for long (MemoryCharge).
  MemoryBudget& memory() { return memory_; }

  // Registers an empty hull. Calls `done`, on this or another thread, after it is committed or
  // refused. Requires: a valid ID (not checked here; CheckHullId runs on arrival of the call).
  // ALREADY_EXISTS; RESOURCE_EXHAUSTED: --max-hulls, or the disk is full; UNAVAILABLE: the store
  // cannot be written.
  void Create(const std::string& id, bool if_absent, Reply<CreateResult> done) {
    lifecycle_.Create(id, if_absent, std::move(done));
  }

  // Removes a hull and notifies its sessions. Replies with the store's revision, as above.
  // NOT_FOUND; ABORTED: if_revision does not match; RESOURCE_EXHAUSTED, UNAVAILABLE: as above.
  void Delete(const std::string& id, std::optional<uint64_t> if_revision, Reply<uint64_t> done) {
    lifecycle_.Delete(id, if_revision, std::move(done));
  }

  // Replaces a hull atomically for all readers. The result is a new incarnation: sessions of the
  // former one end. Replies as above. Requires a builder. Copies the vertices, so it must not run
  // on a gRPC thread. NOT_FOUND, unless create_if_absent; ABORTED: if_revision does not match;
  // RESOURCE_EXHAUSTED: --max-hulls, or the disk is full; UNAVAILABLE: as above.
  void Replace(Replacement replacement, Reply<ReplaceResult> done) {
    lifecycle_.Replace(std::move(replacement), std::move(done));
  }

  // Creates or replaces a body atomically for all readers, and assigns its revisions. Replies as
  // above. Requires: valid IDs and poses (not checked), and between one and --max-pieces-per-body
  // pieces. The hulls of the pieces need not exist. ALREADY_EXISTS: a hull has the ID; ABORTED:
  // if_revision does not match; RESOURCE_EXHAUSTED: --max-hulls, --memory-limit, or the disk is
  // full; UNAVAILABLE: as above.
  void PutBody(StoredBody body, std::optional<uint64_t> if_revision, Reply<PutBodyResult> done) {
    bodies_.Put(std::move(body), if_revision, std::move(done));
  }
  // Removes a body. Replies with the store's revision, as above.
  // NOT_FOUND; ABORTED: if_revision does not match; RESOURCE_EXHAUSTED, UNAVAILABLE: as above.
  void DeleteBody(const std::string& id, std::optional<uint64_t> if_revision,
                  Reply<uint64_t> done) {
    bodies_.Delete(id, if_revision, std::move(done));
  }
  // As List. A page may hold fewer than page_size bodies although more follow.
  absl::StatusOr<BodyPage> ListBodies(const std::string& prefix, const std::string& after,
                                      size_t page_size,
                                      const std::function<bool()>& should_stop = {}) {
    return bodies_.List(prefix, after, page_size, should_stop);
  }
  // Loads unknown records from the store, so it must not run on a gRPC thread. Status: UNAVAILABLE:
  // the store cannot be read; CANCELLED: should_stop returned true; RESOURCE_EXHAUSTED: a read is
  // needed, and readers exceed their share of --memory-limit. Cost: O(log n) each, and one store
  // query per kMostLookupsPerHold; the mutex is released in between.
  FoundBodies FindBodies(std::span<const std::string> ids,
                         const std::function<bool()>& should_stop = {}) {
    return bodies_.Find(ids, should_stop);
  }
  // As FindBodies, but returns nullopt without blocking if the store would have to be read.
  std::optional<FoundBodies> TryFindBodies(std::span<const std::string> ids) {
    return bodies_.TryFind(ids);
  }
  // False if no body exists. Takes no lock.
  bool has_bodies() const { return catalog_.BodyCount() > 0; }

  // Returns at most `page_size` hulls with IDs that start with `prefix` and follow `after` in byte
  // order. Queries the store if it finds records, so it must not run on a gRPC thread then.
  // UNAVAILABLE: the store cannot be read. CANCELLED: should_stop returned true.
  absl::StatusOr<HullPage> List(const std::string& prefix, const std::string& after,
                                size_t page_size, const std::function<bool()>& should_stop = {});

  // Read barrier for a shared store: blocks until all changes that peer servers committed before
  // the call are applied. Required before functions without a freshness of their own (List,
  // FindBodies, ListBodies). Not for gRPC threads. CANCELLED: should_stop returned true.
  // UNAVAILABLE: the store cannot be queried. Cost: one store query shared by all waiting calls;
  // none if the store is not shared.
  absl::Status AwaitOthers(const std::function<bool()>& should_stop) {
    return freshness_.AwaitOthers(should_stop);
  }
  // Blocks likewise until the catalog satisfies `freshness`, and returns the bound on its
  // staleness. Required before functions without a freshness of their own. FAILED_PRECONDITION: the
  // store has not assigned that revision. Other errors as AwaitOthers. Cost: a store query only if
  // the catalog is too stale.
  absl::StatusOr<std::chrono::nanoseconds> AwaitFresh(const Freshness& freshness,
                                                      const std::function<bool()>& should_stop) {
    return freshness_.AwaitFresh(freshness, should_stop);
  }
  // As AwaitFresh, but returns nullopt instead of blocking.
  std::optional<std::chrono::nanoseconds> TryFresh(const Freshness& freshness) {
    return freshness_.TryFresh(freshness);
  }
  // If the catalog does not satisfy `freshness`, requests the changes committed by peer servers so
  // far and calls `done` exactly once after they are applied, on this or another thread, without
  // any lock. Returns false and does nothing if it does. UNAVAILABLE: as AwaitOthers. Cost: as
  // AwaitOthers, but without blocking.
  bool StartFresh(const Freshness& freshness, std::function<void(const absl::Status&)> done) {
    return freshness_.StartFresh(freshness, std::move(done));
  }

  RegistrySizes Sizes() const;
  // Hold times and work per hold of the registry's mutex.
  HoldStatistics Holds() const;
  CacheStatistics Cache() const;
  CommitStatistics Commits() const { return committer_.Statistics(); }
  // Sets the metrics of batches. Call before the first change; `metrics` must outlive this.
  void SetMetrics(StoreMetrics& metrics) {
    reader_.SetMetrics(metrics.snapshot_seconds);
    committer_.SetMetrics(metrics);
  }
  // RESOURCE_EXHAUSTED: this use holds more than its share of --memory-limit.
  absl::Status CheckMemory(MemoryUse use);

  // Returns the hulls, ready to be served, all at one revision of the store that satisfies the
  // plan's freshness. May read the store and prepare hulls, so it must not run on a gRPC thread.
  // CANCELLED: should_stop returned true. FAILED_PRECONDITION, UNAVAILABLE: as AwaitFresh.
  // RESOURCE_EXHAUSTED: hulls must be read from the store, or number more than kMostLookupsPerHold,
  // while readers exceed their share of --memory-limit; without a retry delay if these hulls
  // account for most of it.
  absl::StatusOr<Resolved> Resolve(std::span<const std::string> ids,
                                   const std::function<bool()>& should_stop,
                                   const ReadPlan& plan = {});
  // As Resolve, but returns nullopt without blocking if it would have to query or read the store,
  // or to prepare a hull.
  std::optional<Resolved> TryResolve(std::span<const std::string> ids, const ReadPlan& plan = {}) {
    return reader_.TryResolve(ids, plan);
  }
  // As Resolve, for a caller that repeatedly requests the same hulls: `known` persists between
  // calls, and only hulls changed since are looked up.
  absl::StatusOr<Resolved> Refresh(std::span<const std::string> ids, KnownHulls& known,
                                   const std::function<bool()>& should_stop,
                                   const ReadPlan& plan = {}) {
    return reader_.Refresh(ids, known, should_stop, plan);
  }
  // Resolves one hull; NOT_FOUND and DATA_LOSS become the status.
  absl::StatusOr<std::pair<AsOf, HullView>> Resolve(const std::string& id,
                                                    const std::function<bool()>& should_stop,
                                                    const Freshness& freshness = {});

  // Returns the canonical snapshot of a resolved hull, built at first use; it lives as long as
  // view.served. Not for gRPC threads. DATA_LOSS: the store is damaged. CANCELLED: should_stop
  // returned true. RESOURCE_EXHAUSTED: it is not built yet, and readers exceed their share of
  // --memory-limit. Cost: building the hull.
  absl::StatusOr<const Hull*> Canonical(const HullView& view,
                                        const std::function<bool()>& should_stop) {
    return reader_.Canonical(view, should_stop);
  }

  // Opens a session; `done` runs on this or another thread. `on_gone` is called at most once, on
  // any thread, with the reason if the hull is deleted or replaced before the session is closed.
  // NOT_FOUND; with create_if_absent as Create; DATA_LOSS: the store is damaged;
  // RESOURCE_EXHAUSTED: --max-writers-per-hull. client: shares threads fairly with other clients.
  void OpenAppend(const std::string& id, const std::string& writer_id, bool create_if_absent,
                  std::function<void(const absl::Status&)> on_gone, Reply<OpenResult> done,
                  ClientId client = kNoClient) {
    appender_.OpenAppend(id, writer_id, create_if_absent, std::move(on_gone), std::move(done),
                         client);
  }

  void CloseAppend(const AppendSession& session) { appender_.CloseAppend(session); }

  // Queues a chunk. `on_built`, which may be empty, is called when its points are released and the
  // next chunk may be queued. `done` is called after it is committed or refused. Each is called
  // exactly once, on another thread, in either order. Commits are reported in the order of the
  // sequences; a refusal may precede earlier chunks. Refusals, which change nothing:
  // FAILED_PRECONDITION: a gap in the sequence, or the hull is gone; ABORTED: if_revision does not
  // match; INVALID_ARGUMENT: a point is not finite; RESOURCE_EXHAUSTED: --max-vertices-per-hull,
  // --max-points-per-hull, --max-writers-per-hull, --memory-limit, or the disk is full;
  // UNAVAILABLE: the store cannot be written; DATA_LOSS: the store is damaged; CANCELLED:
  // should_stop returned true.
  void Append(const AppendSession& session, Chunk chunk, std::function<bool()> should_stop,
              std::function<void()> on_built, Reply<ChunkResult> done) {
    appender_.Append(session, std::move(chunk), std::move(should_stop), std::move(on_built),
                     std::move(done));
  }

  // Starts a watch (ChangeFeed). `on_ready` is called on the feed's thread, once after each piece
  // that waits. RESOURCE_EXHAUSTED: --memory-limit.
  absl::StatusOr<std::shared_ptr<ChangeWatch>> OpenWatch(const WatchTarget& target,
                                                         const WatchStart& start,
                                                         std::function<void()> on_ready) {
    return watches_.Open(target, start, std::move(on_ready));
  }
  // Returns the next piece of changes, possibly empty. UNAVAILABLE after EndWatches. Requires: the
  // watch does not wait. Cost: O(kMostPerPiece).
  absl::StatusOr<WatchPiece> TakeChanges(ChangeWatch& watch) { return watches_.Take(watch); }
  // Adds `added` to the watched IDs and removes `dropped`, which must have been added before.
  // Applies to later changes. Requires a target that varies. Cost: one hash per ID.
  void WatchAlso(ChangeWatch& watch, std::span<const std::string> added,
                 std::span<const std::string> dropped) {
    watches_.Extend(watch, added, dropped);
  }
  // Schedules the watch's on_ready although nothing changed.
  void NudgeWatch(const std::shared_ptr<ChangeWatch>& watch) { watches_.Nudge(watch); }
  // Closes a watch. An on_ready that is already due is still called.
  void CloseWatch(const std::shared_ptr<ChangeWatch>& watch) { watches_.Close(watch); }
  // Nudges every watch so that it ends.
  void EndWatches() { watches_.EndAll(); }

 private:
  Store& store_;
  // Limits with the memory limit in force.
  const Limits limits_;
  MemoryBudget memory_;

  // Guards the members below except thread-safe ones (budget, committer, pools), and every
  // RegisteredHull except a builder owned by a thread.
  mutable FairMutex mutex_;
  Catalog catalog_;
  AfterOthers after_others_;
  ChangeFeed feed_;

  // Their threads use all other members, so they end first (~Registry).
  Committer committer_;
  Preparer preparer_;
  // Threads that read records, and help readers that load many hulls.
  std::optional<WorkerPool> loaders_;

  // In the order of their dependencies.
  FreshnessGate freshness_;
  RecordGate gate_;
  RecordReader records_;
  RecordLister lister_;
  HullReader reader_;
  BodyRegistry bodies_;
  HullChanges changes_;
  HullLifecycle lifecycle_;
  HullAppender appender_;
  Takeover takeover_;
  Watches watches_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_REGISTRY_H_
