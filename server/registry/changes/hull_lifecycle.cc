#include "server/registry/changes/hull_lifecycle.h"

#include <absl/strings/str_cat.h>

#include <utility>
#include <vector>

#include "core/base/check.h"
#include "server/contract/error_info.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {

void HullLifecycle::Create(const std::string& id, bool if_absent, Reply<CreateResult> done) {
  freshness_.WhenFresh(done,
                       [=, this](Locked& locked) { CreateLocked(locked, id, if_absent, done); });
}

void HullLifecycle::CreateLocked(Locked& locked, const std::string& id, bool if_absent,
                                 const Reply<CreateResult>& done) {
  if (!catalog_.IsKnown(id)) {
    return records_.WhenKnown(
        locked, id, done, [=, this](Locked& later) { CreateLocked(later, id, if_absent, done); });
  }
  if (BodyTable::Entry* const body = catalog_.BodyInFlight(id); body != nullptr) {
    body->waiting.push_back([=, this](Locked& later) { CreateLocked(later, id, if_absent, done); });
    return;
  }
  const HullPointer existing = catalog_.Find(id);
  if (existing == nullptr) {
    return CreateNew(locked, id, [=, this](Locked& later, const absl::StatusOr<HullPointer>& hull) {
      if (Committer::IsSuperseded(hull.status())) {
        return later.AfterwardsLocked(
            [=, this](Locked& again) { CreateLocked(again, id, if_absent, done); });
      }
      if (!hull.ok()) return Answer<CreateResult>(later, done, hull.status());
      Answer<CreateResult>(later, done,
                           CreateResult{catalog_.revision(), (*hull)->committed.record, true});
    });
  }
  if (existing->state.changing_life()) {
    existing->exclusive.push_back(
        [=, this](Locked& later) { CreateLocked(later, id, if_absent, done); });
  } else if (!if_absent) {
    Answer<CreateResult>(
        locked, done,
        WithReason(absl::AlreadyExistsError(absl::StrCat(
                       QuotedHull(id), " exists; delete it first, or set if_absent to use it")),
                   v1::ERROR_REASON_HULL_EXISTS, {{"hull_id", id}}));
  } else if (existing->state.damaged()) {
    Answer<CreateResult>(locked, done, existing->state.damage());
  } else {
    Answer<CreateResult>(locked, done,
                         CreateResult{catalog_.revision(), existing->committed.record, false});
  }
}

void HullLifecycle::CreateNew(
    Locked& locked, const std::string& id,
    const std::function<void(Locked&, absl::StatusOr<HullPointer>)>& done) {
  if (catalog_.bodies().contains(id)) return done(locked, BodyExists(id));
  if (absl::Status s = catalog_.CheckHullCount(); !s.ok()) return done(locked, s);
  Change change;
  change.begins = true;
  change.hull.record.hull_id = id;
  const HullPointer hull = catalog_.hulls().Insert(change.hull, HullState::Creating());
  catalog_.BeginCreatingHull();
  changes_.Submit(
      locked, hull, std::move(change),
      [this, hull, done](Locked& later, const absl::Status& status, const Change& creation) {
        catalog_.EndCreatingHull(status.ok());
        if (!status.ok()) {
          catalog_.Forget(later, hull, status);
          return done(later, status);
        }
        hull->SetStored(creation.hull);
        catalog_.Publish(hull->committed.record.revision);
        catalog_.NoteChange(*hull);
        feed_.NoteCreated(later, hull);
        done(later, hull);
      });
}

void HullLifecycle::Delete(const std::string& id, std::optional<uint64_t> if_revision,
                           Reply<uint64_t> done) {
  freshness_.WhenFresh(done,
                       [=, this](Locked& locked) { DeleteLocked(locked, id, if_revision, done); });
}

