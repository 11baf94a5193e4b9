#include "server/registry/catalog/registered_hull.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "server/contract/error_info.h"

namespace hulld::server {

RegisteredHull::RegisteredHull(const StoredHull& stored, const HullState& initial, bool readable,
                               MemoryBudget& budget)
    : state(initial),
      readable_from_store(readable),
      committed(stored),
      head(stored),
      account(budget, [this](Locked& locked) { DropUnused(locked); }) {}

void RegisteredHull::DiscardBuilder(Locked& locked) {
  builder_lacks = {};
  if (builder == nullptr) return;
  locked.Discard(std::move(builder));
  builder_bytes = 0;
}

uint64_t RegisteredHull::HeadSequence(const std::string& writer_id) const {
  const auto writer = writers.find(writer_id);
  return writer == writers.end() ? 0 : writer->second.head;
}

void RegisteredHull::SetLive(std::shared_ptr<LiveHull> points) {
  HULLD_CHECK(live == nullptr && served == nullptr && builder == nullptr);
  live = std::move(points);
  committed_mark = live->Now();
  live_is_ahead = false;
  points_since_prepared = 0;
  KeepBox();
}

// Records the bounding box at the mark, if it has one.
void RegisteredHull::KeepBox() {
  if (committed_mark.low()[0] > committed_mark.high()[0]) return;
  has_box = true;
  low = committed_mark.low();
  high = committed_mark.high();
}

HullChange RegisteredHull::Describe() const {
  HullChange change;
  change.record = committed.record;
  change.damaged = state.damaged();
  change.has_box = has_box && !change.damaged;
  change.low = low;
  change.high = high;
  return change;
}

bool RegisteredHull::HoldsMuchElse() const {
  constexpr uint64_t kFewPoints = 1 << 14;
  return points_since_prepared > 2 * committed.record.vertex_count + kFewPoints;
}

// The old mark may hold the last reference to a previous preparation.
void RegisteredHull::SetCommittedMark(Locked& locked, const LiveHull::Mark& mark) {
  locked.Afterwards([before = std::exchange(committed_mark, mark)] {});
  KeepBox();
}

std::shared_ptr<const ServedHull> RegisteredHull::Serve() {
  if (committed.record.vertex_count == 0) return EmptyServedHull();
  if (live == nullptr) return nullptr;
  if (served == nullptr) {
    if (canonical == nullptr) {
      canonical =
          std::make_shared<CanonicalHull>(std::make_shared<MemoryPart>(account.budget(), nullptr));
    }
    served = std::make_shared<const ServedHull>(
        live->VersionAt(committed_mark), committed_mark.low(), committed_mark.high(), canonical);
  }
  std::shared_ptr<const Reading> reading = read_.lock();
  if (reading == nullptr) {
    CountParts();
    reading = std::make_shared<const Reading>(account.parts(), served);
    read_ = reading;
  }
  const ServedHull* const shown = reading->served.get();
  return {std::move(reading), shown};
}

void RegisteredHull::DiscardServed(Locked& locked) {
  read_.reset();
  locked.Discard(std::exchange(served, nullptr));
}

void RegisteredHull::RevertLive(Locked& locked) {
  if (!std::exchange(live_is_ahead, false)) return;
  HULLD_CHECK(live != nullptr);
  // A thread that builds on refused points keeps the former LiveHull, now as its only owner.
  auto reverted = std::make_shared<LiveHull>(*live, committed_mark);
  locked.Discard(std::exchange(live, std::move(reverted)));
  DiscardServed(locked);
}

void RegisteredHull::DiscardAll(Locked& locked) {
  DiscardBuilder(locked);
  DiscardServed(locked);
  locked.Discard(std::exchange(canonical, nullptr));
  locked.Discard(std::exchange(live, nullptr));
  live_is_ahead = false;
  SetCommittedMark(locked, {});
}

void RegisteredHull::Requeue(PendingChunk chunk) {
  const auto next = std::ranges::find_if(
      chunks, [&](const PendingChunk& each) { return each.place > chunk.place; });
  chunks.insert(next, std::move(chunk));
}

// Growth in dimension moves all points, so it does not qualify.
bool RegisteredHull::GrewInto(const StoredHull& stored) const {
  const HullRecord& now = stored.record;
  const HullRecord& before = committed.record;
  const VertexLayout& layout = committed.layout;
  return live != nullptr && state.visible() && !state.damaged() &&
         now.create_revision == before.create_revision && now.dimension == before.dimension &&
         now.revision > before.revision && stored.layout.base_revision == layout.base_revision &&
         stored.layout.delta_count > layout.delta_count &&
         stored.layout.delta_vertices > layout.delta_vertices &&
         stored.layout.delta_vertices - layout.delta_vertices <= kMostGrowth;
}

bool RegisteredHull::Supersede(Locked& locked, const StoredHull& stored,
                               const std::vector<Vector>* growth) {
  state.Supersede();
  RevertLive(locked);
  const bool is_same = stored.record.revision == committed.record.revision;
  const bool grows = !is_same && growth != nullptr && live != nullptr;
  const bool is_built_here = builder != nullptr;
  if (grows) {
    Grow(locked, *growth, stored.record.dimension);
  } else if (!is_same) {
    DiscardAll(locked);
    has_box = false;
  }
  committed = head = stored;
  writers.clear();
  ++supersessions;
  // No local caller requested the points of a peer server: they are no reason to keep the hull in
  // memory, unless it is also appended to here.
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
  SetCommittedMark(locked, live->Append(points, dimension));
  DiscardServed(locked);
  locked.Discard(std::exchange(canonical, nullptr));
  points_since_prepared += points.size();
  if (builder == nullptr) return;
  builder_lacks.insert(builder_lacks.end(), points.begin(), points.end());
  if (builder_lacks.size() > kMostGrowth) DiscardBuilder(locked);
}

void RegisteredHull::NoteUse() {
  CountParts();
  const bool is_for_writing = !readable_from_store || !state.quiet() || !chunks.empty();
  account.Set(builder_bytes + builder_lacks.capacity() * sizeof(Vector) +
                  (live == nullptr ? 0 : LiveHull::OwnBytes()),
              is_for_writing);
}

// A part at a repeated address reuses free memory: the former part had no holder.
void RegisteredHull::CountParts() {
  std::vector<std::shared_ptr<MemoryPart>> parts;
  if (live != nullptr) {
    for (const LiveHull::Shared& shared : live->SharedBy(committed_mark)) {
      const auto known = std::ranges::find(account.parts(), shared.what, &MemoryPart::what);
      parts.push_back(known != account.parts().end()
                          ? *known
                          : std::make_shared<MemoryPart>(account.budget(), shared.what));
      parts.back()->SetBytes(shared.bytes);
    }
  }
  if (canonical != nullptr) parts.push_back(canonical->part());
  account.Hold(std::move(parts));
}

uint64_t RegisteredHull::SharedBytes() const {
  return (live == nullptr ? 0 : live->MemoryBytes()) +
         (canonical == nullptr ? 0 : canonical->MemoryBytes());
}

void RegisteredHull::DropUnused(Locked& locked) {
  if (state.quiet() && chunks.empty()) {
    // Memory referenced by a reader would not be freed, and the next reader would duplicate it.
    const bool is_read = IsRead();
    if (readable_from_store) {
      DiscardBuilder(locked);
      if (!is_read) DiscardAll(locked);
    } else if (!is_read) {
      DiscardServed(locked);
      locked.Discard(std::exchange(canonical, nullptr));
    }
  }
  NoteUse();
}

const std::shared_ptr<const ServedHull>& EmptyServedHull() {
  static const auto* const kServed = [] {
    const auto canonical = std::make_shared<CanonicalHull>(Hull());
    const LiveHull::Mark nothing;
    return new std::shared_ptr<const ServedHull>(std::make_shared<const ServedHull>(
        std::shared_ptr<const QueryHull>(canonical, &canonical->query_hull()), nothing.low(),
        nothing.high(), canonical));
  }();
  return *kServed;
}

std::string QuotedHull(const std::string& id) { return absl::StrCat("hull \"", id, "\""); }

absl::Status Gone(const std::string& id, const char* how) {
  return WithReason(
      absl::FailedPreconditionError(absl::StrCat(
          QuotedHull(id), " was ", how,
          " while points were streamed into it; start a new stream and send all points again")),
      v1::ERROR_REASON_HULL_GONE, {{"hull_id", id}});
}

absl::Status StoreDisagrees(const HullRecord& record) {
  return absl::UnavailableError(absl::StrCat(
      "the store does not hold ", QuotedHull(record.hull_id), " as of revision ", record.revision,
      ", the last known to this server; if this persists, the database was changed outside of "
      "hulld: restart this server"));
}

absl::Status HullNotFound(const std::string& id) {
  return WithReason(absl::NotFoundError(absl::StrCat(QuotedHull(id), " not found")),
                    v1::ERROR_REASON_HULL_NOT_FOUND, {{"hull_id", id}});
}

absl::Status RevisionMismatch(const HullRecord& record, uint64_t if_revision) {
  return WithReason(absl::AbortedError(absl::StrCat(QuotedHull(record.hull_id), " is at revision ",
                                                    record.revision, ", not ", if_revision,
                                                    " (if_revision); read it again, then retry")),
                    v1::ERROR_REASON_REVISION_MISMATCH,
                    {{"hull_id", record.hull_id},
                     {"if_revision", if_revision},
                     {"current_revision", record.revision}});
}

}  // namespace hulld::server
