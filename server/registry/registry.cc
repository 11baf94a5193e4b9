#include "server/registry/registry.h"

#include <absl/status/status.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "server/registry/catalog/registered_hull.h"
#include "server/settings/cpu_limit.h"
#include "server/settings/memory_limit.h"

namespace hulld::server {
namespace {

Limits WithMemoryLimit(Limits limits) {
  if (limits.memory_limit == 0) limits.memory_limit = DefaultMemoryLimit();
  return limits;
}

// The rest is reserved for writers: without a store that keeps hulls, their hulls stay in memory.
uint64_t ReadersShare(uint64_t memory_limit, const Store& store) {
  return memory_limit / (store.keeps_hulls() ? 2 : 4);
}

}  // namespace

Registry::Registry(Store& store, const Limits& limits, WorkerPool& writers,
                   std::optional<PoolMetrics> preparers, std::optional<PoolMetrics> loaders)
    : store_(store),
      limits_(WithMemoryLimit(limits)),
      memory_(limits_.memory_limit, ReadersShare(limits_.memory_limit, store), mutex_),
      catalog_(store, limits_, memory_),
      feed_(mutex_, memory_, Config::kWatchMarkInterval),
      committer_(store, mutex_),
      preparer_(mutex_, catalog_, memory_, preparers),
      loaders_(std::in_place, std::max(1, DefaultThreads() - 1), loaders),
      freshness_(store, mutex_, catalog_, committer_),
      gate_(mutex_, catalog_, committer_, freshness_),
      records_(store, mutex_, catalog_, memory_, gate_, *loaders_),
      lister_(store, mutex_, catalog_, memory_, feed_, gate_, *loaders_),
      reader_(store, limits_, mutex_, catalog_, memory_, freshness_, records_, preparer_,
              *loaders_),
      bodies_(store, mutex_, catalog_, memory_, committer_, feed_, after_others_, freshness_,
              records_, lister_),
      changes_(catalog_, memory_, committer_, after_others_, writers),
      lifecycle_(store, catalog_, memory_, feed_, freshness_, records_, changes_),
      appender_(store, limits_, writers, mutex_, catalog_, memory_, feed_, freshness_, records_,
                preparer_, lifecycle_, changes_),
      takeover_(catalog_, memory_, feed_, after_others_, records_, preparer_, changes_),
      watches_(store, mutex_, catalog_, memory_, feed_, lister_) {
  if (!store.is_shared()) return;
  committer_.SetOthers(
      [this](Locked& locked, const OtherChanges& others) { takeover_.Take(locked, others); },
      [this](Locked&, const OtherChanges& others) { return takeover_.GrownHulls(others); });
}

Registry::~Registry() {
  store_.OnOthers(nullptr);
  {
    const Locked locked(mutex_);
    preparer_.Stop(locked);
  }
  // The committer's thread applies peer changes to the parts that are destroyed below.
  committer_.End();
  preparer_.End();
  loaders_.reset();
  // Closed sessions may outlive this while they hold hulls.
  const std::lock_guard lock(mutex_);
  for (const auto& [id, hull] : catalog_.hulls().entries()) {
    if (hull.awake() != nullptr) hull.awake()->account.Close();
  }
}

absl::Status Registry::Load() {
  Locked locked(mutex_);
  catalog_.Begin(store_.revision());
  feed_.Begin(catalog_.revision());
  absl::Status status;
  if (catalog_.is_cache()) {
    catalog_.SetTotals(store_.totals());
  } else {
    status = store_.ForEachHull([this](const std::string& id, absl::StatusOr<StoredHull> stored) {
      catalog_.AddStored(id, stored);
    });
  }
  if (catalog_.statistics().damaged > 0) {
    spdlog::error("{} of {} hulls are damaged", catalog_.statistics().damaged,
                  catalog_.hulls().size());
  }
  if (!status.ok()) return status;
  if (!catalog_.is_cache()) status = bodies_.Load(locked);
  if (!status.ok() || !store_.is_shared()) return status;
  // The pages read span more than one revision.
  const SteadyClock::time_point asked = SteadyClock::now();
  const absl::Status followed = store_.Follow();
  takeover_.Take(locked, store_.TakeOthers());
  if (followed.ok()) committer_.NoteCaughtUp(locked, asked);
  store_.OnOthers([this] { committer_.FollowSoon(); });
  return followed;
}

absl::StatusOr<Resolved> Registry::Resolve(std::span<const std::string> ids,
                                           const std::function<bool()>& should_stop,
                                           const ReadPlan& plan) {
  KnownHulls known;
  return reader_.Refresh(ids, known, should_stop, plan);
}

absl::StatusOr<std::pair<AsOf, HullView>> Registry::Resolve(
    const std::string& id, const std::function<bool()>& should_stop, const Freshness& freshness) {
  absl::StatusOr<Resolved> resolved =
      Resolve(std::span(&id, 1), should_stop, {.freshness = freshness});
  if (!resolved.ok()) return resolved.status();
  absl::StatusOr<HullView>& hull = resolved->hulls.front();
  if (!hull.ok()) return hull.status();
  return std::pair(resolved->as_of(), *std::move(hull));
}

absl::StatusOr<HullPage> Registry::List(const std::string& prefix, const std::string& after,
                                        size_t page_size,
                                        const std::function<bool()>& should_stop) {
  if (catalog_.is_cache()) return lister_.ListHulls(prefix, after, page_size, should_stop);
  HullPage page;
  const std::lock_guard lock(mutex_);
  page.store_revision = catalog_.revision();
  const HullTable::Entries& all = catalog_.hulls().entries();
  auto next = after.empty() ? all.lower_bound(prefix) : all.upper_bound(after);
  for (; next != all.end() && next->first.starts_with(prefix); ++next) {
    if (!next->second.visible()) continue;
    if (page.hulls.size() == page_size) {
      page.more = true;
      break;
    }
    HullChange hull = next->second.Describe(next->first);
    page.hulls.push_back({std::move(hull.record), hull.damaged});
  }
  return page;
}

HoldStatistics Registry::Holds() const {
  const std::lock_guard lock(mutex_);
  return mutex_.Statistics();
}

RegistrySizes Registry::Sizes() const {
  const std::lock_guard lock(mutex_);
  return catalog_.Sizes();
}

CacheStatistics Registry::Cache() const {
  const std::lock_guard lock(mutex_);
  const MemoryStatistics memory = memory_.Statistics();
  CacheStatistics cache = catalog_.statistics();
  cache.bytes = memory.bytes;
  cache.reading_bytes = memory.reading;
  cache.writing_bytes = memory.writing;
  cache.limit_bytes = memory.limit_bytes;
  cache.evictions = memory.evictions;
  return cache;
}

absl::Status Registry::CheckMemory(MemoryUse use) {
  Locked locked(mutex_);
  return memory_.Check(locked, use);
}

}  // namespace hulld::server
