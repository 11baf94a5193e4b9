#include "server/registry/watch/change_feed.h"

#include <algorithm>
#include <mutex>
#include <utility>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {
namespace {

HullChange DeletionOf(const std::string& id, uint64_t revision, bool is_body) {
  HullChange change;
  change.kind = ChangeKind::kDeleted;
  change.record.hull_id = id;
  change.record.revision = revision;
  change.is_body = is_body;
  return change;
}

}  // namespace

// The watches of a target, and the changes that some of them have not reported.
struct WatchGroup {
  // The last change of a hull.
  struct Pending {
    std::string id;
    ChangeFeed::Change change;
    // End of the previous incarnation; 0 if all watches reported it.
    uint64_t previous_end = 0;

    bool is_deletion() const { return change.kind == ChangeKind::kDeleted; }
  };

  // Bytes of a change, with two map nodes; approximate.
  static uint64_t BytesOf(const std::string& id) { return 2 * id.size() + sizeof(Pending) + 160; }

  WatchTarget target;
  Watch::Set watches;
  // Number of watches that wait.
  size_t waiting = 0;
  // Queued in ChangeFeed::due_.
  bool is_due = false;

  // By revision; each hull once.
  std::map<uint64_t, Pending> changes;
  std::unordered_map<std::string, uint64_t> revision_of;
  // Number of deletions in `changes`.
  size_t deletions = 0;
  uint64_t bytes = 0;
  // The last change, including dropped ones; and the number of watches that have not passed it.
  uint64_t last_revision = 0;
  size_t behind = 0;
  // Changes up to this revision were dropped before all watches had passed them.
  uint64_t lost_revision = 0;
};

void DeletionLog::Add(const std::string& id, uint64_t revision, bool was_body) {
  log_.push_back({revision, id, was_body});
  Last last{revision, was_body ? 0 : revision};
  if (const auto previous = last_.find(id); previous != last_.end()) {
    if (was_body) last.hull_revision = previous->second.hull_revision;
    // The new key outlives the previous one.
    last_.erase(previous);
  }
  last_.emplace(log_.back().id, last);
  if (log_.size() <= kCapacity) return;
  begin_ = log_.front().revision;
  const auto first = last_.find(log_.front().id);
  if (first != last_.end() && first->second.revision == begin_) last_.erase(first);
  log_.pop_front();
}

void DeletionLog::NoteCreation(const std::string& id, bool is_body) {
  const auto last = last_.find(id);
  if (last == last_.end()) return;
  if (is_body) {
    last->second.is_body_now = true;
  } else {
    last_.erase(last);
  }
}

std::deque<DeletionLog::Deletion>::const_iterator DeletionLog::After(uint64_t revision) const {
  return std::ranges::upper_bound(log_, revision, {}, &Deletion::revision);
}

bool DeletionLog::IsFinal(const Deletion& deletion, bool bodies) const {
  const auto last = last_.find(deletion.id);
  if (last == last_.end()) return false;
  if (!bodies) return deletion.revision == last->second.hull_revision;
  return deletion.revision == last->second.revision && !last->second.is_body_now;
}

ChangeFeed::ChangeFeed(const Store& store, FairMutex& mutex, MemoryBudget& memory,
                       std::chrono::milliseconds mark_interval)
    : store_(store),
      mutex_(mutex),
      memory_(memory),
      mark_interval_(mark_interval),
      charge_(memory, MemoryUse::kReading),
      thread_([this] { Run(); }) {}