void HullLifecycle::DeleteLocked(Locked& locked, const std::string& id,
                                 std::optional<uint64_t> if_revision, const Reply<uint64_t>& done) {
  if (!catalog_.IsKnown(id)) {
    return records_.WhenKnown(
        locked, id, done, [=, this](Locked& later) { DeleteLocked(later, id, if_revision, done); });
  }
  const HullPointer hull = catalog_.Find(id);
  if (hull == nullptr) return Answer<uint64_t>(locked, done, catalog_.NoSuchHull(id));
  if (!hull->state.quiet()) {
    hull->exclusive.push_back(
        [=, this](Locked& later) { DeleteLocked(later, id, if_revision, done); });
    return;
  }
  const StoredHull& committed = hull->committed;
  if (if_revision.has_value() && *if_revision != committed.record.revision) {
    return Answer<uint64_t>(locked, done, RevisionMismatch(committed.record, *if_revision));
  }
  Change change;
  change.hull = committed;
  change.deleted = true;
  change.former_layout = committed.layout;
  hull->state.StartEnding();
  changes_.Submit(locked, hull, std::move(change),
                  [=, this](Locked& later, const absl::Status& status, const Change& deletion) {
                    if (Committer::IsSuperseded(status)) {
                      return later.AfterwardsLocked(
                          [=, this](Locked& again) { DeleteLocked(again, id, if_revision, done); });
                    }
                    if (!status.ok()) return Answer<uint64_t>(later, done, status);
                    const uint64_t revision = deletion.revision;
                    catalog_.Publish(revision);
                    catalog_.NoteVertices(hull->committed.record.vertex_count, 0);
                    catalog_.NoteHullEnded();
                    catalog_.NoteChange(*hull);
                    feed_.NoteDeleted(later, hull->committed.record, revision);
                    catalog_.Forget(later, hull, Gone(hull->committed.record.hull_id, "deleted"));
                    Answer<uint64_t>(later, done, revision);
                  });
}

void HullLifecycle::Replace(Replacement replacement, Reply<ReplaceResult> done) {
  HULLD_CHECK(replacement.builder != nullptr);
  std::vector<Vector> vertices = replacement.builder->Vertices();
  if (store_.keeps_hulls()) replacement.vertices = vertices;
  replacement.live =
      std::make_shared<LiveHull>(std::move(vertices), replacement.builder->dimension());
  const auto shared = std::make_shared<Replacement>(std::move(replacement));
  freshness_.WhenFresh(done, [=, this](Locked& locked) { ReplaceLocked(locked, shared, done); });
}

void HullLifecycle::ReplaceLocked(Locked& locked, const std::shared_ptr<Replacement>& replacement,
                                  const Reply<ReplaceResult>& done) {
  const std::string& id = replacement->hull_id;
  if (!catalog_.IsKnown(id)) {
    return records_.WhenKnown(
        locked, id, done, [=, this](Locked& later) { ReplaceLocked(later, replacement, done); });
  }
  if (BodyTable::Entry* const body = catalog_.BodyInFlight(id); body != nullptr) {
    body->waiting.push_back([=, this](Locked& later) { ReplaceLocked(later, replacement, done); });
    return;
  }
  const HullPointer former = catalog_.Find(id);
  if (former != nullptr && !former->state.quiet()) {
    former->exclusive.push_back(
        [=, this](Locked& later) { ReplaceLocked(later, replacement, done); });
    return;
  }
  if (absl::Status s = CheckReplacement(former.get(), *replacement); !s.ok()) {
    return Answer<ReplaceResult>(locked, done, s);
  }
  CommitReplacement(locked, former, replacement, done);
}

// Returns OK if the replacement is allowed. former: null if no hull exists.
absl::Status HullLifecycle::CheckReplacement(const RegisteredHull* former,
                                             const Replacement& replacement) const {
  const std::string& id = replacement.hull_id;
  const std::optional<uint64_t>& if_revision = replacement.if_revision;
  if (former != nullptr) {
    if (!if_revision.has_value() || *if_revision == former->committed.record.revision) {
      return absl::OkStatus();
    }
    return RevisionMismatch(former->committed.record, *if_revision);
  }
  if (if_revision.value_or(0) != 0) {
    return WithReason(
        absl::AbortedError(absl::StrCat(QuotedHull(id), " does not exist, so it is not at ",
                                        "revision ", *if_revision, " (if_revision)")),
        v1::ERROR_REASON_REVISION_MISMATCH,
        {{"hull_id", id}, {"if_revision", *if_revision}, {"current_revision", uint64_t{0}}});
  }
  if (!replacement.create_if_absent) return catalog_.NoSuchHull(id);
  if (catalog_.bodies().contains(id)) return BodyExists(id);
  return catalog_.CheckHullCount();
}

