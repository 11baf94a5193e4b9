#ifndef HULLD_SERVER_REGISTRY_CHANGES_LOCAL_CHANGES_H_
#define HULLD_SERVER_REGISTRY_CHANGES_LOCAL_CHANGES_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/hull/growth/hull_builder.h"
#include "core/query/placed/live_hull.h"
#include "server/process/task_pool.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/commit/committer.h"
#include "server/registry/memory/locked.h"
#include "server/registry/peers/peer_sync.h"
#include "server/registry/records/record_reader.h"
#include "server/registry/state/registry_state.h"
#include "server/store/records.h"

namespace hulld::server {

struct LentBuilder;
struct PendingChunk;

// Local changes of hulls and bodies: creation, deletion, and replacement, and growth of hulls by
// writers' chunks (hull_appender.cc).
//
// Creation, deletion, and replacement depend on the state of an ID: they load that state, wait
// until no change of the ID is in flight, and then decide in one critical section. Chunks overlap.
// The thread that owns the hull's builder (HullState) builds a chunk without the mutex and appends
// the new vertices to the LiveHull; the resulting change is submitted, and the next chunk of the
// hull may be built on it immediately. If the batch fails, all later chunks fail too, and the hull
// returns to its last committed state (Revert). If a peer server committed first, a change is
// retried on the new state, and a chunk returns to its place in the queue.
//
// Invariants:
//   - Advance follows each transition of a hull's HullState, so no runnable task keeps waiting. It
//     runs tasks that need the hull to be quiet (RegisteredHull::exclusive) first, then chunks.
//   - Per hull and writer, chunks commit in the order of their sequences, each exactly once; `head`
//     and the writer's `head` include every chunk in flight, `committed` only committed chunks.
//     Queued chunks occupy no thread.
//   - At most one change of a body is in flight (BodyTable::Entry::in_flight). Tasks that depend on
//     the ID wait in the entry and resume in order after it.
//   - A hull and a body never share an ID: a creation is refused if an object of the other kind has
//     the ID, and waits while a creation or an end of the other kind is in flight.
//   - A change is invisible until the store commits it; a refused change leaves the previous state
//     unchanged.
//
// Guarded by the registry's mutex; functions without a Locked parameter acquire it.
class LocalChanges {
 public:
  // All must outlive this. Chunks are built on `writers`.
  LocalChanges(RegistryState& state, Committer& committer, PeerSync& peers, RecordReader& records,
               TaskPool& writers)
      : state_(state), committer_(committer), peers_(peers), records_(records), writers_(writers) {}
  LocalChanges(const LocalChanges&) = delete;
  LocalChanges& operator=(const LocalChanges&) = delete;

  // Registers an empty hull. Calls `done`, on this or another thread, after it is committed or
  // refused. Requires: a valid ID (not checked here; CheckHullId runs when the call arrives).
  // ALREADY_EXISTS; RESOURCE_EXHAUSTED: --max-hulls, or the disk is full; UNAVAILABLE: the store
  // cannot be written.
  void Create(const std::string& id, bool if_absent, const Reply<PutHullResult>& done);
  // Removes a hull and notifies its sessions, or removes a body. kind: "hull" or "body". Replies
  // with the store's revision, as above. NOT_FOUND; ABORTED: if_revision does not match;
  // RESOURCE_EXHAUSTED, UNAVAILABLE: as above.
  void Delete(const std::string& kind, const std::string& id, std::optional<uint64_t> if_revision,
              const Reply<uint64_t>& done);
  // Creates or replaces a body atomically for all readers, and assigns its revisions. Replies as
  // above. Requires: valid IDs and poses (not checked), and between one and --max-pieces-per-body
  // pieces. The hulls of the pieces need not exist. ALREADY_EXISTS: a hull has the ID; ABORTED:
  // if_revision does not match; RESOURCE_EXHAUSTED: --max-hulls, --memory-limit, or the disk is
  // full; UNAVAILABLE: as above.
  void PutBody(StoredBody stored, std::optional<uint64_t> if_revision,
               const Reply<PutBodyResult>& done);
  // Replaces a hull atomically for all readers. The result is a new incarnation: sessions of the
  // previous one end. Replies as above. Requires a builder. Copies the vertices, so it must not run
  // on a gRPC thread. NOT_FOUND, unless create_if_absent; ABORTED: if_revision does not match;
  // RESOURCE_EXHAUSTED: --max-hulls, or the disk is full; UNAVAILABLE: as above.
  void Replace(Replacement replacement, const Reply<PutHullResult>& done);

