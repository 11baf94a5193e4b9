#include "server/registry/changes/local_changes.h"

#include <absl/strings/str_cat.h>

#include <deque>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/registry/catalog/body.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {
namespace {

// Moves the replacement's vertices into the change. previous: null if no hull exists.
Change MakeChange(const RegisteredHull* previous, Replacement& replacement) {
  Change change;
  change.begins = true;
  HullRecord& record = change.hull.record;
  record.hull_id = replacement.hull_id;
  record.dimension = replacement.builder->dimension();
  record.vertex_count = replacement.builder->vertex_count();
  record.counts = replacement.counts;
  if (previous != nullptr) change.replaced = previous->committed();
  if (!replacement.vertices.empty()) {
    change.vertex_change = VertexChange::kReplaced;
    change.vertices = std::move(replacement.vertices);
    change.hull.layout.base_vertices = record.vertex_count;
  }
  return change;
}

// Moves the data back into the replacement for a retry.
void RestoreReplacement(RegisteredHull& hull, Change& change, Replacement& replacement) {
  *replacement.builder = std::move(*hull.LendBuilder().builder);
  replacement.live = hull.live();
  if (change.vertex_change == VertexChange::kReplaced) {
    replacement.vertices = std::move(change.vertices);
  }
}

// Returns true if a change was refused: runs it again if a peer server superseded it, and answers
// the caller otherwise.
template <typename Refuse>
bool IsRefused(Locked& locked, const absl::Status& status, const LockedTask& again,
               const Refuse& refuse) {
  if (Committer::IsSuperseded(status)) {
    locked.DeferLocked(again);
  } else if (!status.ok()) {
    locked.Defer([=] { refuse(status); });
  }
  return !status.ok();
}

}  // namespace

void LocalChanges::Create(const std::string& id, bool if_absent, const Reply<PutHullResult>& done) {
  records_.WhenReady(
      id, RecordReader::For::kLife, done, [=, this](Locked& locked, const LockedTask& again) {
        const HullPointer existing = state_.Find(id);
        if (existing == nullptr) {
          return CreateNew(
              locked, id, done, again, [=, this](Locked& later, const HullPointer& hull) {
                Answer(later, done,
                       PutHullResult{state_.revision(), hull->committed().record, true});
              });
        }
        if (!if_absent) {
          Answer(locked, done,
                 WithReason(
                     absl::AlreadyExistsError(absl::StrCat(Quoted("hull", id), " already exists")),
                     v1::ERROR_REASON_HULL_EXISTS, {{"hull_id", id}}));
        } else if (existing->state.damaged()) {
          Answer(locked, done, existing->state.damage());
        } else {
          Answer(locked, done,
                 PutHullResult{state_.revision(), existing->committed().record, false});
        }
      });
}

// Creates a hull. done: called with the mutex held when the hull becomes visible. again: called if
// a peer server changed the ID first. Requires: the ID is known to have no hull (checked), and no
// change of a body with the ID is in flight (not checked: its completion would find the hull).
void LocalChanges::CreateNew(Locked& locked, const std::string& id, const Refusal& refuse,
                             const LockedTask& again, const Creation& done) {
  const absl::Status allowed =
      state_.bodies.contains(id) ? IdTaken("body", id) : state_.CheckHullCount();
  if (IsRefused(locked, allowed, again, refuse)) return;
  Change change;
  change.begins = true;
  change.hull.record.hull_id = id;
  const HullPointer hull = state_.hulls.Insert(change.hull, HullState::Creating());
  state_.BeginCreatingHull();
  Submit(locked, hull, std::move(change),
         [=, this](Locked& later, const absl::Status& status, const Change& creation) {
           state_.EndCreatingHull(later, hull, status);
           if (IsRefused(later, status, again, refuse)) return;
           state_.ApplyCreation(later, nullptr, hull, creation.hull);
           done(later, hull);
         });
}

// A hull must be quiet to end; a body always is when it has no change in flight.
void LocalChanges::Delete(const std::string& kind, const std::string& id,
                          std::optional<uint64_t> if_revision, const Reply<uint64_t>& done) {
  const bool is_body = kind == "body";
  const auto need = is_body ? RecordReader::For::kLife : RecordReader::For::kQuiet;
  records_.WhenReady(id, need, done, [=, this](Locked& locked, const LockedTask& again) {
    const HullPointer hull = is_body ? nullptr : state_.Find(id);
    const std::shared_ptr<const Body> body = is_body ? state_.FindBody(id) : nullptr;
    if (hull == nullptr && body == nullptr) {
      return Answer(locked, done, state_.NoSuch(kind, id));
    }
    const uint64_t revision = is_body ? body->record().revision : hull->committed().record.revision;
    if (absl::Status s = CheckRevision(kind, id, revision, if_revision); !s.ok()) {
      return Answer(locked, done, s);
    }
    const auto finish = [=, this](Locked& later, const absl::Status& status,
                                  const Change& deletion) {
      if (IsRefused(later, status, again, done)) return;
      is_body ? state_.ApplyBody(later, id, nullptr, deletion.revision)
              : state_.ApplyDeletion(later, hull, deletion.revision);
      Answer(later, done, deletion.revision);
    };
    Change change;
    change.deleted = true;
    if (is_body) {
      change.body = body->stored();
      return SubmitBody(locked, std::move(change), finish);
    }
    change.hull = hull->committed();
    change.previous_layout = change.hull.layout;
    hull->state.StartEnding();
    Submit(locked, hull, std::move(change), finish);
  });
}

