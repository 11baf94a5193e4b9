#include "server/registry/changes/takeover.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {

// State of an ID after all changes up to `since` were applied.
struct Takeover::Former {
  // True if the state was known. If not, the peer change supplies the rest.
  bool was_known = false;
  // Null also if unknown.
  HullPointer hull;
  std::optional<BodyRecord> body;
  // create_revision of an unknown hull or body that has ended; otherwise 0.
  uint64_t ended_began = 0;
};

std::vector<HullGrowth> Takeover::GrownHulls(const OtherChanges& others) const {
  std::vector<HullGrowth> grown;
  uint64_t points = 0;
  const HullTable::Entries& all = catalog_.hulls().entries();
  for (const auto& [id, other] : others.by_id) {
    if (!other.hull.has_value() || !other.hull->ok()) continue;
    const auto found = all.find(id);
    if (found == all.end() || found->second.awake() == nullptr) continue;
    const RegisteredHull& hull = *found->second.awake();
    const StoredHull& stored = **other.hull;
    if (!hull.GrewInto(stored)) continue;
    points += stored.layout.delta_vertices - hull.committed.layout.delta_vertices;
    if (grown.size() == kMostGrownHulls || points > kMostGrowth) break;
    grown.push_back({hull.committed, stored});
  }
  return grown;
}

void Takeover::Take(Locked& locked, const OtherChanges& others) {
  std::vector<std::pair<uint64_t, const std::string*>> in_order;
  in_order.reserve(others.by_id.size());
  for (const auto& [id, other] : others.by_id) in_order.emplace_back(other.revision, &id);
  std::ranges::sort(in_order);
  const uint64_t since = catalog_.revision();
  for (const auto& [revision, id] : in_order) {
    TakeOne(locked, *id, others.by_id.at(*id), since);
    for (LockedTask& task : records_.EndReadingOf(*id)) after_others_.Add(std::move(task));
    catalog_.hulls().RestSome();
    catalog_.bodies().DropSome(locked);
  }
  if (catalog_.is_cache() && others.revision > 0) catalog_.SetTotals(others.totals);
  if (others.revision > catalog_.revision()) {
    catalog_.Publish(others.revision);
    feed_.NoteOther(locked, others.revision);
  }
  memory_.Evict(locked);
  after_others_.Run(locked);
}

// since: all earlier changes up to this revision were applied.
void Takeover::TakeOne(Locked& locked, const std::string& id, const OtherChange& other,
                       uint64_t since) {
  const Former former = FindFormer(id, other, since);
  // False for changes that were part of the initial load.
  const bool is_news = other.revision > catalog_.revision();
  if (is_news) {
    catalog_.Publish(other.revision);
    // Includes hulls that were created and deleted in between: a reader must learn of the interval.
    catalog_.recent_changes().Note(id);
  }
  if (former.hull != nullptr) {
    if (TakeVersion(locked, former.hull, other, is_news)) {
      return changes_.AdvanceLater(former.hull);
    }
    EndFormer(locked, former.hull, other);
  }
  TakeBody(locked, id, other);
  if (other.hull.has_value()) {
    catalog_.AddStored(id, *other.hull);
    catalog_.NoteChange(*catalog_.hulls().Find(id));
  }
  if (is_news) Tell(locked, id, other, former, since);
}

Takeover::Former Takeover::FindFormer(const std::string& id, const OtherChange& other,
                                      uint64_t since) {
  Former former;
  former.was_known = catalog_.IsKnown(id);
  former.body = FindFormerBody(id, other, since);
  former.hull = catalog_.hulls().Find(id);
  const bool has_ended = !former.was_known && other.former_began <= since;
  if (has_ended) former.ended_began = other.former_began;
  return former;
}

std::optional<BodyRecord> Takeover::FindFormerBody(const std::string& id, const OtherChange& other,
                                                   uint64_t since) {
  if (catalog_.IsKnown(id)) {
    const std::shared_ptr<const Body> body = catalog_.FindBody(id);
    return body == nullptr ? std::nullopt : std::optional(body->record());
  }
  if (other.former_was_body && other.former_began <= since) {
    return BodyRecord{id, other.former_began, 0};
  }
  const bool was_there = other.former_began == 0 && other.body.has_value() && other.body->ok() &&
                         (*other.body)->record.create_revision <= since;
  return was_there ? std::optional((*other.body)->record) : std::nullopt;
}

