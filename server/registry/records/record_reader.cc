#include "server/registry/records/record_reader.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/contract/stopped_call.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {
namespace {

// IDs per store query, and threads that query.
constexpr size_t kMaxAtOnce = kMaxLookupsPerHold;
constexpr size_t kMaxThreads = 2;

// The store reported an older revision than `queried_at`, its revision before the query.
absl::Status RolledBack(uint64_t found, uint64_t queried_at) {
  return Unavailable(
      "the store is at revision ", found, " but was at ", queried_at,
      " earlier: it was restored to an earlier state, or another database is answering");
}

absl::Status IsAhead(uint64_t found, uint64_t known) {
  return Unavailable("the store contains changes up to revision ", found,
                     ", but only changes up to ", known, " are known to be committed; retry");
}

}  // namespace

std::pair<std::shared_ptr<RecordReader::PendingRead>, bool> RecordReader::Join(
    const std::string& id) {
  std::shared_ptr<PendingRead>& pending = reads_[id];
  const bool is_new = pending == nullptr;
  if (is_new) pending = std::make_shared<PendingRead>(PendingRead{id, {}});
  return {pending, is_new};
}

void RecordReader::WhenKnown(const std::string& id, Committer::Barrier done) {
  HULLD_CHECK(!state_.IsKnown(id));
  const auto [pending, is_new] = Join(id);
  pending->waiting.push_back(std::move(done));
  if (!is_new) return;
  due_.push_back(pending);
  if (threads_ == kMaxThreads) return;
  ++threads_;
  loaders_.Submit([this] { ReadDue(); }, kRecordReader);
}

void RecordReader::WhenReady(const std::string& id, For need, Refusal refuse, Task task) {
  const auto ready =
      std::make_shared<const ReadyTask>(ReadyTask{id, need, std::move(refuse), std::move(task)});
  peers_.WhenFresh(ready->refuse, [this, ready](Locked& locked) { RunWhenReady(locked, ready); });
}

void RecordReader::RunWhenReady(Locked& locked, const std::shared_ptr<const ReadyTask>& ready) {
  const LockedTask again = [this, ready](Locked& later) { RunWhenReady(later, ready); };
  const std::string& id = ready->id;
  if (!state_.IsKnown(id)) return WhenKnown(id, PeerSync::RunOrRefuse(ready->refuse, again));
  BodyTable::Entry* const body = state_.bodies.Find(id);
  if (body != nullptr && body->in_flight) return body->waiting.push_back(again);
  if (const HullPointer hull = state_.Find(id); hull != nullptr) {
    const HullState& state = hull->state;
    const bool waits = ready->need == For::kQuiet ? !state.quiet() : state.changing_life();
    if (waits) return hull->exclusive.push_back(again);
  }
  ready->task(locked, again);
}

// Sends one query; IDs that arrive during it go into the next one. The thread is offered to other
// clients in between, so that a steady supply of IDs does not starve them.
void RecordReader::ReadDue() {
  Locked locked(state_.mutex);
  if (!due_.empty()) {
    const auto first = due_.begin();
    const auto last = first + std::min<ptrdiff_t>(due_.size(), kMaxAtOnce);
    const PendingReads taken(first, last);
    due_.erase(first, last);
    ReadRecords(locked, taken);
  }
  if (due_.empty()) {
    --threads_;
  } else {
    loaders_.Submit([this] { ReadDue(); }, kRecordReader);
  }
}

absl::Status RecordReader::AwaitKnown(Locked& locked, std::span<const std::string* const> ids,
                                      const std::function<bool()>& should_stop) {
  HULLD_CHECK(!ids.empty() && ids.size() <= kMaxAtOnce);
  // Runs the deferred tasks before waiting.
  locked.Yield();
  PendingReads own;
  std::shared_ptr<PendingRead> awaited;
  for (const std::string* const id : ids) {
    locked.NoteLookup();
    if (state_.IsKnown(*id)) {
      if (awaited == nullptr) return absl::OkStatus();
      continue;
    }
    const auto [pending, is_new] = Join(*id);
    if (is_new) own.push_back(pending);
    if (awaited == nullptr) awaited = pending;
  }
  const absl::Status read = locked.AwaitCall(should_stop, [&](const auto& done) {
    awaited->waiting.push_back(done);
    if (!own.empty()) ReadRecords(locked, own);
  });
  return Stopped(should_stop) ? Cancelled() : read;
}

// Like AwaitKnown for the unknown ones among `ids`, which must include the first.
// RESOURCE_EXHAUSTED: readers exceed their share of --memory-limit.
absl::Status RecordReader::AwaitMissing(Locked& locked, std::span<const std::string> ids,
                                        const std::function<bool()>& should_stop) {
  HULLD_RETURN_IF_ERROR(state_.memory.Check(locked, MemoryUse::kReading));
  std::vector<const std::string*> missing;
  for (const std::string& id : ids) {
    if (!state_.IsKnown(id)) missing.push_back(&id);
  }
  return AwaitKnown(locked, missing, should_stop);
}

