// Records of a store that finds them: how what there is under an ID becomes known, and what is
// listed without being known.
//
// What was read is of a moment of the store, which may be later than what is known here: then what
// came in between is taken over, or told by our own commits, before what was read counts. What
// others did of an ID meanwhile takes the place of what is being read of it (EndReadingOf). Our own
// changes are of IDs that are known, so none comes in between.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/base/check.h"
#include "server/registry/registered_hull.h"
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
// How soon who waits notices that its call was cancelled.
constexpr std::chrono::milliseconds kCancellationPoll(20);

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

}  // namespace

void Registry::WhenKnown(Locked& locked, const std::string& id, Refusal refuse,
                         std::function<void(Locked&)> next) {
  HULLD_CHECK(locked.Holds(mutex_) && !IsKnown(id));
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

// For a reader: makes an ID known, and with it others that are due. Releases the mutex. Why it
// could not be read, or CANCELLED; OK: it was known at some moment since.
absl::Status Registry::AwaitKnown(Locked& locked, std::span<const std::string> ids,
                                  KnownHulls& hulls, uint32_t k,
                                  const std::function<bool()>& should_stop) {
  // What is due does not wait meanwhile.
  locked.Unlock();
  locked.Lock();
  Readings own;
  std::shared_ptr<Reading> awaited;
  const auto read = [&](uint32_t hull) {
    const std::string& id = ids[hulls.hulls_[hull].first];
    if (IsKnown(id)) return;
    std::shared_ptr<Reading>& reading = readings_[id];
    if (reading == nullptr) {
      reading = std::make_shared<Reading>();
      reading->id = id;
      own.push_back(reading);
    }
    if (hull == k) awaited = reading;
  };
  read(k);
  if (awaited == nullptr) return absl::OkStatus();
  const size_t count = std::min(hulls.due_.size(), kMostAtOnce - 1);
  for (const uint32_t due : std::span(hulls.due_).last(count)) {
    locked.NoteLookup();
    if (due != k) read(due);
  }
  if (!own.empty()) ReadRecords(locked, own);
  const auto is_over = [&] { return awaited->is_over; };
  while (!is_over()) {
    if (should_stop && should_stop()) return absl::CancelledError("the call was cancelled");
    locked.WaitOn([&](auto& lock) { awaited->over.wait_for(lock, kCancellationPoll, is_over); });
  }
  return awaited->status;
}

// Releases the mutex meanwhile. They may be over later than that.
void Registry::ReadRecords(Locked& locked, const Readings& readings) {
  std::vector<std::string> ids;
  ids.reserve(readings.size());
  for (const auto& reading : readings) ids.push_back(reading->id);
  const uint64_t asked_at = revision_;
  locked.Unlock();
  absl::StatusOr<FoundHulls> found = store_.FindHulls(ids);
  locked.Lock();
  WhenReached(locked, asked_at, std::move(found),
              [this, readings](Locked& later, const absl::StatusOr<FoundHulls>& reached) {
                TakeRecords(later, readings, reached);
              });
}

// asked_at: what was known here when the store was asked.
void Registry::WhenReached(Locked& locked, uint64_t asked_at, absl::StatusOr<FoundHulls> found,
                           FoundTaker take) {
  if (found.ok() && found->revision < asked_at) found = WentBack(found->revision, asked_at);
  if (!found.ok() || found->revision <= revision_) return take(locked, found);
  // After this round of the committer, what the store held is known here.
  const auto kept = std::make_shared<const FoundHulls>(*std::move(found));
  committer_.Follow(
      locked, [this, kept, take = std::move(take)](Locked& later, const absl::Status& status) {
        if (!status.ok()) return take(later, status);
        if (kept->revision > revision_) return take(later, IsAhead(kept->revision, revision_));
        take(later, *kept);
      });
}

void Registry::TakeRecords(Locked& locked, const Readings& readings,
                           const absl::StatusOr<FoundHulls>& found) {
  // Before, so that what comes now is there for who waits for it.
  for (size_t i = 0; i < readings.size(); ++i) hulls_.RestSome();
  Readings open;
  for (const auto& reading : readings) {
    if (reading->is_over) continue;
    if (found.ok()) TakeRecord(reading->id, *found);
    open.push_back(reading);
  }
  for (const auto& reading : open) EndReading(locked, *reading, found.status());
}

void Registry::TakeRecord(const std::string& id, const FoundHulls& found) {
  HULLD_CHECK(!IsKnown(id));
  const auto hull = found.hulls.find(id);
  if (hull == found.hulls.end()) return hulls_.NoteAbsent(id);
  AddStored(id, hull->second);
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
  if (!IsKnown(id)) hulls_.NoteAbsent(id);
  reading->is_over = true;
  reading->over.notify_all();
  readings_.erase(found);
  for (auto& [refuse, next] : std::exchange(reading->waiting, {})) {
    after_others_.push_back(std::move(next));
  }
}

absl::StatusOr<HullPage> Registry::ListFound(const std::string& prefix, const std::string& after,
                                             size_t page_size,
                                             const std::function<bool()>& should_stop) {
  uint64_t asked_at = 0;
  {
    const std::lock_guard lock(mutex_);
    asked_at = revision_;
  }
  const absl::StatusOr<FoundHulls> found = store_.ListHulls(prefix, after, page_size);
  if (!found.ok()) return found.status();
  if (found->revision < asked_at) return WentBack(found->revision, asked_at);
  HullPage page;
  page.store_revision = found->revision;
  page.more = found->more;
  Locked locked(mutex_);
  if (found->revision > revision_) {
    if (absl::Status s = AwaitOthers(locked, should_stop); !s.ok()) return s;
    if (found->revision > revision_) return IsAhead(found->revision, revision_);
  }
  for (const auto& [id, stored] : found->hulls) {
    if (locked.lookups() == kMostLookupsPerHold) {
      locked.Unlock();
      locked.Lock();
    }
    locked.NoteLookup();
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
  const auto known = hulls_.entries().find(id);
  if (known == hulls_.entries().end() || !known->second.visible()) return change;
  HullChange described = known->second.Describe(id);
  return described.record == change.record ? described : change;
}

// Has the store list what the watch is told next.
void Registry::ReadPresent(Locked& locked, ChangeWatch& watch) {
  // What changed before the first step need not be told twice.
  if (watch.last_id.empty() && watch.after_revision == 0) feed_.SkipChanges(watch);
  const WatchTarget& target = feed_.TargetOf(watch);
  watch.is_reading = true;
  loaders_->Submit(
      [this, kept = watch.shared_from_this(), reading = ++watch.readings, asked_at = revision_,
       after = watch.last_id, prefix = target.prefix, ids = target.ids] {
        absl::StatusOr<FoundHulls> found =
            ids.empty() ? store_.ListHulls(prefix, after, ChangeFeed::kMostPerPiece)
                        : store_.FindHulls(std::span(ids).first(1));
        Locked later(mutex_);
        WhenReached(later, asked_at, std::move(found),
                    [this, kept, reading](Locked& now, const absl::StatusOr<FoundHulls>& reached) {
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
  FoundHulls& found = **watch.found;
  const WatchTarget& target = feed_.TargetOf(watch);
  const auto is_watched = [&](const std::string& id) {
    return target.ids.empty() ? id.starts_with(target.prefix) : id == target.ids.front();
  };
  // What is damaged has no revision that can be read.
  const auto tell = [&](HullChange change) {
    const bool is_new = watch.after_revision == 0 || change.record.revision > watch.after_revision;
    if (is_new) piece->changes.push_back(std::move(change));
  };
  auto body = bodies_.end();
  if (target.bodies) {
    const std::string& prefix = target.ids.empty() ? target.prefix : target.ids.front();
    body = watch.last_id.empty() ? bodies_.lower_bound(prefix) : bodies_.upper_bound(watch.last_id);
  }
  for (size_t looked_at = 0;; ++looked_at) {
    const bool has_hull = !found.hulls.empty();
    // Those after the last hull that was read come with the hulls that follow.
    if (!has_hull && found.more) {
      watch.found.reset();
      return absl::OkStatus();
    }
    const bool has_body = body != bodies_.end() && is_watched(body->first);
    if (!has_hull && !has_body) break;
    if (looked_at == ChangeFeed::kMostPerPiece) return absl::OkStatus();
    if (!has_body || (has_hull && found.hulls.begin()->first < body->first)) {
      const auto hull = found.hulls.begin();
      watch.last_id = hull->first;
      // What was read may be a body by now.
      if (!bodies_.contains(hull->first)) tell(DescribeFound(hull->first, hull->second));
      found.hulls.erase(hull);
    } else {
      watch.last_id = body->first;
      const auto& committed = body->second.committed;
      if (committed != nullptr) tell(committed->Describe());
      ++body;
    }
  }
  watch.found.reset();
  watch.stage = ChangeWatch::Stage::kChanges;
  watch.synced_at = revision_;
  return absl::OkStatus();
}

}  // namespace hulld::server
