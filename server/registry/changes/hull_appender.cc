// Growth of hulls: writers' sessions and their chunks.
#include <absl/strings/str_cat.h>

#include <utility>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/contract/stopped_call.h"
#include "server/registry/catalog/registered_hull.h"
#include "server/registry/changes/local_changes.h"
#include "server/registry/memory/hull_loader.h"

namespace hulld::server {

struct LocalChanges::OpenRequest {
  std::string hull_id;
  std::string writer_id;
  bool create_if_absent = false;
  std::function<void(const absl::Status&)> on_gone;
  Reply<OpenResult> done;
  ClientId client = kNoClient;
};

// A chunk added to the builder, and its change to commit.
struct LocalChanges::BuiltChunk {
  Change change;
  PointCounts counts;
  // Prefix of the LiveHull that includes this chunk.
  LiveHull::Mark mark;
};

namespace {

absl::Status GoneWhileStreaming(const RegisteredHull& hull) {
  return Gone(hull.committed().record.hull_id, "deleted or replaced");
}

absl::Status Superseded() { return absl::AbortedError("a peer server changed the hull first"); }

absl::Status TooManyWriters(const StoredHull& hull, uint64_t limit) {
  return LimitExceeded(absl::StrCat(Quoted("hull", hull.record.hull_id), " has ", hull.writer_count,
                                    " writers; append with one of their writer_ids"),
                       limit, "max-writers-per-hull");
}

absl::Status CheckPointCount(const HullRecord& record, const Chunk& chunk, const Limits& limits) {
  const uint64_t received = record.counts.received;
  if (received <= limits.max_points_per_hull &&
      chunk.points.size() <= limits.max_points_per_hull - received) {
    return absl::OkStatus();
  }
  return LimitExceeded(absl::StrCat(Quoted("hull", record.hull_id), " has received ", received,
                                    " points, and the chunk has ", chunk.points.size(), " more"),
                       limits.max_points_per_hull, "max-points-per-hull");
}

absl::Status CheckChunkRevision(const AppendSession& session, const HullRecord& record,
                                const Chunk& chunk) {
  const bool untouched = record.revision == record.create_revision;
  if (chunk.if_revision == 0 && session.created_hull && untouched) return absl::OkStatus();
  return CheckRevision("hull", record.hull_id, record.revision, chunk.if_revision);
}

// Adds the points missing from a builder. Returns false if the result differs from the record; the
// builder must then be rebuilt.
bool CatchUp(HullBuilder& builder, std::span<const Vector> backlog, const HullRecord& record) {
  if (backlog.empty()) return true;
  return builder.Add(backlog).ok() && builder.vertex_count() == record.vertex_count &&
         builder.dimension() == record.dimension;
}

void AnswerChunk(Locked& locked, const Reply<ChunkResult>& done, uint64_t sequence,
                 absl::StatusOr<ChunkResult> result) {
  if (!result.ok()) result = Prefixed(absl::StrCat("chunk ", sequence, ": "), result.status());
  Answer(locked, done, std::move(result));
}

}  // namespace

void LocalChanges::OpenAppend(const std::string& id, const std::string& writer_id,
                              bool create_if_absent,
                              std::function<void(const absl::Status&)> on_gone,
                              Reply<OpenResult> done, ClientId client) {
  const auto request = std::make_shared<OpenRequest>(
      OpenRequest{id, writer_id, create_if_absent, std::move(on_gone), std::move(done), client});
  const auto open = [=, this](Locked& locked, const LockedTask& again) {
    const HullPointer hull = state_.Find(request->hull_id);
    if (hull == nullptr) return OpenNew(locked, request, again);
    // May query the store.
    writers_.Submit(
        [=, this] {
          Locked later(state_.mutex);
          OpenExisting(later, hull, request, again);
        },
        request->client);
  };
  writers_.Submit(
      [=, this] {
        records_.WhenReady(request->hull_id, RecordReader::For::kLife, request->done, open);
      },
      client);
}

// The session opens in the completion of the creation, because the hull may be gone immediately
// afterwards.
void LocalChanges::OpenNew(Locked& locked, const std::shared_ptr<OpenRequest>& request,
                           const LockedTask& again) {
  if (!request->create_if_absent) {
    return Answer(locked, request->done, state_.NoSuch("hull", request->hull_id));
  }
  CreateNew(locked, request->hull_id, request->done, again,
            [=, this](Locked& later, const HullPointer& created) {
              OpenSession(later, created, *request, true, 0);
            });
}

// May release the mutex to query the store.
void LocalChanges::OpenExisting(Locked& locked, const HullPointer& hull,
                                const std::shared_ptr<OpenRequest>& request,
                                const LockedTask& again) {
  const auto has_ended = [&] { return hull->state.gone() || hull->state.changing_life(); };
  if (has_ended()) return again(locked);
  if (hull->state.damaged()) return Answer(locked, request->done, hull->state.damage());
  const absl::StatusOr<uint64_t> last = CommittedSequence(locked, *hull, request->writer_id);
  if (!last.ok()) return Answer(locked, request->done, last.status());
  // The end of a hull removes its sequences from the store before the registry applies it.
  if (has_ended()) return again(locked);
  if (*last == 0 && hull->head().writer_count >= state_.limits.max_writers_per_hull) {
    return Answer(locked, request->done,
                  TooManyWriters(hull->head(), state_.limits.max_writers_per_hull));
  }
  OpenSession(locked, hull, *request, false, *last);
}

void LocalChanges::OpenSession(Locked& locked, const HullPointer& hull, OpenRequest& request,
                               bool created_hull, uint64_t last_sequence) {
  HULLD_CHECK(hull->state.visible());
  OpenResult result;
  hull->watches.emplace(++last_watch_, std::move(request.on_gone));
  result.store_revision = state_.revision();
  result.hull = hull->committed().record;
  result.last_sequence = last_sequence;
  result.session = {hull, request.writer_id, created_hull, last_watch_, request.client};
  Answer(locked, request.done, std::move(result));
}

// Returns the last committed sequence of a writer. May release the mutex to query the store.
absl::StatusOr<uint64_t> LocalChanges::CommittedSequence(Locked& locked, RegisteredHull& hull,
                                                         const std::string& writer_id) {
  if (const auto known = hull.CommittedSequence(writer_id)) return *known;
  if (!state_.store.keeps_hulls() || hull.committed().writer_count == 0) return 0;
  const HullRecord record = hull.committed().record;
  const uint64_t supersessions = hull.supersessions();
  hull.StartReadingSequence();
  locked.Unlock();
  const absl::StatusOr<uint64_t> sequence = state_.store.LoadSequence(record, writer_id);
  locked.Lock();
  hull.EndReadingSequence();
  if (absl::IsAborted(sequence.status())) {
    HULLD_RETURN_IF_ERROR(peers_.AwaitPeers(locked, {}));
    // Every caller checks whether the hull is gone.
    if (hull.state.gone()) return 0;
    if (hull.supersessions() == supersessions && hull.committed().record == record) {
      return StoreDisagrees(record);
    }
    return CommittedSequence(locked, hull, writer_id);
  }
  if (!sequence.ok()) return sequence.status();
  // A peer server may have committed a chunk of the writer since.
  if (hull.supersessions() != supersessions) return CommittedSequence(locked, hull, writer_id);
  // A commit during the read is newer and still in the map.
  if (const auto known = hull.CommittedSequence(writer_id)) return *known;
  // A writer that has not written yet gets no entry.
  if (*sequence > 0) hull.KeepSequence(writer_id, *sequence);
  return *sequence;
}

void LocalChanges::CloseAppend(const AppendSession& session) {
  Locked locked(state_.mutex);
  RegisteredHull& hull = *session.hull;
  hull.watches.erase(session.watch);
  hull.DropUnusedWriters();
  if (hull.builder() == nullptr || hull.state.gone()) return;
  hull.DiscardUnneededBuilder(locked);
  hull.NoteUse();
  state_.hulls.RestSoon(locked, hull);
}

void LocalChanges::Append(const AppendSession& session, Chunk chunk,
                          std::function<bool()> should_stop, std::function<void()> on_built,
                          Reply<ChunkResult> done) {
  Locked locked(state_.mutex);
  const uint64_t bytes = chunk.points.capacity() * sizeof(Vector);
  session.hull->chunks.push_back(
      {session, std::move(chunk), std::move(should_stop), std::move(on_built), std::move(done),
       MemoryCharge(state_.memory, MemoryUse::kWriting, bytes), ++session.hull->last_place});
  Advance(locked, session.hull);
}

void LocalChanges::RunNextChunk(const HullPointer& hull) {
  Locked locked(state_.mutex);
  HULLD_CHECK(hull->state.work() == HullState::Work::kScheduled && !hull->chunks.empty());
  PendingChunk pending = std::move(hull->chunks.front());
  hull->chunks.pop_front();
  ApplyChunk(locked, hull, pending);
  pending.chunk.points = {};
  pending.charge.Set(0);
  if (pending.on_built) locked.Defer(std::exchange(pending.on_built, nullptr));
  hull->state.EndWork();
  hull->NoteUse();
  state_.memory.Evict(locked);
  Advance(locked, hull, true);
}

// Refuses the chunks of a hull that can no longer grow.
void LocalChanges::RefuseChunks(const HullPointer& hull) {
  Locked locked(state_.mutex);
  HULLD_CHECK(hull->state.gone() || hull->state.damaged());
  const absl::Status reason = hull->state.gone() ? GoneWhileStreaming(*hull) : hull->state.damage();
  for (PendingChunk& pending : std::exchange(hull->chunks, {})) {
    AnswerChunk(locked, pending.done, pending.chunk.sequence, reason);
    if (pending.on_built) locked.Defer(std::move(pending.on_built));
  }
}

// Answers a chunk, or submits its change, whose completion answers it. Releases the mutex while
// building.
void LocalChanges::ApplyChunk(Locked& locked, const HullPointer& hull, PendingChunk& pending) {
  const uint64_t sequence = pending.chunk.sequence;
  absl::StatusOr<bool> is_new = CheckChunk(locked, *hull, pending);
  // Without a commit, no store write detects a stale state, so compare explicitly.
  if (!is_new.value_or(false) && peers_.has_peers()) {
    const absl::Status fresh = peers_.AwaitPeers(locked, pending.should_stop);
    is_new = fresh.ok() ? CheckChunk(locked, *hull, pending) : fresh;
    // An earlier chunk must be rebuilt first.
    if (hull->HasEarlierChunk(pending)) {
      hull->Requeue(std::move(pending));
      return;
    }
  }
  if (!is_new.ok()) return AnswerChunk(locked, pending.done, sequence, is_new.status());
  if (!*is_new) {
    const HullRecord& record = hull->committed().record;
    return AnswerChunk(
        locked, pending.done, sequence,
        ChunkResult{state_.revision(), true, record.revision, record.vertex_count, {}});
  }
  absl::StatusOr<BuiltChunk> built = Build(locked, *hull, pending);
  if (Committer::IsSuperseded(built.status())) {
    if (!Stopped(pending.should_stop)) {
      // The chunk will be built again.
      hull->Requeue(std::move(pending));
      return;
    }
    built = Cancelled();
  }
  if (!built.ok()) return AnswerChunk(locked, pending.done, sequence, built.status());
  SubmitChunk(locked, hull, pending, *std::move(built));
}

// Checks a chunk before building. Returns false if it was already applied. May release the mutex to
// query the store.
absl::StatusOr<bool> LocalChanges::CheckChunk(Locked& locked, RegisteredHull& hull,
                                              const PendingChunk& pending) {
  if (hull.state.gone()) return GoneWhileStreaming(hull);
  const Chunk& chunk = pending.chunk;
  const std::string& writer_id = pending.session.writer_id;
  HULLD_ASSIGN_OR_RETURN(const uint64_t committed, CommittedSequence(locked, hull, writer_id));
  if (hull.state.gone()) return GoneWhileStreaming(hull);
  if (chunk.sequence <= committed) return false;
  const uint64_t last = hull.HeadSequence(writer_id);
  if (chunk.sequence != last + 1) {
    return WithReason(absl::FailedPreconditionError(absl::StrCat(
                          "the expected sequence is ", last + 1,
                          "; open the stream again and continue after its last_sequence")),
                      v1::ERROR_REASON_SEQUENCE_GAP,
                      {{"hull_id", hull.committed().record.hull_id},
                       {"sequence", chunk.sequence},
                       {"expected_sequence", last + 1}});
  }
  if (last == 0 && hull.head().writer_count >= state_.limits.max_writers_per_hull) {
    return TooManyWriters(hull.head(), state_.limits.max_writers_per_hull);
  }
  const HullRecord& record = hull.head().record;
  HULLD_RETURN_IF_ERROR(CheckChunkRevision(pending.session, record, chunk));
  HULLD_RETURN_IF_ERROR(CheckPointCount(record, chunk, state_.limits));
  HULLD_RETURN_IF_ERROR(state_.memory.Check(locked, MemoryUse::kWriting));
  return true;
}

// Adds a chunk to its hull's builder, without the mutex. On success `head` and the writer's
// sequence include it.
absl::StatusOr<LocalChanges::BuiltChunk> LocalChanges::Build(Locked& locked, RegisteredHull& hull,
                                                             PendingChunk& pending) {
  // A reader may have found damage during a release of the mutex.
  if (hull.state.damaged()) return hull.state.damage();
  hull.state.StartBuilding();
  const absl::StatusOr<std::shared_ptr<LiveHull>> live = LiveForWriter(locked, hull);
  if (Committer::IsSuperseded(live.status())) return live.status();
  if (!live.ok()) return BuildFailure(hull, live.status());
  BuiltChunk built;
  Change& change = built.change;
  change.hull = hull.head();
  change.previous_vertices = hull.head().record.vertex_count;
  change.previous_layout = hull.head().layout;
  LentBuilder lent = hull.LendBuilder();

  locked.Unlock();
  const absl::StatusOr<PointCounts> added = AddPoints(pending, lent, **live, built);
  if (!peers_.has_peers()) pending.chunk.points = {};
  const uint64_t builder_bytes = lent.builder == nullptr ? 0 : lent.builder->MemoryBytes();
  locked.Lock();

  hull.ReturnBuilder(std::move(lent.builder), builder_bytes);
  if (hull.state.work() == HullState::Work::kReverting) {
    hull.DiscardBuilder(locked);
    if (peers_.has_peers()) return Superseded();
    return Unavailable("an earlier change could not be stored");
  }
  if (!added.ok()) return BuildFailure(hull, added.status());
  if (hull.state.damaged()) {
    hull.DiscardBuilder(locked);
    return hull.state.damage();
  }

  built.counts = *added;
  hull.AddToHead(*added, {pending.session.writer_id, pending.chunk.sequence}, &change);
  return built;
}

// Returns the LiveHull to append to. Releases the mutex to read it from the store if it is not in
// memory. A writer does not wait for a reader that loads the same hull; the first to finish wins.
absl::StatusOr<std::shared_ptr<LiveHull>> LocalChanges::LiveForWriter(Locked& locked,
                                                                      RegisteredHull& hull) {
  if (hull.live() != nullptr) return hull.live();
  HULLD_CHECK(hull.state.in_flight() == 0);
  const StoredHull stored = hull.committed();
  if (stored.record.vertex_count == 0) {
    hull.SetLive(std::make_shared<LiveHull>());
    return hull.live();
  }
  locked.Unlock();
  absl::StatusOr<std::shared_ptr<LiveHull>> loaded = LoadLive(state_.store, stored);
  locked.Lock();
  if (absl::IsAborted(loaded.status())) {
    HULLD_RETURN_IF_ERROR(peers_.AwaitPeers(locked, {}));
    const bool is_known = hull.state.work() == HullState::Work::kReverting || hull.state.gone() ||
                          hull.state.changing_life();
    return is_known ? Superseded() : StoreDisagrees(stored.record);
  }
  if (hull.state.work() == HullState::Work::kReverting) return Superseded();
  if (hull.live() != nullptr) return hull.live();
  if (!loaded.ok()) return loaded.status();
  hull.SetLive(*std::move(loaded));
  ++state_.statistics.loads;
  hull.NoteUse();
  hull.changed.notify_all();
  return hull.live();
}

// Adds a chunk's points to the lent builder, after its backlog; builds the builder from the
// committed points if it is missing. Appends the new vertices to the LiveHull and fills the change
// with the data to store. Called without the mutex.
absl::StatusOr<PointCounts> LocalChanges::AddPoints(PendingChunk& pending, LentBuilder& lent,
                                                    LiveHull& live, BuiltChunk& built) {
  Change& change = built.change;
  std::unique_ptr<HullBuilder>& builder = lent.builder;
  if (builder != nullptr && !CatchUp(*builder, lent.backlog, change.hull.record)) {
    builder = nullptr;
  }
  if (builder == nullptr) {
    HULLD_ASSIGN_OR_RETURN(
        std::unique_ptr<HullBuilder> made,
        BuildHull(change.hull.record, live.PointsAt(lent.committed), pending.should_stop));
    builder = std::move(made);
  }
  if (Stopped(pending.should_stop)) return Cancelled();
  AddLimits limits;
  limits.max_vertices = static_cast<size_t>(state_.limits.max_vertices_per_hull);
  limits.should_stop = pending.should_stop;
  absl::StatusOr<PointCounts> added = builder->Add(pending.chunk.points, limits);
  if (!added.ok()) return added;
  if (added->outside == 0) {
    built.mark = live.Now();
    return added;
  }
  std::vector<Vector> vertices = builder->NewVertices();
  built.mark = live.Append(vertices, builder->dimension());
  if (state_.store.keeps_hulls()) {
    const bool base = Store::WantsBase(change.hull.layout, added->outside);
    change.vertex_change = base ? VertexChange::kReplaced : VertexChange::kAdded;
    change.vertices = base ? builder->Vertices() : std::move(vertices);
  }
  return added;
}

// Returns the writer's status for a failure of AddPoints.
absl::Status LocalChanges::BuildFailure(RegisteredHull& hull, const absl::Status& cause) {
  if (absl::IsDataLoss(cause)) state_.MarkDamaged(hull, cause);
  if (!absl::IsResourceExhausted(cause)) return cause;
  return LimitExceeded(
      absl::StrCat(Quoted("hull", hull.head().record.hull_id), " would have too many vertices"),
      state_.limits.max_vertices_per_hull, "max-vertices-per-hull");
}

void LocalChanges::SubmitChunk(Locked& locked, const HullPointer& hull, PendingChunk& pending,
                               BuiltChunk built) {
  // If a peer server may commit first, keeps the chunk for a retry.
  std::shared_ptr<PendingChunk> kept;
  const Reply<ChunkResult> done = pending.done;
  const uint64_t sequence = built.change.writer->sequence;
  if (peers_.has_peers()) {
    kept = std::make_shared<PendingChunk>(std::move(pending));
    // NOLINTNEXTLINE(bugprone-use-after-move): it is the caller's again
    pending.on_built = std::exchange(kept->on_built, nullptr);
  }
  const auto finish = [=, this, mark = built.mark, counts = built.counts](
                          Locked& later, const absl::Status& status, const Change& change) {
    if (!status.ok()) hull->Revert(later);
    if (Committer::IsSuperseded(status)) {
      hull->Requeue(std::move(*kept));
      return;
    }
    if (!status.ok()) return AnswerChunk(later, done, sequence, status);
    state_.ApplyChunk(later, hull, change, mark, counts.outside);
    const HullRecord& record = change.hull.record;
    AnswerChunk(
        later, done, sequence,
        ChunkResult{state_.revision(), false, record.revision, record.vertex_count, counts});
  };
  hull->state.Submit();
  Submit(locked, hull, std::move(built.change), finish);
}

}  // namespace hulld::server
