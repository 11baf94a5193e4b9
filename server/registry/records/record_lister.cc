#include "server/registry/records/record_lister.h"

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>

#include "core/base/check.h"
#include "server/registry/records/record_reader.h"

namespace hulld::server {

// Returns the store's list after the catalog has reached its revision.
absl::StatusOr<FoundRecords> RecordLister::List(const std::string& prefix, const std::string& after,
                                                size_t page_size, RecordKinds kinds,
                                                const std::function<bool()>& should_stop) {
  uint64_t asked_at = 0;
  {
    const std::lock_guard lock(mutex_);
    asked_at = catalog_.revision();
  }
  return gate_.AwaitReached(asked_at, store_.ListRecords(prefix, after, page_size, kinds),
                            should_stop);
}

absl::StatusOr<BodyPage> RecordLister::ListBodies(const std::string& prefix,
                                                  const std::string& after, size_t page_size,
                                                  const std::function<bool()>& should_stop) {
  {
    Locked locked(mutex_);
    if (absl::Status s = memory_.Check(locked, MemoryUse::kReading); !s.ok()) return s;
  }
  const absl::StatusOr<FoundRecords> found =
      List(prefix, after, page_size, {.bodies = true}, should_stop);
  if (!found.ok()) return found.status();
  BodyPage page;
  page.store_revision = found->revision;
  page.more = found->more;
  for (const auto& [id, stored] : found->bodies) {
    page.bodies.push_back(std::make_shared<const Body>(id, stored, memory_, MemoryUse::kReading));
  }
  return page;
}

absl::StatusOr<HullPage> RecordLister::ListHulls(const std::string& prefix,
                                                 const std::string& after, size_t page_size,
                                                 const std::function<bool()>& should_stop) {
  const absl::StatusOr<FoundRecords> found =
      List(prefix, after, page_size, {.hulls = true}, should_stop);
  if (!found.ok()) return found.status();
  HullPage page;
  page.store_revision = found->revision;
  page.more = found->more;
  Locked locked(mutex_);
  for (const auto& [id, stored] : found->hulls) {
    locked.LetOthersPass();
    HullChange hull = Describe(id, stored);
    page.hulls.push_back({std::move(hull.record), hull.damaged});
  }
  return page;
}

// The catalog may know more about this version than its record: its box, or its damage.
HullChange RecordLister::Describe(const std::string& id,
                                  const absl::StatusOr<StoredHull>& stored) const {
  HullChange change;
  change.damaged = !stored.ok();
  if (stored.ok()) {
    change.record = stored->record;
  } else {
    change.record.hull_id = id;
  }
  const HullTable::Entries& all = catalog_.hulls().entries();
  const auto known = all.find(id);
  if (known == all.end() || !known->second.visible()) return change;
  HullChange described = known->second.Describe(id);
  return described.record == change.record ? described : change;
}

// Starts the store query for the watch's next piece.
void RecordLister::ReadPresent(Locked& locked, ChangeWatch& watch) {
  HULLD_CHECK(locked.Holds(mutex_));
  // Changes before the first step are part of the list.
  if (watch.last_id.empty() && watch.after_revision == 0) feed_.SkipChanges(watch);
  const WatchTarget& target = ChangeFeed::TargetOf(watch);
  watch.is_reading = true;
  loaders_.Submit(
      [this, kept = watch.shared_from_this(), reading = ++watch.readings,
       asked_at = catalog_.revision(), after = watch.last_id, prefix = target.prefix,
       ids = target.ids, bodies = target.bodies] {
        absl::StatusOr<FoundRecords> found =
            ids.empty() ? store_.ListRecords(prefix, after, ChangeFeed::kMostPerPiece,
                                             {.hulls = true, .bodies = bodies})
                        : store_.FindRecords(std::span(ids).first(1));
        if (found.ok() && !bodies) found->bodies.clear();
        Locked later(mutex_);
        gate_.WhenReached(
            later, asked_at, std::move(found),
            [this, kept, reading](Locked& now, const absl::StatusOr<FoundRecords>& reached) {
              if (!kept->is_reading || kept->readings != reading) return;
              kept->is_reading = false;
              kept->found = reached;
              feed_.Wake(now, kept);
            });
      },
      kWatchReader);
}

absl::Status RecordLister::TakePresent(Locked& locked, ChangeWatch& watch, WatchPiece* piece) {
  if (!watch.found.has_value()) {
    if (!watch.is_reading) ReadPresent(locked, watch);
    piece->waits = true;
    feed_.Arm(watch);
    return absl::OkStatus();
  }
  if (!watch.found->ok()) return std::exchange(watch.found, std::nullopt)->status();
  const FoundRecords found = **std::exchange(watch.found, std::nullopt);
  // A damaged record has no readable revision.
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
      tell(Describe(hull->first, hull->second));
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
