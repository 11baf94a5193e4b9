// Other servers over the same store: what they committed is taken over as of one of their batches,
// on the committer's thread, so that nothing of it is being committed here meanwhile.
#include <absl/status/status.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "server/registry/catalog/registered_hull.h"
#include "server/registry/registry.h"

namespace hulld::server {

void Registry::Hold(std::shared_ptr<CommitHold> hold) {
  const Locked locked(mutex_);
  committer_.Hold(locked, std::move(hold));
}

void Registry::AdvanceLater(const HullPointer& hull) {
  after_others_.push_back([this, hull](Locked& locked) { Advance(locked, hull); });
}

// Hulls whose points are in memory and that only grew, as far as they can be added within one hold
// of the mutex. What is committed here stays so until Others is told, as the same thread does both.
std::vector<HullGrowth> Registry::GrownHulls(const OtherChanges& others) const {
  std::vector<HullGrowth> grown;
  uint64_t points = 0;
  for (const auto& [id, other] : others.by_id) {
    if (!other.hull.has_value() || !other.hull->ok()) continue;
    const auto found = catalog_.hulls().entries().find(id);
    if (found == catalog_.hulls().entries().end() || found->second.awake() == nullptr) continue;
    const RegisteredHull& hull = *found->second.awake();
    const StoredHull& stored = **other.hull;
    if (!hull.GrewInto(stored)) continue;
    points += stored.layout.delta_vertices - hull.committed.layout.delta_vertices;
    if (grown.size() == kMostGrownHulls || points > kMostGrowth) break;
    grown.push_back({hull.committed, stored});
  }
  return grown;
}

// Nothing of these IDs is in flight.
void Registry::TakeOver(Locked& locked, const OtherChanges& others) {
  std::vector<std::pair<uint64_t, const std::string*>> in_order;
  in_order.reserve(others.by_id.size());
  for (const auto& [id, other] : others.by_id) in_order.emplace_back(other.revision, &id);
  std::ranges::sort(in_order);
  const uint64_t since = catalog_.revision();
  for (const auto& [revision, id] : in_order) {
    TakeOver(locked, *id, others.by_id.at(*id), since);
    for (LockedTask& task : records_.EndReadingOf(*id)) after_others_.push_back(std::move(task));
    catalog_.hulls().RestSome();
    catalog_.bodies().DropSome(locked);
  }
  if (catalog_.is_cache() && others.revision > 0) catalog_.SetTotals(others.totals);
  if (others.revision > catalog_.revision()) {
    catalog_.Publish(others.revision);
    feed_.NoteOther(locked, others.revision);
  }
  memory_.Evict(locked);
  for (const auto& next : std::exchange(after_others_, {})) next(locked);
}

// since: the revision up to which everything was taken over before.
void Registry::TakeOver(Locked& locked, const std::string& id, const OtherChange& other,
                        uint64_t since) {
  const std::optional<BodyRecord> former_body = FormerBody(id, other, since);
  // What was not known to be here is told from what others say of it.
  const bool was_known = catalog_.IsKnown(id);
  const bool has_ended = !was_known && other.former_began != 0 && other.former_began <= since;
  // Not what was read when the store was loaded.
  const bool is_news = other.revision > catalog_.revision();
  if (is_news) catalog_.Publish(other.revision);
  // Also of what came and went, for who has to know that there was nothing all the while.
  if (is_news) catalog_.recent_changes().Note(id);
  const HullPointer former = catalog_.hulls().Find(id);
  if (former != nullptr && TakeOverVersion(locked, former, other, is_news)) {
    return AdvanceLater(former);
  }
  if (former != nullptr) {
    if (!catalog_.is_cache()) catalog_.NoteVertices(former->committed.record.vertex_count, 0);
    catalog_.NoteChange(*former);
    former->state.Vanish();
    ++former->supersessions;
    catalog_.Forget(locked, former, Gone(id, other.hull.has_value() ? "replaced" : "deleted"));
    AdvanceLater(former);
  }
  TakeOverBody(locked, id, other);
  const std::shared_ptr<const Body> body = catalog_.FindBody(id);
  HullPointer hull;
  if (other.hull.has_value()) {
    catalog_.AddStored(id, *other.hull);
    hull = catalog_.hulls().Find(id);
    catalog_.NoteChange(*hull);
  }
  if (!is_news) return;
  const bool is_deletion = !other.body.has_value() && other.ended_at == other.revision;
  if (body != nullptr && body->damage().ok()) {
    if (former != nullptr) {
      feed_.NoteBecameBody(locked, former->committed.record, body);
    } else if (has_ended && !other.former_was_body) {
      HullRecord ended;
      ended.hull_id = id;
      ended.create_revision = other.former_began;
      feed_.NoteBecameBody(locked, ended, body);
    } else {
      feed_.NoteBodyPut(locked, former_body.has_value() ? &*former_body : nullptr, body);
    }
  } else if (hull != nullptr && !hull->state.damaged()) {
    if (former_body.has_value()) {
      feed_.NoteBecameHull(locked, *former_body, hull);
    } else if (!was_known && hull->committed.record.create_revision <= since) {
      feed_.NoteChanged(locked, hull);
    } else if (former != nullptr || has_ended) {
      feed_.NoteReplaced(locked, hull);
    } else {
      feed_.NoteCreated(locked, hull);
    }
  } else if (former_body.has_value() && body == nullptr && hull == nullptr) {
    feed_.NoteBodyDeleted(locked, *former_body, other.revision);
  } else if (hull == nullptr && (former != nullptr || is_deletion)) {
    // Of one that was never known here, who resumes a watch may know.
    HullRecord record;
    record.hull_id = id;
    record.create_revision = former != nullptr ? former->committed.record.create_revision
                             : has_ended       ? other.former_began
                                               : other.revision;
    feed_.NoteDeleted(locked, record, other.revision);
  } else {
    feed_.NoteOther(locked, other.revision);
  }
}

// The body that there was when everything was taken over up to `since`, if there was one.
std::optional<BodyRecord> Registry::FormerBody(const std::string& id, const OtherChange& other,
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

// Whether it is another version of the hull that was known.
bool Registry::TakeOverVersion(Locked& locked, const HullPointer& hull, const OtherChange& other,
                               bool is_news) {
  if (!other.hull.has_value() || !other.hull->ok() || hull->state.damaged()) return false;
  const StoredHull& stored = **other.hull;
  const HullRecord& before = hull->committed.record;
  if (before.create_revision != stored.record.create_revision) return false;
  // Also where the record is the same: an empty chunk counts in the sequences of its writer.
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

void Registry::TakeOverBody(Locked& locked, const std::string& id, const OtherChange& other) {
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

}  // namespace hulld::server