// Returns true if `other` is another version of the known hull, and applies it.
bool Takeover::TakeVersion(Locked& locked, const HullPointer& hull, const OtherChange& other,
                           bool is_news) {
  if (!other.hull.has_value() || !other.hull->ok() || hull->state.damaged()) return false;
  const StoredHull& stored = **other.hull;
  const HullRecord& before = hull->committed.record;
  if (before.create_revision != stored.record.create_revision) return false;
  // Applies even if the record is the same: an empty chunk advances its writer's sequence.
  if (!catalog_.is_cache()) {
    catalog_.NoteVertices(before.vertex_count, stored.record.vertex_count);
  }
  const bool grew =
      hull->Supersede(locked, stored, other.growth.has_value() ? &*other.growth : nullptr);
  catalog_.statistics().grown += grew;
  if (grew) preparer_.ScheduleIfWorn(hull);
  catalog_.NoteChange(*hull);
  if (is_news) feed_.NoteChanged(locked, hull);
  return true;
}

// Ends the known hull, which was deleted or replaced.
void Takeover::EndFormer(Locked& locked, const HullPointer& former, const OtherChange& other) {
  const HullRecord& record = former->committed.record;
  if (!catalog_.is_cache()) catalog_.NoteVertices(record.vertex_count, 0);
  catalog_.NoteChange(*former);
  former->state.Vanish();
  ++former->supersessions;
  catalog_.Forget(locked, former,
                  Gone(record.hull_id, other.hull.has_value() ? "replaced" : "deleted"));
  changes_.AdvanceLater(former);
}

void Takeover::TakeBody(Locked& locked, const std::string& id, const OtherChange& other) {
  const BodyTable::Entry* const entry = catalog_.bodies().Find(id);
  HULLD_CHECK(entry == nullptr || !entry->in_flight);
  if (other.body.has_value()) {
    if (!catalog_.is_cache() && entry == nullptr) catalog_.NoteBodyFound();
    catalog_.AddBody(locked, id, *other.body);
  } else if (entry != nullptr) {
    if (!catalog_.is_cache()) catalog_.NoteBodyEnded();
    catalog_.EraseBody(locked, id);
  }
}

// Notes the change in the feed. Requires: the catalog holds it.
void Takeover::Tell(Locked& locked, const std::string& id, const OtherChange& other,
                    const Former& former, uint64_t since) {
  const std::shared_ptr<const Body> body = catalog_.FindBody(id);
  const HullPointer hull = other.hull.has_value() ? catalog_.hulls().Find(id) : nullptr;
  if (body != nullptr && body->damage().ok()) {
    TellOfBody(locked, id, other, former, body);
  } else if (hull != nullptr && !hull->state.damaged()) {
    TellOfHull(locked, hull, former, since);
  } else if (hull == nullptr) {
    TellOfEnd(locked, id, other, former, body != nullptr);
  } else {
    // A damaged record cannot be described.
    feed_.NoteOther(locked, other.revision);
  }
}

void Takeover::TellOfBody(Locked& locked, const std::string& id, const OtherChange& other,
                          const Former& former, const std::shared_ptr<const Body>& body) {
  if (former.hull != nullptr) {
    feed_.NoteBecameBody(locked, former.hull->committed.record, body);
  } else if (former.ended_began != 0 && !other.former_was_body) {
    HullRecord ended;
    ended.hull_id = id;
    ended.create_revision = former.ended_began;
    feed_.NoteBecameBody(locked, ended, body);
  } else {
    feed_.NoteBodyPut(locked, former.body.has_value() ? &*former.body : nullptr, body);
  }
}

void Takeover::TellOfHull(Locked& locked, const HullPointer& hull, const Former& former,
                          uint64_t since) {
  if (former.body.has_value()) {
    feed_.NoteBecameHull(locked, *former.body, hull);
  } else if (!former.was_known && hull->committed.record.create_revision <= since) {
    feed_.NoteChanged(locked, hull);
  } else if (former.hull != nullptr || former.ended_began != 0) {
    feed_.NoteReplaced(locked, hull);
  } else {
    feed_.NoteCreated(locked, hull);
  }
}

// has_body: a damaged body has the ID now.
void Takeover::TellOfEnd(Locked& locked, const std::string& id, const OtherChange& other,
                         const Former& former, bool has_body) {
  const bool is_deletion = !other.body.has_value() && other.ended_at == other.revision;
  if (former.body.has_value() && !has_body) {
    feed_.NoteBodyDeleted(locked, *former.body, other.revision);
  } else if (former.hull != nullptr || is_deletion) {
    // A resumed watch may know a hull that was never known here.
    HullRecord record;
    record.hull_id = id;
    record.create_revision = other.revision;
    if (former.hull != nullptr) {
      record.create_revision = former.hull->committed.record.create_revision;
    } else if (former.ended_began != 0) {
      record.create_revision = former.ended_began;
    }
    feed_.NoteDeleted(locked, record, other.revision);
  } else {
    feed_.NoteOther(locked, other.revision);
  }
}

}  // namespace hulld::server