void LocalChanges::Replace(Replacement replacement, const Reply<PutHullResult>& done) {
  HULLD_CHECK(replacement.builder != nullptr);
  std::vector<Vector> vertices = replacement.builder->Vertices();
  if (state_.store.keeps_hulls()) replacement.vertices = vertices;
  replacement.live =
      std::make_shared<LiveHull>(std::move(vertices), replacement.builder->dimension());
  const auto shared = std::make_shared<Replacement>(std::move(replacement));
  records_.WhenReady(shared->hull_id, RecordReader::For::kQuiet, done,
                     [=, this](Locked& locked, const LockedTask& again) {
                       const HullPointer previous = state_.Find(shared->hull_id);
                       const absl::Status allowed = CheckReplacement(previous.get(), *shared);
                       if (!allowed.ok()) return Answer(locked, done, allowed);
                       CommitReplacement(locked, previous, shared, done, again);
                     });
}

// Returns OK if the replacement is allowed. previous: null if no hull exists.
absl::Status LocalChanges::CheckReplacement(const RegisteredHull* previous,
                                            const Replacement& replacement) const {
  const std::string& id = replacement.hull_id;
  const uint64_t revision = previous == nullptr ? 0 : previous->committed().record.revision;
  HULLD_RETURN_IF_ERROR(CheckRevision("hull", id, revision, replacement.if_revision));
  if (previous != nullptr) return absl::OkStatus();
  if (!replacement.create_if_absent) return state_.NoSuch("hull", id);
  if (state_.bodies.contains(id)) return IdTaken("body", id);
  return state_.CheckHullCount();
}

// Submits a replacement, moving its builder and points. previous: null if no hull exists; otherwise
// quiet. again: called if a peer server changed the ID first.
void LocalChanges::CommitReplacement(Locked& locked, const HullPointer& previous,
                                     const std::shared_ptr<Replacement>& replacement,
                                     const Reply<PutHullResult>& done, const LockedTask& again) {
  Change change = MakeChange(previous.get(), *replacement);
  const auto hull = std::make_shared<RegisteredHull>(change.hull, HullState::Creating(),
                                                     state_.store.keeps_hulls(), state_.memory);
  if (previous == nullptr) {
    state_.hulls.Insert(hull);
    state_.BeginCreatingHull();
  } else {
    // `hull` enters the table when it replaces the previous hull.
    previous->state.StartEnding();
  }
  hull->SetLive(std::move(replacement->live));
  hull->SetBuilder(std::make_unique<HullBuilder>(std::move(*replacement->builder)));
  Submit(locked, previous == nullptr ? hull : previous, std::move(change),
         [=, this](Locked& later, const absl::Status& status, Change& replaced) {
           if (Committer::IsSuperseded(status)) RestoreReplacement(*hull, replaced, *replacement);
           if (previous == nullptr) state_.EndCreatingHull(later, hull, status);
           if (IsRefused(later, status, again, done)) return;
           state_.ApplyCreation(later, previous, hull, replaced.hull);
           hull->DiscardUnneededBuilder(later);
           hull->NoteUse();
           state_.hulls.RestSoon(later, *hull);
           state_.memory.Evict(later);
           Answer(later, done,
                  PutHullResult{state_.revision(), replaced.hull.record, previous == nullptr});
         });
}

void LocalChanges::PutBody(StoredBody stored, std::optional<uint64_t> if_revision,
                           const Reply<PutBodyResult>& done) {
  HULLD_CHECK(!stored.pieces.empty());
  const std::string id = stored.record.body_id;
  const auto body = std::make_shared<Body>(std::move(stored), state_.memory, MemoryUse::kWriting);
  records_.WhenReady(
      id, RecordReader::For::kLife, done, [=, this](Locked& locked, const LockedTask& again) {
        if (absl::Status s = CheckPutBody(locked, id, if_revision); !s.ok()) {
          return Answer(locked, done, s);
        }
        const bool is_new = !state_.bodies.contains(id);
        const BodyTable::Entry& entry = state_.bodies.Add(id);
        state_.hulls.ForgetAbsent(id);
        if (is_new) state_.BeginCreatingBody();
        Change change;
        change.body = body->stored();
        uint64_t& created = change.body->record.create_revision;
        created = is_new ? 0 : entry.committed()->record().create_revision;
        // A damaged body starts over.
        change.begins = created == 0;
        change.replaces_body = change.begins && !is_new;
        SubmitBody(
            locked, std::move(change),
            [=, this](Locked& later, const absl::Status& status, const Change& put) {
              if (is_new) state_.EndCreatingBody(status.ok());
              if (IsRefused(later, status, again, done)) return;
              state_.ApplyBody(later, id, body, put.revision);
              Answer(later, done, PutBodyResult{state_.revision(), body->Describe(), is_new});
            });
      });
}

