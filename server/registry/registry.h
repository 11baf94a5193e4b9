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

// Keeps hulls by ID, and bodies, whose IDs are of the same namespace, and answers from one revision
// at a time. This class puts its parts together and passes each call to the one whose job it is:
//
//   Catalog        what is known: tables of hulls and bodies, the revision, how many there are
//   RecordReader   makes known what is under an ID, where the store finds records; RecordLister
//                  lists what is not known; RecordGate keeps both from mixing revisions
//   FreshnessGate  lets a call go on once what is here is as fresh as it asks
//   HullReader     gives readers hulls of one moment; Preparer makes what is asked often faster
//   HullLifecycle  begins and ends hulls; HullAppender lets them grow; HullChanges brings both to
//   the
//                  Committer, in order
//   BodyRegistry   puts, deletes, finds and lists bodies
//   Takeover       puts what other servers committed in the place of what was known
//   Watches        tells watches what is there, and what changes, as ChangeFeed notes it
//   MemoryBudget   says what is dropped
//
// A change is made in two steps. It is decided, or built, and submitted to the committer; only when
// the store has kept it does it become visible, as a whole and in the order of submission, and is
// answered. Chunks of one hull may be in flight together, each built on those before it. Creation,
// deletion, replacement and chunks with a condition on the revision wait until no change of their
// hull is in flight, since what they find must be committed. Where another server was first, a
// change is made anew of what there is by then, so callers do not hear of it.
//
// Readers and writers never wait for each other. A writer appends to a LiveHull, without the mutex;
// a mark says up to where that is committed, and readers get the version at the mark. What is not
// in memory is read back from the store at first use. Where the store finds records, not even the
// records are read when a server starts: a call that depends on what there is under an ID first
// makes that known, and looks again when it is done with waiting.
//
// One mutex, of this class, guards the state of all parts and is held for moments only
// (kMostLookupsPerHold). A Locked, which is passed along, shows that it is held.
//
// Lock order: first that mutex; then that of the committer's queue, of the budget, of a pool or
// within a LiveHull. None of the latter is held while another lock is taken. Callbacks run without
// any. The committer completes each batch under the mutex (its header says why); the budget evicts
// under it, since what it drops belongs to hulls; a MemoryCharge takes the budget's mutex alone.
// Thread-safe.
class Registry {
 public:
  // Chunks are applied on `writers`. Store and pool must outlive this; no call may be running and
  // no chunk be pending when it is destroyed. preparers, loaders: where to report what waits to be
  // prepared, and to be read from the store.
  Registry(Store& store, const Limits& limits, WorkerPool& writers,
           std::optional<PoolMetrics> preparers = std::nullopt,
           std::optional<PoolMetrics> loaders = std::nullopt);
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;
  ~Registry();

  // Reads the records of all hulls and bodies that the store holds, unless it finds records; before
  // any other call. Damaged ones are logged, and answered with DATA_LOSS later.
  absl::Status Load();
  // How many records of hulls, and small ones of bodies, a registry over a store that finds them
  // keeps in memory while nobody uses them, instead of what a part of --memory-limit holds. Before
  // Load; for tests.
  void KeepRecords(size_t most) {
    catalog_.hulls().KeepAtMost(most);
    catalog_.bodies().KeepAtMost(most * 2 * BodyTable::kBytesOfEntry);
  }

  const Store& store() const { return store_; }
  const Limits& limits() const { return limits_; }
  // For what calls hold for long (MemoryCharge).
  MemoryBudget& memory() { return memory_; }

  // Registers an empty hull and calls `done` once that is committed or refused, on this or another
  // thread. Requires a valid ID (unchecked: CheckHullId checks it where the call arrives).
  // ALREADY_EXISTS; RESOURCE_EXHAUSTED: --max-hulls, or the disk is full; UNAVAILABLE: the store
  // cannot be written.
  void Create(const std::string& id, bool if_absent, Reply<CreateResult> done) {
    lifecycle_.Create(id, if_absent, std::move(done));
  }

