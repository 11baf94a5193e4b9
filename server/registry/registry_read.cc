// Readers: hulls that are ready to be served, all current at one revision.
#include <absl/status/status.h>

#include <chrono>
#include <utility>

#include "core/base/check.h"
#include "server/registry/hull_loader.h"
#include "server/registry/registered_hull.h"
#include "server/registry/registry.h"

namespace hulld::server {
namespace {

// How soon a reader that waits for the store notices that its call was cancelled.
constexpr std::chrono::milliseconds kCancellationPoll(20);

bool Stopped(const std::function<bool()>& should_stop) { return should_stop && should_stop(); }

absl::Status Cancelled() { return absl::CancelledError("the call was cancelled"); }

}  // namespace

// What one call of Resolve looks for. Used with the mutex held.
class Registry::Lookup {
 public:
  Lookup(Registry& registry, std::span<const std::string> ids, const ReadPlan& plan)
      : registry_(registry), ids_(ids), plan_(plan), wanted_(ids.size()) {}

  // Finds each hull. Returns whether all are in memory, or cannot be.
  bool Find();
  // Reads from the store what is not in memory. Releases the mutex meanwhile. Returns false once
  // should_stop said so.
  bool LoadMissing(Locked& locked, const std::function<bool()>& should_stop);
  // Prepares one hull that Find found, if the plan says so. Releases the mutex meanwhile. Returns
  // whether there was one.
  bool PrepareNext(Locked& locked);
  // What Find, which just said that all are ready, found.
  Resolved Take();

 private:
  struct Wanted {
    HullPointer hull;
    absl::Status failure;
    // Stays in memory until all are there.
    std::shared_ptr<LiveHull> held;
    bool prepared = false;
  };