// Returns OK if the body may be put, including as a replacement.
absl::Status LocalChanges::CheckPutBody(Locked& locked, const std::string& id,
                                        std::optional<uint64_t> if_revision) {
  // The body is already counted.
  HULLD_RETURN_IF_ERROR(state_.memory.Check(locked, MemoryUse::kWriting));
  if (state_.hulls.contains(id)) return IdTaken("hull", id);
  const std::shared_ptr<const Body> body = state_.FindBody(id);
  const uint64_t revision = body == nullptr ? 0 : body->record().revision;
  HULLD_RETURN_IF_ERROR(CheckRevision("body", id, revision, if_revision));
  return body == nullptr ? state_.CheckHullCount() : absl::OkStatus();
}

// Submits a change of a body. finish: called after the change is committed and visible, or refused,
// before waiting tasks resume.
void LocalChanges::SubmitBody(Locked& locked, Change change, Committer::Completion finish) {
  const std::string id = change.body->record.body_id;
  HULLD_CHECK(!std::exchange(state_.bodies.Find(id)->in_flight, true));
  committer_.Submit(locked, std::move(change),
                    [this, id, finish = std::move(finish)](
                        Locked& later, const absl::Status& status, Change& committed) {
                      finish(later, status, committed);
                      BodyTable::Entry& entry = *state_.bodies.Find(id);
                      entry.in_flight = false;
                      std::deque<LockedTask> waiting = std::exchange(entry.waiting, {});
                      // Either a creation was refused, or a deletion was committed.
                      if (entry.committed() == nullptr) state_.EraseBody(later, id);
                      for (LockedTask& next : waiting) {
                        // The peer change must be applied first.
                        Committer::IsSuperseded(status) ? peers_.Defer(std::move(next))
                                                        : next(later);
                      }
                      state_.bodies.DropSome(later);
                    });
}

// Submits a change that follows all earlier changes of its hull. Requires: the state of `hull`
// counts it as in flight. finish: called after the state's transition, before waiting tasks resume.
void LocalChanges::Submit(Locked& locked, const HullPointer& hull, Change change,
                          Committer::Completion finish) {
  HULLD_CHECK(hull->state.in_flight() > 0);
  const auto charge = std::make_shared<MemoryCharge>(state_.memory, MemoryUse::kWriting,
                                                     change.vertices.capacity() * sizeof(Vector));
  committer_.Submit(locked, std::move(change),
                    [this, hull, charge, finish = std::move(finish)](
                        Locked& later, const absl::Status& status, Change& committed) {
                      charge->Set(0);
                      status.ok() ? hull->state.Commit() : hull->state.Refuse();
                      finish(later, status, committed);
                      // The peer change must be applied first.
                      if (Committer::IsSuperseded(status)) return DeferAdvance(hull);
                      // A hull at rest may be evicted.
                      if (hull->state.quiet() && !hull->state.gone()) {
                        hull->DiscardUnneededBuilder(later);
                        hull->NoteUse();
                        state_.memory.Evict(later);
                      }
                      Advance(later, hull);
                      state_.hulls.RestSome(later);
                    });
}

// Resumes the tasks that wait for the hull. is_last: true if the release of the mutex is the last
// action of a task of the writers.
void LocalChanges::Advance(Locked& locked, const HullPointer& hull, bool is_last) {
  hull->changed.notify_all();
  while (hull->state.quiet() && !hull->exclusive.empty()) {
    const auto next = std::move(hull->exclusive.front());
    hull->exclusive.pop_front();
    next(locked);
  }
  if (hull->chunks.empty()) return;
  if (hull->state.gone() || hull->state.damaged()) {
    // A thread at work calls this again when it ends.
    if (hull->state.work() != HullState::Work::kIdle) return;
    // Replies must run on a thread other than the caller's.
    writers_.Submit([this, hull] { RefuseChunks(hull); }, hull->chunks.front().session.client);
    return;
  }
  if (!hull->state.can_schedule() || !hull->exclusive.empty()) return;
  const PendingChunk& next = hull->chunks.front();
  const bool repeated = next.chunk.sequence <= hull->HeadSequence(next.session.writer_id);
  // These chunks depend on the committed state.
  if (hull->state.in_flight() > 0 && (repeated || next.chunk.if_revision.has_value())) return;
  hull->state.Schedule();
  // The task acquires the mutex, so it would only wait if it started before the release.
  locked.Defer([this, hull, is_last, client = next.session.client] {
    writers_.Submit([this, hull] { RunNextChunk(hull); }, client, is_last);
  });
}

void LocalChanges::DeferAdvance(const HullPointer& hull) {
  peers_.Defer([this, hull](Locked& later) { Advance(later, hull); });
}

}  // namespace hulld::server
