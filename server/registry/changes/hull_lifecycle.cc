// Creation, deletion, and replacement of hulls.
#include <absl/strings/str_cat.h>

#include <utility>
#include <vector>

#include "core/base/check.h"
#include "server/contract/error_info.h"
#include "server/registry/catalog/registered_hull.h"
#include "server/registry/changes/hull_changes.h"

namespace hulld::server {
namespace {

// Moves the replacement's vertices into the change. former: null if no hull exists.
Change MakeChange(const RegisteredHull* former, Replacement& replacement) {
  Change change;
  change.begins = true;
  HullRecord& record = change.hull.record;
  record.hull_id = replacement.hull_id;
  record.dimension = replacement.builder->dimension();
  record.vertex_count = replacement.builder->vertex_count();
  record.counts = replacement.counts;
  if (former != nullptr) change.replaced = former->committed();
  if (!replacement.vertices.empty()) {
    change.vertex_change = VertexChange::kReplaced;
    change.vertices = std::move(replacement.vertices);
    change.hull.layout.base_vertices = record.vertex_count;
  }
  return change;
}

// Moves the data back into the replacement for a retry.
void TakeBack(RegisteredHull& hull, Change& change, Replacement& replacement) {
  *replacement.builder = std::move(*hull.LendBuilder().builder);
  replacement.live = hull.live();
  if (change.vertex_change == VertexChange::kReplaced) {
    replacement.vertices = std::move(change.vertices);
  }
}

}  // namespace

void HullChanges::Create(const std::string& id, bool if_absent, Reply<PutHullResult> done) {
  barrier_.WhenFresh(done,
                     [=, this](Locked& locked) { CreateLocked(locked, id, if_absent, done); });
}

void HullChanges::CreateLocked(Locked& locked, const std::string& id, bool if_absent,
                               const Reply<PutHullResult>& done) {
  LockedTask again = [=, this](Locked& later) { CreateLocked(later, id, if_absent, done); };
  if (records_.MustWait(locked, id, RecordReader::For::kLife, done, again)) return;
  const HullPointer existing = state_.catalog.Find(id);
  if (existing == nullptr) {
    return CreateNew(locked, id, [=, this](Locked& later, const absl::StatusOr<HullPointer>& hull) {
      if (Committer::IsSuperseded(hull.status())) return later.AfterwardsLocked(again);
      if (!hull.ok()) return Answer(later, done, hull.status());
      Answer(later, done,
             PutHullResult{state_.catalog.revision(), (*hull)->committed().record, true});
    });
  }
  if (!if_absent) {
    Answer(locked, done,
           WithReason(absl::AlreadyExistsError(absl::StrCat(QuotedHull(id), " already exists")),
                      v1::ERROR_REASON_HULL_EXISTS, {{"hull_id", id}}));
  } else if (existing->state.damaged()) {
    Answer(locked, done, existing->state.damage());
  } else {
    Answer(locked, done,
           PutHullResult{state_.catalog.revision(), existing->committed().record, false});
  }
}

// Creates a hull. done: called with the mutex held when the hull becomes visible, or with an error;
// ABORTED (Committer::IsSuperseded): a peer server changed the ID first. Requires: the ID is known
// to have no hull (checked), and no change of a body with the ID is in flight (not checked: its
// completion would find the hull).
void HullChanges::CreateNew(Locked& locked, const std::string& id, const Creation& done) {
  if (state_.catalog.bodies().contains(id)) return done(locked, IdTaken("body", id));
  if (absl::Status s = state_.catalog.CheckHullCount(); !s.ok()) return done(locked, s);
  Change change;
  change.begins = true;
  change.hull.record.hull_id = id;
  const HullPointer hull = state_.catalog.hulls().Insert(change.hull, HullState::Creating());
  state_.catalog.BeginCreatingHull();
  Submit(locked, hull, std::move(change),
         [this, hull, done](Locked& later, const absl::Status& status, const Change& creation) {
           state_.catalog.EndCreatingHull(later, hull, status);
           if (!status.ok()) return done(later, status);
           state_.ApplyCreation(later, nullptr, hull, creation.hull);
           done(later, hull);
         });
}

void HullChanges::Delete(const std::string& id, std::optional<uint64_t> if_revision,
                         Reply<uint64_t> done) {
  barrier_.WhenFresh(done,
                     [=, this](Locked& locked) { DeleteLocked(locked, id, if_revision, done); });
}

void HullChanges::DeleteLocked(Locked& locked, const std::string& id,
                               std::optional<uint64_t> if_revision, const Reply<uint64_t>& done) {
  LockedTask again = [=, this](Locked& later) { DeleteLocked(later, id, if_revision, done); };
  if (records_.MustWait(locked, id, RecordReader::For::kQuiet, done, again)) return;
  const HullPointer hull = state_.catalog.Find(id);
  if (hull == nullptr) return Answer(locked, done, state_.catalog.NoSuchHull(id));
  const StoredHull& committed = hull->committed();
  const uint64_t revision = committed.record.revision;
  if (if_revision.has_value() && *if_revision != revision) {
    return Answer(locked, done, RevisionMismatch("hull", id, revision, *if_revision));
  }
  Change change;
  change.hull = committed;
  change.deleted = true;
  change.former_layout = committed.layout;
  hull->state.StartEnding();
  Submit(locked, hull, std::move(change),
         [=, this](Locked& later, const absl::Status& status, const Change& deletion) {
           if (Committer::IsSuperseded(status)) return later.AfterwardsLocked(again);
           if (!status.ok()) return Answer(later, done, status);
           state_.ApplyDeletion(later, hull, deletion.revision);
           Answer(later, done, deletion.revision);
         });
}

void HullChanges::Replace(Replacement replacement, Reply<PutHullResult> done) {
  HULLD_CHECK(replacement.builder != nullptr);
  std::vector<Vector> vertices = replacement.builder->Vertices();
  if (state_.store.keeps_hulls()) replacement.vertices = vertices;
  replacement.live =
      std::make_shared<LiveHull>(std::move(vertices), replacement.builder->dimension());
  const auto shared = std::make_shared<Replacement>(std::move(replacement));
  barrier_.WhenFresh(done, [=, this](Locked& locked) { ReplaceLocked(locked, shared, done); });
}

void HullChanges::ReplaceLocked(Locked& locked, const std::shared_ptr<Replacement>& replacement,
                                const Reply<PutHullResult>& done) {
  const std::string& id = replacement->hull_id;
  LockedTask again = [=, this](Locked& later) { ReplaceLocked(later, replacement, done); };
  if (records_.MustWait(locked, id, RecordReader::For::kQuiet, done, std::move(again))) return;
  const HullPointer former = state_.catalog.Find(id);
  if (absl::Status s = CheckReplacement(former.get(), *replacement); !s.ok()) {
    return Answer(locked, done, s);
  }
  CommitReplacement(locked, former, replacement, done);
}

// Returns OK if the replacement is allowed. former: null if no hull exists.
absl::Status HullChanges::CheckReplacement(const RegisteredHull* former,
                                           const Replacement& replacement) const {
  const std::string& id = replacement.hull_id;
  const uint64_t revision = former == nullptr ? 0 : former->committed().record.revision;
  if (replacement.if_revision.value_or(revision) != revision) {
    return RevisionMismatch("hull", id, revision, *replacement.if_revision);
  }
  if (former != nullptr) return absl::OkStatus();
  if (!replacement.create_if_absent) return state_.catalog.NoSuchHull(id);
  if (state_.catalog.bodies().contains(id)) return IdTaken("body", id);
  return state_.catalog.CheckHullCount();
}

// Submits a replacement, moving its builder and points. former: null if no hull exists; otherwise
// quiet.
void HullChanges::CommitReplacement(Locked& locked, const HullPointer& former,
                                    const std::shared_ptr<Replacement>& replacement,
                                    const Reply<PutHullResult>& done) {
  Change change = MakeChange(former.get(), *replacement);
  const auto hull = std::make_shared<RegisteredHull>(change.hull, HullState::Creating(),
                                                     state_.store.keeps_hulls(), state_.memory);
  if (former == nullptr) {
    state_.catalog.hulls().Insert(hull);
    state_.catalog.BeginCreatingHull();
  } else {
    // `hull` enters the catalog when it replaces the former hull.
    former->state.StartEnding();
  }
  hull->SetLive(std::move(replacement->live));
  hull->SetBuilder(std::make_unique<HullBuilder>(std::move(*replacement->builder)));
  Submit(locked, former == nullptr ? hull : former, std::move(change),
         [=, this](Locked& later, const absl::Status& status, Change& replaced) {
           const bool again = Committer::IsSuperseded(status);
           if (again) TakeBack(*hull, replaced, *replacement);
           if (former == nullptr) state_.catalog.EndCreatingHull(later, hull, status);
           if (again) {
             return later.AfterwardsLocked(
                 [=, this](Locked& once_more) { ReplaceLocked(once_more, replacement, done); });
           }
           if (!status.ok()) return Answer(later, done, status);
           state_.ApplyCreation(later, former, hull, replaced.hull);
           hull->DiscardUnneededBuilder(later);
           hull->NoteUse();
           state_.catalog.hulls().RestSoon(later, *hull);
           state_.memory.Evict(later);
           Answer(
               later, done,
               PutHullResult{state_.catalog.revision(), replaced.hull.record, former == nullptr});
         });
}

}  // namespace hulld::server