// Looks up kMaxLookupsPerHold bodies per hold and reads the unknown ones together. A reader of
// many bodies may evict them again, so bodies already found are not looked up again.
FoundBodies RecordReader::FindBodies(std::span<const std::string> ids,
                                     const std::function<bool()>& should_stop, bool may_wait) {
  Locked locked(state_.mutex);
  FoundBodies found;
  found.bodies.resize(ids.size());
  for (size_t first = 0; first < ids.size(); first += kMaxLookupsPerHold) {
    if (first > 0) locked.Yield();
    const size_t end = std::min<size_t>(first + kMaxLookupsPerHold, ids.size());
    for (size_t i = first; i < end; ++i) {
      while (found.status.ok() && !state_.IsKnown(ids[i])) {
        found.status =
            may_wait ? AwaitMissing(locked, ids.subspan(i, end - i), should_stop) : WouldWait();
      }
      // A body that could not be read may be known by now.
      found.bodies[i] = state_.FindBody(ids[i]);
      locked.NoteLookup();
    }
  }
  found.store_revision = state_.revision();
  return found;
}

absl::Status RecordReader::NoSuchBody(const std::string& id) {
  const Locked locked(state_.mutex);
  return state_.NoSuch("body", id);
}

// Releases the mutex during the read. The reads may end later than this call.
void RecordReader::ReadRecords(Locked& locked, const PendingReads& reads) {
  std::vector<std::string> ids;
  ids.reserve(reads.size());
  for (const auto& pending : reads) ids.push_back(pending->id);
  const uint64_t queried_at = state_.revision();
  locked.Unlock();
  const auto found =
      std::make_shared<const absl::StatusOr<FoundRecords>>(state_.store.FindRecords(ids));
  locked.Lock();
  WhenReached(locked, queried_at, found,
              [this, reads, found](Locked& later, const absl::Status& status) {
                TakeRecords(later, reads, found, status);
              });
}

// Ends the reads with the records, or with an error.
void RecordReader::TakeRecords(Locked& locked, const PendingReads& reads, const Found& found,
                               const absl::Status& status) {
  // Evicts first, so that the new records are still known when their callers resume.
  for (size_t i = 0; i < reads.size(); ++i) state_.hulls.RestSome(locked);
  state_.bodies.DropSome(locked);
  PendingReads open;
  for (const auto& pending : reads) {
    const auto current = reads_.find(pending->id);
    if (current == reads_.end() || current->second != pending) continue;
    if (status.ok()) TakeRecord(locked, pending->id, **found);
    reads_.erase(current);
    open.push_back(pending);
  }
  for (const auto& pending : open) {
    for (const Committer::Barrier& done : pending->waiting) done(locked, status);
  }
}

void RecordReader::TakeRecord(Locked& locked, const std::string& id, const FoundRecords& found) {
  HULLD_CHECK(!state_.IsKnown(id));
  const auto hull = found.hulls.find(id);
  const auto body = found.bodies.find(id);
  if (hull != found.hulls.end()) state_.AddStored(id, hull->second);
  if (body != found.bodies.end()) state_.AddBody(locked, id, body->second);
  if (!state_.IsKnown(id)) state_.hulls.NoteAbsent(id);
}

void RecordReader::OnPeerChange(const std::string& id) {
  const auto found = reads_.find(id);
  if (found == reads_.end()) return;
  if (!state_.IsKnown(id)) state_.hulls.NoteAbsent(id);
  for (Committer::Barrier& done : found->second->waiting) {
    peers_.Defer([done = std::move(done)](Locked& later) { done(later, absl::OkStatus()); });
  }
  reads_.erase(found);
}

void RecordReader::WhenReached(Locked& locked, uint64_t queried_at, const Found& found,
                               Committer::Barrier take) {
  if (!found->ok()) return take(locked, found->status());
  const uint64_t revision = (*found)->revision;
  if (revision < queried_at) return take(locked, RolledBack(revision, queried_at));
  if (!IsBehind(locked, **found)) return take(locked, absl::OkStatus());
  // After this round of the committer, the registry includes everything that the store contained.
  committer_.AddBarrier(
      [this, revision, take = std::move(take)](Locked& later, const absl::Status& status) {
        const uint64_t known = state_.revision();
        take(later, status.ok() && revision > known ? IsAhead(revision, known) : status);
      });
}

// Returns true if the store has a later state of the hull than the registry, at the same revision:
// points that change no vertex do not create a revision.
bool RecordReader::IsBehind(const std::string& id, const absl::StatusOr<StoredHull>& stored) const {
  if (!stored.ok()) return false;
  const HullTable::Entries& all = state_.hulls.entries();
  const auto known = all.find(id);
  if (known == all.end() || known->second.revision() != stored->record.revision) return false;
  return known->second.Describe(id).record.counts.received < stored->record.counts.received;
}

// Returns true if the records are newer than the registry: committed, perhaps by a peer server, but
// not yet applied. An answer from them would be followed by an older one from memory. The registry
// only advances, so releasing the mutex between hulls is safe.
bool RecordReader::IsBehind(Locked& locked, const FoundRecords& found) const {
  if (found.revision > state_.revision()) return true;
  return std::ranges::any_of(found.hulls, [&](const auto& hull) {
    locked.NoteLookupOrYield();
    return IsBehind(hull.first, hull.second);
  });
}

