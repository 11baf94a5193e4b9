// What the registry holds of hulls in memory: snapshots for readers, builders, and what is dropped.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <chrono>
#include <utility>

#include "server/contract/error_info.h"
#include "server/contract/limit_error.h"
#include "server/registry/registered_hull.h"
#include "server/registry/registry.h"

namespace hulld::server {
namespace {

// When hulls in use may have come to rest.
constexpr std::chrono::milliseconds kRetryMemory(1000);

// How soon a reader that waits for a chunk notices that its call was cancelled.
constexpr std::chrono::milliseconds kCancellationPoll(20);

bool Stopped(const std::function<bool()>& should_stop) { return should_stop && should_stop(); }

}  // namespace

// The builder of a committed hull, from the store.
absl::StatusOr<std::unique_ptr<HullBuilder>> Registry::LoadBuilder(
    const StoredHull& stored, const std::function<bool()>& should_stop) {
  auto builder = std::make_unique<HullBuilder>();
  const HullRecord& record = stored.record;
  if (record.vertex_count == 0) return builder;
  const absl::StatusOr<std::vector<Vector>> vertices = store_.LoadVertices(stored);
  if (!vertices.ok()) return vertices.status();
  AddLimits limits;
  limits.should_stop = should_stop;
  const absl::StatusOr<PointCounts> added = builder->Add(*vertices, limits);
  if (absl::IsCancelled(added.status())) return added.status();
  if (!added.ok() || builder->vertex_count() != record.vertex_count ||
      builder->dimension() != record.dimension) {
    return WithReason(
        absl::DataLossError(absl::StrCat(
            QuotedHull(record.hull_id), " is damaged in the store (",
            added.ok() ? absl::StrCat("its points make a hull of dimension ", builder->dimension(),
                                      " with ", builder->vertex_count(), " vertices, not ",
                                      record.dimension, " with ", record.vertex_count)
                       : std::string(added.status().message()),
            "); delete it and append it anew, or restore a backup")),
        v1::ERROR_REASON_HULL_DAMAGED, {{"hull_id", record.hull_id}});
  }
  return builder;
}

// Waits until the hull is quiet and makes its snapshot unless it has one, or is gone.
absl::Status Registry::MakeSnapshot(Locked& locked, RegisteredHull& hull,
                                    const std::function<bool()>& should_stop) {
  const auto needless = [&] {
    return hull.state == RegisteredHull::State::kGone || hull.snapshot != nullptr;
  };
  while (!hull.released.wait_for(locked.lock(), kCancellationPoll,
                                 [&] { return hull.quiet() || needless(); })) {
    if (Stopped(should_stop)) return absl::CancelledError("the call was cancelled");
  }
  if (needless()) return absl::OkStatus();
  if (!hull.damage.ok()) return hull.damage;
  hull.busy = true;
  const StoredHull stored = hull.committed;
  const uint64_t reverts = hull.reverts;
  std::unique_ptr<HullBuilder> builder = std::move(hull.builder);
  const bool load = builder == nullptr;

  locked.Unlock();
  absl::Status status;
  std::shared_ptr<const Snapshot> snapshot;
  if (load) {
    absl::StatusOr<std::unique_ptr<HullBuilder>> loaded = LoadBuilder(stored, should_stop);
    status = loaded.status();
    if (loaded.ok()) builder = *std::move(loaded);
  }
  if (builder != nullptr) {
    absl::StatusOr<Hull> made = builder->Snapshot(should_stop);
    if (made.ok()) snapshot = std::make_shared<const Snapshot>(*std::move(made));
    status = made.status();
  }
  const size_t builder_bytes = builder == nullptr ? 0 : builder->MemoryBytes();
  locked.Lock();

  if (load && builder != nullptr) ++cache_.loads;
  hull.busy = false;
  if (hull.reverts != reverts || hull.state == RegisteredHull::State::kGone) {
    locked.Discard(std::move(builder));
    hull.builder_bytes = 0;
  } else {
    // Who only reads needs no builder.
    if (load && hull.watches.empty()) {
      locked.Discard(std::move(builder));
    } else {
      hull.builder = std::move(builder);
    }
    hull.builder_bytes = hull.builder == nullptr ? 0 : builder_bytes;
    hull.snapshot = std::move(snapshot);
    if (absl::IsDataLoss(status)) {
      hull.damage = status;
      ++cache_.damaged;
    }
  }
  Charge(locked, hull);
  hull.released.notify_all();
  return status;
}

// Optimistic first: take what is current, and make the snapshots that are missing. Should a writer
// have changed one of the hulls meanwhile, hold back the writers of all of them and try again; the
// chunks in progress then are the last ones to wait for.
absl::StatusOr<Resolved> Registry::Resolve(std::span<const std::string> ids,
                                           const std::function<bool()>& should_stop) {
  Resolved resolved;
  std::vector<HullPointer> hulls(ids.size());
  std::vector<absl::Status> failures(ids.size());
  std::vector<HullPointer> pinned;
  Locked locked(mutex_);
  bool stopped = false;
  for (int attempt = 0; !stopped; ++attempt) {
    bool all_current = true;
    for (size_t i = 0; i < ids.size(); ++i) {
      if (hulls[i] == nullptr || hulls[i]->state != RegisteredHull::State::kPresent) {
        hulls[i] = FindVisible(ids[i]);
        failures[i] = hulls[i] == nullptr ? HullNotFound(ids[i]) : hulls[i]->damage;
      }
      if (!failures[i].ok()) continue;
      const HullPointer& hull = hulls[i];
      const bool stale = hull->snapshot == nullptr;
      if (stale || attempt == 1) {
        ++hull->pins;
        pinned.push_back(hull);
      }
      if (attempt == 0) ++(stale ? cache_.misses : cache_.hits);
      all_current = all_current && !stale;
    }
    if (all_current) break;
    for (size_t i = 0; i < ids.size() && !stopped; ++i) {
      if (failures[i].ok()) failures[i] = MakeSnapshot(locked, *hulls[i], should_stop);
      stopped = Stopped(should_stop) || absl::IsCancelled(failures[i]);
    }
  }
  if (!stopped) {
    resolved.store_revision = revision_;
    resolved.hulls.reserve(ids.size());
    for (size_t i = 0; i < ids.size(); ++i) {
      if (!failures[i].ok()) {
        resolved.hulls.emplace_back(failures[i]);
        continue;
      }
      resolved.hulls.emplace_back(HullView{hulls[i]->committed.record, hulls[i]->snapshot});
      Charge(locked, *hulls[i]);
    }
  }
  for (const HullPointer& hull : pinned) Unpin(locked, hull);
  Evict(locked);
  if (stopped) return absl::CancelledError("the call was cancelled");
  return resolved;
}

std::optional<Resolved> Registry::TryResolve(std::span<const std::string> ids) {
  Resolved resolved;
  Locked locked(mutex_);
  for (const std::string& id : ids) {
    const HullPointer hull = FindVisible(id);
    if (hull == nullptr) {
      resolved.hulls.emplace_back(HullNotFound(id));
    } else if (!hull->damage.ok()) {
      resolved.hulls.emplace_back(hull->damage);
    } else if (hull->snapshot == nullptr) {
      return std::nullopt;
    } else {
      resolved.hulls.emplace_back(HullView{hull->committed.record, hull->snapshot});
      ++cache_.hits;
      Charge(locked, *hull);
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

void Registry::Unpin(Locked& locked, const HullPointer& hull) {
  if (--hull->pins == 0) Advance(locked, hull);
}

// Counts what the hull holds now, and that it was used just now.
void Registry::Charge(Locked&, RegisteredHull& hull) {
  Account(hull);
  if (hull.in_used_list) used_.splice(used_.begin(), used_, hull.used_place);
}

void Registry::Account(RegisteredHull& hull) {
  size_t bytes = hull.builder == nullptr ? 0 : hull.builder_bytes;
  if (hull.snapshot != nullptr && hull.snapshot != empty_snapshot_) {
    bytes += hull.snapshot->MemoryBytes();
  }
  cache_.bytes += bytes - hull.charged_bytes;
  hull.charged_bytes = bytes;
  if (bytes == 0 && hull.in_used_list) used_.erase(hull.used_place);
  if (bytes > 0 && !hull.in_used_list) hull.used_place = used_.insert(used_.begin(), &hull);
  hull.in_used_list = bytes > 0;
}

// Drops what the hull holds and nobody uses, if the store can give it back; whether that was
// anything.
bool Registry::DropUnused(Locked& locked, RegisteredHull& hull) {
  if (!hull.quiet() || hull.pins > 0 || !hull.chunks.empty()) return false;
  const size_t before = hull.charged_bytes;
  if (store_.keeps_hulls()) {
    locked.Discard(std::move(hull.builder));
    hull.builder_bytes = 0;
  }
  const bool can_make_again = store_.keeps_hulls() || hull.builder != nullptr;
  if (can_make_again && hull.snapshot.use_count() == 1) {
    locked.Discard(std::exchange(hull.snapshot, nullptr));
  }
  Account(hull);
  return hull.charged_bytes < before;
}

// Drops what was not used for longest until the rest is within the limit.
void Registry::Evict(Locked& locked) {
  for (auto place = used_.end(); cache_.bytes > limits_.memory_limit && place != used_.begin();) {
    const auto newer = place;
    RegisteredHull& hull = **--place;
    if (DropUnused(locked, hull)) ++cache_.evictions;
    if (!hull.in_used_list) place = newer;
  }
}

absl::Status Registry::CheckMemoryLocked(Locked& locked) {
  Evict(locked);
  if (cache_.bytes <= limits_.memory_limit) return absl::OkStatus();
  return Overloaded(
      absl::StrCat("hulls in use, points on their way to them and streams of queries hold ",
                   cache_.bytes, " bytes of memory"),
      limits_.memory_limit, "memory-limit", kRetryMemory);
}

void MemoryCharge::Set(uint64_t bytes) {
  if (bytes == bytes_) return;
  const std::lock_guard lock(registry_.mutex_);
  registry_.cache_.bytes += bytes - bytes_;
  bytes_ = bytes;
}

absl::Status Registry::CheckMemory() {
  Locked locked(mutex_);
  return CheckMemoryLocked(locked);
}

}  // namespace hulld::server
