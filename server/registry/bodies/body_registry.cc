#include "server/registry/bodies/body_registry.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "server/contract/error_info.h"
#include "server/contract/limit_error.h"
#include "server/registry/catalog/body.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {
void BodyRegistry::Put(StoredBody body, std::optional<uint64_t> if_revision,
                       Reply<PutBodyResult> done) {
  HULLD_CHECK(!body.pieces.empty());
  const auto shared = std::make_shared<Body>(std::move(body), state_.memory, MemoryUse::kWriting);
  barrier_.WhenFresh(done, [=, this](Locked& locked) {
    // The body is already counted. A retry after a wait does not count it twice.
    if (absl::Status s = state_.memory.Check(locked, MemoryUse::kWriting); !s.ok()) {
      return Answer(locked, done, s);
    }
    PutLocked(locked, shared, if_revision, done);
  });
}

// Returns OK if the body may be put, including as a replacement.
absl::Status BodyRegistry::CheckPut(const std::string& id, std::optional<uint64_t> if_revision) {
  if (state_.catalog.hulls().contains(id)) return IdTaken("hull", id);
  const std::shared_ptr<const Body> body = state_.catalog.FindBody(id);
  const uint64_t revision = body == nullptr ? 0 : body->record().revision;
  if (if_revision.has_value() && *if_revision != revision) {
    return RevisionMismatch("body", id, revision, *if_revision);
  }
  return body == nullptr ? state_.catalog.CheckHullCount() : absl::OkStatus();
}

void BodyRegistry::PutLocked(Locked& locked, const std::shared_ptr<Body>& body,
                             std::optional<uint64_t> if_revision,
                             const Reply<PutBodyResult>& done) {
  const std::string& id = body->record().body_id;
  LockedTask again = [=, this](Locked& later) { PutLocked(later, body, if_revision, done); };
  if (records_.MustWait(locked, id, RecordReader::For::kLife, done, again)) return;
  if (absl::Status s = CheckPut(id, if_revision); !s.ok()) {
    return Answer(locked, done, s);
  }
  const bool is_new = !state_.catalog.bodies().contains(id);
  const BodyTable::Entry& entry = state_.catalog.bodies().Add(id);
  state_.catalog.hulls().ForgetAbsent(id);
  if (is_new) state_.catalog.BeginCreatingBody();
  Change change;
  change.body = body->stored();
  uint64_t& created = change.body->record.create_revision;
  created = is_new ? 0 : entry.committed()->record().create_revision;
  // A damaged body starts over.
  change.begins = created == 0;
  change.replaces_body = change.begins && !is_new;
  Submit(locked, std::move(change),
         [=, this](Locked& later, const absl::Status& status, const Change& put) {
           if (is_new) state_.catalog.EndCreatingBody(status.ok());
           if (Committer::IsSuperseded(status)) return later.AfterwardsLocked(again);
           if (!status.ok()) return Answer(later, done, status);
           const BodyRecord& record = body->record();
           state_.ApplyBody(later, record.body_id, body, put.revision);
           Answer(later, done,
                  PutBodyResult{state_.catalog.revision(), record, body->pieces().size(), is_new});
         });
}

void BodyRegistry::Delete(const std::string& id, std::optional<uint64_t> if_revision,
                          Reply<uint64_t> done) {
  barrier_.WhenFresh(done,
                     [=, this](Locked& locked) { DeleteLocked(locked, id, if_revision, done); });
}

