#include "server/registry/watch/watches.h"

#include <algorithm>
#include <mutex>
#include <utility>

#include "server/contract/error_info.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {

absl::StatusOr<std::shared_ptr<ChangeWatch>> Watches::Open(const WatchTarget& target,
                                                           const WatchStart& start,
                                                           std::function<void()> on_ready) {
  Locked locked(mutex_);
  if (absl::Status s = memory_.Check(locked, MemoryUse::kReading); !s.ok()) return s;
  std::shared_ptr<ChangeWatch> watch = feed_.Open(target, std::move(on_ready));
  if (!start.tell_present) return watch;
  const bool resumes = start.after_revision > 0;
  const bool can_resume = start.store_id == store_.id() &&
                          start.after_revision <= catalog_.revision() &&
                          feed_.Remembers(start.after_revision);
  watch->stage = ChangeWatch::Stage::kPresent;
  watch->is_exact = false;
  if (resumes && can_resume) {
    watch->stage = ChangeWatch::Stage::kDeletions;
    watch->after_revision = watch->last_deletion = start.after_revision;
  }
  watch->anew = resumes && !can_resume;
  return watch;
}

absl::StatusOr<WatchPiece> Watches::Take(ChangeWatch& watch) {
  Locked locked(mutex_);
  if (feed_.has_ended()) return Draining();
  if (feed_.IsLost(watch)) {
    feed_.StartAnew(watch);
    watch.found.reset();
    watch.is_reading = false;
  }
  WatchPiece piece;
  piece.anew = std::exchange(watch.anew, false);
  piece.revision = watch.after_revision;
  const bool tells_bodies = ChangeFeed::TargetOf(watch).bodies;
  const auto is_there = [this, tells_bodies](const std::string& id) {
    if (catalog_.bodies().contains(id)) return tells_bodies && catalog_.FindBody(id) != nullptr;
    return catalog_.hulls().Knows(id) ? catalog_.hulls().IsVisible(id)
                                      : feed_.BeganAnew(id, tells_bodies);
  };
  switch (watch.stage) {
    case ChangeWatch::Stage::kDeletions:
      if (!feed_.TakeDeletions(watch, is_there, &piece)) watch.stage = ChangeWatch::Stage::kPresent;
      break;
    case ChangeWatch::Stage::kPresent:
      if (!catalog_.is_cache()) {
        TakePresent(watch, &piece);
      } else if (absl::Status s = lister_.TakePresent(locked, watch, &piece); !s.ok()) {
        return s;
      }
      break;
    case ChangeWatch::Stage::kChanges:
      feed_.TakeChanges(watch, &piece);
      break;
  }
  return piece;
}

// Adds the next existing hulls. A change behind the walk is reported after it.
void Watches::TakePresent(ChangeWatch& watch, WatchPiece* piece) {
  // Changes before the first step are part of the list.
  if (watch.last_id.empty() && watch.after_revision == 0) feed_.SkipChanges(watch);
  const WatchTarget& target = ChangeFeed::TargetOf(watch);
  const std::string& prefix = target.ids.empty() ? target.prefix : target.ids.front();
  const auto is_watched = [&](const std::string& id) {
    return target.ids.empty() ? id.starts_with(prefix) : id == prefix;
  };
  // A damaged record has no readable revision.
  const auto is_new = [&watch](uint64_t revision) {
    return watch.after_revision == 0 || revision > watch.after_revision;
  };
  const auto begin_of = [&](const auto& all) {
    return watch.last_id.empty() ? all.lower_bound(prefix) : all.upper_bound(watch.last_id);
  };
  auto hull = begin_of(catalog_.hulls().entries());
  const auto hulls_end = catalog_.hulls().entries().end();
  const auto bodies_end = catalog_.bodies().entries().end();
  auto body = target.bodies ? begin_of(catalog_.bodies().entries()) : bodies_end;
  for (size_t looked_at = 0;; ++looked_at) {
    const bool has_hull = hull != hulls_end && is_watched(hull->first);
    const bool has_body = body != bodies_end && is_watched(body->first);
    if (!has_hull && !has_body) break;
    if (looked_at == ChangeFeed::kMostPerPiece) return;
    if (!has_body || (has_hull && hull->first < body->first)) {
      watch.last_id = hull->first;
      const HullTable::Entry& entry = hull->second;
      if (is_new(entry.revision()) && entry.visible())
        piece->changes.push_back(entry.Describe(hull->first));
      ++hull;
    } else {
      watch.last_id = body->first;
      const std::shared_ptr<const Body>& committed = body->second.committed();
      if (committed != nullptr && is_new(committed->record().revision)) {
        piece->changes.push_back(committed->Describe());
      }
      ++body;
    }
  }
  watch.stage = ChangeWatch::Stage::kChanges;
  watch.synced_at = catalog_.revision();
}

void Watches::Extend(ChangeWatch& watch, std::span<const std::string> added,
                     std::span<const std::string> dropped) {
  // Releases the mutex between slices.
  const auto in_slices = [this](std::span<const std::string> ids, const auto& take) {
    while (!ids.empty()) {
      const size_t count = std::min<size_t>(ids.size(), kMostLookupsPerHold);
      const std::lock_guard lock(mutex_);
      take(ids.first(count));
      ids = ids.subspan(count);
    }
  };
  in_slices(added, [&](std::span<const std::string> ids) { feed_.WatchAlso(watch, ids, {}); });
  in_slices(dropped, [&](std::span<const std::string> ids) { feed_.WatchAlso(watch, {}, ids); });
}

void Watches::Nudge(const std::shared_ptr<ChangeWatch>& watch) {
  Locked locked(mutex_);
  feed_.Nudge(locked, watch);
}

void Watches::Close(const std::shared_ptr<ChangeWatch>& watch) {
  const std::lock_guard lock(mutex_);
  feed_.Close(watch);
}

void Watches::EndAll() {
  Locked locked(mutex_);
  feed_.End(locked);
}

}  // namespace hulld::server
