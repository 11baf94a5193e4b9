#include "server/registry.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <unordered_map>
#include <utility>

#include "server/limit_error.h"
#include "server/status_map.h"

namespace hulld::server {

struct Registry::PendingChunk {
  AppendSession session;
  Chunk chunk;
  std::function<bool()> should_stop;
  std::function<void(absl::StatusOr<ChunkResult>)> done;
};

struct RegisteredHull {
  HullRecord record;
  // Of record.revision; null when nobody has asked since the last change.
  std::shared_ptr<const Snapshot> snapshot;
  bool deleted = false;
  // Not OK once a change that the builder holds could not be stored.
  absl::Status failure;
  // Last committed sequence by writer.
  std::unordered_map<std::string, uint64_t> writers;
  std::map<uint64_t, std::function<void()>> deletion_watches;

  // Whoever set `busy` owns the builder, without the registry's mutex.
  bool busy = false;
  HullBuilder builder;
  // Readers that need the builder; the next chunk waits for them.
  int pins = 0;
  std::condition_variable released;
  std::deque<Registry::PendingChunk> pending;
};

namespace {

// How soon a reader that waits for a chunk notices that its call was cancelled.
constexpr std::chrono::milliseconds kCancellationPoll(20);

std::string Quoted(const std::string& id) { return absl::StrCat("hull \"", id, "\""); }

absl::Status NotFound(const std::string& id) {
  return absl::NotFoundError(absl::StrCat(Quoted(id), " not found; create it first"));
}

absl::Status Deleted(const HullRecord& record) {
  return absl::FailedPreconditionError(
      absl::StrCat(Quoted(record.hull_id),
                   " was deleted while points were streamed into it; create it and start again"));
}

absl::Status RevisionMismatch(const HullRecord& record, uint64_t if_revision) {
  return absl::AbortedError(absl::StrCat(Quoted(record.hull_id), " is at revision ",
                                         record.revision, ", not ", if_revision,
                                         " (if_revision); read it again, then retry"));
}

bool Stopped(const std::function<bool()>& should_stop) { return should_stop && should_stop(); }

absl::Status CheckChunkRevision(const AppendSession& session, const HullRecord& record,
                                const Chunk& chunk) {
  if (!chunk.if_revision.has_value() || *chunk.if_revision == record.revision) {
    return absl::OkStatus();
  }
  const bool untouched = record.revision == record.create_revision;
  if (*chunk.if_revision == 0 && session.created_hull && untouched) return absl::OkStatus();
  return RevisionMismatch(record, *chunk.if_revision);
}

absl::Status CheckPointCount(const HullRecord& record, const Chunk& chunk, const Limits& limits) {
  const uint64_t received = record.counts.received;
  if (received <= limits.max_points_per_hull &&
      chunk.points.size() <= limits.max_points_per_hull - received) {
    return absl::OkStatus();
  }
  return LimitExceeded(absl::StrCat(Quoted(record.hull_id), " has taken ", received,
                                    " points, and ", chunk.points.size(), " more came"),
                       limits.max_points_per_hull, "max-points-per-hull");
}

void AddTo(PointCounts& sums, const PointCounts& counts) {
  sums.received += counts.received;
  sums.outside += counts.outside;
  sums.duplicate += counts.duplicate;
  sums.inside += counts.inside;
}

}  // namespace

Registry::Registry(Store& store, const Limits& limits, WorkerPool& writers)
    : store_(store), limits_(limits), writers_(writers) {}

Registry::HullPointer Registry::Find(const std::string& id) const {
  const auto found = hulls_.find(id);
  return found == hulls_.end() ? nullptr : found->second;
}

absl::StatusOr<Registry::HullPointer> Registry::CreateLocked(const std::string& id) {
  if (hulls_.size() >= limits_.max_hulls) {
    return LimitExceeded(absl::StrCat("the store holds ", hulls_.size(), " hulls"),
                         limits_.max_hulls, "max-hulls");
  }
  const uint64_t revision = revision_ + 1;
  if (absl::Status s = store_.Commit(HullCreated{id, revision}); !s.ok()) return s;
  revision_ = revision;
  auto hull = std::make_shared<RegisteredHull>();
  hull->record.hull_id = id;
  hull->record.create_revision = hull->record.revision = revision;
  hull->snapshot = empty_snapshot_;
  hulls_.emplace(id, hull);
  return hull;
}

absl::StatusOr<CreateResult> Registry::Create(const std::string& id, bool if_absent) {
  const Lock lock(mutex_);
  if (const HullPointer existing = Find(id); existing != nullptr) {
    if (if_absent) return CreateResult{revision_, existing->record, false};
    return absl::AlreadyExistsError(
        absl::StrCat(Quoted(id), " exists; delete it first, or set if_absent to use it"));
  }
  const absl::StatusOr<HullPointer> created = CreateLocked(id);
  if (!created.ok()) return created.status();
  return CreateResult{revision_, (*created)->record, true};
}

absl::StatusOr<uint64_t> Registry::Delete(const std::string& id,
                                          std::optional<uint64_t> if_revision) {
  HullPointer hull;
  std::map<uint64_t, std::function<void()>> watches;
  uint64_t revision = 0;
  {
    const Lock lock(mutex_);
    hull = Find(id);
    if (hull == nullptr) return NotFound(id);
    const HullRecord& record = hull->record;
    if (if_revision.has_value() && *if_revision != record.revision) {
      return RevisionMismatch(record, *if_revision);
    }
    revision = revision_ + 1;
    const absl::Status stored =
        store_.Commit(HullDeleted{record.hull_id, record.create_revision, revision});
    if (!stored.ok()) return stored;
    revision_ = revision;
    vertex_count_ -= record.vertex_count;
    hull->deleted = true;
    hull->released.notify_all();
    watches.swap(hull->deletion_watches);
    hulls_.erase(id);
  }
  for (const auto& [number, on_deleted] : watches) on_deleted();
  return revision;
}

HullPage Registry::List(const std::string& prefix, const std::string& after,
                        size_t page_size) const {
  HullPage page;
  const Lock lock(mutex_);
  page.store_revision = revision_;
  auto next = after.empty() ? hulls_.lower_bound(prefix) : hulls_.upper_bound(after);
  for (; next != hulls_.end() && next->first.starts_with(prefix); ++next) {
    if (page.hulls.size() == page_size) {
      page.more = true;
      break;
    }
    page.hulls.push_back(next->second->record);
  }
  return page;
}

RegistrySizes Registry::Sizes() const {
  const Lock lock(mutex_);
  return {revision_, hulls_.size(), vertex_count_};
}

void Registry::Unpin(const HullPointer& hull) {
  if (--hull->pins == 0) StartNextChunk(hull);
}

void Registry::MakeSnapshot(Lock& lock, RegisteredHull& hull,
                            const std::function<bool()>& should_stop) {
  const auto ready = [&] { return !hull.busy || hull.deleted || hull.snapshot != nullptr; };
  while (!hull.released.wait_for(lock, kCancellationPoll, ready)) {
    if (Stopped(should_stop)) return;
  }
  if (hull.busy || hull.deleted || hull.snapshot != nullptr) return;
  hull.busy = true;
  lock.unlock();
  auto snapshot = std::make_shared<const Snapshot>(hull.builder.Snapshot());
  lock.lock();
  hull.snapshot = std::move(snapshot);
  hull.busy = false;
  hull.released.notify_all();
}

// Requires the lock and that every snapshot is current.
Resolved Registry::View(std::span<const std::string> ids,
                        std::span<const HullPointer> hulls) const {
  Resolved resolved;
  resolved.store_revision = revision_;
  resolved.hulls.reserve(ids.size());
  for (size_t i = 0; i < ids.size(); ++i) {
    if (hulls[i] == nullptr) {
      resolved.hulls.emplace_back(NotFound(ids[i]));
    } else if (!hulls[i]->failure.ok()) {
      resolved.hulls.emplace_back(hulls[i]->failure);
    } else {
      resolved.hulls.emplace_back(HullView{hulls[i]->record, hulls[i]->snapshot});
    }
  }
  return resolved;
}

std::optional<Resolved> Registry::TryResolve(std::span<const std::string> ids) {
  std::vector<HullPointer> hulls(ids.size());
  const Lock lock(mutex_);
  for (size_t i = 0; i < ids.size(); ++i) {
    hulls[i] = Find(ids[i]);
    const bool missing = hulls[i] != nullptr && hulls[i]->snapshot == nullptr;
    if (missing && hulls[i]->failure.ok()) return std::nullopt;
  }
  return View(ids, hulls);
}

// Optimistic first: take what is current, and make the snapshots that are missing. Should a writer
// have changed one of the hulls meanwhile, hold back the writers of all of them and try again; the
// chunks in progress then are the last ones to wait for.
absl::StatusOr<Resolved> Registry::Resolve(std::span<const std::string> ids,
                                           const std::function<bool()>& should_stop) {
  std::vector<HullPointer> hulls(ids.size());
  std::vector<HullPointer> pinned;
  Lock lock(mutex_);
  const auto pin = [&](const HullPointer& hull) {
    ++hull->pins;
    pinned.push_back(hull);
  };
  bool stopped = false;
  for (int attempt = 0; !stopped; ++attempt) {
    bool all_current = true;
    for (size_t i = 0; i < ids.size(); ++i) {
      if (hulls[i] == nullptr || hulls[i]->deleted) hulls[i] = Find(ids[i]);
      const HullPointer& hull = hulls[i];
      if (hull == nullptr) continue;
      const bool stale = hull->snapshot == nullptr && hull->failure.ok();
      if (stale || attempt == 1) pin(hull);
      all_current = all_current && !stale;
    }
    if (all_current) break;
    for (size_t i = 0; i < ids.size() && !stopped; ++i) {
      if (hulls[i] != nullptr) MakeSnapshot(lock, *hulls[i], should_stop);
      stopped = Stopped(should_stop);
    }
  }
  Resolved resolved;
  if (!stopped) resolved = View(ids, hulls);
  for (const HullPointer& hull : pinned) Unpin(hull);
  if (stopped) return absl::CancelledError("the call was cancelled");
  return resolved;
}

absl::StatusOr<std::pair<uint64_t, HullView>> Registry::Resolve(
    const std::string& id, const std::function<bool()>& should_stop) {
  absl::StatusOr<Resolved> resolved = Resolve(std::span(&id, 1), should_stop);
  if (!resolved.ok()) return resolved.status();
  absl::StatusOr<HullView>& hull = resolved->hulls.front();
  if (!hull.ok()) return hull.status();
  return std::pair(resolved->store_revision, *std::move(hull));
}

absl::StatusOr<OpenResult> Registry::OpenAppend(const std::string& id, const std::string& writer_id,
                                                bool create_if_absent,
                                                std::function<void()> on_deleted) {
  const Lock lock(mutex_);
  OpenResult result;
  HullPointer hull = Find(id);
  if (hull == nullptr) {
    if (!create_if_absent) return NotFound(id);
    absl::StatusOr<HullPointer> created = CreateLocked(id);
    if (!created.ok()) return created.status();
    hull = *std::move(created);
    result.session.created_hull = true;
  }
  if (!hull->failure.ok()) return hull->failure;
  const auto writer = hull->writers.find(writer_id);
  if (writer != hull->writers.end()) result.last_sequence = writer->second;
  hull->deletion_watches.emplace(++last_watch_, std::move(on_deleted));
  result.store_revision = revision_;
  result.hull = hull->record;
  result.session.deletion_watch = last_watch_;
  result.session.writer_id = writer_id;
  result.session.hull = std::move(hull);
  return result;
}

void Registry::CloseAppend(const AppendSession& session) {
  const Lock lock(mutex_);
  session.hull->deletion_watches.erase(session.deletion_watch);
}

void Registry::Append(const AppendSession& session, Chunk chunk, std::function<bool()> should_stop,
                      std::function<void(absl::StatusOr<ChunkResult>)> done) {
  const Lock lock(mutex_);
  session.hull->pending.push_back(
      {session, std::move(chunk), std::move(should_stop), std::move(done)});
  StartNextChunk(session.hull);
}

void Registry::StartNextChunk(const HullPointer& hull) {
  if (hull->busy || hull->pins > 0 || hull->pending.empty()) return;
  hull->busy = true;
  writers_.Submit([this, hull] { RunNextChunk(hull); });
}

void Registry::RunNextChunk(const HullPointer& hull) {
  std::shared_ptr<const Snapshot> stale;  // goes after the lock
  Lock lock(mutex_);
  const PendingChunk pending = std::move(hull->pending.front());
  hull->pending.pop_front();
  absl::StatusOr<ChunkResult> result = Apply(lock, *hull, pending, &stale);
  hull->busy = false;
  hull->released.notify_all();
  StartNextChunk(hull);
  lock.unlock();
  pending.done(std::move(result));
}

// Entered and left with the lock held; requires that the builder is owned.
absl::StatusOr<ChunkResult> Registry::Apply(Lock& lock, RegisteredHull& hull,
                                            const PendingChunk& pending,
                                            std::shared_ptr<const Snapshot>* stale) {
  const Chunk& chunk = pending.chunk;
  const std::string name = absl::StrCat("chunk ", chunk.sequence, ": ");
  if (hull.deleted) return Prefixed(name, Deleted(hull.record));
  if (!hull.failure.ok()) return hull.failure;

  const auto writer = hull.writers.find(pending.session.writer_id);
  const uint64_t last = writer == hull.writers.end() ? 0 : writer->second;
  if (chunk.sequence <= last) {
    return ChunkResult{revision_, true, hull.record.revision, hull.record.vertex_count, {}};
  }
  if (chunk.sequence != last + 1) {
    return absl::FailedPreconditionError(
        absl::StrCat(name, "the expected sequence is ", last + 1,
                     "; open the stream again and continue after its last_sequence"));
  }
  absl::Status allowed = CheckChunkRevision(pending.session, hull.record, chunk);
  if (!allowed.ok()) return Prefixed(name, allowed);
  allowed = CheckPointCount(hull.record, chunk, limits_);
  if (!allowed.ok()) return Prefixed(name, allowed);

  lock.unlock();
  absl::StatusOr<PointCounts> added = absl::CancelledError("the call was cancelled");
  if (!Stopped(pending.should_stop)) {
    added = hull.builder.Add(
        chunk.points, {static_cast<size_t>(limits_.max_vertices_per_hull), pending.should_stop});
  }
  lock.lock();

  if (added.status().code() == absl::StatusCode::kResourceExhausted) {
    return LimitExceeded(
        absl::StrCat(name, Quoted(hull.record.hull_id), " would hold too many vertices"),
        limits_.max_vertices_per_hull, "max-vertices-per-hull");
  }
  if (!added.ok()) return Prefixed(name, added.status());
  if (hull.deleted) return Prefixed(name, Deleted(hull.record));
  absl::Status committed = CommitChunk(hull, pending, *added, stale);
  if (!committed.ok()) return committed;
  return ChunkResult{revision_, false, hull.record.revision, hull.record.vertex_count, *added};
}

absl::Status Registry::CommitChunk(RegisteredHull& hull, const PendingChunk& pending,
                                   const PointCounts& counts,
                                   std::shared_ptr<const Snapshot>* stale) {
  HullRecord& record = hull.record;
  const Chunk& chunk = pending.chunk;
  const bool changed = counts.outside > 0;
  const uint64_t revision = changed ? revision_ + 1 : record.revision;
  const absl::Status stored =
      store_.Commit(ChunkApplied{record.hull_id, record.create_revision, revision,
                                 pending.session.writer_id, chunk.sequence, chunk.points, counts});
  if (!stored.ok()) {
    // The builder already holds points that nobody may see.
    hull.failure = Prefixed(
        absl::StrCat(Quoted(record.hull_id), " cannot be used: a change could not be stored: "),
        stored);
    return hull.failure;
  }
  hull.writers[pending.session.writer_id] = chunk.sequence;
  AddTo(record.counts, counts);
  if (!changed) return absl::OkStatus();
  const uint64_t vertex_count = hull.builder.vertex_count();
  revision_ = record.revision = revision;
  vertex_count_ += vertex_count - record.vertex_count;
  record.vertex_count = vertex_count;
  record.dimension = hull.builder.dimension();
  *stale = std::move(hull.snapshot);
  hull.snapshot = nullptr;
  return absl::OkStatus();
}

}  // namespace hulld::server
