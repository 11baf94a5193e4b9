#include "server/registry/read/hull_reader.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "server/contract/limit_error.h"
#include "server/contract/stopped_call.h"
#include "server/registry/catalog/registered_hull.h"
#include "server/registry/memory/hull_loader.h"

namespace hulld::server {

// A read of several hulls.
struct HullReader::HullsRead {
  std::span<const std::string> ids;
  KnownHulls& known;
  const std::function<bool()>& should_stop;
  const ReadPlan& plan;
};

// Updates the views of all due hulls. Releases the mutex after a number of lookups, and, if
// allowed, to read from the store and to prepare. CANCELLED: should_stop returned true.
absl::Status HullReader::LookUpDue(Locked& locked, const HullsRead& read) {
  absl::Status status = LookUpAll(locked, read);
  // After a success no load is left, so the mutex stays held.
  if (!status.ok()) {
    KnownHulls& known = read.known;
    const std::function<bool()> stop = [] { return true; };
    EndAllLoading(locked, {read.ids, known, stop, read.plan});
    for (const uint32_t k : known.due_) known.hulls_[k].found = nullptr;
  }
  return status;
}

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
    } else if (!known.ahead_.empty()) {
      EndAllLoading(locked, read);
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
    if (*found == nullptr || (*found)->state.gone()) found = state_.hulls.Ask(id);
    if (!found.has_value() && !state_.bodies.contains(id)) {
      if (!plan.may_wait) return WouldWait();
      if (absl::Status s = AwaitRecord(locked, read, k); !s.ok()) return NoteFailure(s, known);
      continue;
    }
    const HullPointer hull = std::move(found).value_or(nullptr);
    if (hull == nullptr || !hull->state.visible()) {
      known.view = state_.NoSuchHull(id);
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
      const absl::Status loaded = AwaitPoints(locked, read, k, *hull, was_missing);
      if (!loaded.ok()) return NoteFailure(loaded, known);
      continue;
    }
    const bool prepare = hull->WantsPreparing(plan.expected_questions);
    if (prepare && plan.prepare_first) {
      if (!plan.may_wait) return WouldWait();
      if (!std::exchange(known.is_prepared, true)) {
        HULLD_RETURN_IF_ERROR(PrepareFirst(locked, read, *hull));
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
  KnownHulls& hulls = read.known;
  if (!hulls.ahead_.empty()) {
    EndAllLoading(locked, read);
    return absl::OkStatus();
  }
  std::vector<const std::string*> wanted = {&read.ids[hulls.hulls_[k].first]};
  const size_t count = std::min<size_t>(hulls.due_.size(), kMaxLookupsPerHold - 1);
  for (const uint32_t due : std::span(hulls.due_).last(count)) {
    if (due != k) wanted.push_back(&read.ids[hulls.hulls_[due].first]);
  }
  const absl::Status asked = records_.AwaitKnown(locked, wanted, read.should_stop);
  return Stopped(read.should_stop) ? Cancelled() : asked;
}

// Loads the points of this hull, and at first of the hulls due next. As AwaitRecord otherwise.
absl::Status HullReader::AwaitPoints(Locked& locked, const HullsRead& read, uint32_t k,
                                     RegisteredHull& hull, bool& was_missing) {
  absl::Status loaded;
  if (!std::exchange(was_missing, true)) {
    ++state_.statistics.misses;
    LoadMany(locked, read, k);
  } else if (!read.known.ahead_.empty()) {
    EndAllLoading(locked, read);
    return absl::OkStatus();
  } else {
    loaded = LoadOne(locked, hull, read.should_stop);
  }
  if (Stopped(read.should_stop)) return Cancelled();
  return hull.state.gone() ? absl::OkStatus() : loaded;
}

// Prepares the hull before its first query. Releases the mutex.
absl::Status HullReader::PrepareFirst(Locked& locked, const HullsRead& read, RegisteredHull& hull) {
  if (!read.known.ahead_.empty()) {
    EndAllLoading(locked, read);
    if (!hull.WantsPreparing(read.plan.expected_questions)) return absl::OkStatus();
  }
  state_.Prepare(locked, hull);
  return Stopped(read.should_stop) ? Cancelled() : absl::OkStatus();
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
  // Serve counted its parts.
  hull->NoteRead();
  if (was_missing || was_loaded) {
    state_.memory.Evict(locked);
    state_.hulls.RestSome(locked);
  }
}

// Loads the missing points of this hull and of the hulls due next, on several threads, except hulls
// that another reader is loading. While these hulls are looked up, threads load the next ones. A
// read finishes its own loads before it waits for another reader, which may wait for them. Releases
// the mutex. Points that cannot be read, or that a writer superseded, stay missing.
void HullReader::LoadMany(Locked& locked, const HullsRead& read, uint32_t k) {
  KnownHulls& hulls = read.known;
  const bool& is_ahead = hulls.hulls_[k].is_ahead;
  if (!is_ahead) hulls.ahead_end_ = hulls.due_.size();
  while (hulls.ahead_.size() < 2 && BeginLoading(locked, read)) continue;
  while (is_ahead) EndLoading(locked, read);
}

// Starts a load if enough hulls are missing. Returns false if not.
bool HullReader::BeginLoading(Locked& locked, const HullsRead& read) {
  KnownHulls& hulls = read.known;
  // At about 200 bytes per point, a twentieth of the memory limit: the readers' share is not
  // checked until each hull is looked up.
  uint64_t max_points = std::min<uint64_t>(1 << 17, state_.limits.memory_limit / 4096);
  // Two jobs, so that the second loads while the hulls of the first are looked up.
  const uint64_t enough_points = max_points / 2;
  for (const KnownHulls::Loading& loading : hulls.ahead_) {
    max_points -= std::min(max_points, loading.points);
  }
  if (locked.lookups() > 0) locked.Yield();
  KnownHulls::Loading next;
  std::vector<StoredHull> stored;
  // due_ is processed from the back.
  size_t& end = hulls.ahead_end_;
  end = std::min(end, hulls.due_.size());
  for (uint64_t looked_at = 1; end > 0 && looked_at < kMaxLookupsPerHold; ++looked_at) {
    const uint32_t k = hulls.due_[end - 1];
    locked.NoteLookup();
    const KnownHulls::Known& known = hulls.hulls_[k];
    const std::string& id = read.ids[known.first];
    const HullPointer hull = state_.IsKnown(id) ? state_.FindVisible(id) : nullptr;
    if (hull == nullptr || hull->state.damaged() || hull->IsReady() || hull->is_loading() ||
        hull->state.life() == HullState::Life::kEnding || IsHeld(known, *hull)) {
      --end;
      continue;
    }
    const VertexLayout& layout = hull->committed().layout;
    const uint64_t points = next.points + layout.base_vertices + layout.delta_vertices;
    if (points > max_points || (points > enough_points && next.hulls.size() > 1)) break;
    --end;
    next.points = points;
    next.found.push_back(hull);
    next.hulls.push_back(k);
    stored.push_back(hull->committed());
  }
  if (next.hulls.size() < 2) return false;
  for (size_t i = 0; i < next.hulls.size(); ++i) {
    next.found[i]->StartLoading();
    hulls.hulls_[next.hulls[i]].is_ahead = true;
  }
  next.job = std::make_shared<LoadJob>(state_.store, std::move(stored), loaders_);
  hulls.ahead_.push_back(std::move(next));
  return true;
}

// Waits for the first job and installs its hulls.
void HullReader::EndLoading(Locked& locked, const HullsRead& read) {
  KnownHulls& hulls = read.known;
  const KnownHulls::Loading loading = std::move(hulls.ahead_.front());
  hulls.ahead_.erase(hulls.ahead_.begin());
  locked.Unlock();
  std::vector<LoadJob::Loaded> loaded = loading.job->Finish(read.should_stop);
  locked.Lock();
  for (size_t i = 0; i < loading.hulls.size(); ++i) {
    KnownHulls::Known& known = hulls.hulls_[loading.hulls[i]];
    RegisteredHull& hull = *loading.found[i];
    known.is_ahead = false;
    hull.EndLoading();
    const uint64_t revision = loading.job->hulls()[i].record.revision;
    const bool is_current = hull.committed().record.revision == revision;
    if (!loaded[i].ok() || !is_current || hull.live() != nullptr || hull.state.gone()) continue;
    hull.SetLive(*std::move(loaded[i]));
    ++state_.statistics.loads;
    hull.NoteUse();
    known.is_loaded = true;
    known.found = loading.found[i];
  }
}

void HullReader::EndAllLoading(Locked& locked, const HullsRead& read) {
  while (!read.known.ahead_.empty()) EndLoading(locked, read);
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
    if (const auto known_staleness = barrier_.TryFresh(locked, plan.freshness)) {
      staleness = *known_staleness;
    } else if (plan.may_wait) {
      staleness = barrier_.AwaitFresh(locked, plan.freshness, should_stop);
    }
    if (!staleness.ok()) return staleness.status();
    resolved.as_of.staleness = *staleness;
    HULLD_RETURN_IF_ERROR(LookUpDue(locked, {ids, known, should_stop, plan}));
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
      // Runs the deferred tasks before waiting.
      locked.Yield();
      const auto may_go_on = [&] {
        return !hull.is_loading() && !(failed && hull.state.life() == HullState::Life::kEnding);
      };
      locked.WaitOn([&](auto& lock) { hull.changed.wait_for(lock, kStopPoll, may_go_on); });
      if (Stopped(should_stop)) return Cancelled();
      continue;
    }
    hull.StartLoading();
    const StoredHull stored = hull.committed();
    locked.Unlock();
    absl::StatusOr<std::shared_ptr<LiveHull>> loaded = LoadLive(state_.store, stored);
    locked.Lock();
    hull.EndLoading();
    if (absl::IsAborted(loaded.status())) {
      HULLD_RETURN_IF_ERROR(barrier_.AwaitPeers(locked, should_stop));
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
