// Records of a store that finds them: how what there is under an ID becomes known, and what is
// listed without being known.
//
// What was read is of a moment of the store, which may be later than what is known here: then what
// came in between is taken over, or told by our own commits, before what was read counts. What
// others did of an ID meanwhile takes the place of what is being read of it (EndReadingOf). Our own
// changes are of IDs that are known, so none comes in between.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "server/contract/stopped_call.h"
#include "server/registry/catalog/registered_hull.h"
#include "server/registry/registry.h"

namespace hulld::server {
namespace {

// IDs in one question to the store, and threads that ask.
constexpr size_t kMostAtOnce = Registry::kMostLookupsPerHold;
constexpr size_t kMostThreads = 2;
// Who takes turns for the threads that read: what is due under IDs, and what watches are told, with
// those that load points.
constexpr ClientId kRecordReader = 1;
constexpr ClientId kWatchReader = 2;

// The store was asked after it had said to be at `asked_at`.
absl::Status WentBack(uint64_t found, uint64_t asked_at) {
  return absl::UnavailableError(
      absl::StrCat("the store answers as of revision ", found, ", and was at ", asked_at,
                   " before: it was put back to an earlier time, or another database answers"));
}

absl::Status IsAhead(uint64_t found, uint64_t known) {
  return absl::UnavailableError(absl::StrCat("the store holds changes up to revision ", found,
                                             ", and only those up to ", known,
                                             " are known to be committed; try again"));
}

// Two records of one ID are not written; the hull is kept, as its vertices cannot be had again.
void NoteBodyUnderHull(const std::string& id) {
  spdlog::error("the store holds a body under the ID of hull \"{}\"; it is left alone", id);
}

}  // namespace

void Registry::WhenKnown(Locked& locked, const std::string& id, Refusal refuse,
                         std::function<void(Locked&)> next) {
  HULLD_CHECK(locked.Holds(mutex_) && !catalog_.IsKnown(id));
  std::shared_ptr<Reading>& reading = readings_[id];
  const bool is_new = reading == nullptr;
  if (is_new) {
    reading = std::make_shared<Reading>();
    reading->id = id;
  }
  reading->waiting.emplace_back(std::move(refuse), std::move(next));
  if (!is_new) return;
  due_readings_.push_back(reading);
  if (reading_threads_ == kMostThreads) return;
  ++reading_threads_;
  loaders_->Submit([this] { ReadDue(); }, kRecordReader);
}

// One question; who comes while it is under way is in the next one. In between others get the
// thread, so that they do not wait as long as more comes.
void Registry::ReadDue() {
  Locked locked(mutex_);
  if (!due_readings_.empty()) {
    const auto first = due_readings_.begin();
    const auto last = first + std::min<ptrdiff_t>(due_readings_.size(), kMostAtOnce);
    const Readings taken(first, last);
    due_readings_.erase(first, last);
    ReadRecords(locked, taken);
  }
  if (due_readings_.empty()) {
    --reading_threads_;
  } else {
    loaders_->Submit([this] { ReadDue(); }, kRecordReader);
  }
}

// For a reader: makes the first ID known, and with it others, at most kMostAtOnce, that are due.
// Releases the mutex. Why it could not be read, or CANCELLED; OK: it was known at some moment
// since.
absl::Status Registry::AwaitKnown(Locked& locked, std::span<const std::string* const> ids,
                                  const std::function<bool()>& should_stop) {
  HULLD_CHECK(!ids.empty() && ids.size() <= kMostAtOnce);
  // What is due does not wait meanwhile.
  locked.Unlock();
  locked.Lock();
  Readings own;
  std::shared_ptr<Reading> awaited;
  for (const std::string* const id : ids) {
    locked.NoteLookup();
    if (catalog_.IsKnown(*id)) {
      if (awaited == nullptr) return absl::OkStatus();
      continue;
    }
    std::shared_ptr<Reading>& reading = readings_[*id];
    if (reading == nullptr) {
      reading = std::make_shared<Reading>();
      reading->id = *id;
      own.push_back(reading);
    }
    if (awaited == nullptr) awaited = reading;
  }
  if (!own.empty()) ReadRecords(locked, own);
  const auto is_over = [&] { return awaited->is_over; };
  while (!is_over()) {
    if (Stopped(should_stop)) return Cancelled();
    locked.WaitOn([&](auto& lock) { awaited->over.wait_for(lock, kStopPoll, is_over); });
  }
  return awaited->status;
}

// The same for those of these IDs that are not known, of which the first is one.
absl::Status Registry::ReadMissing(Locked& locked, std::span<const std::string> ids,
                                   const std::function<bool()>& should_stop, bool may_wait) {
  if (!may_wait) return absl::UnavailableError("it would have to wait");
  if (absl::Status s = memory_.Check(locked, MemoryUse::kReading); !s.ok()) return s;
  std::vector<const std::string*> missing;
  for (const std::string& id : ids) {
    if (!catalog_.IsKnown(id)) missing.push_back(&id);
  }
  const absl::Status read = AwaitKnown(locked, missing, should_stop);
  if (Stopped(should_stop)) return Cancelled();
  return read;
}

// Releases the mutex meanwhile. They may be over later than that.
void Registry::ReadRecords(Locked& locked, const Readings& readings) {
  std::vector<std::string> ids;
  ids.reserve(readings.size());
  for (const auto& reading : readings) ids.push_back(reading->id);
  const uint64_t asked_at = catalog_.revision();
  locked.Unlock();
  absl::StatusOr<FoundRecords> found = store_.FindRecords(ids);
  locked.Lock();
  WhenReached(locked, asked_at, std::move(found),
              [this, readings](Locked& later, const absl::StatusOr<FoundRecords>& reached) {
                TakeRecords(later, readings, reached);
              });
}

// asked_at: what was known here when the store was asked.
void Registry::WhenReached(Locked& locked, uint64_t asked_at, absl::StatusOr<FoundRecords> found,
                           FoundTaker take) {
  if (found.ok() && found->revision < asked_at) found = WentBack(found->revision, asked_at);
  if (!found.ok() || !IsBehind(*found)) return take(locked, found);
  // After this round of the committer, what the store held is known here.
  const auto kept = std::make_shared<const FoundRecords>(*std::move(found));
  committer_.Follow(
      locked, [this, kept, take = std::move(take)](Locked& later, const absl::Status& status) {
        if (!status.ok()) return take(later, status);
        if (kept->revision > catalog_.revision())
          return take(later, IsAhead(kept->revision, catalog_.revision()));
        take(later, *kept);
      });
}

void Registry::TakeRecords(Locked& locked, const Readings& readings,
                           const absl::StatusOr<FoundRecords>& found) {
  // Before, so that what comes now is there for who waits for it.
  for (size_t i = 0; i < readings.size(); ++i) catalog_.hulls().RestSome();
  catalog_.bodies().DropSome(locked);
  Readings open;
  for (const auto& reading : readings) {
    if (reading->is_over) continue;
    if (found.ok()) TakeRecord(locked, reading->id, *found);
    open.push_back(reading);
  }
  for (const auto& reading : open) EndReading(locked, *reading, found.status());
}

void Registry::TakeRecord(Locked& locked, const std::string& id, const FoundRecords& found) {
  HULLD_CHECK(!catalog_.IsKnown(id));
  const auto hull = found.hulls.find(id);
  const auto body = found.bodies.find(id);
  if (hull == found.hulls.end() && body == found.bodies.end())
    return catalog_.hulls().NoteAbsent(id);
  if (hull == found.hulls.end()) return catalog_.AddBody(locked, id, body->second);
  if (body != found.bodies.end()) NoteBodyUnderHull(id);
  catalog_.AddStored(id, hull->second);
}

void Registry::EndReading(Locked& locked, Reading& reading, const absl::Status& status) {
  reading.is_over = true;
  reading.status = status;
  reading.over.notify_all();
  readings_.erase(reading.id);
  for (auto& [refuse, next] : std::exchange(reading.waiting, {})) {
    if (status.ok()) {
      next(locked);
    } else {
      locked.Afterwards([refuse = std::move(refuse), status] { refuse(status); });
    }
  }
}

void Registry::EndReadingOf(const std::string& id) {
  const auto found = readings_.find(id);
  if (found == readings_.end()) return;
  const std::shared_ptr<Reading> reading = found->second;
  if (!catalog_.IsKnown(id)) catalog_.hulls().NoteAbsent(id);
  reading->is_over = true;
  reading->over.notify_all();
  readings_.erase(found);
  for (auto& [refuse, next] : std::exchange(reading->waiting, {})) {
    after_others_.push_back(std::move(next));
  }
}

// Before a lookup of many: others have the mutex after some of them.
void Registry::LetOthersPass(Locked& locked) {
  if (locked.lookups() == kMostLookupsPerHold) {
    locked.Unlock();
    locked.Lock();
  }
  locked.NoteLookup();
}

// Whether the store held more of this hull than is known here, under the same revision: points that
// changed no vertex take none.
bool Registry::IsBehind(const std::string& id, const absl::StatusOr<StoredHull>& stored) const {
  if (!stored.ok()) return false;
  const auto known = catalog_.hulls().entries().find(id);
  const bool is_same = known != catalog_.hulls().entries().end() &&
                       known->second.revision() == stored->record.revision;
  if (!is_same) return false;
  return known->second.Describe(id).record.counts.received < stored->record.counts.received;
}

// Whether what was found is of a later moment than what is known here: committed, perhaps by
// others, and not taken over yet. Who tells it would be followed by one who tells what is here.
bool Registry::IsBehind(const FoundRecords& found) const {
  if (found.revision > catalog_.revision()) return true;
  return std::ranges::any_of(
      found.hulls, [this](const auto& hull) { return IsBehind(hull.first, hull.second); });
}

// What the store lists, once it is of no later moment than what is known here.
absl::StatusOr<FoundRecords> Registry::ListFound(const std::string& prefix,
                                                 const std::string& after, size_t page_size,
                                                 RecordKinds kinds,
                                                 const std::function<bool()>& should_stop) {
  uint64_t asked_at = 0;
  {
    const std::lock_guard lock(mutex_);
    asked_at = catalog_.revision();
  }
  absl::StatusOr<FoundRecords> found = store_.ListRecords(prefix, after, page_size, kinds);
  if (!found.ok()) return found;
  if (found->revision < asked_at) return WentBack(found->revision, asked_at);
  Locked locked(mutex_);
  bool is_behind = found->revision > catalog_.revision();
  for (auto hull = found->hulls.begin(); !is_behind && hull != found->hulls.end(); ++hull) {
    LetOthersPass(locked);
    is_behind = IsBehind(hull->first, hull->second);
  }
  if (!is_behind) return found;
  if (absl::Status s = AwaitOthers(locked, should_stop); !s.ok()) return s;
  if (found->revision > catalog_.revision()) return IsAhead(found->revision, catalog_.revision());
  return found;
}

absl::StatusOr<BodyPage> Registry::ListFoundBodies(const std::string& prefix,
                                                   const std::string& after, size_t page_size,
                                                   const std::function<bool()>& should_stop) {
  if (absl::Status s = CheckMemory(MemoryUse::kReading); !s.ok()) return s;
  const absl::StatusOr<FoundRecords> found =
      ListFound(prefix, after, page_size, {.bodies = true}, should_stop);
  if (!found.ok()) return found.status();
  BodyPage page;
  page.store_revision = found->revision;
  page.more = found->more;
  for (const auto& [id, stored] : found->bodies) {
    page.bodies.push_back(std::make_shared<const Body>(id, stored, memory_, MemoryUse::kReading));
  }
  return page;
}

absl::StatusOr<HullPage> Registry::ListFoundHulls(const std::string& prefix,
                                                  const std::string& after, size_t page_size,
                                                  const std::function<bool()>& should_stop) {
  const absl::StatusOr<FoundRecords> found =
      ListFound(prefix, after, page_size, {.hulls = true}, should_stop);
  if (!found.ok()) return found.status();
  HullPage page;
  page.store_revision = found->revision;
  page.more = found->more;
  Locked locked(mutex_);
  for (const auto& [id, stored] : found->hulls) {
    LetOthersPass(locked);
    HullChange hull = DescribeFound(id, stored);
    page.hulls.push_back({std::move(hull.record), hull.damaged});
  }
  return page;
}

// What is known of the same version is more than its record: its box, or that it is damaged.
HullChange Registry::DescribeFound(const std::string& id,
                                   const absl::StatusOr<StoredHull>& stored) const {
  HullChange change;
  change.damaged = !stored.ok();
  if (stored.ok()) {
    change.record = stored->record;
  } else {
    change.record.hull_id = id;
  }
  const auto known = catalog_.hulls().entries().find(id);
  if (known == catalog_.hulls().entries().end() || !known->second.visible()) return change;
  HullChange described = known->second.Describe(id);
  return described.record == change.record ? described : change;
}

// Has the store list what the watch is told next.
void Registry::ReadPresent(Locked& locked, ChangeWatch& watch) {
  // What changed before the first step need not be told twice.
  if (watch.last_id.empty() && watch.after_revision == 0) feed_.SkipChanges(watch);
  const WatchTarget& target = ChangeFeed::TargetOf(watch);
  watch.is_reading = true;
  loaders_->Submit(
      [this, kept = watch.shared_from_this(), reading = ++watch.readings,
       asked_at = catalog_.revision(), after = watch.last_id, prefix = target.prefix,
       ids = target.ids, bodies = target.bodies] {
        absl::StatusOr<FoundRecords> found =
            ids.empty() ? store_.ListRecords(prefix, after, ChangeFeed::kMostPerPiece,
                                             {.hulls = true, .bodies = bodies})
                        : store_.FindRecords(std::span(ids).first(1));
        if (found.ok() && !bodies) found->bodies.clear();
        Locked later(mutex_);
        WhenReached(
            later, asked_at, std::move(found),
            [this, kept, reading](Locked& now, const absl::StatusOr<FoundRecords>& reached) {
              if (!kept->is_reading || kept->readings != reading) return;
              kept->is_reading = false;
              kept->found = reached;
              feed_.Wake(now, kept);
            });
      },
      kWatchReader);
  HULLD_CHECK(locked.Holds(mutex_));
}

// As TakePresent, of what the store lists. The watch waits until that was read.
absl::Status Registry::TakePresentFound(Locked& locked, ChangeWatch& watch, WatchPiece* piece) {
  if (!watch.found.has_value()) {
    if (!watch.is_reading) ReadPresent(locked, watch);
    piece->waits = true;
    feed_.Arm(watch);
    return absl::OkStatus();
  }
  if (!watch.found->ok()) return std::exchange(watch.found, std::nullopt)->status();
  const FoundRecords found = **std::exchange(watch.found, std::nullopt);
  // What is damaged has no revision that can be read.
  const auto tell = [&](HullChange change) {
    const bool is_new = watch.after_revision == 0 || change.record.revision > watch.after_revision;
    if (is_new) piece->changes.push_back(std::move(change));
  };
  auto hull = found.hulls.begin();
  auto body = found.bodies.begin();
  while (hull != found.hulls.end() || body != found.bodies.end()) {
    const bool is_hull =
        body == found.bodies.end() || (hull != found.hulls.end() && hull->first < body->first);
    watch.last_id = is_hull ? hull->first : body->first;
    if (is_hull) {
      tell(DescribeFound(hull->first, hull->second));
      ++hull;
    } else {
      const absl::StatusOr<StoredBody>& stored = body->second;
      const StoredBody nothing = {{body->first, 0, 0}, {}, {}};
      tell(Body::Describe(stored.ok() ? *stored : nothing, stored.status()));
      ++body;
    }
  }
  if (found.more) return absl::OkStatus();
  watch.stage = ChangeWatch::Stage::kChanges;
  watch.synced_at = catalog_.revision();
  return absl::OkStatus();
}

}  // namespace hulld::server
