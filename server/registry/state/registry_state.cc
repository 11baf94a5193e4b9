#include "server/registry/state/registry_state.h"

#include <utility>

#include "core/base/check.h"
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

}  // namespace

RegistryState::RegistryState(Store& store_in, const Limits& limits_in,
                             std::optional<PoolMetrics> preparers)
    : store(store_in),
      limits(WithMemoryLimit(limits_in)),
      memory(limits.memory_limit, ReadersShare(limits.memory_limit, store), mutex),
      catalog(store, limits, memory),
      feed(store, mutex, memory, Config::kWatchMarkInterval),
      preparer(mutex, catalog, memory, preparers) {}

void RegistryState::ApplyCreation(Locked& locked, const HullPointer& former,
                                  const HullPointer& hull, const StoredHull& stored) {
  hull->SetStored(stored);
  std::optional<Incarnation> replaced;
  if (former != nullptr) {
    const HullRecord& record = former->committed().record;
    replaced = Incarnation::Of(record);
    hull->state.Commit();
    catalog.NoteVertices(record.vertex_count, 0);
    catalog.Forget(locked, former, Gone(record.hull_id, "replaced"));
    catalog.hulls().Insert(hull);
  }
  catalog.NoteVertices(0, stored.record.vertex_count);
  catalog.Publish(stored.record.revision);
  catalog.NoteChange(*hull);
  feed.NoteHull(locked, replaced, hull);
}

void RegistryState::ApplyDeletion(Locked& locked, const HullPointer& hull, uint64_t revision) {
  const HullRecord& record = hull->committed().record;
  catalog.Publish(revision);
  catalog.NoteVertices(record.vertex_count, 0);
  catalog.NoteHullEnded();
  catalog.NoteChange(*hull);
  feed.NoteDeleted(locked, record.hull_id, Incarnation::Of(record), revision);
  catalog.Forget(locked, hull, Gone(record.hull_id, "deleted"));
}

void RegistryState::ApplyChunk(Locked& locked, const HullPointer& hull,
                               const CommittedChunk& chunk) {
  const HullRecord before = hull->committed().record;
  const HullRecord& after = chunk.hull.record;
  hull->Commit(locked, chunk.hull, chunk.mark, chunk.writer, chunk.vertices);
  catalog.NoteChange(*hull);
  if (after.revision != before.revision) {
    catalog.Publish(after.revision);
    catalog.NoteVertices(before.vertex_count, after.vertex_count);
    feed.NoteHull(locked, Incarnation::Of(before), hull);
  }
  preparer.ScheduleIfWorn(hull);
}

void RegistryState::ApplyBody(Locked& locked, const std::string& id,
                              const std::shared_ptr<const Body>& body, uint64_t revision) {
  std::optional<Incarnation> former;
  if (const auto known = catalog.FindBody(id)) former = Incarnation::Of(known->record());
  catalog.Publish(revision);
  // For readers that look for a hull with this ID.
  catalog.recent_changes().Note(id);
  catalog.bodies().Set(locked, id, body);
  if (body != nullptr) {
    feed.NoteBody(locked, former, body);
  } else {
    catalog.NoteBodyEnded();
    feed.NoteDeleted(locked, id, *former, revision);
  }
}

HullPointer RegistryState::ApplyPeerChange(Locked& locked, const std::string& id,
                                           const PeerChange& change, uint64_t since) {
  const std::optional<Incarnation> former = FindFormer(id, change, since);
  HullPointer hull = catalog.hulls().Find(id);
  // False for changes that were part of the initial load.
  const bool is_new = change.revision > catalog.revision();
  if (is_new) {
    catalog.Publish(change.revision);
    // Includes hulls that were created and deleted in between: a reader must learn of the interval.
    catalog.recent_changes().Note(id);
  }
  if (hull != nullptr) {
    if (ApplyPeerVersion(locked, hull, change, is_new)) return hull;
    EndFormer(locked, hull, change);
  }
  ApplyPeerBody(locked, id, change);
  if (change.hull.has_value()) {
    catalog.AddStored(id, *change.hull);
    catalog.NoteChange(*catalog.hulls().Find(id));
  }
  if (is_new) Note(locked, id, change, former);
  return hull;
}

