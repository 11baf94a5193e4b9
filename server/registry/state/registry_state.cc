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

// The rest is reserved for writers: without a store that keeps hulls, their hulls stay in memory.
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

void RegistryState::ApplyCreation(Locked& locked, const HullPointer& hull,
                                  const StoredHull& stored) {
  hull->SetStored(stored);
  catalog.NoteVertices(0, stored.record.vertex_count);
  catalog.Publish(stored.record.revision);
  catalog.NoteChange(*hull);
  feed.NoteHull(locked, ChangeKind::kCreated, hull);
}

void RegistryState::ApplyReplacement(Locked& locked, const HullPointer& former,
                                     const HullPointer& hull, const StoredHull& stored) {
  hull->SetStored(stored);
  hull->state.Commit();
  catalog.NoteVertices(former->committed().record.vertex_count, stored.record.vertex_count);
  catalog.Forget(locked, former, Gone(stored.record.hull_id, "replaced"));
  catalog.hulls().Insert(hull);
  catalog.Publish(stored.record.revision);
  catalog.NoteChange(*hull);
  feed.NoteHull(locked, ChangeKind::kReplaced, hull);
}

void RegistryState::ApplyDeletion(Locked& locked, const HullPointer& hull, uint64_t revision) {
  const HullRecord& record = hull->committed().record;
  catalog.Publish(revision);
  catalog.NoteVertices(record.vertex_count, 0);
  catalog.NoteHullEnded();
  catalog.NoteChange(*hull);
  feed.NoteDeleted(locked, record, revision);
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
    feed.NoteHull(locked, ChangeKind::kChanged, hull);
  }
  preparer.ScheduleIfWorn(hull);
}

void RegistryState::ApplyBody(Locked& locked, const std::string& id,
                              const std::shared_ptr<const Body>& body, uint64_t revision) {
  const std::shared_ptr<const Body> former = catalog.FindBody(id);
  catalog.Publish(revision);
  // For readers that look for a hull with this ID.
  catalog.recent_changes().Note(id);
  catalog.bodies().Set(locked, id, body);
  if (body != nullptr) {
    feed.NoteBodyPut(locked, former == nullptr ? nullptr : &former->record(), body);
  } else {
    catalog.NoteBodyEnded();
    feed.NoteBodyDeleted(locked, former->record(), revision);
  }
}

// State of an ID after all changes up to `since` were applied.
struct RegistryState::Former {
  // True if the state was known. If not, the peer change supplies the rest.
  bool was_known = false;
  // Null also if unknown.
  HullPointer hull;
  std::optional<BodyRecord> body;
  // create_revision of an unknown hull or body that has ended; otherwise 0.
  uint64_t ended_began = 0;
};

RegistryState::HullPointer RegistryState::ApplyPeerChange(Locked& locked, const std::string& id,
                                                          const PeerChange& change,
                                                          uint64_t since) {
  const Former former = FindFormer(id, change, since);
  // False for changes that were part of the initial load.
  const bool is_new = change.revision > catalog.revision();
  if (is_new) {
    catalog.Publish(change.revision);
    // Includes hulls that were created and deleted in between: a reader must learn of the interval.
    catalog.recent_changes().Note(id);
  }
  if (former.hull != nullptr) {
    if (ApplyPeerVersion(locked, former.hull, change, is_new)) return former.hull;
    EndFormer(locked, former.hull, change);
  }
  ApplyPeerBody(locked, id, change);
  if (change.hull.has_value()) {
    catalog.AddStored(id, *change.hull);
    catalog.NoteChange(*catalog.hulls().Find(id));
  }
  if (is_new) Note(locked, id, change, former, since);
  return former.hull;
}

RegistryState::Former RegistryState::FindFormer(const std::string& id, const PeerChange& change,
                                                uint64_t since) {
  Former former;
  former.was_known = catalog.IsKnown(id);
  former.body = FindFormerBody(id, change, since);
  former.hull = catalog.hulls().Find(id);
  const bool has_ended = !former.was_known && change.former_began <= since;
  if (has_ended) former.ended_began = change.former_began;
  return former;
}