  // Removes a hull; its sessions hear of it. Replies with the store's revision, as above.
  // NOT_FOUND; ABORTED: if_revision does not match; RESOURCE_EXHAUSTED, UNAVAILABLE: as above.
  void Delete(const std::string& id, std::optional<uint64_t> if_revision, Reply<uint64_t> done) {
    lifecycle_.Delete(id, if_revision, std::move(done));
  }

  // Puts a hull in the place of another, at once for all readers. It is a new incarnation: sessions
  // of the former one end. Replies as above. Requires a builder. Copies the vertices, hence not for
  // gRPC's threads.
  // NOT_FOUND, unless create_if_absent; ABORTED: if_revision does not match; RESOURCE_EXHAUSTED:
  // --max-hulls, or the disk is full; UNAVAILABLE: as above.
  void Replace(Replacement replacement, Reply<ReplaceResult> done) {
    lifecycle_.Replace(std::move(replacement), std::move(done));
  }

  // Puts a body in the place of another or of none, at once for all readers; its revisions are
  // given here. Replies as above. Requires valid IDs and poses (unchecked), and pieces, at most
  // --max-pieces-per-body. The hulls of the pieces need not exist.
  // ALREADY_EXISTS: a hull has the ID; ABORTED: if_revision does not match; RESOURCE_EXHAUSTED:
  // --max-hulls, --memory-limit, or the disk is full; UNAVAILABLE: as above.
  void PutBody(StoredBody body, std::optional<uint64_t> if_revision, Reply<PutBodyResult> done) {
    bodies_.Put(std::move(body), if_revision, std::move(done));
  }
  // Removes a body. Replies with the store's revision, as above.
  // NOT_FOUND; ABORTED: if_revision does not match; RESOURCE_EXHAUSTED, UNAVAILABLE: as above.
  void DeleteBody(const std::string& id, std::optional<uint64_t> if_revision,
                  Reply<uint64_t> done) {
    bodies_.Delete(id, if_revision, std::move(done));
  }
  // As List. A page may hold less than page_size although there are more.
  absl::StatusOr<BodyPage> ListBodies(const std::string& prefix, const std::string& after,
                                      size_t page_size,
                                      const std::function<bool()>& should_stop = {}) {
    return bodies_.List(prefix, after, page_size, should_stop);
  }
  // What is not known is read from the store, hence not for gRPC's threads. The status:
  // UNAVAILABLE: it cannot be read; CANCELLED: should_stop said so; RESOURCE_EXHAUSTED: it would
  // have to be, and readers hold more than their share of --memory-limit. Cost: O(log n) each, and
  // a question to the store for each kMostLookupsPerHold; others pass in between.
  FoundBodies FindBodies(std::span<const std::string> ids,
                         const std::function<bool()>& should_stop = {}) {
    return bodies_.Find(ids, should_stop);
  }
  // The same, but nullopt, at once, where the store would have to be read.
  std::optional<FoundBodies> TryFindBodies(std::span<const std::string> ids) {
    return bodies_.TryFind(ids);
  }
  // Whether there may be a body. Takes no lock.
  bool has_bodies() const { return catalog_.BodyCount() > 0; }

  // At most `page_size` hulls whose IDs start with `prefix` and come after `after`, in byte order.
  // Where the store finds records, it is asked, hence not for gRPC's threads then. UNAVAILABLE: it
  // cannot be read. CANCELLED: should_stop said so.
  absl::StatusOr<HullPage> List(const std::string& prefix, const std::string& after,
                                size_t page_size, const std::function<bool()>& should_stop = {});