ChangeFeed::~ChangeFeed() {
  {
    const std::lock_guard lock(mutex_);
    HULLD_CHECK(watches_.empty());
    is_stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void ChangeFeed::Begin(uint64_t revision, PageSource& pages) {
  pages_ = &pages;
  revision_ = revision;
  deletions_.Begin(revision);
}

void ChangeFeed::NotePresent(Locked& locked, const std::optional<Incarnation>& previous,
                             const HullPointer& hull, const std::shared_ptr<const Body>& body) {
  const HullRecord record = body != nullptr ? body->Describe().record : hull->committed().record;
  const Incarnation now = {record.create_revision, body != nullptr};
  Change change = {.is_body = now.is_body,
                   .revision = record.revision,
                   .create_revision = record.create_revision,
                   .hull = hull,
                   .body = body};
  change.kind = !previous.has_value() ? ChangeKind::kCreated
                : *previous == now    ? ChangeKind::kChanged
                                      : ChangeKind::kReplaced;
  if (previous.has_value() && previous->is_body != now.is_body) {
    change.other_kind_began = previous->create_revision;
    deletions_.Add(record.hull_id, change.revision, previous->is_body);
  }
  Note(locked, record.hull_id, change);
}

void ChangeFeed::NoteDeleted(Locked& locked, const std::string& id, const Incarnation& previous,
                             uint64_t revision) {
  deletions_.Add(id, revision, previous.is_body);
  Note(locked, id, {ChangeKind::kDeleted, previous.is_body, revision, previous.create_revision});
}

void ChangeFeed::NoteOther(const Locked& locked, uint64_t revision) {
  HULLD_CHECK(locked.Holds(mutex_) && revision > revision_);
  revision_ = revision;
}

// Returns the change as a watch of this target reports it; for a watch without bodies, an ID exists
// only while it is a hull's.
std::optional<ChangeFeed::Change> ChangeFeed::AsReportedTo(const WatchTarget& target,
                                                           const Change& change) {
  if (target.bodies || (!change.is_body && change.other_kind_began == 0)) return change;
  if (!change.is_body) {
    Change creation = change;
    creation.kind = ChangeKind::kCreated;
    return creation;
  }
  if (change.other_kind_began == 0) return std::nullopt;
  return Change{ChangeKind::kDeleted, false, change.revision, change.other_kind_began};
}

void ChangeFeed::Note(Locked& locked, const std::string& id, const Change& change) {
  HULLD_CHECK(locked.Holds(mutex_) && change.revision > revision_);
  revision_ = change.revision;
  if (change.kind != ChangeKind::kDeleted) deletions_.NoteCreation(id, change.is_body);
  const auto note_for = [&](const GroupsByName& groups, std::string_view name) {
    const auto found = groups.find(absl::string_view(name.data(), name.size()));
    if (found == groups.end()) return;
    for (const auto& group : found->second) {
      const std::optional<Change> reported = AsReportedTo(group->target, change);
      if (reported.has_value()) NoteFor(locked, group, id, *reported);
    }
  };
  for (const auto& [length, count] : prefix_lengths_) {
    if (length > id.size()) break;
    note_for(by_prefix_, std::string_view(id).substr(0, length));
  }
  note_for(by_id_, id);
}

// Replaces the pending change of the ID, if there is one.
void ChangeFeed::NoteFor(Locked& locked, const std::shared_ptr<WatchGroup>& group,
                         const std::string& id, const Change& change) {
  const uint64_t revision = change.revision;
  auto& changes = group->changes;
  const auto [place, is_new] = group->revision_of.emplace(id, revision);
  if (is_new) {
    changes.emplace_hint(changes.end(), revision, WatchGroup::Pending{id, {}, 0});
    group->bytes += WatchGroup::BytesOf(id);
    charge_.Set(charge_.bytes() + WatchGroup::BytesOf(id));
  } else {
    auto node = changes.extract(std::exchange(place->second, revision));
    const bool was_deletion = node.mapped().is_deletion();
    if (was_deletion) --group->deletions;
    if (was_deletion && change.kind == ChangeKind::kCreated) {
      node.mapped().previous_end = node.key();
    }
    node.key() = revision;
    changes.insert(changes.end(), std::move(node));
  }
  WatchGroup::Pending& pending = changes.rbegin()->second;
  pending.change = change;
  if (change.kind == ChangeKind::kReplaced) pending.previous_end = revision;
  if (change.kind == ChangeKind::kDeleted) ++group->deletions;

  group->last_revision = revision;
  group->behind = group->watches.size();
  if (group->deletions > DeletionLog::kCapacity) {
    DropChanges(*group);
    group->lost_revision = revision;
  }
  if (group->waiting == 0 || std::exchange(group->is_due, true)) return;
  due_.push_back(group);
  if (due_.size() == 1) locked.Defer([this] { wake_.notify_one(); });
}

// Returns a group to share, or a new one. Only watches of a prefix or a single hull are likely to
// have the same target.
std::shared_ptr<WatchGroup> ChangeFeed::GroupOf(const WatchTarget& target) {
  if (target.lists_existing) {
    const GroupsByName& groups = target.ids.empty() ? by_prefix_ : by_id_;
    const auto found = groups.find(target.ids.empty() ? target.prefix : *target.ids.begin());
    if (found != groups.end()) {
      for (const auto& group : found->second) {
        if (group->target == target) return group;
      }
    }
  }
  const auto group = std::make_shared<WatchGroup>();
  group->target = target;
  for (const std::string& id : target.ids) by_id_[id].push_back(group);
  if (!target.ids.empty()) return group;
  by_prefix_[target.prefix].push_back(group);
  ++prefix_lengths_[target.prefix.size()];
  return group;
}

void ChangeFeed::RemoveGroup(const std::shared_ptr<WatchGroup>& group) {
  DropChanges(*group);
  const WatchTarget& target = group->target;
  for (const std::string& id : target.ids) Remove(by_id_, id, group);
  if (!target.ids.empty()) return;
  Remove(by_prefix_, target.prefix, group);
  const auto length = prefix_lengths_.find(target.prefix.size());
  if (--length->second == 0) prefix_lengths_.erase(length);
}

void ChangeFeed::Remove(GroupsByName& groups, const std::string& name,
                        const std::shared_ptr<WatchGroup>& group) {
  const auto found = groups.find(name);
  HULLD_CHECK(found != groups.end());
  std::erase(found->second, group);
  if (found->second.empty()) groups.erase(found);
}

void ChangeFeed::DropChanges(WatchGroup& group) {
  charge_.Set(charge_.bytes() - std::exchange(group.bytes, 0));
  group.changes.clear();
  group.revision_of.clear();
  group.deletions = 0;
}

absl::StatusOr<std::shared_ptr<Watch>> ChangeFeed::Open(const WatchTarget& target,
                                                        const WatchPosition& position,
                                                        std::function<void()> on_ready) {
  HULLD_CHECK(!target.lists_existing || target.ids.size() <= 1);
  Locked locked(mutex_);
  HULLD_RETURN_IF_ERROR(memory_.Check(locked, MemoryUse::kReading));
  const auto watch = std::make_shared<Watch>();
  if (!watches_.empty()) watch->number_ = (*watches_.rbegin())->number_ + 1;
  watch->on_ready_ = std::move(on_ready);
  watch->cursor_ = watch->reported_ = revision_;
  watch->group_ = GroupOf(target);
  watch->group_->watches.insert(watch);
  watches_.insert(watch);
  // The thread waits for marks only while there are watches.
  if (watches_.size() == 1) wake_.notify_one();
  if (!target.lists_existing) return watch;
  const bool resumes = position.after_revision > 0;
  const bool can_resume = resumes && position.store_id == store_.id() &&
                          position.after_revision <= revision_ &&
                          deletions_.IsCompleteAfter(position.after_revision);
  BeginCatchUp(*watch, can_resume ? position.after_revision : 0);
  watch->restarted_ = resumes && !can_resume;
  return watch;
}

void ChangeFeed::Close(const std::shared_ptr<Watch>& watch) {
  const std::lock_guard lock(mutex_);
  const std::shared_ptr<WatchGroup> group = watch->group_;
  if (std::exchange(watch->is_waiting_, false)) --group->waiting;
  MoveCursor(*watch, revision_);
  watches_.erase(watch);
  group->watches.erase(watch);
  if (group->watches.empty()) RemoveGroup(group);
}

void ChangeFeed::ChangeIds(Watch& watch, std::span<const std::string> added,
                           std::span<const std::string> removed) {
  const std::shared_ptr<WatchGroup> group = watch.group_;
  HULLD_CHECK(!group->target.lists_existing);
  const auto in_slices = [this](std::span<const std::string> ids, const auto& change) {
    while (!ids.empty()) {
      const size_t count = std::min<size_t>(ids.size(), kMaxLookupsPerHold);
      const std::lock_guard lock(mutex_);
      for (const std::string& id : ids.first(count)) change(id);
      ids = ids.subspan(count);
    }
  };
  in_slices(added, [&](const std::string& id) {
    HULLD_CHECK(group->target.ids.insert(id).second);
    by_id_[id].push_back(group);
  });
  in_slices(removed, [&](const std::string& id) {
    HULLD_CHECK(group->target.ids.erase(id) == 1);
    Remove(by_id_, id, group);
  });
}

absl::StatusOr<WatchBatch> ChangeFeed::Next(const std::shared_ptr<Watch>& watch) {
  Locked locked(mutex_);
  if (has_ended_) return Draining();
  if (IsLost(*watch)) Restart(*watch);
  WatchBatch batch;
  batch.revision = watch->catch_up_.after_revision;
  if (watch->state_ != Watch::State::kCatchingUp) {
    AddChanges(*watch, &batch);
  } else if (watch->catch_up_.deletions_after != Watch::kNoDeletions) {
    AddDeletions(*watch, &batch);
  } else if (absl::Status s = AddExisting(locked, watch, &batch); !s.ok()) {
    return s;
  }
  if (!batch.waits) batch.restarted = std::exchange(watch->restarted_, false);
  return batch;
}

// Returns true if changes or deletions that the watch has not reported were dropped.
bool ChangeFeed::IsLost(const Watch& watch) const {
  return watch.cursor_ < watch.group_->lost_revision ||
         !deletions_.IsCompleteAfter(watch.catch_up_.deletions_after);
}

void ChangeFeed::Restart(Watch& watch) {
  watch.restarted_ = true;
  if (watch.group_->target.lists_existing) return BeginCatchUp(watch, 0);
  watch.state_ = Watch::State::kSynced;
  MoveCursor(watch, revision_);
}

// after_revision: 0, or the revision after which the watch resumes.
void ChangeFeed::BeginCatchUp(Watch& watch, uint64_t after_revision) {
  watch.state_ = Watch::State::kCatchingUp;
  watch.catch_up_ = {};
  watch.synced_at_.reset();
  MoveCursor(watch, revision_);
  if (after_revision == 0) return;
  watch.catch_up_.after_revision = watch.catch_up_.deletions_after = after_revision;
}

void ChangeFeed::AddDeletions(Watch& watch, WatchBatch* batch) {
  const WatchTarget& target = watch.group_->target;
  uint64_t& after = watch.catch_up_.deletions_after;
  size_t visited = 0;
  for (auto next = deletions_.After(after); next != deletions_.end(); ++next) {
    if (next->revision > watch.cursor_) break;
    if (visited++ == kMaxPerBatch) return;
    after = next->revision;
    if (!target.Includes(next->id) || (next->was_body && !target.bodies)) continue;
    if (!deletions_.IsFinal(*next, target.bodies)) continue;
    batch->changes.push_back(DeletionOf(next->id, next->revision, next->was_body));
  }
  after = Watch::kNoDeletions;
}

// Adds the next page of existing hulls and bodies. While it is read from the store, the watch
// waits. After the last page, the changes noted since the listing began follow.
absl::Status ChangeFeed::AddExisting(Locked& locked, const std::shared_ptr<Watch>& watch,
                                     WatchBatch* batch) {
  Watch::CatchUp& catch_up = watch->catch_up_;
  if (catch_up.page == nullptr) {
    catch_up.page = std::make_shared<std::optional<absl::StatusOr<RecordPage>>>();
    const WatchTarget& target = watch->group_->target;
    pages_->ReadPage(
        locked,
        {target.prefix,
         {target.ids.begin(), target.ids.end()},
         {.hulls = true, .bodies = target.bodies},
         catch_up.last_id,
         kMaxPerBatch},
        [this, watch, page = catch_up.page](Locked& now, absl::StatusOr<RecordPage> read) {
          // A watch that restarted or was closed does not use it.
          *page = std::move(read);
          Wake(now, watch);
        });
  }
  if (!catch_up.page->has_value()) {
    Wait(*watch, batch);
    return absl::OkStatus();
  }
  HULLD_ASSIGN_OR_RETURN(RecordPage page, **std::exchange(catch_up.page, nullptr));
  for (HullChange& change : page.entries) {
    catch_up.last_id = change.record.hull_id;
    // A damaged hull or body may have no revision.
    const uint64_t after = catch_up.after_revision;
    if (after == 0 || change.record.revision > after) batch->changes.push_back(std::move(change));
  }
  if (page.more) return absl::OkStatus();
  watch->state_ = Watch::State::kBehind;
  watch->synced_at_ = revision_;
  return absl::OkStatus();
}

void ChangeFeed::AddChanges(Watch& watch, WatchBatch* batch) {
  const auto& changes = watch.group_->changes;
  const uint64_t before = watch.cursor_;
  const bool was_synced = watch.state_ == Watch::State::kSynced;
  // A reader that reads existing hulls itself may know hulls created after the cursor.
  const bool may_be_ahead = !watch.group_->target.lists_existing;
  uint64_t revision = revision_;
  auto next = changes.upper_bound(before);
  for (size_t visited = 0; next != changes.end(); ++next) {
    if (visited++ == kMaxPerBatch) {
      revision = std::prev(next)->first;
      break;
    }
    const auto& [id, change, previous_end] = next->second;
    const bool was_known = change.create_revision <= before;
    const bool another_ended = previous_end > before;
    if (change.kind == ChangeKind::kDeleted) {
      if (was_synced && !was_known && !another_ended && !may_be_ahead) continue;
      batch->changes.push_back(DeletionOf(id, change.revision, change.is_body));
      continue;
    }
    HullChange described = change.is_body ? change.body->Describe() : change.hull->Describe();
    if (was_synced) {
      described.kind = was_known       ? ChangeKind::kChanged
                       : another_ended ? ChangeKind::kReplaced
                                       : ChangeKind::kCreated;
    }
    batch->changes.push_back(std::move(described));
  }
  watch.state_ = next == changes.end() ? Watch::State::kSynced : Watch::State::kBehind;
  MoveCursor(watch, revision);
  batch->revision = revision;
  batch->synced = watch.synced_at_.has_value() && revision >= *watch.synced_at_;
  if (batch->synced) watch.synced_at_.reset();
  const bool is_nudged = std::exchange(watch.is_nudged_, false);
  const bool is_behind = watch.state_ == Watch::State::kBehind;
  if (batch->changes.empty() && !batch->synced && !is_nudged && !is_behind && !watch.restarted_) {
    return Wait(watch, batch);
  }
  watch.reported_ = revision;
}

// Drops the changes of the group when no watch is behind.
void ChangeFeed::MoveCursor(Watch& watch, uint64_t revision) {
  WatchGroup& group = *watch.group_;
  const bool was_behind = watch.cursor_ < group.last_revision;
  watch.cursor_ = revision;
  if (!was_behind || revision < group.last_revision) return;
  HULLD_CHECK(group.behind > 0);
  if (--group.behind == 0) DropChanges(group);
}

void ChangeFeed::Wait(Watch& watch, WatchBatch* batch) {
  batch->waits = true;
  HULLD_CHECK(!std::exchange(watch.is_waiting_, true));
  ++watch.group_->waiting;
}

void ChangeFeed::Wake(Locked& locked, const std::shared_ptr<Watch>& watch) {
  HULLD_CHECK(locked.Holds(mutex_));
  if (!watch->is_waiting_) return;
  MakeReady(watch);
  locked.Defer([this] { wake_.notify_one(); });
}

void ChangeFeed::Nudge(const std::shared_ptr<Watch>& watch) {
  Locked locked(mutex_);
  watch->is_nudged_ = true;
  Wake(locked, watch);
}

void ChangeFeed::EndAll() {
  Locked locked(mutex_);
  has_ended_ = true;
  for (const auto& watch : watches_) Wake(locked, watch);
}

void ChangeFeed::MakeReady(const std::shared_ptr<Watch>& watch) {
  HULLD_CHECK(std::exchange(watch->is_waiting_, false));
  --watch->group_->waiting;
  ready_.push_back(watch);
}

void ChangeFeed::Run() {
  Locked locked(mutex_);
  auto next_marks = SteadyClock::now() + mark_interval_;
  while (!is_stopping_) {
    if (due_.empty() && ready_.empty()) {
      if (watches_.empty()) {
        locked.WaitOn([this](auto& lock) { wake_.wait(lock); });
      } else {
        locked.WaitOn([&](auto& lock) { wake_.wait_until(lock, next_marks); });
      }
    }
    for (const auto& group : std::exchange(due_, {})) {
      group->is_due = false;
      for (const auto& watch : group->watches) {
        if (watch->is_waiting_) MakeReady(watch);
      }
    }
    if (const auto now = SteadyClock::now(); now >= next_marks) {
      next_marks = now + mark_interval_;
      NudgeForMarks();
    }
    {
      const auto ready = std::exchange(ready_, {});
      locked.Unlock();
      for (const auto& watch : ready) watch->on_ready_();
    }
    locked.Lock();
  }
}

// A watch still waits, so its target did not change, but the revision advanced.
void ChangeFeed::NudgeForMarks() {
  for (const auto& watch : watches_) {
    if (!watch->is_waiting_ || watch->reported_ == revision_) continue;
    watch->is_nudged_ = true;
    MakeReady(watch);
  }
}

}  // namespace hulld::server
