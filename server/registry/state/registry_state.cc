#include "server/registry/state/registry_state.h"

#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "core/base/check.h"
#include "server/contract/errors.h"
#include "server/registry/catalog/registered_hull.h"
#include "server/settings/resource_limits.h"

namespace hulld::server {
namespace {

Limits WithMemoryLimit(Limits limits) {
  if (limits.memory_limit == 0) limits.memory_limit = DefaultMemoryLimit();
  return limits;
}

// The rest is reserved for writers: if the store does not keep hulls, all hulls stay in memory.
uint64_t ReadersShare(uint64_t memory_limit, const Store& store) {
  return memory_limit / (store.keeps_hulls() ? 2 : 4);
}

// Returns the number of records that fill a sixteenth of the limit, in addition to the memory held
// for points.
size_t MaxRecords(uint64_t memory_limit) {
  return std::max<uint64_t>(1 << 12, memory_limit / 16 / HullTable::kBytesOfRecord);
}

// Unused bodies may use up to 1/kBodiesShare of the limit.
constexpr uint64_t kBodiesShare = 16;

}  // namespace

RegistryState::RegistryState(Store& store_in, const Limits& limits_in,
                             std::optional<PoolMetrics> preparers)
    : store(store_in),
      limits(WithMemoryLimit(limits_in)),
      memory(limits.memory_limit, ReadersShare(limits.memory_limit, store), mutex),
      hulls(store.keeps_hulls(), memory),
      feed(store, mutex, memory, Config::kWatchMarkInterval),
      is_cache_(store.supports_lookup()),
      preparer_(std::in_place, 1, preparers) {
  if (!is_cache_) return;
  hulls.SetCapacity(MaxRecords(limits.memory_limit));
  bodies.SetCapacity(limits.memory_limit / kBodiesShare);
}

HullPointer RegistryState::Find(const std::string& id) {
  std::optional<HullPointer> hull = hulls.LookUp(id);
  HULLD_CHECK(hull.has_value() || bodies.contains(id));
  return std::move(hull).value_or(nullptr);
}

HullPointer RegistryState::FindVisible(const std::string& id) {
  HullPointer hull = Find(id);
  return hull != nullptr && hull->state.visible() ? hull : nullptr;
}

std::shared_ptr<const Body> RegistryState::FindBody(const std::string& id) {
  const BodyTable::Entry* const entry = bodies.Find(id);
  return entry == nullptr ? nullptr : entry->committed();
}

absl::Status RegistryState::NoSuch(const std::string& kind, const std::string& id) {
  if (kind == "hull") return NotFound(kind, id, bodies.contains(id));
  const HullPointer hull = hulls.Find(id);
  return NotFound(kind, id, hull != nullptr && hull->state.visible());
}

void RegistryState::AddStored(const std::string& id, const absl::StatusOr<StoredHull>& stored) {
  if (stored.ok()) {
    hulls.AddResting(*stored);
    return;
  }
  spdlog::error("{}", std::string(stored.status().message()));
  StoredHull nothing;
  nothing.record.hull_id = id;
  MarkDamaged(*hulls.Insert(nothing, HullState::Present()), stored.status());
}

void RegistryState::MarkDamaged(RegisteredHull& hull, const absl::Status& damage) {
  if (hull.state.damaged() || hull.state.life() != HullState::Life::kPresent) return;
  hull.state.Damage(damage);
  NoteChange(hull);
  ++statistics.damaged;
}

void RegistryState::NoteChange(const RegisteredHull& hull) {
  recent_changes.Note(hull.committed().record.hull_id);
}

void RegistryState::Forget(Locked& locked, const HullPointer& hull, const absl::Status& reason) {
  HULLD_CHECK(hull->state.gone());
  hulls.Erase(hull);
  for (auto& [number, on_gone] : hull->watches) {
    locked.Defer([on_gone = std::move(on_gone), reason] { on_gone(reason); });
  }
  hull->watches.clear();
  hull->DiscardAll(locked);
  hull->account.Close();
}

void RegistryState::AddBody(Locked& locked, const std::string& id,
                            const absl::StatusOr<StoredBody>& stored) {
  if (hulls.contains(id)) {
    return spdlog::error(
        "the store contains a body under the ID of hull \"{}\"; the body is ignored; delete one of "
        "the two",
        id);
  }
  if (!stored.ok()) {
    spdlog::error("{}", std::string(stored.status().message()));
    ++statistics.damaged;
  }
  bodies.Add(id);
  bodies.Set(locked, id,
             std::make_shared<const Body>(id, stored, memory,
                                          is_cache_ ? MemoryUse::kReading : MemoryUse::kWriting));
  hulls.ForgetAbsent(id);
}

void RegistryState::EraseBody(Locked& locked, const std::string& id) {
  bodies.Erase(locked, id);
  if (is_cache_) hulls.NoteAbsent(id);
}

absl::Status RegistryState::CheckHullCount() const {
  const uint64_t hull_count = HullCount();
  const uint64_t body_count = BodyCount();
  if (hull_count + body_count < limits.max_hulls) return absl::OkStatus();
  std::string held = absl::StrCat("the store contains ", hull_count, " hulls");
  if (body_count > 0) absl::StrAppend(&held, " and ", body_count, " bodies");
  return LimitExceeded(held, limits.max_hulls, "max-hulls");
}

RegistrySizes RegistryState::Sizes() const {
  return {revision(), HullCount() - creating_hulls_, vertex_count_, kept_bodies_};
}

void RegistryState::EndCreatingHull(Locked& locked, const HullPointer& hull,
                                    const absl::Status& status) {
  --creating_hulls_;
  if (!status.ok()) return Forget(locked, hull, status);
  ++kept_hulls_;
}

void RegistryState::EndCreatingBody(bool is_committed) {
  --creating_bodies_;
  if (is_committed) ++kept_bodies_;
}

void RegistryState::SetTotals(const StoreTotals& totals) {
  kept_hulls_ = totals.hulls;
  vertex_count_ = totals.vertices;
  kept_bodies_ = totals.bodies;
}

void RegistryState::ApplyCreation(Locked& locked, const HullPointer& previous,
                                  const HullPointer& hull, const StoredHull& stored) {
  hull->SetStored(stored);
  std::optional<Incarnation> replaced;
  if (previous != nullptr) {
    const HullRecord& record = previous->committed().record;
    replaced = Incarnation::Of(record);
    hull->state.Commit();
    NoteVertices(record.vertex_count, 0);
    Forget(locked, previous, Gone(record.hull_id, "replaced"));
    hulls.Insert(hull);
  }
  NoteVertices(0, stored.record.vertex_count);
  NoteChange(*hull);
  feed.NotePresent(locked, replaced, hull, nullptr);
}

void RegistryState::ApplyDeletion(Locked& locked, const HullPointer& hull, uint64_t revision) {
  const HullRecord& record = hull->committed().record;
  NoteVertices(record.vertex_count, 0);
  --kept_hulls_;
  NoteChange(*hull);
  feed.NoteDeleted(locked, record.hull_id, Incarnation::Of(record), revision);
  Forget(locked, hull, Gone(record.hull_id, "deleted"));
}

void RegistryState::ApplyChunk(Locked& locked, const HullPointer& hull, const Change& chunk,
                               const LiveHull::Mark& mark, uint64_t points) {
  const HullRecord before = hull->committed().record;
  const HullRecord& after = chunk.hull.record;
  hull->Commit(locked, chunk, mark, points);
  NoteChange(*hull);
  if (after.revision != before.revision) {
    NoteVertices(before.vertex_count, after.vertex_count);
    feed.NotePresent(locked, Incarnation::Of(before), hull, nullptr);
  }
  PrepareIfWorn(hull);
}

void RegistryState::ApplyBody(Locked& locked, const std::string& id,
                              const std::shared_ptr<const Body>& body, uint64_t revision) {
  std::optional<Incarnation> previous;
  if (const auto known = FindBody(id)) previous = Incarnation::Of(known->record());
  // For readers that look for a hull with this ID.
  recent_changes.Note(id);
  bodies.Set(locked, id, body);
  if (body != nullptr) {
    feed.NotePresent(locked, previous, nullptr, body);
  } else {
    --kept_bodies_;
    feed.NoteDeleted(locked, id, *previous, revision);
  }
}

HullPointer RegistryState::ApplyPeerChange(Locked& locked, const std::string& id,
                                           const PeerChange& change, uint64_t since) {
  const std::optional<Incarnation> previous = FindPrevious(id, change, since);
  const StoreTotals before = TotalsOf(id);
  HullPointer hull = hulls.Find(id);
  // False for changes that were part of the initial load.
  const bool is_new = change.revision > revision();
  // Includes hulls that were created and deleted in between, because a reader must learn of that,
  // too.
  if (is_new) recent_changes.Note(id);
  if (hull == nullptr || !ApplyPeerVersion(locked, hull, change)) {
    if (hull != nullptr) EndPrevious(locked, hull, change);
    ApplyPeerBody(locked, id, change);
    if (change.hull.has_value()) {
      AddStored(id, *change.hull);
      NoteChange(*hulls.Find(id));
    }
  }
  if (!is_cache_) {
    const StoreTotals now = TotalsOf(id);
    kept_hulls_ += now.hulls - before.hulls;
    kept_bodies_ += now.bodies - before.bodies;
    NoteVertices(before.vertices, now.vertices);
  }
  if (is_new) Note(locked, id, change, previous);
  return hull;
}

// Counts the known hull or body with this ID.
StoreTotals RegistryState::TotalsOf(const std::string& id) {
  const HullPointer hull = hulls.Find(id);
  const uint64_t vertices = hull == nullptr ? 0 : hull->committed().record.vertex_count;
  return {hull != nullptr, vertices, bodies.contains(id)};
}

// Returns the incarnation that had the ID after all changes up to `since`. If it is not known here,
// the peer change supplies it.
std::optional<Incarnation> RegistryState::FindPrevious(const std::string& id,
                                                       const PeerChange& change, uint64_t since) {
  if (IsKnown(id)) {
    if (const auto body = FindBody(id)) return Incarnation::Of(body->record());
    const HullPointer hull = hulls.Find(id);
    if (hull == nullptr) return std::nullopt;
    return Incarnation::Of(hull->committed().record);
  }
  std::optional<Incarnation> previous = change.previous;
  if (!previous.has_value() && change.hull.has_value() && change.hull->ok()) {
    previous = Incarnation::Of((*change.hull)->record);
  } else if (!previous.has_value() && change.body.has_value() && change.body->ok()) {
    previous = Incarnation::Of((*change.body)->record);
  }
  return previous.has_value() && previous->create_revision <= since ? previous : std::nullopt;
}

// Returns true if `change` is another version of the known hull, and applies it.
bool RegistryState::ApplyPeerVersion(Locked& locked, const HullPointer& hull,
                                     const PeerChange& change) {
  if (!change.hull.has_value() || !change.hull->ok() || hull->state.damaged()) return false;
  const StoredHull& stored = **change.hull;
  if (hull->committed().record.create_revision != stored.record.create_revision) return false;
  // Applies even if the record is the same: an empty chunk advances its writer's sequence.
  const bool grew =
      hull->Supersede(locked, stored, change.growth.has_value() ? &*change.growth : nullptr);
  statistics.grown += grew;
  if (grew) PrepareIfWorn(hull);
  NoteChange(*hull);
  return true;
}

// Ends the known hull, which was deleted or replaced.
void RegistryState::EndPrevious(Locked& locked, const HullPointer& previous,
                                const PeerChange& change) {
  NoteChange(*previous);
  previous->Vanish();
  Forget(
      locked, previous,
      Gone(previous->committed().record.hull_id, change.hull.has_value() ? "replaced" : "deleted"));
}

void RegistryState::ApplyPeerBody(Locked& locked, const std::string& id, const PeerChange& change) {
  const BodyTable::Entry* const entry = bodies.Find(id);
  HULLD_CHECK(entry == nullptr || !entry->in_flight);
  if (change.body.has_value()) {
    AddBody(locked, id, *change.body);
  } else if (entry != nullptr) {
    EraseBody(locked, id);
  }
}

// Notes the change in the feed. Requires: the tables contain it.
void RegistryState::Note(Locked& locked, const std::string& id, const PeerChange& change,
                         const std::optional<Incarnation>& previous) {
  const std::shared_ptr<const Body> body = FindBody(id);
  const HullPointer hull = change.hull.has_value() ? hulls.Find(id) : nullptr;
  if (body != nullptr ? body->damage().ok() : hull != nullptr && !hull->state.damaged()) {
    return feed.NotePresent(locked, previous, hull, body);
  }
  const bool has_ended =
      hull == nullptr && (body == nullptr || (previous.has_value() && !previous->is_body));
  if (has_ended && (previous.has_value() || change.ended_at == change.revision)) {
    // A resumed watch may know a hull that was never known here.
    const Incarnation ended = previous.value_or(Incarnation{.create_revision = change.revision});
    feed.NoteDeleted(locked, id, ended, change.revision);
  } else {
    // A damaged record cannot be described.
    feed.NoteOther(locked, change.revision);
  }
}

void RegistryState::Prepare(Locked& locked, RegisteredHull& hull) {
  HULLD_CHECK(!hull.is_preparing() && hull.live() != nullptr);
  hull.SetPreparing(true);
  hull.ResetWear();
  const std::shared_ptr<LiveHull> live = hull.live();
  const LiveHull::Mark mark = hull.committed_mark();
  locked.Unlock();
  live->Prepare(mark);
  locked.Lock();
  hull.SetPreparing(false);
  if (hull.live() != live) return;
  hull.NotePrepared(locked);
  NoteChange(hull);
}

void RegistryState::SchedulePreparing(const HullPointer& hull) {
  HULLD_CHECK(!hull->is_preparing());
  hull->SetPreparing(true);
  preparer_->Submit([this, hull] {
    Locked locked(mutex);
    hull->SetPreparing(false);
    if (has_ended_preparing_ || hull->live() == nullptr) return;
    Prepare(locked, *hull);
    memory.Evict(locked);
  });
}

void RegistryState::PrepareIfWorn(const HullPointer& hull) {
  if (!has_ended_preparing_ && hull->IsWorn() && !hull->is_preparing()) SchedulePreparing(hull);
}

void RegistryState::EndPreparing() {
  {
    const std::lock_guard lock(mutex);
    has_ended_preparing_ = true;
  }
  preparer_.reset();
}

}  // namespace hulld::server