// Moves the replacement's vertices into the change. former: null if no hull exists.
Change HullLifecycle::MakeChange(const RegisteredHull* former, Replacement& replacement) {
  Change change;
  change.begins = true;
  HullRecord& record = change.hull.record;
  record.hull_id = replacement.hull_id;
  record.dimension = replacement.builder->dimension();
  record.vertex_count = replacement.builder->vertex_count();
  record.counts = replacement.counts;
  if (former != nullptr) change.replaced = former->committed;
  if (!replacement.vertices.empty()) {
    change.vertex_change = VertexChange::kReplaced;
    change.vertices = std::move(replacement.vertices);
    change.hull.layout.base_vertices = record.vertex_count;
  }
  return change;
}

// Submits a replacement, moving its builder and points. former: null if no hull exists; otherwise
// quiet.
void HullLifecycle::CommitReplacement(Locked& locked, const HullPointer& former,
                                      const std::shared_ptr<Replacement>& replacement,
                                      const Reply<ReplaceResult>& done) {
  Change change = MakeChange(former.get(), *replacement);
  HullPointer hull;
  if (former == nullptr) {
    hull = catalog_.hulls().Insert(change.hull, HullState::Creating());
    catalog_.BeginCreatingHull();
  } else {
    // Not in the catalog until it replaces the former hull.
    hull = std::make_shared<RegisteredHull>(change.hull, HullState::Creating(),
                                            store_.keeps_hulls(), memory_);
    former->state.StartEnding();
  }
  hull->SetLive(std::move(replacement->live));
  hull->builder = std::make_unique<HullBuilder>(std::move(*replacement->builder));
  hull->builder_bytes = hull->builder->MemoryBytes();
  changes_.Submit(locked, former == nullptr ? hull : former, std::move(change),
                  [=, this](Locked& later, const absl::Status& status, Change& replaced) {
                    const bool again = Committer::IsSuperseded(status);
                    if (again) TakeBack(*hull, replaced, *replacement);
                    absl::StatusOr<ReplaceResult> result =
                        FinishReplacement(later, former, hull, status, replaced);
                    if (!again) return Answer(later, done, std::move(result));
                    later.AfterwardsLocked([=, this](Locked& once_more) {
                      ReplaceLocked(once_more, replacement, done);
                    });
                  });
}

// Moves the data back into the replacement for a retry.
void HullLifecycle::TakeBack(RegisteredHull& hull, Change& change, Replacement& replacement) {
  *replacement.builder = std::move(*hull.builder);
  replacement.live = hull.live;
  if (change.vertex_change == VertexChange::kReplaced) {
    replacement.vertices = std::move(change.vertices);
  }
}

// hull: replaces `former`, which may be null, if `status` is OK.
absl::StatusOr<ReplaceResult> HullLifecycle::FinishReplacement(Locked& locked,
                                                               const HullPointer& former,
                                                               const HullPointer& hull,
                                                               const absl::Status& status,
                                                               const Change& change) {
  if (status.ok()) hull->SetStored(change.hull);
  const HullRecord& record = hull->committed.record;
  if (former == nullptr) {
    catalog_.EndCreatingHull(status.ok());
    if (!status.ok()) catalog_.Forget(locked, hull, status);
  } else if (status.ok()) {
    hull->state.Commit();
    catalog_.NoteVertices(former->committed.record.vertex_count, 0);
    catalog_.Forget(locked, former, Gone(record.hull_id, "replaced"));
    catalog_.hulls().Insert(hull);
  }
  if (!status.ok()) return status;
  catalog_.NoteVertices(0, record.vertex_count);
  catalog_.Publish(record.revision);
  catalog_.NoteChange(*hull);
  if (former == nullptr) {
    feed_.NoteCreated(locked, hull);
  } else {
    feed_.NoteReplaced(locked, hull);
  }
  hull->NoteUse();
  memory_.Evict(locked);
  return ReplaceResult{catalog_.revision(), record, former == nullptr};
}

}  // namespace hulld::server