void BodyRegistry::DeleteLocked(Locked& locked, const std::string& id,
                                std::optional<uint64_t> if_revision, const Reply<uint64_t>& done) {
  LockedTask again = [=, this](Locked& later) { DeleteLocked(later, id, if_revision, done); };
  if (records_.MustWait(locked, id, RecordReader::For::kLife, done, again)) return;
  BodyTable::Entry* const entry = state_.catalog.bodies().Find(id);
  if (entry == nullptr) {
    const absl::Status missing =
        state_.catalog.hulls().contains(id)
            ? WithReason(absl::NotFoundError(absl::StrCat("\"", id, "\" is a hull, not a body")),
                         v1::ERROR_REASON_BODY_NOT_FOUND, {{"body_id", id}})
            : BodyNotFound(id);
    return Answer(locked, done, missing);
  }
  const std::shared_ptr<const Body> body = entry->committed();
  if (if_revision.has_value() && *if_revision != body->record().revision) {
    return Answer(locked, done,
                  RevisionMismatch("body", id, body->record().revision, *if_revision));
  }
  Change change;
  change.deleted = true;
  change.body = body->stored();
  Submit(locked, std::move(change),
         [=, this](Locked& later, const absl::Status& status, const Change& deletion) {
           if (Committer::IsSuperseded(status)) return later.AfterwardsLocked(again);
           if (!status.ok()) return Answer(later, done, status);
           state_.ApplyBody(later, id, nullptr, deletion.revision);
           Answer(later, done, deletion.revision);
         });
}

// finish: called after the change is committed and visible, or refused, before waiting tasks
// resume.
void BodyRegistry::Submit(Locked& locked, Change change, Committer::Completion finish) {
  const std::string id = change.body->record.body_id;
  HULLD_CHECK(!std::exchange(state_.catalog.bodies().Find(id)->in_flight, true));
  committer_.Submit(locked, std::move(change),
                    [this, id, finish = std::move(finish)](
                        Locked& later, const absl::Status& status, Change& committed) {
                      Complete(later, id, finish, status, committed);
                    });
}

void BodyRegistry::Complete(Locked& locked, const std::string& id,
                            const Committer::Completion& finish, const absl::Status& status,
                            Change& change) {
  finish(locked, status, change);
  BodyTable::Entry& entry = *state_.catalog.bodies().Find(id);
  entry.in_flight = false;
  std::deque<LockedTask> waiting = std::exchange(entry.waiting, {});
  // Either a creation was refused, or a deletion was committed.
  if (entry.committed() == nullptr) state_.catalog.EraseBody(locked, id);
  for (LockedTask& next : waiting) {
    if (Committer::IsSuperseded(status)) {
      barrier_.Defer(std::move(next));
    } else {
      next(locked);
    }
  }
  state_.catalog.bodies().DropSome(locked);
}

// Looks up kMaxLookupsPerHold bodies per hold and reads the unknown ones together. A reader of
// many bodies may evict them again, so bodies already found are not looked up again. Returns
// nullopt if it would have to wait but may not.
std::optional<FoundBodies> BodyRegistry::Find(Locked& locked, std::span<const std::string> ids,
                                              const std::function<bool()>& should_stop,
                                              bool may_wait) {
  FoundBodies found;
  found.bodies.resize(ids.size());
  for (size_t first = 0; first < ids.size(); first += kMaxLookupsPerHold) {
    if (first > 0) locked.Yield();
    const size_t end = std::min<size_t>(first + kMaxLookupsPerHold, ids.size());
    for (size_t i = first; i < end; ++i) {
      while (found.status.ok() && !state_.catalog.IsKnown(ids[i])) {
        if (!may_wait) return std::nullopt;
        found.status = records_.AwaitMissing(locked, ids.subspan(i, end - i), should_stop);
      }
      // A body that could not be read may be known by now.
      found.bodies[i] = state_.catalog.FindBody(ids[i]);
      locked.NoteLookup();
    }
  }
  found.store_revision = state_.catalog.revision();
  return found;
}

FoundBodies BodyRegistry::Find(std::span<const std::string> ids,
                               const std::function<bool()>& should_stop) {
  Locked locked(state_.mutex);
  return *Find(locked, ids, should_stop, true);
}

std::optional<FoundBodies> BodyRegistry::TryFind(std::span<const std::string> ids) {
  Locked locked(state_.mutex);
  return Find(locked, ids, {}, false);
}

}  // namespace hulld::server