// Returns the incarnation that had the ID after all changes up to `since`. If it is not known here,
// the peer change supplies it.
std::optional<Incarnation> RegistryState::FindFormer(const std::string& id,
                                                     const PeerChange& change, uint64_t since) {
  if (catalog.IsKnown(id)) {
    if (const auto body = catalog.FindBody(id)) return Incarnation::Of(body->record());
    const HullPointer hull = catalog.hulls().Find(id);
    if (hull == nullptr) return std::nullopt;
    return Incarnation::Of(hull->committed().record);
  }
  std::optional<Incarnation> former;
  if (change.former_began != 0) {
    former = {change.former_began, change.former_was_body};
  } else if (change.hull.has_value() && change.hull->ok()) {
    former = Incarnation::Of((*change.hull)->record);
  } else if (change.body.has_value() && change.body->ok()) {
    former = Incarnation::Of((*change.body)->record);
  }
  return former.has_value() && former->create_revision <= since ? former : std::nullopt;
}

// Returns true if `change` is another version of the known hull, and applies it.
bool RegistryState::ApplyPeerVersion(Locked& locked, const HullPointer& hull,
                                     const PeerChange& change, bool is_new) {
  if (!change.hull.has_value() || !change.hull->ok() || hull->state.damaged()) return false;
  const StoredHull& stored = **change.hull;
  const HullRecord& before = hull->committed().record;
  if (before.create_revision != stored.record.create_revision) return false;
  // Applies even if the record is the same: an empty chunk advances its writer's sequence.
  if (!catalog.is_cache()) {
    catalog.NoteVertices(before.vertex_count, stored.record.vertex_count);
  }
  const bool grew =
      hull->Supersede(locked, stored, change.growth.has_value() ? &*change.growth : nullptr);
  catalog.statistics().grown += grew;
  if (grew) preparer.ScheduleIfWorn(hull);
  catalog.NoteChange(*hull);
  if (is_new) feed.NoteHull(locked, Incarnation::Of(stored.record), hull);
  return true;
}

// Ends the known hull, which was deleted or replaced.
void RegistryState::EndFormer(Locked& locked, const HullPointer& former, const PeerChange& change) {
  const HullRecord& record = former->committed().record;
  if (!catalog.is_cache()) catalog.NoteVertices(record.vertex_count, 0);
  catalog.NoteChange(*former);
  former->Vanish();
  catalog.Forget(locked, former,
                 Gone(record.hull_id, change.hull.has_value() ? "replaced" : "deleted"));
}

void RegistryState::ApplyPeerBody(Locked& locked, const std::string& id, const PeerChange& change) {
  const BodyTable::Entry* const entry = catalog.bodies().Find(id);
  HULLD_CHECK(entry == nullptr || !entry->in_flight);
  if (change.body.has_value()) {
    if (!catalog.is_cache() && entry == nullptr) catalog.NoteBodyFound();
    catalog.AddBody(locked, id, *change.body);
  } else if (entry != nullptr) {
    if (!catalog.is_cache()) catalog.NoteBodyEnded();
    catalog.EraseBody(locked, id);
  }
}

// Notes the change in the feed. Requires: the catalog contains it.
void RegistryState::Note(Locked& locked, const std::string& id, const PeerChange& change,
                         const std::optional<Incarnation>& former) {
  const std::shared_ptr<const Body> body = catalog.FindBody(id);
  const HullPointer hull = change.hull.has_value() ? catalog.hulls().Find(id) : nullptr;
  if (body != nullptr && body->damage().ok()) return feed.NoteBody(locked, former, body);
  if (hull != nullptr && !hull->state.damaged()) return feed.NoteHull(locked, former, hull);
  const bool has_ended =
      hull == nullptr && (body == nullptr || (former.has_value() && !former->is_body));
  if (has_ended && (former.has_value() || change.ended_at == change.revision)) {
    // A resumed watch may know a hull that was never known here.
    const Incarnation ended = former.value_or(Incarnation{.create_revision = change.revision});
    feed.NoteDeleted(locked, id, ended, change.revision);
  } else {
    // A damaged record cannot be described.
    feed.NoteOther(locked, change.revision);
  }
}

}  // namespace hulld::server
