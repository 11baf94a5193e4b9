// Watches: what is there, then what changes.
#include <absl/status/status.h>

#include <utility>

#include "server/contract/error_info.h"
#include "server/registry/registered_hull.h"
#include "server/registry/registry.h"

namespace hulld::server {

absl::StatusOr<std::shared_ptr<ChangeWatch>> Registry::OpenWatch(const WatchTarget& target,
                                                                 const WatchStart& start,
                                                                 std::function<void()> on_ready) {
  Locked locked(mutex_);
  if (absl::Status s = memory_.Check(locked, MemoryUse::kReading); !s.ok()) return s;
  std::shared_ptr<ChangeWatch> watch = feed_.Open(target, std::move(on_ready));
  if (!start.tell_present) return watch;
  const bool resumes = start.after_revision > 0;
  const bool can_resume = start.store_id == store_.id() && start.after_revision <= revision_ &&
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

absl::StatusOr<WatchPiece> Registry::TakeChanges(ChangeWatch& watch) {
  const std::lock_guard lock(mutex_);
  if (feed_.has_ended()) return Draining();
  if (feed_.IsLost(watch)) feed_.StartAnew(watch);
  WatchPiece piece;
  piece.anew = std::exchange(watch.anew, false);
  piece.revision = watch.after_revision;
  const auto is_there = [this](const std::string& id) { return hulls_.IsVisible(id); };
  switch (watch.stage) {
    case ChangeWatch::Stage::kDeletions:
      if (!feed_.TakeDeletions(watch, is_there, &piece)) watch.stage = ChangeWatch::Stage::kPresent;
      break;
    case ChangeWatch::Stage::kPresent:
      TakePresent(watch, &piece);
      break;
    case ChangeWatch::Stage::kChanges:
      feed_.TakeChanges(watch, &piece);
      break;
  }
  return piece;
}

// Some of what is there. What changes behind the walk is told after it.
void Registry::TakePresent(ChangeWatch& watch, WatchPiece* piece) {
  // What changed before the first step need not be told twice.
  if (watch.last_id.empty() && watch.after_revision == 0) feed_.SkipChanges(watch);
  const WatchTarget& target = feed_.TargetOf(watch);
  const std::string& prefix = target.ids.empty() ? target.prefix : target.ids.front();
  const HullTable::Entries& all = hulls_.entries();
  auto next = watch.last_id.empty() ? all.lower_bound(prefix) : all.upper_bound(watch.last_id);
  for (size_t looked_at = 0; next != all.end() && next->first.starts_with(prefix); ++next) {
    if (!target.ids.empty() && next->first != prefix) break;
    if (looked_at++ == ChangeFeed::kMostPerPiece) return;
    watch.last_id = next->first;
    const HullTable::Entry& hull = next->second;
    const bool is_new = hull.revision() > watch.after_revision;
    if (is_new && hull.visible()) piece->changes.push_back(hull.Describe(next->first));
  }
  watch.stage = ChangeWatch::Stage::kChanges;
  watch.synced_at = revision_;
}

void Registry::NudgeWatch(const std::shared_ptr<ChangeWatch>& watch) {
  Locked locked(mutex_);
  feed_.Nudge(locked, watch);
}

void Registry::CloseWatch(const std::shared_ptr<ChangeWatch>& watch) {
  const std::lock_guard lock(mutex_);
  feed_.Close(watch);
}

void Registry::EndWatches() {
  Locked locked(mutex_);
  feed_.End(locked);
}

}  // namespace hulld::server
