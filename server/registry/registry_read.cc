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

// How soon a reader that waits for a chunk notices that its call was cancelled.
constexpr std::chrono::milliseconds kCancellationPoll(20);

bool Stopped(const std::function<bool()>& should_stop) { return should_stop && should_stop(); }

absl::Status Cancelled() { return absl::CancelledError("the call was cancelled"); }

}  // namespace

// What one call of Resolve looks for. Used with the mutex held.
class Registry::Lookup {
 public:
  explicit Lookup(Registry& registry, std::span<const std::string> ids)
      : registry_(registry), ids_(ids), wanted_(ids.size()) {}

  // Finds each hull, and pins those that are not ready; `all`: the others too. Returns whether all
  // are ready, or cannot be.
  bool Find(bool all);
  // Makes what is missing of those that are pinned. Returns false once should_stop said so.
  bool MakeMissing(Locked& locked, const std::function<bool()>& should_stop);
  // What Find, which just said that all are ready, found.
  Resolved Take() const;
  void Unpin(Locked& locked);

 private:
  struct Wanted {
    HullPointer hull;
    absl::Status failure;
    bool pinned = false;
  };

  Registry& registry_;
  const std::span<const std::string> ids_;
  std::vector<Wanted> wanted_;
  // One for each pin.
  std::vector<HullPointer> pinned_;
  bool counted_ = false;
};

bool Registry::Lookup::Find(bool all) {
  bool ready = true;
  for (size_t i = 0; i < ids_.size(); ++i) {
    Wanted& wanted = wanted_[i];
    if (wanted.hull == nullptr || wanted.hull->state.gone()) {
      wanted.hull = registry_.FindVisible(ids_[i]);
      wanted.pinned = false;
      wanted.failure = wanted.hull == nullptr ? HullNotFound(ids_[i]) : wanted.hull->state.damage();
    }
    if (!wanted.failure.ok()) continue;
    const bool missing = wanted.hull->served == nullptr;
    if ((missing || all) && !wanted.pinned) {
      wanted.hull->state.Pin();
      wanted.pinned = true;
      pinned_.push_back(wanted.hull);
    }
    if (!counted_) ++(missing ? registry_.cache_.misses : registry_.cache_.hits);
    ready = ready && !missing;
  }
  counted_ = true;
  return ready;
}

bool Registry::Lookup::MakeMissing(Locked& locked, const std::function<bool()>& should_stop) {
  for (Wanted& wanted : wanted_) {
    // What became stale since Find is not pinned, so nothing says when its writer pauses: that
    // waits for the next Find.
    if (!wanted.failure.ok() || !wanted.pinned || wanted.hull->served != nullptr) continue;
    wanted.failure = registry_.MakeServed(locked, wanted.hull, should_stop);
    if (Stopped(should_stop) || absl::IsCancelled(wanted.failure)) return false;
  }
  return true;
}

Resolved Registry::Lookup::Take() const {
  Resolved resolved;
  resolved.store_revision = registry_.revision_;
  resolved.hulls.reserve(wanted_.size());
  for (const Wanted& wanted : wanted_) {
    if (!wanted.failure.ok()) {
      resolved.hulls.emplace_back(wanted.failure);
      continue;
    }
    HULLD_CHECK(wanted.hull->served != nullptr);
    resolved.hulls.emplace_back(HullView{wanted.hull->committed.record, wanted.hull->served});
    wanted.hull->NoteUse();
  }
  return resolved;
}

void Registry::Lookup::Unpin(Locked& locked) {
  for (const HullPointer& hull : pinned_) {
    if (hull->state.Unpin()) registry_.Advance(locked, hull);
  }
  pinned_.clear();
}

