#include "server/registry/read/hull_reader.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/contract/stopped_call.h"
#include "server/registry/catalog/registered_hull.h"
#include "server/registry/memory/hull_loader.h"

namespace hulld::server {

// Hulls are numbered by their first occurrence: neighbors in a request were mostly created
// together, so a store has them in one place.
void KnownHulls::Begin(std::span<const std::string> ids) {
  HULLD_CHECK(!has_begun_ || hull_of_.size() == ids.size());
  if (std::exchange(has_begun_, true)) return;
  hulls_.reserve(ids.size());
  hull_of_.reserve(ids.size());
  by_hash_.reserve(ids.size());
  for (uint32_t i = 0; i < ids.size(); ++i) {
    const auto next = static_cast<uint32_t>(hulls_.size());
    uint32_t* hull = &by_hash_.try_emplace(RecentChanges::HashOf(ids[i]), next).first->second;
    while (*hull != next && *hull != kNone && ids[hulls_[*hull].first] != ids[i]) {
      hull = &hulls_[*hull].same_hash;
    }
    if (*hull == kNone) *hull = next;
    hull_of_.push_back(*hull);
    if (*hull == next) hulls_.emplace_back().first = i;
  }
  ForgetAll();
}

// In reverse, so that the first hull is processed first.
void KnownHulls::ForgetAll() {
  for (size_t k = hulls_.size(); k-- > 0;) MakeDue(static_cast<uint32_t>(k));
}

void KnownHulls::NoteChange(uint64_t hash) {
  const auto changed = by_hash_.find(hash);
  if (changed == by_hash_.end()) return;
  for (uint32_t k = changed->second; k != kNone; k = hulls_[k].same_hash) MakeDue(k);
}

void KnownHulls::MakeDue(uint32_t hull) {
  if (!std::exchange(hulls_[hull].is_due, true)) due_.push_back(hull);
}

void KnownHulls::BeginLookup() {
  for (uint32_t k = 0; k < hulls_.size(); ++k) {
    hulls_[k].is_prepared = false;
    const absl::Status& status = hulls_[k].view.status();
    const bool is_final = status.ok() || absl::IsNotFound(status) || absl::IsDataLoss(status);
    if (!is_final) MakeDue(k);
  }
}

uint64_t KnownHulls::HullBytes() const {
  uint64_t bytes = 0;
  for (const Known& known : hulls_) bytes += known.view.ok() ? known.bytes : 0;
  return bytes;
}

std::vector<absl::StatusOr<HullView>> KnownHulls::Views(std::span<const std::string> ids) {
  HULLD_CHECK(ids.size() == hull_of_.size());
  std::vector<absl::StatusOr<HullView>> views;
  views.reserve(ids.size());
  const bool takes = is_for_one_lookup_ && hulls_.size() == ids.size();
  for (const uint32_t hull : hull_of_) {
    absl::StatusOr<HullView>& view = hulls_[hull].view;
    views.push_back(takes ? std::move(view) : view);
  }
  return views;
}

// A read of several hulls.
struct HullReader::HullsRead {
  std::span<const std::string> ids;
  KnownHulls& known;
  const std::function<bool()>& should_stop;
  const ReadPlan& plan;
};

// Finds the hulls due next and loads them into the processor's caches, so that their cache misses
// overlap: a lookup reads about twenty cache lines, each found through another. Returns the number
// of due hulls that remain after them.
size_t HullReader::FindAhead(const HullsRead& read) {
  constexpr size_t kFoundAhead = 16;
  KnownHulls& known = read.known;
  const size_t count = std::min(kFoundAhead, known.due_.size());
  const std::span<const uint32_t> next = std::span(known.due_).last(count);
  HullTable& hulls = state_.hulls;
  for (const uint32_t k : next) hulls.Prefetch(read.ids[known.hulls_[k].first]);
  for (const uint32_t k : next) {
    HullPointer& found = known.hulls_[k].found;
    if (found == nullptr) found = hulls.Find(read.ids[known.hulls_[k].first]);
    if (found != nullptr) found->Prefetch();
  }
  for (const uint32_t k : next) {
    if (known.hulls_[k].found != nullptr) known.hulls_[k].found->PrefetchParts();
  }
  for (const uint32_t k : next) {
    if (known.hulls_[k].found == nullptr) continue;
    for (const auto& part : *known.hulls_[k].found->account.parts()) __builtin_prefetch(part.get());
  }
  return known.due_.size() - count;
}

// Updates the views of all due hulls. Releases the mutex after a number of lookups, and, if
// allowed, to read from the store and to prepare. CANCELLED: should_stop returned true.
absl::Status HullReader::LookUpAll(Locked& locked, const HullsRead& read) {
  KnownHulls& known = read.known;
  if (!known.next_change_.has_value()) known.next_change_ = state_.recent_changes.end();
  size_t left_to_find = known.due_.size();
  while (true) {
    uint64_t& next = *known.next_change_;
    if (!state_.recent_changes.Knows(next)) {
      next = state_.recent_changes.end();
      locked.Unlock();
      known.ForgetAll();
      locked.Lock();
    } else if (next < state_.recent_changes.end()) {
      known.NoteChange(state_.recent_changes.at(next++));
    } else if (!known.due_.empty()) {
      if (known.due_.size() <= left_to_find) left_to_find = FindAhead(read);
      KnownHulls::Known& due = known.hulls_[known.due_.back()];
      HULLD_RETURN_IF_ERROR(LookUp(locked, read, known.due_.back()));
      due.is_due = false;
      known.due_.pop_back();
    } else {
      return absl::OkStatus();
    }
    locked.NoteLookup();
    if (locked.lookups() < kMaxLookupsPerHold) continue;
    locked.Unlock();
    const bool stopped = Stopped(read.should_stop);
    locked.Lock();
    if (stopped) return Cancelled();
    HULLD_RETURN_IF_ERROR(CheckReaders(locked, known));
  }
}

// RESOURCE_EXHAUSTED: readers exceed their share.
absl::Status HullReader::CheckReaders(Locked& locked, const KnownHulls& known) {
  if (!state_.memory.IsOver(MemoryUse::kReading)) return absl::OkStatus();
  const uint64_t share = state_.memory.share(MemoryUse::kReading);
  // A retry does not help a read that itself holds most of the memory.
  if (const uint64_t bytes = known.HullBytes(); bytes > share / 2) {
    return LimitExceeded(absl::StrCat("the hulls named by the call use ", bytes,
                                      " bytes of memory so far, which, together with other calls, "
                                      "exceeds the readers' share; request fewer hulls per call"),
                         share, "memory-limit");
  }
  return state_.memory.Check(locked, MemoryUse::kReading);
}

// Looks up the view of a hull, or its error. UNAVAILABLE: WouldWait.
absl::Status HullReader::LookUp(Locked& locked, const HullsRead& read, uint32_t k) {
  KnownHulls::Known& known = read.known.hulls_[k];
  const std::string& id = read.ids[known.first];
  const ReadPlan& plan = read.plan;
  bool was_missing = false;
  while (true) {
    std::optional<HullPointer> found = std::exchange(known.found, nullptr);
    if (*found == nullptr || (*found)->state.gone()) found = state_.hulls.LookUp(id);
    if (!found.has_value() && !state_.bodies.contains(id)) {
      if (!plan.may_wait) return WouldWait();
      if (absl::Status s = AwaitRecord(locked, read, k); !s.ok()) return NoteFailure(s, known);
      continue;
    }
    const HullPointer hull = std::move(found).value_or(nullptr);
    if (hull == nullptr || !hull->state.visible()) {
      known.view = state_.NoSuch("hull", id);
      return absl::OkStatus();
    }
    if (hull->state.damaged()) {
      known.view = hull->state.damage();
      return absl::OkStatus();
    }
    if (!hull->IsReady()) {
      // The hull was looked up, prepared, and evicted since. Loading and preparing it again could
      // evict another hull of the same read, and so on indefinitely.
      if (IsHeld(known, *hull)) {
        ++state_.statistics.hits;
        return absl::OkStatus();
      }
      if (!plan.may_wait) return WouldWait();
      HULLD_RETURN_IF_ERROR(CheckReaders(locked, read.known));
      absl::Status loaded;
      if (was_missing) {
        loaded = LoadOne(locked, *hull, read.should_stop);
      } else {
        // Loads the hulls due next, too.
        ++state_.statistics.misses;
        was_missing = true;
        LoadMany(locked, read);
      }
      if (Stopped(read.should_stop)) return Cancelled();
      if (!loaded.ok() && !hull->state.gone()) return NoteFailure(loaded, known);
      continue;
    }
    const bool prepare = hull->WantsPreparing(plan.expected_queries);
    if (prepare && plan.prepare_first) {
      if (!plan.may_wait) return WouldWait();
      if (!std::exchange(known.is_prepared, true)) {
        state_.Prepare(locked, *hull);
        if (Stopped(read.should_stop)) return Cancelled();
        continue;
      }
    }
    if (prepare) state_.SchedulePreparing(hull);
    NoteView(locked, hull, read.known, k, was_missing);
    return absl::OkStatus();
  }
}

// Records that a hull could not be read; the lookup of the other hulls goes on unless it is
// cancelled.
absl::Status HullReader::NoteFailure(const absl::Status& status, KnownHulls::Known& known) {
  if (absl::IsCancelled(status)) return status;
  known.view = status;
  return absl::OkStatus();
}

// Loads the records of this hull and of some hulls due next. The caller must look the hull up again
// unless the read failed. Releases the mutex.
absl::Status HullReader::AwaitRecord(Locked& locked, const HullsRead& read, uint32_t k) {
  const KnownHulls& hulls = read.known;
  std::vector<const std::string*> wanted = {&read.ids[hulls.hulls_[k].first]};
  const size_t count = std::min<size_t>(hulls.due_.size(), kMaxLookupsPerHold - 1);
  for (const uint32_t due : std::span(hulls.due_).last(count)) {
    if (due != k) wanted.push_back(&read.ids[hulls.hulls_[due].first]);
  }
  return records_.AwaitKnown(locked, wanted, read.should_stop);
}

// Returns true if this reader already has the committed state of the hull.
bool HullReader::IsHeld(const KnownHulls::Known& known, const RegisteredHull& hull) {
  return known.view.ok() && known.view->record == hull.committed().record;
}

// Records the view of a hull that is ready. was_missing: its points were read for it.
void HullReader::NoteView(Locked& locked, const HullPointer& hull, KnownHulls& hulls, uint32_t k,
                          bool was_missing) {
  KnownHulls::Known& known = hulls.hulls_[k];
  const bool was_loaded = std::exchange(known.is_loaded, false);
  if (!was_missing) ++(was_loaded ? state_.statistics.misses : state_.statistics.hits);
  known.view = HullView{hull->committed().record, hull->Serve()};
  known.bytes = hull->shared_bytes();
  // Serve has updated the hull's memory account.
  hull->NoteRead();
  if (was_missing || was_loaded) {
    state_.memory.Evict(locked);
    state_.hulls.RestSome(locked);
  }
}

// Loads the missing points of the hulls due next, on several threads, if there are at least two,
// except hulls that another reader is loading. Releases the mutex. Points that cannot be read, or
// that a writer superseded, stay missing.
void HullReader::LoadMany(Locked& locked, const HullsRead& read) {
  // Many lookups, so that threads are seldom started. Not tuned.
  constexpr size_t kMaxHulls = 4 * kMaxLookupsPerHold;
  KnownHulls& hulls = read.known;
  // At about 200 bytes per point, a twentieth of the memory limit: the readers' share is not
  // checked until each hull is looked up.
  const uint64_t max_points = std::min<uint64_t>(1 << 17, state_.limits.memory_limit / 4096);
  std::vector<KnownHulls::Known*> chosen;
  std::vector<StoredHull> stored;
  uint64_t points = 0;
  // due_ is processed from the back.
  for (size_t n = 0; n < std::min(hulls.due_.size(), kMaxHulls); ++n) {
    locked.NoteLookupOrYield();
    KnownHulls::Known& known = hulls.hulls_[hulls.due_[hulls.due_.size() - 1 - n]];
    const std::string& id = read.ids[known.first];
    const HullPointer hull = state_.IsKnown(id) ? state_.FindVisible(id) : nullptr;
    if (hull == nullptr || hull->state.damaged() || hull->IsReady() || hull->is_loading() ||
        hull->state.life() == HullState::Life::kEnding || IsHeld(known, *hull)) {
      continue;
    }
    const VertexLayout& layout = hull->committed().layout;
    points += layout.base_vertices + layout.delta_vertices;
    if (points > max_points) break;
    hull->StartLoading();
    known.found = hull;
    chosen.push_back(&known);
    stored.push_back(hull->committed());
  }
  // LoadOne reports the error of a single hull.
  if (chosen.size() == 1) chosen.front()->found->EndLoading();
  if (chosen.size() < 2) return;
  locked.Unlock();
  std::vector<LoadedHull> loaded = LoadEach(state_.store, stored, loaders_, read.should_stop);
  locked.Lock();
  for (size_t i = 0; i < chosen.size(); ++i) {
    locked.NoteLookupOrYield();
    RegisteredHull& hull = *chosen[i]->found;
    hull.EndLoading();
    const bool is_current = hull.committed().record.revision == stored[i].record.revision;
    if (!loaded[i].ok() || !is_current || hull.live() != nullptr || hull.state.gone()) continue;
    hull.SetLive(*std::move(loaded[i]));
    ++state_.statistics.loads;
    hull.NoteUse();
    chosen[i]->is_loaded = true;
  }
}

absl::StatusOr<Resolved> HullReader::Refresh(std::span<const std::string> ids, KnownHulls& known,
                                             const std::function<bool()>& should_stop,
                                             const ReadPlan& plan) {
  known.Begin(ids);
  known.BeginLookup();
  Resolved resolved;
  {
    Locked locked(state_.mutex);
    absl::StatusOr<std::chrono::nanoseconds> staleness = WouldWait();
    if (const auto known_staleness = peers_.TryFresh(locked, plan.freshness)) {
      staleness = *known_staleness;
    } else if (plan.may_wait) {
      staleness = peers_.AwaitFresh(locked, plan.freshness, should_stop);
    }
    if (!staleness.ok()) return staleness.status();
    resolved.as_of.staleness = *staleness;
    const absl::Status found = LookUpAll(locked, {ids, known, should_stop, plan});
    if (!found.ok()) {
      for (const uint32_t k : known.due_) known.hulls_[k].found = nullptr;
      return found;
    }
    resolved.as_of.revision = state_.revision();
    if (plan.may_wait) state_.memory.Evict(locked);
  }
  resolved.hulls = known.Views(ids);
  return resolved;
}

absl::StatusOr<const Hull*> HullReader::Canonical(const HullView& view,
                                                  const std::function<bool()>& should_stop) {
  if (const Hull* made = view.served->canonical(); made != nullptr) return made;
  {
    Locked locked(state_.mutex);
    HULLD_RETURN_IF_ERROR(state_.memory.Check(locked, MemoryUse::kReading));
  }
  const auto start = std::chrono::steady_clock::now();
  const absl::Status status = view.served->MakeCanonical(view.record, should_stop);
  if (snapshot_seconds_ != nullptr) {
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    snapshot_seconds_->Observe(taken.count());
  }
  Locked locked(state_.mutex);
  const std::string& id = view.record.hull_id;
  // An unknown hull has no state to update.
  const HullPointer hull = state_.IsKnown(id) ? state_.FindVisible(id) : nullptr;
  const bool is_current =
      hull != nullptr && hull->committed().record.revision == view.record.revision;
  if (is_current && absl::IsDataLoss(status)) state_.MarkDamaged(*hull, status);
  if (is_current) hull->NoteUse();
  state_.memory.Evict(locked);
  if (!status.ok()) return status;
  return view.served->canonical();
}

// Reads a hull's points from the store unless they are in memory or the hull is gone. Releases the
// mutex.
absl::Status HullReader::LoadOne(Locked& locked, RegisteredHull& hull,
                                 const std::function<bool()>& should_stop) {
  bool failed = false;
  while (!hull.IsReady() && !hull.state.gone()) {
    if (hull.state.damaged()) return hull.state.damage();
    const bool is_ending = hull.state.life() == HullState::Life::kEnding;
    if (hull.is_loading() || (failed && is_ending)) {
      HULLD_RETURN_IF_ERROR(locked.Await(hull.changed, should_stop, [&] {
        return !hull.is_loading() && !(failed && hull.state.life() == HullState::Life::kEnding);
      }));
      continue;
    }
    hull.StartLoading();
    const StoredHull stored = hull.committed();
    locked.Unlock();
    absl::StatusOr<std::shared_ptr<LiveHull>> loaded = LoadLive(state_.store, stored);
    locked.Lock();
    hull.EndLoading();
    if (absl::IsAborted(loaded.status())) {
      HULLD_RETURN_IF_ERROR(peers_.AwaitPeers(locked, should_stop));
      const HullRecord& now = hull.committed().record;
      if (!hull.state.gone() && now.revision == stored.record.revision) return StoreDisagrees(now);
      continue;
    }
    // If a writer was faster, the points read, or missing, belong to a state that is no longer
    // current.
    const bool is_current = hull.committed().record.revision == stored.record.revision;
    if (hull.live() != nullptr || hull.state.gone() || !is_current) {
      // This may repeat, so should_stop is checked.
      if (Stopped(should_stop)) return Cancelled();
      continue;
    }
    if (loaded.ok()) {
      hull.SetLive(*std::move(loaded));
      ++state_.statistics.loads;
      hull.NoteUse();
      return absl::OkStatus();
    }
    // A pending end of the hull first removes its points from the store; its outcome shows whether
    // they are damaged.
    failed = true;
    if (hull.state.life() == HullState::Life::kEnding) continue;
    if (absl::IsDataLoss(loaded.status())) state_.MarkDamaged(hull, loaded.status());
    return loaded.status();
  }
  return absl::OkStatus();
}

}  // namespace hulld::server
