#include "server/registry/bodies/body_registry.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/contract/error_info.h"
#include "server/registry/catalog/body.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {

void BodyRegistry::Put(StoredBody stored, std::optional<uint64_t> if_revision,
                       const Reply<PutBodyResult>& done) {
  HULLD_CHECK(!stored.pieces.empty());
  const std::string id = stored.record.body_id;
  const auto body = std::make_shared<Body>(std::move(stored), state_.memory, MemoryUse::kWriting);
  records_.WhenReady(
      id, RecordReader::For::kLife, done, [=, this](Locked& locked, const LockedTask& again) {
        if (absl::Status s = CheckPut(locked, id, if_revision); !s.ok()) {
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
        Submit(locked, std::move(change),
               [=, this](Locked& later, const absl::Status& status, const Change& put) {
                 if (is_new) state_.EndCreatingBody(status.ok());
                 if (Committer::IsSuperseded(status)) return later.AfterwardsLocked(again);
                 if (!status.ok()) return Answer(later, done, status);
                 state_.ApplyBody(later, id, body, put.revision);
                 Answer(later, done,
                        PutBodyResult{state_.revision(), body->record(), body->pieces().size(),
                                      is_new});
               });
      });
}

// Returns OK if the body may be put, including as a replacement.
absl::Status BodyRegistry::CheckPut(Locked& locked, const std::string& id,
                                    std::optional<uint64_t> if_revision) {
  // The body is already counted.
  HULLD_RETURN_IF_ERROR(state_.memory.Check(locked, MemoryUse::kWriting));
  if (state_.hulls.contains(id)) return IdTaken("hull", id);
  const std::shared_ptr<const Body> body = state_.FindBody(id);
  const uint64_t revision = body == nullptr ? 0 : body->record().revision;
  if (if_revision.has_value() && *if_revision != revision) {
    return RevisionMismatch("body", id, revision, *if_revision);
  }
  return body == nullptr ? state_.CheckHullCount() : absl::OkStatus();
}

void BodyRegistry::Delete(const std::string& id, std::optional<uint64_t> if_revision,
                          const Reply<uint64_t>& done) {
  records_.WhenReady(
      id, RecordReader::For::kLife, done, [=, this](Locked& locked, const LockedTask& again) {
        BodyTable::Entry* const entry = state_.bodies.Find(id);
        if (entry == nullptr) return Answer(locked, done, NoSuchBody(id));
        const std::shared_ptr<const Body> body = entry->committed();
        const uint64_t revision = body->record().revision;
        if (if_revision.has_value() && *if_revision != revision) {
          return Answer(locked, done, RevisionMismatch("body", id, revision, *if_revision));
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
      });
}

absl::Status BodyRegistry::NoSuchBody(const std::string& id) const {
  if (!state_.hulls.contains(id)) return BodyNotFound(id);
  return WithReason(absl::NotFoundError(absl::StrCat("\"", id, "\" is a hull, not a body")),
                    v1::ERROR_REASON_BODY_NOT_FOUND, {{"body_id", id}});
}

// finish: called after the change is committed and visible, or refused, before waiting tasks
// resume.
void BodyRegistry::Submit(Locked& locked, Change change, Committer::Completion finish) {
  const std::string id = change.body->record.body_id;
  HULLD_CHECK(!std::exchange(state_.bodies.Find(id)->in_flight, true));
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
  BodyTable::Entry& entry = *state_.bodies.Find(id);
  entry.in_flight = false;
  std::deque<LockedTask> waiting = std::exchange(entry.waiting, {});
  // Either a creation was refused, or a deletion was committed.
  if (entry.committed() == nullptr) state_.EraseBody(locked, id);
  for (LockedTask& next : waiting) {
    if (Committer::IsSuperseded(status)) {
      barrier_.Defer(std::move(next));
    } else {
      next(locked);
    }
  }
  state_.bodies.DropSome(locked);
}

// Looks up kMaxLookupsPerHold bodies per hold and reads the unknown ones together. A reader of
// many bodies may evict them again, so bodies already found are not looked up again.
FoundBodies BodyRegistry::Find(std::span<const std::string> ids,
                               const std::function<bool()>& should_stop, bool may_wait) {
  Locked locked(state_.mutex);
  FoundBodies found;
  found.bodies.resize(ids.size());
  for (size_t first = 0; first < ids.size(); first += kMaxLookupsPerHold) {
    if (first > 0) locked.Yield();
    const size_t end = std::min<size_t>(first + kMaxLookupsPerHold, ids.size());
    for (size_t i = first; i < end; ++i) {
      while (found.status.ok() && !state_.IsKnown(ids[i])) {
        found.status = may_wait
                           ? records_.AwaitMissing(locked, ids.subspan(i, end - i), should_stop)
                           : WouldWait();
      }
      // A body that could not be read may be known by now.
      found.bodies[i] = state_.FindBody(ids[i]);
      locked.NoteLookup();
    }
  }
  found.store_revision = state_.revision();
  return found;
}

}  // namespace hulld::server