  // Where the store is shared, waits until all that other servers had committed by the time of the
  // call is taken over: before what does not do so itself (List, FindBodies, ListBodies). Not for
  // gRPC's threads. CANCELLED: should_stop said so. UNAVAILABLE: the store cannot be asked. Cost: a
  // question to the store, one for all that wait; nothing where it is not shared.
  absl::Status AwaitOthers(const std::function<bool()>& should_stop) {
    return freshness_.AwaitOthers(should_stop);
  }
  // Waits until what is here is as fresh as this, in the same way, and tells how stale it may be:
  // before what does not do so itself. FAILED_PRECONDITION: the store has not given that revision.
  // Otherwise as AwaitOthers. Cost: a question to the store only where it is not.
  absl::StatusOr<std::chrono::nanoseconds> AwaitFresh(const Freshness& freshness,
                                                      const std::function<bool()>& should_stop) {
    return freshness_.AwaitFresh(freshness, should_stop);
  }
  // The same, but nullopt, at once, where it would have to wait.
  std::optional<std::chrono::nanoseconds> TryFresh(const Freshness& freshness) {
    return freshness_.TryFresh(freshness);
  }
  // Has what other servers had committed by now taken over, and calls `done` then, once, on this
  // or another thread, without any lock: for a caller that asks several registries at once.
  // UNAVAILABLE: as AwaitOthers. Cost: as that, but nobody waits.
  void StartFollow(std::function<void(const absl::Status&)> done) {
    freshness_.StartFollow(std::move(done));
  }
  // The same where what is here is not as fresh as this; false, and nothing, where it is.
  bool StartFresh(const Freshness& freshness, std::function<void(const absl::Status&)> done) {
    return freshness_.StartFresh(freshness, std::move(done));
  }

  // Has nothing committed here for a while (Committer::Hold). What is resolved meanwhile of what is
  // here (Freshness::OfWhatIsHere) is what the store holds all the while.
  void Hold(std::shared_ptr<CommitHold> hold);

  // Hulls and bodies of other registries, which count against --max-hulls with those that are here.
  // Called under the mutex, and takes none. Before any other call.
  void CountAlso(std::function<uint64_t()> held_elsewhere) {
    catalog_.CountAlso(std::move(held_elsewhere));
  }
  // How many hulls and bodies are here. Takes no lock.
  uint64_t held() const { return catalog_.HullCount() + catalog_.BodyCount(); }

  RegistrySizes Sizes() const;
  // How long, and for how much, the mutex of the records was held.
  HoldStatistics Holds() const;
  CacheStatistics Cache() const;
  CommitStatistics Commits() const { return committer_.Statistics(); }
  // Where each batch is timed and counted; set before the first change, and outlives this.
  void SetMetrics(StoreMetrics& metrics) {
    reader_.SetMetrics(metrics.snapshot_seconds);
    committer_.SetMetrics(metrics);
  }
  // RESOURCE_EXHAUSTED: more is held for this use than its share of --memory-limit.
  absl::Status CheckMemory(MemoryUse use);

  // The hulls, ready to be served, all current at one revision of the store, as fresh as the plan
  // says. May read from the store and prepare, hence not for gRPC's threads. CANCELLED when
  // should_stop said so. FAILED_PRECONDITION, UNAVAILABLE: as AwaitFresh.
  // RESOURCE_EXHAUSTED: hulls would have to be read from the store, or are more than
  // kMostLookupsPerHold, and what readers hold is beyond their share of --memory-limit; without a
  // time to retry, if these hulls are most of it.
  absl::StatusOr<Resolved> Resolve(std::span<const std::string> ids,
                                   const std::function<bool()>& should_stop,
                                   const ReadPlan& plan = {});
  // The same, but nullopt, at once, where it would have to ask or read the store, or to prepare.
  std::optional<Resolved> TryResolve(std::span<const std::string> ids, const ReadPlan& plan = {}) {
    return reader_.TryResolve(ids, plan);
  }
  // As Resolve, for a caller that asks for the same hulls again and again: `known` is kept in
  // between, and only what changed since is looked up.
  absl::StatusOr<Resolved> Refresh(std::span<const std::string> ids, KnownHulls& known,
                                   const std::function<bool()>& should_stop,
                                   const ReadPlan& plan = {}) {
    return reader_.Refresh(ids, known, should_stop, plan);
  }
  // The same for one hull; NOT_FOUND and DATA_LOSS are the status.
  absl::StatusOr<std::pair<AsOf, HullView>> Resolve(const std::string& id,
                                                    const std::function<bool()>& should_stop,
                                                    const Freshness& freshness = {});

  // The canonical snapshot of what was resolved, made if nobody needed it before; it lives as long
  // as view.served. Not for gRPC's threads. DATA_LOSS: the store is damaged. CANCELLED: should_stop
  // said so. RESOURCE_EXHAUSTED: it is not made yet, and readers hold more than their share of
  // --memory-limit. Cost: that of building the hull.
  absl::StatusOr<const Hull*> Canonical(const HullView& view,
                                        const std::function<bool()>& should_stop) {
    return reader_.Canonical(view, should_stop);
  }

