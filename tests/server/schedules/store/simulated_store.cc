#include "tests/server/schedules/store/simulated_store.h"

#include <absl/status/status.h>

#include "tests/server/schedules/scheduler.h"

namespace hulld::server {
namespace {

absl::Status Killed() { return absl::UnavailableError("the process was killed"); }

}  // namespace

absl::Status SimulatedStore::ForEachRecord(const StoredHullVisitor& visit_hull,
                                           const StoredBodyVisitor& visit_body) {
  for (const auto& [id, kept] : hulls_) visit_hull(id, kept.stored);
  for (const auto& [id, body] : bodies_) visit_body(id, body);
  return absl::OkStatus();
}

absl::StatusOr<std::vector<Vector>> SimulatedStore::LoadVertices(const StoredHull& hull) {
  Scheduler& scheduler = Scheduler::Current();
  ++counts_.loads;
  scheduler.Note("store: reads points of a hull at revision", hull.record.revision);
  if (Scheduler::Current().random().OneIn(faults_.read)) {
    ++counts_.failed_reads;
    return absl::UnavailableError("the disk does not answer");
  }
  const uint64_t incarnation = hull.record.create_revision;
  if (Scheduler::Current().random().OneIn(faults_.damage)) damaged_.insert(incarnation);
  if (is_damaged(incarnation)) return absl::DataLossError("the points are damaged");
  const auto found = hulls_.find(hull.record.hull_id);
  std::vector<Vector> points;
  if (found != hulls_.end() && found->second.stored.record.create_revision == incarnation) {
    for (const auto& [revision, point] : found->second.vertices) {
      if (revision <= hull.record.revision) points.push_back(point);
    }
  }
  scheduler.Note("store: has read points:", points.size());
  if (points.size() == hull.layout.base_vertices + hull.layout.delta_vertices) return points;
  return absl::DataLossError("points are missing");
}

absl::StatusOr<uint64_t> SimulatedStore::LoadSequence(const HullRecord& hull,
                                                      const std::string& writer_id) {
  Scheduler& scheduler = Scheduler::Current();
  ++counts_.sequences;
  scheduler.Note("store: reads a sequence of a hull at revision", hull.revision);
  if (Scheduler::Current().random().OneIn(faults_.read)) {
    ++counts_.failed_reads;
    return absl::UnavailableError("the disk does not answer");
  }
  uint64_t sequence = 0;
  const auto found = hulls_.find(hull.hull_id);
  if (found != hulls_.end() &&
      found->second.stored.record.create_revision == hull.create_revision) {
    const auto writer = found->second.sequences.find(writer_id);
    if (writer != found->second.sequences.end()) sequence = writer->second;
  }
  scheduler.Note("store: has read the sequence", sequence);
  return sequence;
}

absl::StatusOr<FoundRecords> SimulatedStore::FindRecords(std::span<const std::string> ids) {
  Scheduler& scheduler = Scheduler::Current();
  ++counts_.lookups;
  scheduler.Note("store: looks up records:", ids.size());
  if (Scheduler::Current().random().OneIn(faults_.read)) {
    ++counts_.failed_reads;
    ++counts_.failed_lookups;
    return absl::UnavailableError("the disk does not answer");
  }
  FoundRecords found;
  found.revision = ledger_.revision();
  for (const std::string& id : ids) {
    const auto kept = hulls_.find(id);
    if (kept != hulls_.end()) found.hulls.emplace(id, kept->second.stored);
    const auto body = bodies_.find(id);
    if (body != bodies_.end()) found.bodies.emplace(id, body->second);
  }
  scheduler.Note("store: has found records at revision", found.revision,
                 found.hulls.size() + found.bodies.size());
  return found;
}

absl::StatusOr<FoundRecords> SimulatedStore::ListRecords(const std::string& prefix,
                                                         const std::string& after, size_t limit,
                                                         RecordKinds kinds) {
  // All of them in one step.
  absl::StatusOr<FoundRecords> found = FindRecords({});
  if (!found.ok()) return found;
  found->revision = ledger_.revision();
  found->more = false;
  size_t listed = 0;
  for (size_t hull = 0; hull < kHulls; ++hull) {
    const std::string id = HullName(hull);
    const auto kept = hulls_.find(id);
    const auto body = bodies_.find(id);
    const bool has_hull = kinds.hulls && kept != hulls_.end();
    const bool has_body = kinds.bodies && body != bodies_.end();
    if ((!has_hull && !has_body) || !id.starts_with(prefix) || id <= after) continue;
    found->more = listed == limit;
    if (found->more) break;
    ++listed;
    if (has_hull) found->hulls.emplace(id, kept->second.stored);
    if (has_body) found->bodies.emplace(id, body->second);
  }
  Scheduler::Current().Note("store: has listed records at revision", found->revision, listed);
  return found;
}

StoreTotals SimulatedStore::totals() const {
  StoreTotals totals;
  totals.hulls = hulls_.size();
  totals.bodies = bodies_.size();
  for (const auto& [id, kept] : hulls_) totals.vertices += kept.stored.record.vertex_count;
  return totals;
}

absl::Status SimulatedStore::Commit(std::span<Change* const> changes) {
  Scheduler& scheduler = Scheduler::Current();
  if (is_busy_) scheduler.Fail("two calls commit at the same time");
  if (is_failing_) scheduler.Fail("a batch arrives after an error without Recover");
  is_busy_ = true;
  ++counts_.batches;
  scheduler.Note("store: begins to commit changes:", changes.size());
  NumberChanges(changes, ledger_.revision());
  const absl::Status status = RefuseBatch(changes);
  is_failing_ = !status.ok();
  if (status.ok()) {
    for (const Change* change : changes) Keep(*change, false);
  }
  scheduler.Note(status.ok() ? "store: has committed up to revision" : "store: refuses the batch",
                 ledger_.revision());
  is_busy_ = false;
  return status;
}

// Returns OK if the batch is not refused.
absl::Status SimulatedStore::RefuseBatch(std::span<const Change* const> changes) {
  const auto leave_unknown = [&] {
    ++counts_.unknown;
    for (const Change* change : changes) unknown_.push_back(*change);
  };
  if (is_dead_) {
    ++counts_.refused;
    return Killed();
  }
  if (counts_.batches == faults_.killed_at_batch) {
    ++counts_.kills;
    is_dead_ = true;
    leave_unknown();
    return Killed();
  }
  if (Scheduler::Current().random().OneIn(faults_.full)) {
    ++counts_.refused;
    was_full_ = true;
    return absl::ResourceExhaustedError("the disk is full");
  }
  if (Scheduler::Current().random().OneIn(faults_.unknown)) {
    leave_unknown();
    return absl::UnavailableError("the disk failed, and its contents are unknown");
  }
  if (Scheduler::Current().random().OneIn(faults_.refused)) {
    ++counts_.refused;
    return absl::UnavailableError("the disk failed");
  }
  return absl::OkStatus();
}

absl::Status SimulatedStore::Recover() {
  Scheduler& scheduler = Scheduler::Current();
  if (is_busy_) scheduler.Fail("Recover is called during a commit");
  is_busy_ = true;
  scheduler.Note("store: recovers");
  const bool fails = is_dead_ || Scheduler::Current().random().OneIn(faults_.recover);
  if (fails) {
    ++counts_.refused;
  } else {
    ++counts_.recovered;
    is_failing_ = false;
    unknown_.clear();
  }
  scheduler.Note(fails ? "store: cannot recover" : "store: has recovered");
  is_busy_ = false;
  return fails ? absl::UnavailableError("the disk still fails") : absl::OkStatus();
}

absl::StatusOr<std::string> SimulatedStore::MakeCopy() {
  return absl::FailedPreconditionError("a simulated store cannot be copied");
}

void SimulatedStore::Reopen(const StoreFaults& faults) {
  faults_ = faults;
  is_dead_ = is_failing_ = false;
  // All or none.
  if (!unknown_.empty() && Scheduler::Current().random().OneIn(2)) {
    ++counts_.revived;
    for (const Change& change : unknown_) Keep(change, true);
  }
  unknown_.clear();
}

void SimulatedStore::KeepBody(const Change& change) {
  const BodyRecord& record = change.body->record;
  Logged logged = {record.body_id, change.revision};
  if (change.deleted) {
    logged.ended_at = change.revision;
    if (record.create_revision != 0) logged.previous = Incarnation::Of(record);
  }
  log_.push_back(std::move(logged));
  if (change.deleted) {
    bodies_.erase(record.body_id);
  } else {
    bodies_[record.body_id] = *change.body;
  }
}

void SimulatedStore::Keep(const Change& change, bool nobody_waits) {
  if (auto fault = ledger_.Keep(change, nobody_waits)) Scheduler::Current().Fail(*fault);
  if (change.body != nullptr) return KeepBody(change);
  const HullRecord& record = change.hull.record;
  Logged logged = {record.hull_id, change.revision};
  if (change.deleted || change.replaced.has_value()) {
    const HullRecord& ended = change.deleted ? record : change.replaced->record;
    logged.ended_at = change.revision;
    if (ended.create_revision != 0) logged.previous = Incarnation::Of(ended);
  }
  log_.push_back(std::move(logged));
  if (change.deleted) {
    hulls_.erase(record.hull_id);
    return;
  }
  StoredVertices& kept = hulls_[record.hull_id];
  if (change.replaced.has_value()) kept = {};
  kept.stored = change.hull;
  if (change.vertex_change == VertexChange::kReplaced) kept.vertices.clear();
  for (const Vector& vertex : change.vertices) kept.vertices.emplace_back(record.revision, vertex);
  if (change.writer.has_value()) {
    kept.sequences[change.writer->writer_id] = change.writer->sequence;
  }
}

}  // namespace hulld::server