// Optimistic first: take what is ready, and make what is missing. If a writer changed one of the
// hulls meanwhile, hold back the writers of all of them and try again: the chunks in progress then
// are the last ones to wait for.
absl::StatusOr<Resolved> Registry::Resolve(std::span<const std::string> ids,
                                           const std::function<bool()>& should_stop) {
  Locked locked(mutex_);
  Lookup lookup(*this, ids);
  bool ready = lookup.Find(/*all=*/false);
  bool stopped = false;
  while (!ready && !stopped) {
    stopped = !lookup.MakeMissing(locked, should_stop);
    if (!stopped) ready = lookup.Find(/*all=*/true);
  }
  absl::StatusOr<Resolved> resolved = Cancelled();
  if (ready) resolved = lookup.Take();
  lookup.Unpin(locked);
  memory_.Evict(locked);
  return resolved;
}

std::optional<Resolved> Registry::TryResolve(std::span<const std::string> ids) {
  Resolved resolved;
  Locked locked(mutex_);
  for (const std::string& id : ids) {
    const HullPointer hull = FindVisible(id);
    if (hull == nullptr) {
      resolved.hulls.emplace_back(HullNotFound(id));
    } else if (hull->state.damaged()) {
      resolved.hulls.emplace_back(hull->state.damage());
    } else if (hull->served == nullptr) {
      return std::nullopt;
    } else {
      resolved.hulls.emplace_back(HullView{hull->committed.record, hull->served});
      ++cache_.hits;
      hull->NoteUse();
    }
  }
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

// Until the hull is quiet, served or gone. It must be pinned: nothing else brings it to rest.
absl::Status Registry::WaitUntilReadable(Locked& locked, RegisteredHull& hull,
                                         const std::function<bool()>& should_stop) {
  HULLD_CHECK(hull.state.pinned());
  const auto readable = [&hull] {
    return hull.state.quiet() || hull.state.gone() || hull.served != nullptr;
  };
  if (readable()) return absl::OkStatus();
  // Answers that are due do not wait meanwhile.
  locked.Unlock();
  locked.Lock();
  while (!hull.released.wait_for(locked.lock(), kCancellationPoll, readable)) {
    if (Stopped(should_stop)) return Cancelled();
  }
  return absl::OkStatus();
}

// Makes what is served of a pinned hull, unless that is there or the hull is gone. Releases the
// mutex meanwhile.
absl::Status Registry::MakeServed(Locked& locked, const HullPointer& pinned,
                                  const std::function<bool()>& should_stop) {
  RegisteredHull& hull = *pinned;
  if (absl::Status s = WaitUntilReadable(locked, hull, should_stop); !s.ok()) return s;
  if (hull.state.gone() || hull.served != nullptr) return absl::OkStatus();
  if (hull.state.damaged()) return hull.state.damage();
  hull.state.StartReading();
  const StoredHull stored = hull.committed;
  std::unique_ptr<HullBuilder> builder = std::move(hull.builder);
  const bool load = builder == nullptr;

  locked.Unlock();
  absl::Status status;
  std::shared_ptr<const ServedHull> served;
  if (load) {
    absl::StatusOr<std::unique_ptr<HullBuilder>> loaded = LoadBuilder(store_, stored, should_stop);
    status = loaded.status();
    if (loaded.ok()) builder = *std::move(loaded);
  }
  if (builder != nullptr) {
    absl::StatusOr<Hull> made = builder->Snapshot(should_stop);
    if (made.ok()) served = std::make_shared<const ServedHull>(*std::move(made));
    status = made.status();
  }
  const uint64_t builder_bytes = builder == nullptr ? 0 : builder->MemoryBytes();
  locked.Lock();

  if (load && builder != nullptr) ++cache_.loads;
  hull.builder = std::move(builder);
  hull.builder_bytes = builder_bytes;
  // A hull that is only read needs no builder.
  if (load && hull.watches.empty()) hull.DiscardBuilder(locked);
  hull.served = std::move(served);
  if (absl::IsDataLoss(status)) MarkDamaged(hull, status);
  const bool kept = hull.state.EndWork();
  HULLD_CHECK(kept);  // nothing of it was in flight
  hull.NoteUse();
  Advance(locked, pinned);
  return status;
}

}  // namespace hulld::server
