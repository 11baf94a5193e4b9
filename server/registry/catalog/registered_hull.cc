#include "server/registry/catalog/registered_hull.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "server/contract/errors.h"
#include "server/registry/catalog/body.h"
#include "server/registry/catalog/hull_table.h"

namespace hulld::server {
namespace {

Box BoxAt(const LiveHull::Mark& mark) { return {mark.low(), mark.high()}; }

}  // namespace

RegisteredHull::RegisteredHull(const StoredHull& stored, const HullState& initial, bool readable,
                               MemoryBudget& budget)
    : state(initial),
      readable_from_store_(readable),
      account(budget, [this](Locked& locked) { DropUnused(locked); }) {
  committed_.stored = in_flight_.head = stored;
}

HullChange RegisteredHull::Describe() const {
  HullChange change;
  change.record = committed().record;
  change.damaged = state.damaged();
  if (!change.damaged) change.box = committed_.box;
  return change;
}

void RegisteredHull::SetStored(const StoredHull& stored) {
  HULLD_CHECK(committed().record.revision == 0);
  committed_.stored = in_flight_.head = stored;
}

// The old mark may hold the last reference to a previous preparation.
void RegisteredHull::SetCommittedMark(Locked& locked, const LiveHull::Mark& mark) {
  locked.Defer([before = std::exchange(committed_.mark, mark)] {});
  if (const Box box = BoxAt(mark); !box.IsEmpty()) committed_.box = box;
}

void RegisteredHull::Commit(Locked& locked, const Change& chunk, const LiveHull::Mark& mark,
                            uint64_t points) {
  const bool is_changed = chunk.hull.record.revision != committed().record.revision;
  committed_.stored = chunk.hull;
  *in_flight_.revisions = RevisionsOf(chunk.hull);
  SetRevisions(*in_flight_.revisions, &in_flight_.head);
  SetCommittedMark(locked, mark);
  if (is_changed) {
    DiscardServed(locked);
    DiscardCanonical(locked);
  }
  const uint64_t sequence = chunk.writer->sequence;
  Sequences& sequences = in_flight_.writers[chunk.writer->writer_id];
  HULLD_CHECK(sequence == sequences.committed + 1 && sequence <= sequences.head);
  sequences.committed = sequence;
  served_.points_since_prepared += points;
  NoteUse();
}

// Growth in dimension moves all points, so it does not qualify.
bool RegisteredHull::GrewInto(const StoredHull& stored) const {
  const HullRecord& now = stored.record;
  const HullRecord& before = committed().record;
  const VertexLayout& layout = committed().layout;
  return live() != nullptr && state.visible() && !state.damaged() &&
         now.create_revision == before.create_revision && now.dimension == before.dimension &&
         now.revision > before.revision && stored.layout.base_revision == layout.base_revision &&
         stored.layout.delta_count > layout.delta_count &&
         stored.layout.delta_vertices > layout.delta_vertices &&
         stored.layout.delta_vertices - layout.delta_vertices <= kMaxGrowth;
}

bool RegisteredHull::Supersede(Locked& locked, const StoredHull& stored,
                               const std::vector<Vector>* growth) {
  state.Supersede();
  RevertLive(locked);
  const bool is_same = stored.record.revision == committed().record.revision;
  const bool grows = !is_same && growth != nullptr && live() != nullptr;
  const bool is_built_here = builder() != nullptr;
  if (grows) {
    Grow(locked, *growth, stored.record.dimension);
  } else if (!is_same) {
    DiscardAll(locked);
    committed_.box = Box::Empty();
  }
  committed_.stored = in_flight_.head = stored;
  in_flight_.writers.clear();
  ++committed_.supersessions;
  // No local caller requested the points of a peer server, so they do not justify keeping the hull
  // in memory, unless local writers append to it, too.
  if (grows && !is_built_here) {
    CountParts();
  } else {
    NoteUse();
  }
  return grows;
}

// Readers keep their versions. A building thread owns the builder and, because `live` was reverted,
// a LiveHull other than this one.
void RegisteredHull::Grow(Locked& locked, const std::vector<Vector>& points, int dimension) {
  SetCommittedMark(locked, live()->Append(points, dimension));
  DiscardServed(locked);
  DiscardCanonical(locked);
  served_.points_since_prepared += points.size();
  if (builder() == nullptr) return;
  std::vector<Vector>& backlog = in_flight_.backlog;
  backlog.insert(backlog.end(), points.begin(), points.end());
  if (backlog.size() > kMaxGrowth) DiscardBuilder(locked);
}

void RegisteredHull::Vanish() {
  state.Vanish();
  ++committed_.supersessions;
}

uint64_t RegisteredHull::HeadSequence(const std::string& writer_id) const {
  const auto writer = in_flight_.writers.find(writer_id);
  return writer == in_flight_.writers.end() ? 0 : writer->second.head;
}

std::optional<uint64_t> RegisteredHull::CommittedSequence(const std::string& writer_id) const {
  const auto writer = in_flight_.writers.find(writer_id);
  if (writer == in_flight_.writers.end()) return std::nullopt;
  return writer->second.committed;
}

void RegisteredHull::KeepSequence(const std::string& writer_id, uint64_t sequence) {
  in_flight_.writers.emplace(writer_id, Sequences{sequence, sequence});
}

void RegisteredHull::DropUnusedWriters() {
  const bool unused =
      watches.empty() && state.quiet() && chunks.empty() && in_flight_.sequence_readers == 0;
  if (unused && readable_from_store_) in_flight_.writers.clear();
}

void RegisteredHull::SetBuilder(std::unique_ptr<HullBuilder> builder) {
  in_flight_.builder_bytes = builder->MemoryBytes();
  in_flight_.builder = std::move(builder);
}

LentBuilder RegisteredHull::LendBuilder() {
  in_flight_.live_is_ahead = true;
  HULLD_CHECK(builder() != nullptr || state.in_flight() == 0);
  return {std::move(in_flight_.builder), std::exchange(in_flight_.backlog, {}), committed_.mark};
}

void RegisteredHull::ReturnBuilder(std::unique_ptr<HullBuilder> builder, uint64_t bytes) {
  in_flight_.builder = std::move(builder);
  in_flight_.builder_bytes = bytes;
}

void RegisteredHull::DiscardBuilder(Locked& locked) {
  in_flight_.backlog = {};
  if (builder() == nullptr) return;
  locked.Discard(std::move(in_flight_.builder));
  in_flight_.builder_bytes = 0;
}

void RegisteredHull::DiscardUnneededBuilder(Locked& locked) {
  if (!is_small() || !state.quiet() || !watches.empty() || !chunks.empty()) return;
  DiscardBuilder(locked);
  in_flight_.revisions = nullptr;
}

void RegisteredHull::AddToHead(const PointCounts& added, const WriterSequence& writer,
                               Change* change) {
  if (state.in_flight() == 0) {
    in_flight_.revisions = std::make_shared<HullRevisions>(RevisionsOf(committed()));
  }
  HullRecord& record = change->hull.record;
  record.counts += added;
  change->before = in_flight_.revisions;
  change->takes_revision = added.outside > 0;
  if (change->takes_revision) {
    record.vertex_count = builder()->vertex_count();
    record.dimension = builder()->dimension();
    VertexLayout& layout = change->hull.layout;
    if (change->vertex_change == VertexChange::kReplaced) {
      layout = {.base_vertices = record.vertex_count};
    } else if (change->vertex_change == VertexChange::kAdded) {
      ++layout.delta_count;
      layout.delta_vertices += change->vertices.size();
    }
  }
  Sequences& sequences = in_flight_.writers[writer.writer_id];
  if (sequences.head == 0) ++change->hull.writer_count;
  sequences.head = writer.sequence;
  change->writer = writer;
  in_flight_.head = change->hull;
}

void RegisteredHull::Revert(Locked& locked) {
  in_flight_.head = committed();
  for (auto& [writer_id, sequences] : in_flight_.writers) sequences.head = sequences.committed;
  DiscardBuilder(locked);
  RevertLive(locked);
  NoteUse();
}

void RegisteredHull::RevertLive(Locked& locked) {
  if (!std::exchange(in_flight_.live_is_ahead, false)) return;
  HULLD_CHECK(live() != nullptr);
  // A thread that builds on refused points keeps the previous LiveHull, now as its only owner.
  auto reverted = std::make_shared<LiveHull>(*live(), committed_.mark);
  locked.Discard(std::exchange(served_.live, std::move(reverted)));
  DiscardServed(locked);
}

void RegisteredHull::SetLive(std::shared_ptr<LiveHull> points) {
  HULLD_CHECK(live() == nullptr && served_.version == nullptr && builder() == nullptr);
  served_.live = std::move(points);
  committed_.mark = live()->Now();
  in_flight_.live_is_ahead = false;
  if (const Box box = BoxAt(committed_.mark); !box.IsEmpty()) committed_.box = box;
  ResetWear();
}

std::shared_ptr<const ServedHull> RegisteredHull::Serve() {
  if (committed().record.vertex_count == 0) return EmptyServedHull();
  if (live() == nullptr) return nullptr;
  const bool is_new = served_.version == nullptr;
  if (is_new) {
    if (served_.canonical == nullptr) {
      served_.canonical =
          std::make_shared<CanonicalHull>(std::make_shared<MemoryPart>(account.budget(), nullptr));
    }
    const LiveHull::Mark& mark = committed_.mark;
    served_.version =
        std::make_shared<const ServedHull>(live()->VersionAt(mark), BoxAt(mark), served_.canonical);
  }
  std::shared_ptr<const PinnedVersion> pinned = served_.readers.lock();
  if (is_new) CountParts();
  if (pinned == nullptr) {
    pinned = std::make_shared<const PinnedVersion>(account.parts(), served_.version);
    served_.readers = pinned;
  }
  const ServedHull* const shown = pinned->served.get();
  return {std::move(pinned), shown};
}

void RegisteredHull::Prefetch() const {
  __builtin_prefetch(&state);
  __builtin_prefetch(&committed_.stored.record);
  __builtin_prefetch(&committed_.stored.record.counts);
  __builtin_prefetch(&committed_.mark);
  __builtin_prefetch(&served_);
  __builtin_prefetch(&served_.readers);
  __builtin_prefetch(&account);
}

void RegisteredHull::PrefetchParts() const {
  __builtin_prefetch(served_.live.get());
  __builtin_prefetch(served_.version.get());
  __builtin_prefetch(account.parts().get());
}

void RegisteredHull::EndLoading() {
  served_.is_loading = false;
  changed.notify_all();
}

bool RegisteredHull::WantsPreparing(uint64_t expected_queries) const {
  return !is_preparing() && live() != nullptr && state.visible() &&
         live()->WantsPreparing(committed_mark(), expected_queries);
}

void RegisteredHull::NotePrepared(Locked& locked) {
  // Nothing was appended since: the new mark releases the previous preparation.
  if (state.quiet() && !state.damaged()) SetCommittedMark(locked, live()->Now());
  DiscardServed(locked);
  NoteUse();
}

bool RegisteredHull::IsWorn() const {
  constexpr uint64_t kFewPoints = 1 << 14;
  return served_.points_since_prepared > 2 * committed().record.vertex_count + kFewPoints;
}

void RegisteredHull::DiscardServed(Locked& locked) {
  served_.readers.reset();
  locked.Discard(std::exchange(served_.version, nullptr));
}

void RegisteredHull::DiscardCanonical(Locked& locked) {
  locked.Discard(std::exchange(served_.canonical, nullptr));
}

void RegisteredHull::NoteUse() {
  CountParts();
  const bool is_for_writing = !readable_from_store_ || !state.quiet() || !chunks.empty();
  account.Set(in_flight_.builder_bytes + in_flight_.backlog.capacity() * sizeof(Vector) +
                  (live() == nullptr ? 0 : LiveHull::OwnBytes()),
              is_for_writing);
}

// If an address repeats, its memory was freed and reused, so the earlier part had no holder.
void RegisteredHull::CountParts() {
  MemoryParts parts;
  served_.shared_bytes = 0;
  if (live() != nullptr) {
    for (const LiveHull::Shared& shared : live()->SharedBy(committed_.mark)) {
      const auto known = std::ranges::find(*account.parts(), shared.what, &MemoryPart::what);
      parts.push_back(known != account.parts()->end()
                          ? *known
                          : std::make_shared<MemoryPart>(account.budget(), shared.what));
      parts.back()->SetBytes(shared.bytes);
      served_.shared_bytes += shared.bytes;
    }
  }
  if (served_.canonical != nullptr) {
    parts.push_back(served_.canonical->part());
    served_.shared_bytes += served_.canonical->MemoryBytes();
  }
  account.Hold(std::move(parts));
}

bool RegisteredHull::IsUnused() const {
  return state.life() == HullState::Life::kPresent && state.quiet() && !state.damaged() &&
         !is_loading() && !is_preparing() && in_flight_.sequence_readers == 0 && watches.empty() &&
         chunks.empty() && exclusive.empty();
}

std::unique_ptr<CompactHull> RegisteredHull::Compact() const {
  if (!IsUnused() || IsRead()) return nullptr;
  auto compact = std::make_unique<CompactHull>();
  if (live() != nullptr) {
    if (!is_small()) return nullptr;
    compact->points = live()->PointsAt(committed_.mark);
    // Preparing drops points that are no longer vertices.
    if (compact->points.size() > 2 * kMaxSmallVertices) return nullptr;
    compact->points.shrink_to_fit();
  }
  if (!readable_from_store_) {
    compact->writers.reserve(in_flight_.writers.size());
    for (const auto& [writer_id, sequences] : in_flight_.writers) {
      compact->writers.emplace_back(writer_id, sequences.committed);
    }
  }
  return compact;
}

void RegisteredHull::Restore(const CompactHull& compact) {
  for (const auto& [writer_id, sequence] : compact.writers) KeepSequence(writer_id, sequence);
  if (compact.points.empty()) return;
  SetLive(std::make_shared<LiveHull>(compact.points, committed().record.dimension));
  NoteUse();
}

void RegisteredHull::DiscardAll(Locked& locked) {
  DiscardBuilder(locked);
  DiscardServed(locked);
  DiscardCanonical(locked);
  locked.Discard(std::exchange(served_.live, nullptr));
  in_flight_.live_is_ahead = false;
  SetCommittedMark(locked, {});
}

void RegisteredHull::DropUnused(Locked& locked) {
  if (state.quiet() && chunks.empty()) {
    // Memory referenced by a reader would not be freed, and the next reader would duplicate it.
    const bool is_read = IsRead();
    if (readable_from_store_) {
      DiscardBuilder(locked);
      if (!is_read) DiscardAll(locked);
    } else if (!is_read) {
      DiscardServed(locked);
      DiscardCanonical(locked);
    }
  }
  NoteUse();
}

void RegisteredHull::Requeue(PendingChunk chunk) {
  const auto next = std::ranges::find_if(
      chunks, [&](const PendingChunk& each) { return each.place > chunk.place; });
  chunks.insert(next, std::move(chunk));
}

const std::shared_ptr<const ServedHull>& EmptyServedHull() {
  static const auto* const kServed = [] {
    const auto canonical = std::make_shared<CanonicalHull>(Hull());
    return new std::shared_ptr<const ServedHull>(std::make_shared<const ServedHull>(
        std::shared_ptr<const QueryHull>(canonical, &canonical->query_hull()), Box::Empty(),
        canonical));
  }();
  return *kServed;
}

absl::Status Gone(const std::string& id, const char* how) {
  return WithReason(
      absl::FailedPreconditionError(absl::StrCat(Quoted("hull", id), " was ", how,
                                                 " while points were being streamed into it; start "
                                                 "a new stream and send all points again")),
      v1::ERROR_REASON_HULL_GONE, {{"hull_id", id}});
}

absl::Status StoreDisagrees(const HullRecord& record) {
  return Unavailable(
      "the store does not contain ", Quoted("hull", record.hull_id), " as of revision ",
      record.revision,
      ", the last known to this server; if this persists, the database was changed outside of "
      "hulld: restart this server");
}

}  // namespace hulld::server