  // Opens a session; `done` is called on this or another thread. `on_gone` is called once, on any
  // thread, with the reason when the hull is deleted or replaced before the session is closed.
  // NOT_FOUND; with create_if_absent as Create; DATA_LOSS: the store is damaged;
  // RESOURCE_EXHAUSTED: --max-writers-per-hull. client: takes turns with others for a thread.
  void OpenAppend(const std::string& id, const std::string& writer_id, bool create_if_absent,
                  std::function<void(const absl::Status&)> on_gone, Reply<OpenResult> done,
                  ClientId client = kNoClient) {
    appender_.OpenAppend(id, writer_id, create_if_absent, std::move(on_gone), std::move(done),
                         client);
  }

  void CloseAppend(const AppendSession& session) { appender_.CloseAppend(session); }

  // Queues a chunk. `on_built`, which may be empty, is called once its points are no longer held:
  // the next one may be queued then. `done` is called once it is committed or refused. Both come
  // once, on other threads, in either order; what is committed is reported in the order of the
  // sequences, a refusal possibly before what goes before it.
  // Refusals, which change nothing: FAILED_PRECONDITION: a gap in the sequence, or the hull is
  // gone; ABORTED: if_revision does not match; INVALID_ARGUMENT: a point is not finite;
  // RESOURCE_EXHAUSTED: --max-vertices-per-hull, --max-points-per-hull, --max-writers-per-hull,
  // --memory-limit, or the disk is full; UNAVAILABLE: the store cannot be written; DATA_LOSS: the
  // store is damaged; CANCELLED: should_stop said so.
  void Append(const AppendSession& session, Chunk chunk, std::function<bool()> should_stop,
              std::function<void()> on_built, Reply<ChunkResult> done) {
    appender_.Append(session, std::move(chunk), std::move(should_stop), std::move(on_built),
                     std::move(done));
  }

  // Begins to tell of changes (ChangeFeed). `on_ready` is called on the feed's thread, once after
  // each piece that waits. RESOURCE_EXHAUSTED: --memory-limit.
  absl::StatusOr<std::shared_ptr<ChangeWatch>> OpenWatch(const WatchTarget& target,
                                                         const WatchStart& start,
                                                         std::function<void()> on_ready) {
    return watches_.Open(target, start, std::move(on_ready));
  }
  // What is to be told next; may be nothing. UNAVAILABLE once EndWatches was called. Requires that
  // the watch does not wait. Cost: O(kMostPerPiece).
  absl::StatusOr<WatchPiece> TakeChanges(ChangeWatch& watch) { return watches_.Take(watch); }
  // What changes of `added` from now on is told, too, and what changes of `dropped`, which were
  // added before, no more. Requires a target that varies. Cost: a hash for each ID.
  void WatchAlso(ChangeWatch& watch, std::span<const std::string> added,
                 std::span<const std::string> dropped) {
    watches_.Extend(watch, added, dropped);
  }
  // The watch waits no more than until its on_ready is called, although nothing changed.
  void NudgeWatch(const std::shared_ptr<ChangeWatch>& watch) { watches_.Nudge(watch); }
  // An on_ready that is due by then still comes.
  void CloseWatch(const std::shared_ptr<ChangeWatch>& watch) { watches_.Close(watch); }
  // Every watch is to end: nudges them all.
  void EndWatches() { watches_.EndAll(); }

 private:
  Store& store_;
  // With the memory limit in force.
  const Limits limits_;
  MemoryBudget memory_;

  // Guards the rest, but what is thread-safe by itself (the budget, the committer, pools), and all
  // of a RegisteredHull but a builder that a thread owns.
  mutable FairMutex mutex_;
  Catalog catalog_;
  AfterOthers after_others_;
  ChangeFeed feed_;

  // Their threads use all the rest, so they end before anything else does (~Registry).
  Committer committer_;
  Preparer preparer_;
  // These read records, and help readers that read many hulls from the store.
  std::optional<WorkerPool> loaders_;

  // In the order in which they build on each other.
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