RecordReader::Found RecordReader::Query(const PageRequest& request) {
  absl::StatusOr<FoundRecords> found =
      request.ids.empty() ? state_.store.ListRecords(request.prefix, request.after,
                                                     request.page_size, request.kinds)
                          : state_.store.FindRecords(request.ids);
  if (found.ok() && !request.kinds.bodies) found->bodies.clear();
  return std::make_shared<const absl::StatusOr<FoundRecords>>(std::move(found));
}

absl::StatusOr<RecordPage> RecordReader::List(std::string prefix, std::string after,
                                              size_t page_size,
                                              const std::function<bool()>& should_stop,
                                              RecordKinds kinds) {
  const PageRequest request = {.prefix = std::move(prefix),
                               .kinds = kinds,
                               .after = std::move(after),
                               .page_size = page_size};
  Locked locked(state_.mutex);
  if (!state_.is_cache()) return CataloguedPage(request);
  if (request.kinds.bodies) {
    HULLD_RETURN_IF_ERROR(state_.memory.Check(locked, MemoryUse::kReading));
  }
  const uint64_t queried_at = state_.revision();
  locked.Unlock();
  const Found found = Query(request);
  locked.Lock();
  HULLD_RETURN_IF_ERROR(locked.AwaitCall(
      should_stop, [&](const auto& done) { WhenReached(locked, queried_at, found, done); }));
  return Describe(locked, **found);
}

// The registry may know more about this version than its record: its box, or its damage.
HullChange RecordReader::Describe(const std::string& id,
                                  const absl::StatusOr<StoredHull>& stored) const {
  HullChange change;
  change.damaged = !stored.ok();
  if (stored.ok()) {
    change.record = stored->record;
  } else {
    change.record.hull_id = id;
  }
  const HullTable::Entries& all = state_.hulls.entries();
  const auto known = all.find(id);
  if (known == all.end() || !known->second.visible()) return change;
  HullChange described = known->second.Describe(id);
  return described.record == change.record ? described : change;
}

// Describes a page whose revision the registry has reached. Releases the mutex between hulls.
RecordPage RecordReader::Describe(Locked& locked, const FoundRecords& found) const {
  RecordPage page = {.store_revision = found.revision, .more = found.more};
  for (const auto& [id, stored] : found.hulls) {
    locked.NoteLookupOrYield();
    page.entries.push_back(Describe(id, stored));
  }
  for (const auto& [id, stored] : found.bodies) {
    const StoredBody nothing = {{id, 0, 0}, {}, {}};
    page.entries.push_back(Body::Describe(stored.ok() ? *stored : nothing, stored.status()));
  }
  std::ranges::sort(page.entries, {}, [](const HullChange& change) -> const std::string& {
    return change.record.hull_id;
  });
  return page;
}

RecordPage RecordReader::CataloguedPage(const PageRequest& request) const {
  const std::string& first = request.ids.empty() ? request.prefix : request.ids.front();
  const auto has_next = [&](const auto& entries, const auto& next) {
    if (next == entries.end()) return false;
    return request.ids.empty() ? next->first.starts_with(first) : next->first == first;
  };
  const auto begin_of = [&](const auto& entries) {
    return request.after.empty() ? entries.lower_bound(first) : entries.upper_bound(request.after);
  };
  const auto& hulls = state_.hulls.entries();
  const auto& bodies = state_.bodies.entries();
  auto hull = request.kinds.hulls ? begin_of(hulls) : hulls.end();
  auto body = request.kinds.bodies ? begin_of(bodies) : bodies.end();
  RecordPage page = {.store_revision = state_.revision()};
  while (true) {
    const bool has_hull = has_next(hulls, hull);
    const bool has_body = has_next(bodies, body);
    if (!has_hull && !has_body) return page;
    const bool is_hull = !has_body || (has_hull && hull->first < body->first);
    const bool is_visible = is_hull ? hull->second.visible() : body->second.committed() != nullptr;
    page.more = is_visible && page.entries.size() == request.page_size;
    if (page.more) return page;
    if (is_visible) {
      page.entries.push_back(is_hull ? hull->second.Describe(hull->first)
                                     : body->second.committed()->Describe());
    }
    if (is_hull) {
      ++hull;
    } else {
      ++body;
    }
  }
}

void RecordReader::ReadPage(Locked& locked, PageRequest request,
                            std::function<void(Locked&, absl::StatusOr<RecordPage>)> done) {
  HULLD_CHECK(locked.Holds(state_.mutex));
  if (!state_.is_cache()) return done(locked, CataloguedPage(request));
  loaders_.Submit(
      [this, request = std::move(request), done = std::move(done),
       queried_at = state_.revision()]() mutable {
        const Found found = Query(request);
        Locked later(state_.mutex);
        WhenReached(later, queried_at, found,
                    [this, found, done = std::move(done)](Locked& now, const absl::Status& status) {
                      if (!status.ok()) return done(now, status);
                      done(now, Describe(now, **found));
                    });
      },
      kWatchReader);
}

}  // namespace hulld::server
