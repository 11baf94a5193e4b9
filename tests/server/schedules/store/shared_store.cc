#include "tests/server/schedules/store/shared_store.h"

#include <absl/status/status.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "tests/server/schedules/scheduler.h"

namespace hulld::server {
namespace {

absl::Status Moved() { return absl::AbortedError("a peer server changed the hull"); }

}  // namespace

SharedStore::SharedStore(SimulatedStore& database)
    : database_(database),
      known_{database.log_.size(), database.ledger_.revision(), database.totals()} {
  const std::lock_guard lock(database_.servers_mutex_);
  database_.servers_.push_back(this);
}

SharedStore::~SharedStore() {
  NoteEnd(false);
  const std::lock_guard lock(database_.servers_mutex_);
  std::erase(database_.servers_, this);
}

void SharedStore::Begin(const char* what, uint64_t number) {
  Scheduler& scheduler = Scheduler::Current();
  if (is_busy_) scheduler.Fail("two calls commit, fetch, or recover at the same time");
  is_busy_ = true;
  scheduler.Note(what, number);
}

absl::Status SharedStore::End(const char* what, const absl::Status& status) {
  Scheduler::Current().Note(status.ok() ? what : "database: refuses", known_.revision, known_.seen);
  is_busy_ = false;
  return status;
}

// Not an atomic snapshot.
absl::Status SharedStore::ForEachRecord(const StoredHullVisitor& visit_hull,
                                        const StoredBodyVisitor&) {
  std::string last;
  while (true) {
    Scheduler::Current().Note("database: reads the next hull");
    const auto next = database_.hulls_.upper_bound(last);
    if (next == database_.hulls_.end()) return absl::OkStatus();
    last = next->first;
    visit_hull(last, next->second.stored);
  }
}

const SimulatedStore::StoredVertices* SharedStore::Find(const HullRecord& record) const {
  const auto found = database_.hulls_.find(record.hull_id);
  if (found == database_.hulls_.end()) return nullptr;
  const HullRecord& now = found->second.stored.record;
  return now.create_revision == record.create_revision ? &found->second : nullptr;
}

absl::StatusOr<std::vector<Vector>> SharedStore::LoadVertices(const StoredHull& hull) {
  Scheduler& scheduler = Scheduler::Current();
  ++database_.counts_.loads;
  scheduler.Note("database: reads points of a hull at revision", hull.record.revision);
  if (Scheduler::Current().random().OneIn(database_.faults_.read)) {
    ++database_.counts_.failed_reads;
    return absl::UnavailableError("the database does not answer");
  }
  const SimulatedStore::StoredVertices* const kept = Find(hull.record);
  // A base replaces everything before it.
  if (kept == nullptr || kept->stored.layout.base_revision != hull.layout.base_revision) {
    scheduler.Note("database: finds a different hull than that of revision", hull.record.revision);
    return Moved();
  }
  std::vector<Vector> points;
  for (const auto& [revision, point] : kept->vertices) {
    if (revision <= hull.record.revision) points.push_back(point);
  }
  scheduler.Note("database: has read points:", points.size());
  return points;
}

absl::StatusOr<uint64_t> SharedStore::LoadSequence(const HullRecord& hull,
                                                   const std::string& writer_id) {
  Scheduler& scheduler = Scheduler::Current();
  ++database_.counts_.sequences;
  scheduler.Note("database: reads a sequence of a hull at revision", hull.revision);
  if (Scheduler::Current().random().OneIn(database_.faults_.read)) {
    ++database_.counts_.failed_reads;
    return absl::UnavailableError("the database does not answer");
  }
  const SimulatedStore::StoredVertices* const kept = Find(hull);
  absl::StatusOr<uint64_t> sequence = Moved();
  if (kept != nullptr && kept->stored.record == hull) {
    const auto writer = kept->sequences.find(writer_id);
    sequence = writer == kept->sequences.end() ? 0 : writer->second;
  }
  scheduler.Note("database: has read a sequence", sequence.ok() ? *sequence : 0);
  return sequence;
}

// Records the peer changes since its last known revision.
void SharedStore::NotePeerChanges() {
  known_.revision = database_.ledger_.revision();
  known_.totals = database_.totals();
  for (; known_.seen < database_.log_.size(); ++known_.seen) {
    const SimulatedStore::Logged& logged = database_.log_[known_.seen];
    PeerChange& other = known_.peer_changes.by_id[logged.hull_id];
    other.revision = logged.revision;
    other.ended_at = std::max(other.ended_at, logged.ended_at);
    if (!other.previous.has_value()) other.previous = logged.previous;
    other.hull.reset();
    other.body.reset();
    const auto body = database_.bodies_.find(logged.hull_id);
    if (body != database_.bodies_.end()) {
      other.body = body->second;
      other.revision = body->second.record.revision;
    }
    const auto found = database_.hulls_.find(logged.hull_id);
    if (found == database_.hulls_.end()) continue;
    other.hull = found->second.stored;
    other.revision = found->second.stored.record.revision;
  }
  if (known_.peer_changes.by_id.empty()) return;
  known_.peer_changes.revision = known_.revision;
  known_.peer_changes.totals = known_.totals;
}

void SharedStore::StartFetch() {
  Begin("database: receives a request for peer changes since change", known_.seen);
  if (!Scheduler::Current().random().OneIn(database_.faults_.read)) {
    const Known before = known_;
    NotePeerChanges();
    started_ = std::exchange(known_, before);
  }
  End("database: has received the request, at revision, change", absl::OkStatus()).IgnoreError();
}

absl::Status SharedStore::Fetch() {
  Begin("database: fetches peer changes since change", known_.seen);
  absl::Status status;
  // A server that cannot reach the database at its start ends.
  if (std::exchange(has_fetched_, true) &&
      Scheduler::Current().random().OneIn(database_.faults_.read)) {
    ++database_.counts_.failed_reads;
    status = absl::UnavailableError("the database does not answer");
  } else if (started_.has_value()) {
    known_ = *std::move(started_);
  } else {
    NotePeerChanges();
  }
  started_.reset();
  return End("database: has fetched peer changes up to revision, change", status);
}

absl::Status SharedStore::Commit(std::span<Change* const> changes) {
  Begin("database: begins to commit changes:", changes.size());
  if (is_failing_) Scheduler::Current().Fail("a batch arrives after an error without Recover");
  ++database_.counts_.batches;
  const absl::Status status = CommitInTurn(changes);
  NoteEnd(!status.ok());
  if (status.ok()) NotifyPeers();
  return End("database: has committed up to revision, change", status);
}

// No peer commits during the turn, so this is one step.
absl::Status SharedStore::CommitInTurn(std::span<Change* const> changes) {
  const StoreFaults& faults = database_.faults_;
  const auto refuse = [&](absl::Status status) {
    ++database_.counts_.refused;
    return status;
  };
  if (Scheduler::Current().random().OneIn(faults.refused))
    return refuse(absl::UnavailableError("the database cannot be reached"));
  NotePeerChanges();
  std::vector<Change*> kept;
  for (Change* change : changes) {
    if (!known_.peer_changes.by_id.contains(change->id())) kept.push_back(change);
  }
  database_.counts_.superseded += changes.size() - kept.size();
  if (kept.empty()) return absl::OkStatus();
  NumberChanges(kept, known_.revision);
  if (Scheduler::Current().random().OneIn(faults.refused))
    return refuse(absl::UnavailableError("the session ended"));
  if (Scheduler::Current().random().OneIn(faults.full)) {
    database_.was_full_ = true;
    return refuse(absl::ResourceExhaustedError("the disk of the database is full"));
  }
  const bool is_unknown = Scheduler::Current().random().OneIn(faults.unknown);
  if (is_unknown) ++database_.counts_.unknown;
  if (!is_unknown || Scheduler::Current().random().OneIn(2)) {
    for (const Change* change : kept) database_.Keep(*change, is_unknown);
  }
  if (is_unknown) return absl::UnavailableError("the outcome of the commit is unknown");
  known_.seen = database_.log_.size();
  known_.revision = database_.ledger_.revision();
  known_.totals = database_.totals();
  return absl::OkStatus();
}

absl::Status SharedStore::Recover() {
  Begin("database: recovers", 0);
  NoteEnd(false);
  ++database_.counts_.recovered;
  return End("database: has recovered", absl::OkStatus());
}

void SharedStore::NoteEnd(bool failed) {
  if (failed && !is_failing_) ++database_.failing_servers_;
  if (!failed && is_failing_) --database_.failing_servers_;
  is_failing_ = failed;
}

void SharedStore::NotifyPeers() {
  const std::lock_guard lock(database_.servers_mutex_);
  for (SharedStore* server : database_.servers_) {
    if (server != this && server->on_peer_commit_ && Scheduler::Current().random().OneIn(2))
      server->on_peer_commit_();
  }
}

void SharedStore::OnPeerCommit(std::function<void()> committed) {
  const std::lock_guard lock(database_.servers_mutex_);
  on_peer_commit_ = std::move(committed);
}

}  // namespace hulld::server
