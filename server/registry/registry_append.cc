// Sessions and their chunks: the first half of each change that an append makes.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <utility>

#include "server/contract/error_info.h"
#include "server/contract/limit_error.h"
#include "server/contract/status_map.h"
#include "server/registry/registered_hull.h"
#include "server/registry/registry.h"

namespace hulld::server {
namespace {

absl::Status GoneWhileStreaming(const HullRecord& record) {
  return WithReason(
      absl::FailedPreconditionError(absl::StrCat(
          QuotedHull(record.hull_id),
          " was deleted or replaced while points were streamed into it; open the stream again")),
      v1::ERROR_REASON_HULL_GONE, {{"hull_id", record.hull_id}});
}

absl::Status TooManyWriters(const StoredHull& hull, uint64_t limit) {
  return LimitExceeded(
      absl::StrCat(QuotedHull(hull.record.hull_id), " was written by ", hull.writer_count,
                   " writers, so append under an earlier writer_id"),
      limit, "max-writers-per-hull");
}

absl::Status CheckPointCount(const HullRecord& record, const Chunk& chunk, const Limits& limits) {
  const uint64_t received = record.counts.received;
  if (received <= limits.max_points_per_hull &&
      chunk.points.size() <= limits.max_points_per_hull - received) {
    return absl::OkStatus();
  }
  return LimitExceeded(absl::StrCat(QuotedHull(record.hull_id), " has taken ", received,
                                    " points, and ", chunk.points.size(), " more came"),
                       limits.max_points_per_hull, "max-points-per-hull");
}

absl::Status CheckChunkRevision(const AppendSession& session, const HullRecord& record,
                                const Chunk& chunk) {
  if (!chunk.if_revision.has_value() || *chunk.if_revision == record.revision) {
    return absl::OkStatus();
  }
  const bool untouched = record.revision == record.create_revision;
  if (*chunk.if_revision == 0 && session.created_hull && untouched) return absl::OkStatus();
  return RevisionMismatch(record, *chunk.if_revision);
}

}  // namespace

void Registry::OpenAppend(const std::string& id, const std::string& writer_id,
                          bool create_if_absent, std::function<void(const absl::Status&)> on_gone,
                          Reply<OpenResult> done) {
  const auto request = std::make_shared<OpenRequest>(
      OpenRequest{id, writer_id, create_if_absent, false, std::move(on_gone), std::move(done)});
  // The store may have to be read.
  writers_.Submit([this, request] {
    Locked locked(mutex_);
    OpenLocked(locked, request);
  });
}

void Registry::OpenLocked(Locked& locked, const std::shared_ptr<OpenRequest>& request) {
  const auto retry = [this, request](Locked&, const absl::Status& status) {
    if (!status.ok()) return request->done(status);
    writers_.Submit([this, request] {
      Locked later(mutex_);
      OpenLocked(later, request);
    });
  };
  const auto refuse = [&locked, &request](const absl::Status& status) {
    locked.Afterwards([request, status] { request->done(status); });
  };
  const HullPointer hull = Find(request->hull_id);
  if (hull == nullptr) {
    if (!request->create_if_absent) return refuse(HullNotFound(request->hull_id));
    // The session opens at the very moment of the creation: the hull may be gone right after.
    return CreateNew(locked, request->hull_id,
                     [this, request](Locked& later, const absl::Status& status) {
                       if (!status.ok()) {
                         return later.Afterwards([request, status] { request->done(status); });
                       }
                       request->created_hull = true;
                       OpenSession(later, Find(request->hull_id), request, 0);
                     });
  }
  if (hull->ending) {
    hull->exclusive.push_back([retry](Locked& later) { retry(later, absl::OkStatus()); });
    return;
  }
  if (!hull->damage.ok()) return refuse(hull->damage);
  const absl::StatusOr<uint64_t> last = CommittedSequence(locked, *hull, request->writer_id);
  if (!last.ok()) return refuse(last.status());
  if (hull->state == RegisteredHull::State::kGone) return OpenLocked(locked, request);
  if (*last == 0 && hull->head.writer_count >= limits_.max_writers_per_hull) {
    return refuse(TooManyWriters(hull->head, limits_.max_writers_per_hull));
  }
  OpenSession(locked, hull, request, *last);
}

void Registry::OpenSession(Locked& locked, const HullPointer& hull,
                           const std::shared_ptr<OpenRequest>& request, uint64_t last_sequence) {
  OpenResult result;
  hull->watches.emplace(++last_watch_, std::move(request->on_gone));
  result.store_revision = revision_;
  result.hull = hull->committed.record;
  result.last_sequence = last_sequence;
  result.session = {hull, request->writer_id, request->created_hull, last_watch_};
  locked.Afterwards([request, result] { request->done(result); });
}

// May release the mutex to ask the store.
absl::StatusOr<uint64_t> Registry::CommittedSequence(Locked& locked, RegisteredHull& hull,
                                                     const std::string& writer_id) {
  auto writer = hull.writers.find(writer_id);
  if (writer != hull.writers.end()) return writer->second.committed;
  if (!store_.keeps_hulls() || hull.committed.writer_count == 0) return 0;
  const HullRecord record = hull.committed.record;
  locked.Unlock();
  const absl::StatusOr<uint64_t> sequence = store_.LoadSequence(record, writer_id);
  locked.Lock();
  if (!sequence.ok()) return sequence.status();
  // What others committed meanwhile is newer.
  writer = hull.writers.find(writer_id);
  if (writer != hull.writers.end()) return writer->second.committed;
  // Who has not written yet leaves nothing behind.
  if (*sequence > 0) {
    hull.writers.emplace(writer_id, RegisteredHull::Sequences{*sequence, *sequence});
  }
  return *sequence;
}

void Registry::CloseAppend(const AppendSession& session) {
  const std::lock_guard lock(mutex_);
  RegisteredHull& hull = *session.hull;
  hull.watches.erase(session.watch);
  const bool unused = hull.watches.empty() && hull.quiet() && hull.chunks.empty();
  if (unused && store_.keeps_hulls()) hull.writers.clear();
}

void Registry::Append(const AppendSession& session, Chunk chunk, std::function<bool()> should_stop,
                      std::function<void()> on_built, Reply<ChunkResult> done) {
  Locked locked(mutex_);
  const uint64_t bytes = chunk.points.capacity() * sizeof(Vector);
  cache_.bytes += bytes;
  session.hull->chunks.push_back({session, std::move(chunk), std::move(should_stop),
                                  std::move(on_built), std::move(done), bytes});
  Advance(locked, session.hull);
}

void Registry::RunNextChunk(const HullPointer& hull) {
  Locked locked(mutex_);
  PendingChunk pending = std::move(hull->chunks.front());
  hull->chunks.pop_front();
  std::optional<ChunkResult> already;
  PointCounts counts;
  absl::StatusOr<Change> change = Build(locked, hull, pending, &already, &counts);
  pending.chunk.points = {};
  cache_.bytes -= pending.charged_bytes;
  if (pending.on_built) locked.Afterwards(pending.on_built);
  if (change.ok()) {
    SubmitChunk(hull, pending, *std::move(change), counts);
  } else {
    absl::StatusOr<ChunkResult> result = change.status();
    if (already.has_value()) result = *already;
    locked.Afterwards([done = pending.done, result] { done(result); });
  }
  hull->busy = false;
  Charge(locked, *hull);
  Evict(locked);
  Advance(locked, hull);
}

// What is to be known before building; sets `already` when the chunk is committed.
absl::Status Registry::CheckChunk(Locked& locked, RegisteredHull& hull, const PendingChunk& pending,
                                  std::optional<ChunkResult>* already) {
  if (hull.state == RegisteredHull::State::kGone) return GoneWhileStreaming(hull.committed.record);
  if (!hull.damage.ok()) return hull.damage;
  const Chunk& chunk = pending.chunk;
  const absl::StatusOr<uint64_t> committed =
      CommittedSequence(locked, hull, pending.session.writer_id);
  if (!committed.ok()) return committed.status();
  const auto writer = hull.writers.find(pending.session.writer_id);
  const uint64_t last = writer == hull.writers.end() ? 0 : writer->second.head;
  if (chunk.sequence <= *committed) {
    const HullRecord& record = hull.committed.record;
    *already = ChunkResult{revision_, true, record.revision, record.vertex_count, {}};
    return absl::AlreadyExistsError("the chunk is committed");
  }
  if (chunk.sequence != last + 1) {
    return WithReason(absl::FailedPreconditionError(absl::StrCat(
                          "the expected sequence is ", last + 1,
                          "; open the stream again and continue after its last_sequence")),
                      v1::ERROR_REASON_SEQUENCE_GAP,
                      {{"hull_id", hull.committed.record.hull_id},
                       {"sequence", chunk.sequence},
                       {"expected_sequence", last + 1}});
  }
  if (last == 0 && hull.head.writer_count >= limits_.max_writers_per_hull) {
    return TooManyWriters(hull.head, limits_.max_writers_per_hull);
  }
  if (absl::Status s = CheckChunkRevision(pending.session, hull.head.record, chunk); !s.ok()) {
    return s;
  }
  if (absl::Status s = CheckPointCount(hull.head.record, pending.chunk, limits_); !s.ok()) return s;
  return CheckMemoryLocked(locked);
}

// The points of a chunk go into its hull's builder, which is read from the store where there is
// none, and what the store is to keep of it into the change. Without the mutex.
absl::StatusOr<PointCounts> Registry::AddPoints(PendingChunk& pending, Change& change,
                                                std::unique_ptr<HullBuilder>& builder) {
  if (builder == nullptr) {
    absl::StatusOr<std::unique_ptr<HullBuilder>> loaded =
        LoadBuilder(change.hull, pending.should_stop);
    if (!loaded.ok()) return loaded.status();
    builder = *std::move(loaded);
  }
  if (pending.should_stop && pending.should_stop()) {
    return absl::CancelledError("the call was cancelled");
  }
  absl::StatusOr<PointCounts> added =
      builder->Add(pending.chunk.points,
                   {static_cast<size_t>(limits_.max_vertices_per_hull), pending.should_stop});
  if (added.ok() && added->outside > 0 && store_.keeps_hulls()) {
    const bool base = Store::WantsBase(change.hull.layout, added->outside);
    change.vertex_change = base ? VertexChange::kReplaced : VertexChange::kAdded;
    change.vertices = base ? builder->Vertices() : builder->NewVertices();
  }
  return added;
}

// What a writer is told when AddPoints failed.
absl::Status Registry::WhyNotBuilt(RegisteredHull& hull, const absl::Status& cause) {
  if (absl::IsDataLoss(cause)) {
    hull.damage = cause;
    ++cache_.damaged;
  }
  if (!absl::IsResourceExhausted(cause)) return cause;
  return LimitExceeded(
      absl::StrCat(QuotedHull(hull.head.record.hull_id), " would hold too many vertices"),
      limits_.max_vertices_per_hull, "max-vertices-per-hull");
}

// The record and the layout of the hull as it is with the points that were added.
void Registry::FillChange(const RegisteredHull& hull, const PointCounts& added, Change& change) {
  HullRecord& record = change.hull.record;
  VertexLayout& layout = change.hull.layout;
  record.counts += added;
  change.revision = assigned_revision_;
  if (added.outside == 0) return;
  change.revision = record.revision = ++assigned_revision_;
  record.vertex_count = hull.builder->vertex_count();
  record.dimension = hull.builder->dimension();
  if (change.vertex_change == VertexChange::kReplaced) {
    layout = {record.revision, record.vertex_count, 0, 0};
  } else if (change.vertex_change == VertexChange::kAdded) {
    ++layout.delta_count;
    layout.delta_vertices += change.vertices.size();
  }
}

// Entered and left with the mutex held; requires that the hull is busy for the caller. On success
// `head` and the writer's sequence include the change.
absl::StatusOr<Change> Registry::Build(Locked& locked, const HullPointer& hull,
                                       PendingChunk& pending, std::optional<ChunkResult>* already,
                                       PointCounts* counts) {
  const std::string name = absl::StrCat("chunk ", pending.chunk.sequence, ": ");
  absl::Status allowed = CheckChunk(locked, *hull, pending, already);
  if (!allowed.ok()) return Prefixed(name, allowed);
  const uint64_t reverts = hull->reverts;
  Change change;
  change.hull = hull->head;
  change.former_layout = hull->head.layout;
  std::unique_ptr<HullBuilder> builder = std::move(hull->builder);
  const bool load = builder == nullptr;

  locked.Unlock();
  const absl::StatusOr<PointCounts> added = AddPoints(pending, change, builder);
  pending.chunk.points = {};
  const size_t builder_bytes = builder == nullptr ? 0 : builder->MemoryBytes();
  locked.Lock();

  if (load && builder != nullptr) ++cache_.loads;
  if (hull->reverts != reverts) {
    locked.Discard(std::move(builder));
    hull->builder_bytes = 0;
    return Prefixed(name, absl::UnavailableError("a change before it could not be stored"));
  }
  hull->builder = std::move(builder);
  hull->builder_bytes = builder_bytes;
  if (!added.ok()) return Prefixed(name, WhyNotBuilt(*hull, added.status()));

  *counts = *added;
  FillChange(*hull, *added, change);
  RegisteredHull::Sequences& sequences = hull->writers[pending.session.writer_id];
  if (sequences.head == 0) ++change.hull.writer_count;
  sequences.head = pending.chunk.sequence;
  change.writer = WriterSequence{pending.session.writer_id, pending.chunk.sequence};
  hull->head = change.hull;
  return change;
}

void Registry::SubmitChunk(const HullPointer& hull, const PendingChunk& pending, Change change,
                           const PointCounts& counts) {
  const StoredHull after = change.hull;
  const auto finish = [this, hull, after, counts, done = pending.done,
                       writer_id = pending.session.writer_id, sequence = pending.chunk.sequence](
                          Locked& locked, const absl::Status& status) {
    absl::StatusOr<ChunkResult> result =
        ErrorOrEmpty<ChunkResult>(Prefixed(absl::StrCat("chunk ", sequence, ": "), status));
    if (status.ok()) {
      const HullRecord& record = after.record;
      if (record.revision != hull->committed.record.revision) {
        revision_ = record.revision;
        vertex_count_ += record.vertex_count - hull->committed.record.vertex_count;
        locked.Discard(std::exchange(hull->snapshot, nullptr));
      }
      hull->committed = after;
      hull->writers[writer_id].committed = sequence;
      Charge(locked, *hull);
      result = ChunkResult{revision_, false, record.revision, record.vertex_count, counts};
    }
    locked.Afterwards([done, result] { done(result); });
  };
  Submit(hull, std::move(change), finish);
}

}  // namespace hulld::server