  Registry& registry_;
  const std::span<const std::string> ids_;
  const ReadPlan plan_;
  std::vector<Wanted> wanted_;
  bool counted_ = false;
};

bool Registry::Lookup::Find() {
  bool ready = true;
  for (size_t i = 0; i < ids_.size(); ++i) {
    Wanted& wanted = wanted_[i];
    if (wanted.hull == nullptr || wanted.hull->state.gone()) {
      wanted = {};
      wanted.hull = registry_.FindVisible(ids_[i]);
      if (wanted.hull == nullptr) wanted.failure = HullNotFound(ids_[i]);
    }
    if (wanted.hull != nullptr && wanted.hull->state.damaged()) {
      wanted.failure = wanted.hull->state.damage();
    }
    if (!wanted.failure.ok()) continue;
    const bool found = wanted.hull->Serve() != nullptr;
    wanted.held = wanted.hull->live;
    if (!counted_) ++(found ? registry_.cache_.hits : registry_.cache_.misses);
    ready = ready && found;
  }
  counted_ = true;
  return ready;
}

bool Registry::Lookup::LoadMissing(Locked& locked, const std::function<bool()>& should_stop) {
  for (Wanted& wanted : wanted_) {
    if (!wanted.failure.ok() || wanted.hull->Serve() != nullptr) continue;
    wanted.failure = registry_.LoadForReaders(locked, *wanted.hull, should_stop);
    wanted.held = wanted.hull->live;
    if (Stopped(should_stop) || absl::IsCancelled(wanted.failure)) return false;
  }
  return true;
}

bool Registry::Lookup::PrepareNext(Locked& locked) {
  if (!plan_.prepare_first) return false;
  for (Wanted& wanted : wanted_) {
    if (!wanted.failure.ok() || std::exchange(wanted.prepared, true)) continue;
    if (!WantsPreparing(*wanted.hull, plan_.expected_questions)) continue;
    registry_.Prepare(locked, *wanted.hull);
    return true;
  }
  return false;
}

Resolved Registry::Lookup::Take() {
  Resolved resolved;
  resolved.store_revision = registry_.revision_;
  resolved.hulls.reserve(wanted_.size());
  for (const Wanted& wanted : wanted_) {
    if (!wanted.failure.ok()) {
      resolved.hulls.emplace_back(wanted.failure);
      continue;
    }
    std::shared_ptr<const ServedHull> served = wanted.hull->Serve();
    HULLD_CHECK(served != nullptr);
    resolved.hulls.emplace_back(HullView{wanted.hull->committed.record, std::move(served)});
    wanted.hull->NoteUse();
    if (WantsPreparing(*wanted.hull, plan_.expected_questions)) {
      registry_.SchedulePreparing(wanted.hull);
    }
  }
  return resolved;
}

// What is in memory is taken at once. Otherwise what is missing is read and all are looked for
// again, since writers went on meanwhile; what was read stays, so that comes to an end.
absl::StatusOr<Resolved> Registry::Resolve(std::span<const std::string> ids,
                                           const std::function<bool()>& should_stop,
                                           const ReadPlan& plan) {
  Locked locked(mutex_);
  Lookup lookup(*this, ids, plan);
  while (true) {
    if (!lookup.Find()) {
      if (!lookup.LoadMissing(locked, should_stop)) return Cancelled();
    } else if (lookup.PrepareNext(locked)) {
      if (Stopped(should_stop)) return Cancelled();
    } else {
      break;
    }
  }
  Resolved resolved = lookup.Take();
  memory_.Evict(locked);
  return resolved;
}

std::optional<Resolved> Registry::TryResolve(std::span<const std::string> ids,
                                             const ReadPlan& plan) {
  Resolved resolved;
  Locked locked(mutex_);
  std::vector<HullPointer> found;
  for (const std::string& id : ids) {
    const HullPointer hull = FindVisible(id);
    if (hull == nullptr) {
      resolved.hulls.emplace_back(HullNotFound(id));
      continue;
    }
    if (hull->state.damaged()) {
      resolved.hulls.emplace_back(hull->state.damage());
      continue;
    }
    std::shared_ptr<const ServedHull> served = hull->Serve();
    if (served == nullptr) return std::nullopt;
    const bool wants_preparing = WantsPreparing(*hull, plan.expected_questions);
    if (wants_preparing && plan.prepare_first) return std::nullopt;
    if (wants_preparing) SchedulePreparing(hull);
    resolved.hulls.emplace_back(HullView{hull->committed.record, std::move(served)});
    found.push_back(hull);
  }
  for (const HullPointer& hull : found) hull->NoteUse();
  cache_.hits += found.size();
  resolved.store_revision = revision_;
  return resolved;
}

absl::StatusOr<std::pair<uint64_t, HullView>> Registry::Resolve(
    const std::string& id, const std::function<bool()>& should_stop) {
  absl::StatusOr<Resolved> resolved = Resolve(std::span(&id, 1), should_stop);
  if (!resolved.ok()) return resolved.status();
  absl::StatusOr<HullView>& hull = resolved->hulls.front();
  if (!hull.ok()) return hull.status();
  return std::pair(resolved->store_revision, *std::move(hull));
}

absl::StatusOr<const Hull*> Registry::Canonical(const HullView& view,
                                                const std::function<bool()>& should_stop) {
  if (const Hull* made = view.served->canonical(); made != nullptr) return made;
  const auto start = std::chrono::steady_clock::now();
  const absl::Status status = view.served->MakeCanonical(view.record, should_stop);
  if (snapshot_seconds_ != nullptr) {
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    snapshot_seconds_->Observe(taken.count());
  }
  Locked locked(mutex_);
  const HullPointer hull = FindVisible(view.record.hull_id);
  const bool is_current =
      hull != nullptr && hull->committed.record.revision == view.record.revision;
  if (is_current && absl::IsDataLoss(status)) MarkDamaged(*hull, status);
  if (is_current) hull->NoteUse();
  memory_.Evict(locked);
  if (!status.ok()) return status;
  return view.served->canonical();
}

// Reads a hull's points from the store, unless they are in memory or the hull is gone. Releases the
// mutex meanwhile.
absl::Status Registry::LoadForReaders(Locked& locked, RegisteredHull& hull,
                                      const std::function<bool()>& should_stop) {
  bool failed = false;
  while (hull.Serve() == nullptr && !hull.state.gone()) {
    if (hull.state.damaged()) return hull.state.damage();
    const bool is_ending = hull.state.life() == HullState::Life::kEnding;
    if (hull.loading || (failed && is_ending)) {
      // Answers that are due do not wait meanwhile.
      locked.Unlock();
      locked.Lock();
      const auto may_go_on = [&] {
        return !hull.loading && !(failed && hull.state.life() == HullState::Life::kEnding);
      };
      hull.changed.wait_for(locked.lock(), kCancellationPoll, may_go_on);
      if (Stopped(should_stop)) return Cancelled();
      continue;
    }
    hull.loading = true;
    const StoredHull stored = hull.committed;
    locked.Unlock();
    absl::StatusOr<std::shared_ptr<LiveHull>> loaded = LoadLive(store_, stored);
    locked.Lock();
    hull.loading = false;
    hull.changed.notify_all();
    // A writer was faster. What was read, or not found, is of a state that was left since.
    const bool is_current = hull.committed.record.revision == stored.record.revision;
    if (hull.live != nullptr || hull.state.gone() || !is_current) continue;
    if (loaded.ok()) {
      hull.SetLive(*std::move(loaded));
      ++cache_.loads;
      hull.NoteUse();
      return absl::OkStatus();
    }
    // The end of a hull that is on its way takes its points out of the store first: how that ends
    // tells whether they are damaged.
    failed = true;
    if (hull.state.life() == HullState::Life::kEnding) continue;
    if (absl::IsDataLoss(loaded.status())) MarkDamaged(hull, loaded.status());
    return loaded.status();
  }
  return absl::OkStatus();
}

// Whether questions have paid for preparing what they look through, and nobody does it yet.
bool Registry::WantsPreparing(const RegisteredHull& hull, uint64_t expected_questions) {
  return !hull.preparing && hull.live != nullptr && hull.state.visible() &&
         hull.live->WantsPreparing(hull.committed_mark, expected_questions);
}

// Prepares what is committed of a hull. Releases the mutex meanwhile.
void Registry::Prepare(Locked& locked, RegisteredHull& hull) {
  HULLD_CHECK(!hull.preparing && hull.live != nullptr);
  hull.preparing = true;
  hull.points_since_prepared = 0;
  const std::shared_ptr<LiveHull> live = hull.live;
  const LiveHull::Mark mark = hull.committed_mark;
  locked.Unlock();
  live->Prepare(mark);
  locked.Lock();
  hull.preparing = false;
  if (hull.live != live) return;
  // Nothing came after: the mark lets go of what there was before.
  if (hull.state.quiet() && !hull.state.damaged()) hull.SetCommittedMark(locked, live->Now());
  hull.DiscardServed(locked);
  hull.NoteUse();
}

// Has another thread do it.
void Registry::SchedulePreparing(const HullPointer& hull) {
  HULLD_CHECK(!hull->preparing);
  hull->preparing = true;
  preparers_->Submit([this, hull] {
    Locked locked(mutex_);
    hull->preparing = false;
    if (ending_ || hull->live == nullptr) return;
    Prepare(locked, *hull);
    memory_.Evict(locked);
  });
}

}  // namespace hulld::server
