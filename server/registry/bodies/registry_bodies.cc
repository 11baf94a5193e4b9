// Bodies: which there are, and how they begin, change and end. A body is small beside the hulls of
// its pieces, so all of it is in memory at all times, counted as what calls hold for long is.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "core/base/check.h"
#include "server/contract/error_info.h"
#include "server/contract/limit_error.h"
#include "server/registry/body.h"
#include "server/registry/registered_hull.h"
#include "server/registry/registry.h"

namespace hulld::server {
namespace {

absl::Status BodyMismatch(const std::string& id, uint64_t revision, uint64_t if_revision) {
  const std::string found =
      revision == 0 ? absl::StrCat(" does not exist, so it is not at revision ", if_revision)
                    : absl::StrCat(" is at revision ", revision, ", not ", if_revision);
  return WithReason(
      absl::AbortedError(
          absl::StrCat(QuotedBody(id), found, " (if_revision); read it again, then retry")),
      v1::ERROR_REASON_REVISION_MISMATCH,
      {{"body_id", id}, {"if_revision", if_revision}, {"current_revision", revision}});
}

absl::Status HullHasTheId(const std::string& id) {
  return WithReason(absl::AlreadyExistsError(absl::StrCat(
                        "\"", id,
                        "\" is a hull, and hulls and bodies share their IDs; choose another ID, or "
                        "delete the hull first")),
                    v1::ERROR_REASON_HULL_EXISTS, {{"hull_id", id}});
}

}  // namespace

absl::Status Registry::LoadBodies() {
  return store_.ForEachBody([this](const std::string& id, absl::StatusOr<StoredBody> stored) {
    // Two records of one ID are not written; the hull is kept, as its vertices cannot be had again.
    if (hulls_.contains(id)) {
      spdlog::error("the store holds a body under the ID of hull \"{}\"; it is left alone", id);
      return;
    }
    std::shared_ptr<const Body> body;
    if (stored.ok()) {
      body = std::make_shared<const Body>(*std::move(stored), memory_);
    } else {
      spdlog::error("{}", std::string(stored.status().message()));
      ++cache_.damaged;
      body = std::make_shared<const Body>(id, stored.status(), memory_);
    }
    bodies_[id].committed = std::move(body);
    ++body_count_;
  });
}

// NOT_FOUND, which says so where the ID is a body's.
absl::Status Registry::NoSuchHull(const std::string& id) const {
  if (!bodies_.contains(id)) return HullNotFound(id);
  return WithReason(absl::NotFoundError(absl::StrCat(
                        "\"", id, "\" is a body, not a hull; this is for hulls alone")),
                    v1::ERROR_REASON_HULL_NOT_FOUND, {{"hull_id", id}});
}

void Registry::PutBody(StoredBody body, std::optional<uint64_t> if_revision,
                       Reply<PutBodyResult> done) {
  HULLD_CHECK(!body.pieces.empty());
  const auto shared = std::make_shared<Body>(std::move(body), memory_);
  WhenFresh(done, [=, this](Locked& locked) {
    // Counted by now. What waits for others is not counted twice.
    if (absl::Status s = memory_.Check(locked, MemoryUse::kWriting); !s.ok()) {
      return Answer<PutBodyResult>(locked, done, s);
    }
    PutBodyLocked(locked, shared, if_revision, done);
  });
}

// Whether a body may be put. OK also where it takes the place of another.
absl::Status Registry::CheckBody(Locked&, const std::string& id,
                                 std::optional<uint64_t> if_revision) {
  if (hulls_.contains(id)) return HullHasTheId(id);
  const auto found = bodies_.find(id);
  const uint64_t revision = found == bodies_.end() ? 0 : found->second.committed->record().revision;
  if (if_revision.has_value() && *if_revision != revision) {
    return BodyMismatch(id, revision, *if_revision);
  }
  return found == bodies_.end() ? CheckHullCount() : absl::OkStatus();
}

void Registry::PutBodyLocked(Locked& locked, const std::shared_ptr<Body>& body,
                             std::optional<uint64_t> if_revision,
                             const Reply<PutBodyResult>& done) {
  const std::string& id = body->record().body_id;
  if (const auto found = bodies_.find(id); found != bodies_.end() && found->second.in_flight) {
    found->second.waiting.push_back(
        [=, this](Locked& later) { PutBodyLocked(later, body, if_revision, done); });
    return;
  }
  if (!IsKnown(id)) {
    return WhenKnown(locked, id, done,
                     [=, this](Locked& later) { PutBodyLocked(later, body, if_revision, done); });
  }
  if (absl::Status s = CheckBody(locked, id, if_revision); !s.ok()) {
    return Answer<PutBodyResult>(locked, done, s);
  }
  const auto [entry, is_new] = bodies_.try_emplace(id);
  if (is_new) ++body_count_;
  Change change;
  change.body = body->stored();
  uint64_t& created = change.body->record.create_revision;
  created = is_new ? 0 : entry->second.committed->record().create_revision;
  // One that was damaged begins anew.
  change.begins = created == 0;
  SubmitBody(locked, std::move(change),
             [=, this, is_new = is_new](Locked& later, const absl::Status& status, const Change&) {
               if (Committer::IsSuperseded(status)) {
                 return Again(later, [=, this](Locked& again) {
                   PutBodyLocked(again, body, if_revision, done);
                 });
               }
               const BodyRecord& record = body->record();
               if (!status.ok()) return Answer<PutBodyResult>(later, done, status);
               later.Discard(std::exchange(bodies_.at(record.body_id).committed, body));
               Answer<PutBodyResult>(
                   later, done, PutBodyResult{revision_, record, body->pieces().size(), is_new});
             });
}

void Registry::DeleteBody(const std::string& id, std::optional<uint64_t> if_revision,
                          Reply<uint64_t> done) {
  WhenFresh(done, [=, this](Locked& locked) { DeleteBodyLocked(locked, id, if_revision, done); });
}

void Registry::DeleteBodyLocked(Locked& locked, const std::string& id,
                                std::optional<uint64_t> if_revision, const Reply<uint64_t>& done) {
  if (!IsKnown(id)) {
    return WhenKnown(locked, id, done,
                     [=, this](Locked& later) { DeleteBodyLocked(later, id, if_revision, done); });
  }
  const auto found = bodies_.find(id);
  if (found == bodies_.end()) {
    const absl::Status missing =
        hulls_.contains(id)
            ? WithReason(absl::NotFoundError(absl::StrCat("\"", id, "\" is a hull, not a body")),
                         v1::ERROR_REASON_BODY_NOT_FOUND, {{"body_id", id}})
            : BodyNotFound(id);
    return Answer<uint64_t>(locked, done, missing);
  }
  if (found->second.in_flight) {
    found->second.waiting.push_back(
        [=, this](Locked& later) { DeleteBodyLocked(later, id, if_revision, done); });
    return;
  }
  const std::shared_ptr<const Body> body = found->second.committed;
  if (if_revision.has_value() && *if_revision != body->record().revision) {
    return Answer<uint64_t>(locked, done, BodyMismatch(id, body->record().revision, *if_revision));
  }
  Change change;
  change.deleted = true;
  change.body = body->stored();
  SubmitBody(locked, std::move(change),
             [=, this](Locked& later, const absl::Status& status, const Change& deletion) {
               if (Committer::IsSuperseded(status)) {
                 return Again(later, [=, this](Locked& again) {
                   DeleteBodyLocked(again, id, if_revision, done);
                 });
               }
               if (!status.ok()) return Answer<uint64_t>(later, done, status);
               later.Discard(std::exchange(bodies_.at(id).committed, nullptr));
               Answer<uint64_t>(later, done, deletion.revision);
             });
}

// finish: called once the change is committed and visible, or refused, before what waits for the
// body goes on.
void Registry::SubmitBody(Locked& locked, Change change, Committer::Completion finish) {
  const std::string id = change.body->record.body_id;
  HULLD_CHECK(!std::exchange(bodies_.at(id).in_flight, true));
  committer_.Submit(locked, std::move(change),
                    [this, id, finish = std::move(finish)](
                        Locked& later, const absl::Status& status, Change& committed) {
                      const std::shared_ptr<const Body> former = bodies_.at(id).committed;
                      if (status.ok()) Publish(committed.revision);
                      // Where readers look for a hull with this ID.
                      if (status.ok()) recent_changes_.Note(id);
                      finish(later, status, committed);
                      RegisteredBody& body = bodies_.at(id);
                      if (status.ok() && body.committed != nullptr) {
                        feed_.NoteBodyPut(later, former, body.committed);
                      } else if (status.ok()) {
                        feed_.NoteBodyDeleted(later, *former, committed.revision);
                      }
                      body.in_flight = false;
                      std::deque<std::function<void(Locked&)>> waiting =
                          std::exchange(body.waiting, {});
                      // Nothing was there before a creation that was refused, nor is after a
                      // deletion.
                      if (body.committed == nullptr) {
                        bodies_.erase(id);
                        --body_count_;
                      }
                      for (auto& next : waiting) {
                        if (Committer::IsSuperseded(status)) {
                          after_others_.push_back(std::move(next));
                        } else {
                          next(later);
                        }
                      }
                    });
}

std::shared_ptr<const Body> Registry::FindBody(const std::string& id) const {
  const auto found = bodies_.find(id);
  return found == bodies_.end() ? nullptr : found->second.committed;
}

BodyPage Registry::ListBodies(const std::string& prefix, const std::string& after,
                              size_t page_size) const {
  BodyPage page;
  const std::lock_guard lock(mutex_);
  page.store_revision = revision_;
  auto next = after.empty() ? bodies_.lower_bound(prefix) : bodies_.upper_bound(after);
  for (; next != bodies_.end() && next->first.starts_with(prefix); ++next) {
    if (next->second.committed == nullptr) continue;
    if (page.bodies.size() == page_size) {
      page.more = true;
      break;
    }
    page.bodies.push_back(next->second.committed);
  }
  return page;
}

FoundBodies Registry::FindBodies(std::span<const std::string> ids) const {
  FoundBodies found;
  found.bodies.reserve(ids.size());
  Locked locked(mutex_);
  for (const std::string& id : ids) {
    if (locked.lookups() == kMostLookupsPerHold) {
      locked.Unlock();
      locked.Lock();
    }
    found.bodies.push_back(FindBody(id));
    locked.NoteLookup();
  }
  found.store_revision = revision_;
  return found;
}

}  // namespace hulld::server