  // Opens a session; `done` runs on another thread, because the caller may hold a lock that it
  // acquires. `on_gone` is called at most once, on any thread, with the reason if the hull is
  // deleted or replaced before the session is closed. NOT_FOUND; with create_if_absent as Create;
  // DATA_LOSS: the store is damaged; RESOURCE_EXHAUSTED: --max-writers-per-hull. client: shares
  // threads fairly with other clients.
  void OpenAppend(const std::string& id, const std::string& writer_id, bool create_if_absent,
                  std::function<void(const absl::Status&)> on_gone, Reply<OpenResult> done,
                  ClientId client = kNoClient);
  void CloseAppend(const AppendSession& session);
  // Queues a chunk. `on_built`, which may be empty, is called when its points are released and the
  // next chunk may be queued. `done` is called after it is committed or refused. Each is called
  // exactly once, on another thread, in either order; `done` may be called before that of an
  // earlier chunk. Refusals, which change nothing: FAILED_PRECONDITION: a gap in the sequence, or
  // the hull is gone; ABORTED: if_revision does not match; INVALID_ARGUMENT: a point is not finite;
  // RESOURCE_EXHAUSTED: --max-vertices-per-hull, --max-points-per-hull, --max-writers-per-hull,
  // --memory-limit, or the disk is full; UNAVAILABLE: the store cannot be written; DATA_LOSS: the
  // store is damaged; CANCELLED: should_stop returned true.
  void Append(const AppendSession& session, Chunk chunk, std::function<bool()> should_stop,
              std::function<void()> on_built, Reply<ChunkResult> done);

  // Defers the tasks that wait for the hull, which a peer server changed. Requires the mutex.
  void DeferAdvance(const HullPointer& hull);

 private:
  using Creation = std::function<void(Locked&, const HullPointer&)>;
  struct OpenRequest;
  struct BuiltChunk;

  void Submit(Locked& locked, const HullPointer& hull, Change change, Committer::Completion finish);
  void Advance(Locked& locked, const HullPointer& hull, bool is_last = false);

  void CreateNew(Locked& locked, const std::string& id, const Refusal& refuse,
                 const LockedTask& again, const Creation& done);
  absl::Status CheckPutBody(Locked& locked, const std::string& id,
                            std::optional<uint64_t> if_revision);
  void SubmitBody(Locked& locked, Change change, Committer::Completion finish);
  absl::Status CheckReplacement(const RegisteredHull* previous,
                                const Replacement& replacement) const;
  void CommitReplacement(Locked& locked, const HullPointer& previous,
                         const std::shared_ptr<Replacement>& replacement,
                         const Reply<PutHullResult>& done, const LockedTask& again);

  void OpenNew(Locked& locked, const std::shared_ptr<OpenRequest>& request,
               const LockedTask& again);
  void OpenExisting(Locked& locked, const HullPointer& hull,
                    const std::shared_ptr<OpenRequest>& request, const LockedTask& again);
  void OpenSession(Locked& locked, const HullPointer& hull, OpenRequest& request, bool created_hull,
                   uint64_t last_sequence);
  absl::StatusOr<uint64_t> CommittedSequence(Locked& locked, RegisteredHull& hull,
                                             const std::string& writer_id);
  void RunNextChunk(const HullPointer& hull);
  void RefuseChunks(const HullPointer& hull);
  void ApplyChunk(Locked& locked, const HullPointer& hull, PendingChunk& pending);
  absl::StatusOr<bool> CheckChunk(Locked& locked, RegisteredHull& hull,
                                  const PendingChunk& pending);
  absl::StatusOr<BuiltChunk> Build(Locked& locked, RegisteredHull& hull, PendingChunk& pending);
  absl::StatusOr<std::shared_ptr<LiveHull>> LiveForWriter(Locked& locked, RegisteredHull& hull);
  absl::StatusOr<PointCounts> AddPoints(PendingChunk& pending, LentBuilder& lent, LiveHull& live,
                                        BuiltChunk& built);
  absl::Status BuildFailure(RegisteredHull& hull, const absl::Status& cause);
  void SubmitChunk(Locked& locked, const HullPointer& hull, PendingChunk& pending,
                   BuiltChunk built);

  RegistryState& state_;
  Committer& committer_;
  PeerSync& peers_;
  RecordReader& records_;
  TaskPool& writers_;
  // Key of the newest session in RegisteredHull::watches. Guarded by the registry's mutex.
  uint64_t last_watch_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CHANGES_LOCAL_CHANGES_H_