std::optional<BodyRecord> RegistryState::FindFormerBody(const std::string& id,
                                                        const PeerChange& change, uint64_t since) {
  if (catalog.IsKnown(id)) {
    const std::shared_ptr<const Body> body = catalog.FindBody(id);
    return body == nullptr ? std::nullopt : std::optional(body->record());
  }
  if (change.former_was_body && change.former_began <= since) {
    return BodyRecord{id, change.former_began, 0};
  }
  const bool was_there = change.former_began == 0 && change.body.has_value() && change.body->ok() &&
                         (*change.body)->record.create_revision <= since;
  return was_there ? std::optional((*change.body)->record) : std::nullopt;
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
  if (is_new) feed.NoteHull(locked, ChangeKind::kChanged, hull);
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

// Notes the change in the feed. Requires: the catalog holds it.
void RegistryState::Note(Locked& locked, const std::string& id, const PeerChange& change,
                         const Former& former, uint64_t since) {
  const std::shared_ptr<const Body> body = catalog.FindBody(id);
  const HullPointer hull = change.hull.has_value() ? catalog.hulls().Find(id) : nullptr;
  if (body != nullptr && body->damage().ok()) {
    NoteBody(locked, id, change, former, body);
  } else if (hull != nullptr && !hull->state.damaged()) {
    NoteHull(locked, hull, former, since);
  } else if (hull == nullptr) {
    NoteEnd(locked, id, change, former, body != nullptr);
  } else {
    // A damaged record cannot be described.
    feed.NoteOther(locked, change.revision);
  }
}

void RegistryState::NoteBody(Locked& locked, const std::string& id, const PeerChange& change,
                             const Former& former, const std::shared_ptr<const Body>& body) {
  if (former.hull != nullptr) {
    feed.NoteBecameBody(locked, former.hull->committed().record, body);
  } else if (former.ended_began != 0 && !change.former_was_body) {
    HullRecord ended;
    ended.hull_id = id;
    ended.create_revision = former.ended_began;
    feed.NoteBecameBody(locked, ended, body);
  } else {
    feed.NoteBodyPut(locked, former.body.has_value() ? &*former.body : nullptr, body);
  }
}

void RegistryState::NoteHull(Locked& locked, const HullPointer& hull, const Former& former,
                             uint64_t since) {
  if (former.body.has_value()) {
    feed.NoteBecameHull(locked, *former.body, hull);
  } else if (!former.was_known && hull->committed().record.create_revision <= since) {
    feed.NoteHull(locked, ChangeKind::kChanged, hull);
  } else if (former.hull != nullptr || former.ended_began != 0) {
    feed.NoteHull(locked, ChangeKind::kReplaced, hull);
  } else {
    feed.NoteHull(locked, ChangeKind::kCreated, hull);
  }
}

// has_body: a damaged body has the ID now.
void RegistryState::NoteEnd(Locked& locked, const std::string& id, const PeerChange& change,
                            const Former& former, bool has_body) {
  const bool is_deletion = !change.body.has_value() && change.ended_at == change.revision;
  if (former.body.has_value() && !has_body) {
    feed.NoteBodyDeleted(locked, *former.body, change.revision);
  } else if (former.hull != nullptr || is_deletion) {
    // A resumed watch may know a hull that was never known here.
    HullRecord record;
    record.hull_id = id;
    record.create_revision = change.revision;
    if (former.hull != nullptr) {
      record.create_revision = former.hull->committed().record.create_revision;
    } else if (former.ended_began != 0) {
      record.create_revision = former.ended_began;
    }
    feed.NoteDeleted(locked, record, change.revision);
  } else {
    feed.NoteOther(locked, change.revision);
  }
}

}  // namespace hulld::server
