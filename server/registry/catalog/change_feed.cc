#include "server/registry/catalog/change_feed.h"

#include <algorithm>
#include <mutex>
#include <utility>

#include "core/base/check.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {
namespace {

// The last change of a hull or body.
struct Changed {
  std::string id;
  // Both null for a deletion.
  std::shared_ptr<RegisteredHull> hull;
  std::shared_ptr<const Body> body;
  bool is_body = false;
  // Start of the current incarnation, or of the deleted one.
  uint64_t create_revision = 0;
  // End of the previous incarnation; 0 if every watch reported it.
  uint64_t former_end = 0;

  bool went() const { return hull == nullptr && body == nullptr; }
};

HullChange DeletionOf(const std::string& id, uint64_t revision, bool is_body) {
  HullChange change;
  change.kind = ChangeKind::kDeleted;
  change.record.hull_id = id;
  change.record.revision = revision;
  change.is_body = is_body;
  return change;
}

// Bytes of a change with two map nodes; approximate.
uint64_t BytesOf(const std::string& id) { return 2 * id.size() + sizeof(Changed) + 160; }

}  // namespace

// The watches of a target, and the changes that some of them have not reported.
struct WatchInterest {
  WatchTarget target;
  // Watched IDs in addition to the target's (WatchAlso).
  std::set<std::string> more_ids;
  std::set<std::shared_ptr<ChangeWatch>> watches;
  size_t armed = 0;
  // Queued in due_.
  bool is_due = false;

  // By revision; each hull appears at its last change only.
  std::map<uint64_t, Changed> changes;
  std::unordered_map<std::string, uint64_t> revision_of;
  // Number of deletions in `changes`.
  size_t deletions = 0;
  uint64_t bytes = 0;
  // The last change, including dropped ones, and the number of watches with a cursor before it.
  uint64_t last_revision = 0;
  size_t behind = 0;
  // Changes up to this revision were dropped before all watches had reported them.
  uint64_t lost_revision = 0;
};

ChangeFeed::ChangeFeed(FairMutex& order, MemoryBudget& budget,
                       std::chrono::milliseconds mark_interval)
    : order_(order),
      mark_interval_(mark_interval),
      charge_(budget, MemoryUse::kReading),
      thread_([this] { Run(); }) {}

