#include "server/registry/registry.h"

#include <absl/status/status.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "core/base/status_macros.h"
#include "server/registry/catalog/registered_hull.h"
#include "server/settings/resource_limits.h"

namespace hulld::server {

Registry::Registry(Store& store, const Limits& limits, TaskPool& writers,
                   std::optional<PoolMetrics> preparers, std::optional<PoolMetrics> loaders)
    : state_(store, limits, preparers),
      committer_(store, state_.mutex),
      loaders_(std::in_place, std::max(1, DefaultThreads() - 1), loaders),
      peers_(state_, committer_),
      records_(state_, committer_, peers_, *loaders_),
      reader_(state_, peers_, records_, *loaders_),
      changes_(state_, committer_, peers_, records_, writers) {}

Registry::~Registry() {
  peers_.End();
  state_.EndPreparing();
  // Its thread applies peer changes to the parts that are destroyed below.
  committer_.End();
  loaders_.reset();
  // Closed sessions may outlive this while they hold hulls.
  const std::lock_guard lock(state_.mutex);
  for (const auto& [id, hull] : state_.hulls.entries()) {
    if (hull.awake() != nullptr) hull.awake()->account.Close();
  }
}

absl::Status Registry::Load() {
  Locked locked(state_.mutex);
  Store& store = state_.store;
  state_.feed.Begin(store.revision(), records_);
  StoreTotals totals;
  if (state_.is_cache()) {
    totals = store.totals();
  } else {
    HULLD_RETURN_IF_ERROR(store.ForEachRecord(
        [&](const std::string& id, const absl::StatusOr<StoredHull>& stored) {
          state_.AddStored(id, stored);
          if (stored.ok()) totals.vertices += stored->record.vertex_count;
        },
        [&](const std::string& id, const absl::StatusOr<StoredBody>& body) {
          state_.AddBody(locked, id, body);
        }));
    totals.hulls = state_.hulls.size();
    totals.bodies = state_.bodies.size();
    if (state_.statistics.damaged > 0) {
      spdlog::error("{} of {} hulls and bodies are damaged", state_.statistics.damaged,
                    totals.hulls + totals.bodies);
    }
  }
  state_.SetTotals(totals);
  return peers_.Begin(locked, [this](const std::string& id, const HullPointer& hull) {
    if (hull != nullptr) changes_.DeferAdvance(hull);
    records_.OnPeerChange(id);
  });
}

absl::StatusOr<Resolved> Registry::Resolve(std::span<const std::string> ids,
                                           const std::function<bool()>& should_stop,
                                           const ReadPlan& plan) {
  KnownHulls known(/*for_one_lookup=*/true);
  return reader_.Refresh(ids, known, should_stop, plan);
}

absl::StatusOr<std::pair<AsOf, HullView>> Registry::Resolve(
    const std::string& id, const std::function<bool()>& should_stop, const Freshness& freshness) {
  absl::StatusOr<Resolved> resolved =
      Resolve(std::span(&id, 1), should_stop, {.freshness = freshness});
  if (!resolved.ok()) return resolved.status();
  absl::StatusOr<HullView>& hull = resolved->hulls.front();
  if (!hull.ok()) return hull.status();
  return std::pair(resolved->as_of, *std::move(hull));
}

HoldStatistics Registry::Holds() const {
  const std::lock_guard lock(state_.mutex);
  return state_.mutex.Statistics();
}

void Registry::RestIdleHulls() {
  std::string cursor;
  for (bool more = true; more;) {
    Locked locked(state_.mutex);
    more = state_.hulls.RestIdle(locked, cursor);
  }
}

RegistrySizes Registry::Sizes() const {
  const std::lock_guard lock(state_.mutex);
  return state_.Sizes();
}

CacheStatistics Registry::Cache() const {
  const std::lock_guard lock(state_.mutex);
  CacheStatistics cache = state_.statistics;
  static_cast<MemoryStatistics&>(cache) = state_.memory.Statistics();
  return cache;
}

absl::Status Registry::CheckMemory(MemoryUse use) {
  Locked locked(state_.mutex);
  return state_.memory.Check(locked, use);
}

}  // namespace hulld::server