ChangeFeed::~ChangeFeed() {
  {
    const std::lock_guard lock(order_);
    HULLD_CHECK(watches_.empty());
    ending_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void ChangeFeed::Begin(uint64_t revision) { revision_ = deletions_begin_ = revision; }

void ChangeFeed::NoteCreated(Locked& locked, const std::shared_ptr<RegisteredHull>& hull) {
  const HullRecord& record = hull->committed().record;
  Note(locked, record.hull_id,
       {record.revision, record.create_revision, Life::kBegan, false, hull});
}

void ChangeFeed::NoteChanged(Locked& locked, const std::shared_ptr<RegisteredHull>& hull) {
  const HullRecord& record = hull->committed().record;
  Note(locked, record.hull_id,
       {record.revision, record.create_revision, Life::kChanged, false, hull});
}

void ChangeFeed::NoteReplaced(Locked& locked, const std::shared_ptr<RegisteredHull>& hull) {
  const HullRecord& record = hull->committed().record;
  Note(locked, record.hull_id,
       {record.revision, record.create_revision, Life::kReplaced, false, hull});
}

void ChangeFeed::NoteDeleted(Locked& locked, const HullRecord& record, uint64_t revision) {
  const State state = {revision, record.create_revision, Life::kEnded};
  RememberDeletion(record.hull_id, state);
  Note(locked, record.hull_id, state);
}

void ChangeFeed::NoteBodyPut(Locked& locked, const BodyRecord* former,
                             const std::shared_ptr<const Body>& body) {
  const BodyRecord& record = body->record();
  const Life life = former == nullptr                                   ? Life::kBegan
                    : record.create_revision != former->create_revision ? Life::kReplaced
                                                                        : Life::kChanged;
  Note(locked, record.body_id,
       {record.revision, record.create_revision, life, true, nullptr, body});
}

void ChangeFeed::NoteBodyDeleted(Locked& locked, const BodyRecord& record, uint64_t revision) {
  const State state = {revision, record.create_revision, Life::kEnded, true};
  RememberDeletion(record.body_id, state);
  Note(locked, record.body_id, state);
}

void ChangeFeed::NoteBecameBody(Locked& locked, const HullRecord& former,
                                const std::shared_ptr<const Body>& body) {
  const BodyRecord& record = body->record();
  RememberDeletion(former.hull_id, {record.revision, former.create_revision, Life::kEnded});
  Note(locked, record.body_id,
       {record.revision, record.create_revision, Life::kReplaced, true, nullptr, body,
        former.create_revision});
}

void ChangeFeed::NoteBecameHull(Locked& locked, const BodyRecord& former,
                                const std::shared_ptr<RegisteredHull>& hull) {
  const HullRecord& record = hull->committed().record;
  RememberDeletion(record.hull_id, {record.revision, former.create_revision, Life::kEnded, true});
  Note(locked, record.hull_id,
       {record.revision, record.create_revision, Life::kReplaced, false, hull, nullptr,
        former.create_revision});
}

void ChangeFeed::NoteOther(const Locked& locked, uint64_t revision) {
  HULLD_CHECK(locked.Holds(order_) && revision > revision_);
  revision_ = revision;
}

// Returns the state as a watch of this target reports it: for a watch without bodies, an ID exists
// only while a hull has it.
std::optional<ChangeFeed::State> ChangeFeed::AsToldTo(const WatchTarget& target,
                                                      const State& state) {
  if (target.bodies || (!state.is_body && state.other_kind_began == 0)) return state;
  if (!state.is_body) {
    State begun = state;
    begun.life = Life::kBegan;
    return begun;
  }
  if (state.other_kind_began == 0) return std::nullopt;
  return State{state.revision, state.other_kind_began, Life::kEnded};
}

void ChangeFeed::Note(Locked& locked, const std::string& id, const State& state) {
  HULLD_CHECK(locked.Holds(order_) && state.revision > revision_);
  revision_ = state.revision;
  if (state.life != Life::kEnded) NoteBegan(id, state.is_body);
  const auto note_for = [&](const Interests& interests) {
    for (const auto& interest : interests) {
      const std::optional<State> told = AsToldTo(interest->target, state);
      if (told.has_value()) NoteFor(locked, interest, id, *told);
    }
  };
  for (const auto& [length, count] : prefix_lengths_) {
    if (length > id.size()) break;
    const auto found = by_prefix_.find(std::string_view(id).substr(0, length));
    if (found != by_prefix_.end()) note_for(found->second);
  }
  const auto found = by_id_.find(id);
  if (found != by_id_.end()) note_for(found->second);
}

void ChangeFeed::NoteFor(Locked& locked, const std::shared_ptr<WatchInterest>& interest,
                         const std::string& id, const State& state) {
  const uint64_t revision = state.revision;
  auto& changes = interest->changes;
  const auto [place, is_new] = interest->revision_of.emplace(id, revision);
  if (is_new) {
    Changed changed;
    changed.id = id;
    changes.emplace_hint(changes.end(), revision, std::move(changed));
    Count(interest->bytes, interest->bytes + BytesOf(id));
    interest->bytes += BytesOf(id);
  } else {
    auto node = changes.extract(std::exchange(place->second, revision));
    const bool was_deleted = node.mapped().went();
    if (was_deleted) --interest->deletions;
    if (was_deleted && state.life == Life::kBegan) node.mapped().former_end = node.key();
    node.key() = revision;
    changes.insert(changes.end(), std::move(node));
  }
  Changed& changed = changes.rbegin()->second;
  changed.hull = state.hull;
  changed.body = state.body;
  changed.is_body = state.is_body;
  changed.create_revision = state.create_revision;
  if (state.life == Life::kReplaced) changed.former_end = revision;
  if (state.life == Life::kEnded) ++interest->deletions;

  interest->last_revision = revision;
  interest->behind = interest->watches.size();
  if (interest->deletions > kMostDeletions) {
    Forget(*interest);
    interest->lost_revision = revision;
  }
  if (interest->armed == 0 || std::exchange(interest->is_due, true)) return;
  due_.push_back(interest);
  if (due_.size() == 1) locked.Afterwards([this] { wake_.notify_one(); });
}

void ChangeFeed::NoteBegan(const std::string& id, bool is_body) {
  const auto found = gone_.find(id);
  if (found == gone_.end()) return;
  if (is_body) {
    found->second.is_body_now = true;
  } else {
    gone_.erase(found);
  }
}

void ChangeFeed::RememberDeletion(const std::string& id, const State& state) {
  deletions_.push_back({state.revision, id, state.is_body});
  // The key must refer to the ID of the last deletion.
  gone_.erase(id);
  gone_.emplace(deletions_.back().id, Gone{state.revision});
  if (deletions_.size() <= kMostDeletions) return;
  deletions_begin_ = deletions_.front().revision;
  const auto first = gone_.find(deletions_.front().id);
  if (first != gone_.end() && first->second.revision == deletions_begin_) gone_.erase(first);
  deletions_.pop_front();
}

void ChangeFeed::Count(uint64_t before, uint64_t now) {
  bytes_ += now - before;
  charge_.Set(bytes_);
}

std::shared_ptr<WatchInterest> ChangeFeed::FindInterest(const WatchTarget& target) const {
  // Only a prefix or a single hull is likely to have several watches.
  if (target.varies || target.ids.size() > 1) return nullptr;
  const auto& by_name = target.ids.empty() ? by_prefix_ : by_id_;
  const auto found = by_name.find(target.ids.empty() ? target.prefix : target.ids.front());
  if (found == by_name.end()) return nullptr;
  for (const auto& interest : found->second) {
    if (interest->target == target) return interest;
  }
  return nullptr;
}

void ChangeFeed::AddInterest(const std::shared_ptr<WatchInterest>& interest) {
  const WatchTarget& target = interest->target;
  for (const std::string& id : target.ids) AddId(id, interest);
  if (!target.ids.empty()) return;
  by_prefix_[target.prefix].push_back(interest);
  ++prefix_lengths_[target.prefix.size()];
}

void ChangeFeed::RemoveInterest(const std::shared_ptr<WatchInterest>& interest) {
  Forget(*interest);
  const WatchTarget& target = interest->target;
  for (const std::string& id : target.ids) RemoveId(id, interest);
  for (const std::string& id : interest->more_ids) RemoveId(id, interest);
  if (!target.ids.empty()) return;
  const auto found = by_prefix_.find(target.prefix);
  std::erase(found->second, interest);
  if (found->second.empty()) by_prefix_.erase(found);
  const auto length = prefix_lengths_.find(target.prefix.size());
  if (--length->second == 0) prefix_lengths_.erase(length);
}

void ChangeFeed::AddId(const std::string& id, const std::shared_ptr<WatchInterest>& interest) {
  by_id_[id].push_back(interest);
}

void ChangeFeed::RemoveId(const std::string& id, const std::shared_ptr<WatchInterest>& interest) {
  const auto found = by_id_.find(id);
  HULLD_CHECK(found != by_id_.end());
  std::erase(found->second, interest);
  if (found->second.empty()) by_id_.erase(found);
}

void ChangeFeed::WatchAlso(ChangeWatch& watch, std::span<const std::string> added,
                           std::span<const std::string> dropped) {
  const std::shared_ptr<WatchInterest> interest = watch.interest;
  HULLD_CHECK(interest->target.varies);
  for (const std::string& id : added) {
    HULLD_CHECK(interest->more_ids.insert(id).second);
    AddId(id, interest);
  }
  for (const std::string& id : dropped) {
    HULLD_CHECK(interest->more_ids.erase(id) == 1);
    RemoveId(id, interest);
  }
}

std::shared_ptr<ChangeWatch> ChangeFeed::Open(const WatchTarget& target,
                                              std::function<void()> on_ready) {
  auto watch = std::make_shared<ChangeWatch>();
  watch->on_ready = std::move(on_ready);
  watch->cursor = watch->told = revision_;
  watch->is_exact = true;
  watch->interest = FindInterest(target);
  if (watch->interest == nullptr) {
    watch->interest = std::make_shared<WatchInterest>();
    watch->interest->target = target;
    AddInterest(watch->interest);
  }
  watch->interest->watches.insert(watch);
  watches_.insert(watch);
  // The thread waits for marks only while watches exist.
  if (watches_.size() == 1) wake_.notify_one();
  return watch;
}

void ChangeFeed::Close(const std::shared_ptr<ChangeWatch>& watch) {
  if (std::exchange(watch->is_armed, false)) --watch->interest->armed;
  MoveCursor(*watch, revision_);
  watches_.erase(watch);
  const std::shared_ptr<WatchInterest> interest = watch->interest;
  interest->watches.erase(watch);
  if (interest->watches.empty()) RemoveInterest(interest);
}

// Drops the changes of the interest when none of its watches is behind.
void ChangeFeed::MoveCursor(ChangeWatch& watch, uint64_t revision) {
  WatchInterest& interest = *watch.interest;
  const bool was_behind = watch.cursor < interest.last_revision;
  watch.cursor = revision;
  if (!was_behind || revision < interest.last_revision) return;
  HULLD_CHECK(interest.behind > 0);
  if (--interest.behind == 0) Forget(interest);
}

void ChangeFeed::Forget(WatchInterest& interest) {
  Count(interest.bytes, 0);
  interest.bytes = 0;
  interest.changes.clear();
  interest.revision_of.clear();
  interest.deletions = 0;
}

bool ChangeFeed::IsLost(const ChangeWatch& watch) const {
  if (watch.stage == ChangeWatch::Stage::kDeletions && !Remembers(watch.last_deletion)) return true;
  return watch.cursor < watch.interest->lost_revision;
}

const WatchTarget& ChangeFeed::TargetOf(const ChangeWatch& watch) { return watch.interest->target; }

void ChangeFeed::StartAnew(ChangeWatch& watch) {
  watch.stage = ChangeWatch::Stage::kPresent;
  watch.after_revision = 0;
  watch.last_id.clear();
  MoveCursor(watch, revision_);
  watch.synced_at.reset();
  watch.is_exact = false;
  watch.anew = true;
}

bool ChangeFeed::TakeDeletions(ChangeWatch& watch,
                               const std::function<bool(const std::string&)>& is_there,
                               WatchPiece* piece) {
  const WatchTarget& target = watch.interest->target;
  auto next = std::upper_bound(
      deletions_.begin(), deletions_.end(), watch.last_deletion,
      [](uint64_t revision, const Deletion& deletion) { return revision < deletion.revision; });
  for (size_t looked_at = 0; next != deletions_.end(); ++next) {
    const auto& [revision, id, is_body] = *next;
    if (revision > watch.cursor) return false;
    if (looked_at++ == kMostPerPiece) return true;
    watch.last_deletion = revision;
    const bool is_watched =
        target.ids.empty() ? id.starts_with(target.prefix) : id == target.ids.front();
    if (!is_watched || (is_body && !target.bodies) || is_there(id)) continue;
    piece->changes.push_back(DeletionOf(id, revision, is_body));
  }
  return false;
}

void ChangeFeed::TakeChanges(ChangeWatch& watch, WatchPiece* piece) {
  const auto& changes = watch.interest->changes;
  const uint64_t before = watch.cursor;
  auto next = changes.upper_bound(before);
  uint64_t revision = revision_;
  for (size_t looked_at = 0; next != changes.end(); ++next) {
    if (looked_at++ == kMostPerPiece) {
      revision = std::prev(next)->first;
      break;
    }
    const Changed& changed = next->second;
    const bool is_known = changed.create_revision <= before;
    const bool another_ended = changed.former_end > before;
    if (changed.went()) {
      if (watch.is_exact && !is_known && !another_ended) continue;
      piece->changes.push_back(DeletionOf(changed.id, next->first, changed.is_body));
      continue;
    }
    HullChange change = changed.is_body ? changed.body->Describe() : changed.hull->Describe();
    if (watch.is_exact) {
      change.kind = is_known        ? ChangeKind::kChanged
                    : another_ended ? ChangeKind::kReplaced
                                    : ChangeKind::kCreated;
    }
    piece->changes.push_back(std::move(change));
  }
  watch.is_exact = next == changes.end();
  MoveCursor(watch, revision);
  piece->revision = revision;
  piece->synced = watch.synced_at.has_value() && revision >= *watch.synced_at;
  if (piece->synced) watch.synced_at.reset();
  const bool is_nudged = std::exchange(watch.is_nudged, false);
  if (!piece->changes.empty() || piece->synced || is_nudged || !watch.is_exact) {
    watch.told = revision;
    return;
  }
  piece->waits = true;
  Arm(watch);
}

void ChangeFeed::Arm(ChangeWatch& watch) {
  HULLD_CHECK(!std::exchange(watch.is_armed, true));
  ++watch.interest->armed;
}

void ChangeFeed::Wake(Locked& locked, const std::shared_ptr<ChangeWatch>& watch) {
  HULLD_CHECK(locked.Holds(order_));
  if (!watch->is_armed) return;
  MakeReady(watch);
  locked.Afterwards([this] { wake_.notify_one(); });
}

void ChangeFeed::Nudge(Locked& locked, const std::shared_ptr<ChangeWatch>& watch) {
  HULLD_CHECK(locked.Holds(order_));
  watch->is_nudged = true;
  Wake(locked, watch);
}

void ChangeFeed::End(Locked& locked) {
  has_ended_ = true;
  for (const auto& watch : watches_) Nudge(locked, watch);
}

void ChangeFeed::MakeReady(const std::shared_ptr<ChangeWatch>& watch) {
  HULLD_CHECK(std::exchange(watch->is_armed, false));
  --watch->interest->armed;
  ready_.push_back(watch);
}

void ChangeFeed::Run() {
  Locked locked(order_);
  auto next_marks = SteadyClock::now() + mark_interval_;
  while (!ending_) {
    if (due_.empty() && ready_.empty()) {
      if (watches_.empty()) {
        locked.WaitOn([this](auto& lock) { wake_.wait(lock); });
      } else {
        locked.WaitOn([&](auto& lock) { wake_.wait_until(lock, next_marks); });
      }
    }
    for (const auto& interest : std::exchange(due_, {})) {
      interest->is_due = false;
      for (const auto& watch : interest->watches) {
        if (watch->is_armed) MakeReady(watch);
      }
    }
    if (const auto now = SteadyClock::now(); now >= next_marks) {
      next_marks = now + mark_interval_;
      NudgeForMarks();
    }
    {
      const auto ready = std::exchange(ready_, {});
      locked.Unlock();
      for (const auto& watch : ready) watch->on_ready();
    }
    locked.Lock();
  }
}

// A watch still waits, so its target did not change, but the revision advanced.
void ChangeFeed::NudgeForMarks() {
  for (const auto& watch : watches_) {
    if (!watch->is_armed || watch->told == revision_) continue;
    watch->is_nudged = true;
    MakeReady(watch);
  }
}

}  // namespace hulld::server
