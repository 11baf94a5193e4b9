#include "server/shards/shards.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/base/check.h"
#include "server/settings/memory_limit.h"

namespace hulld::server {
namespace {

// Each shard's part of --memory-limit; 0 stays what it means, for one.
Limits LimitsOfShard(Limits limits, size_t shards) {
  if (shards == 1) return limits;
  if (limits.memory_limit == 0) limits.memory_limit = DefaultMemoryLimit();
  limits.memory_limit /= shards;
  return limits;
}

// The first of some sorted pages, all of them merged. A page that is not its shard's last may hold
// few: what comes after its end is not known, so the merged page ends there. id_of: the ID of an
// entry.
template <typename Page, typename IdOf>
auto MergePages(const std::vector<Page>& pages, size_t page_size, const IdOf& id_of) {
  std::pair<decltype(pages.front().entries), bool> merged;
  auto& [entries, more] = merged;
  std::vector<size_t> next(pages.size());
  const auto is_at_end = [&](size_t i) { return next[i] == pages[i].entries.size(); };
  while (entries.size() < page_size) {
    std::optional<size_t> first;
    bool is_known = true;
    for (size_t i = 0; i < pages.size(); ++i) {
      if (is_at_end(i)) {
        is_known = is_known && !pages[i].more;
      } else if (!first ||
                 id_of(pages[i].entries[next[i]]) < id_of(pages[*first].entries[next[*first]])) {
        first = i;
      }
    }
    if (!first || !is_known) break;
    entries.push_back(pages[*first].entries[next[*first]++]);
  }
  for (size_t i = 0; i < pages.size(); ++i) more |= pages[i].more || !is_at_end(i);
  return merged;
}

// One shard's part of a list.
template <typename Entry>
struct PartOfList {
  std::vector<Entry> entries;
  bool more = false;
};

}  // namespace

Shards::Shards(Store& store, const Limits& limits, WorkerPool& writers,
               std::optional<PoolMetrics> preparers, std::optional<PoolMetrics> loaders)
    : Shards(std::array<Store*, 1>{&store}, ShardOfSlot{}, limits,
             std::array<WorkerPool*, 1>{&writers}, preparers, loaders) {}

Shards::Shards(std::span<Store* const> stores, const ShardOfSlot& shard_of_slot,
               const Limits& limits, std::span<WorkerPool* const> writers,
               std::optional<PoolMetrics> preparers, std::optional<PoolMetrics> loaders)
    : limits_(limits), shard_of_slot_(shard_of_slot) {
  HULLD_CHECK(!stores.empty() && writers.size() >= stores.size());
  for (const uint16_t shard : shard_of_slot_) HULLD_CHECK(shard < stores.size());
  const Limits each = LimitsOfShard(limits, stores.size());
  for (size_t i = 0; i < stores.size(); ++i) {
    store_ids_.push_back(stores[i]->id());
    registries_.push_back(
        std::make_unique<Registry>(*stores[i], each, *writers[i], preparers, loaders));
  }
  limits_.memory_limit = registries_.front()->limits().memory_limit * registries_.size();
  if (registries_.size() == 1) return;
  for (size_t i = 0; i < registries_.size(); ++i) {
    registries_[i]->CountAlso([this, i] {
      uint64_t held = 0;
      for (size_t k = 0; k < registries_.size(); ++k) held += k == i ? 0 : registries_[k]->held();
      return held;
    });
  }
}

absl::Status Shards::Load() {
  for (const auto& registry : registries_) {
    if (absl::Status s = registry->Load(); !s.ok()) return s;
  }
  return absl::OkStatus();
}

absl::Status Shards::CheckMemory(MemoryUse use) {
  if (registries_.size() == 1) return registries_.front()->CheckMemory(use);
  uint64_t held = 0;
  uint64_t share = 0;
  for (const auto& registry : registries_) {
    const MemoryStatistics statistics = registry->memory().Statistics();
    held += use == MemoryUse::kReading ? statistics.reading : statistics.writing;
    share += registry->memory().share(use);
  }
  if (held <= share) return absl::OkStatus();
  // One that is over its part lets go of what it can, and says the rest.
  for (const auto& registry : registries_) {
    if (absl::Status s = registry->CheckMemory(use); !s.ok()) return s;
  }
  return absl::OkStatus();
}

absl::StatusOr<ShardsHullPage> Shards::List(const std::string& prefix, const std::string& after,
                                            size_t page_size,
                                            const std::function<bool()>& should_stop) {
  std::vector<PartOfList<ListedHull>> parts;
  ShardRevisions revisions;
  for (size_t shard = 0; shard < size(); ++shard) {
    absl::StatusOr<HullPage> page = at(shard).List(prefix, after, page_size, should_stop);
    if (!page.ok()) return page.status();
    revisions.push_back({shard, page->store_revision});
    parts.push_back({std::move(page->hulls), page->more});
  }
  auto [hulls, more] =
      MergePages(parts, page_size,
                 [](const ListedHull& hull) -> const std::string& { return hull.record.hull_id; });
  return ShardsHullPage{std::move(revisions), std::move(hulls), more};
}

absl::StatusOr<ShardsBodyPage> Shards::ListBodies(const std::string& prefix,
                                                  const std::string& after, size_t page_size,
                                                  const std::function<bool()>& should_stop) {
  std::vector<PartOfList<std::shared_ptr<const Body>>> parts;
  ShardRevisions revisions;
  for (size_t shard = 0; shard < size(); ++shard) {
    absl::StatusOr<BodyPage> page = at(shard).ListBodies(prefix, after, page_size, should_stop);
    if (!page.ok()) return page.status();
    revisions.push_back({shard, page->store_revision});
    parts.push_back({std::move(page->bodies), page->more});
  }
  auto [bodies, more] = MergePages(
      parts, page_size, [](const std::shared_ptr<const Body>& body) -> const std::string& {
        return body->record().body_id;
      });
  return ShardsBodyPage{std::move(revisions), std::move(bodies), more};
}

FoundBodies Shards::FindBodiesInEach(
    std::span<const std::string> ids,
    const std::function<FoundBodies(Registry&, std::span<const std::string>)>& find) {
  if (size() == 1) return find(at(0), ids);
  FoundBodies all;
  all.bodies.resize(ids.size());
  std::vector<std::vector<size_t>> places(size());
  for (size_t i = 0; i < ids.size(); ++i) places[shard_of(ids[i])].push_back(i);
  for (size_t shard = 0; shard < size(); ++shard) {
    if (places[shard].empty() || !at(shard).has_bodies()) continue;
    std::vector<std::string> asked;
    asked.reserve(places[shard].size());
    for (const size_t i : places[shard]) asked.push_back(ids[i]);
    FoundBodies found = find(at(shard), asked);
    all.status.Update(found.status);
    for (size_t k = 0; k < places[shard].size(); ++k) {
      all.bodies[places[shard][k]] = std::move(found.bodies[k]);
    }
  }
  return all;
}

FoundBodies Shards::FindBodies(std::span<const std::string> ids,
                               const std::function<bool()>& should_stop) {
  return FindBodiesInEach(ids, [&](Registry& registry, std::span<const std::string> some) {
    return registry.FindBodies(some, should_stop);
  });
}

std::optional<FoundBodies> Shards::TryFindBodies(std::span<const std::string> ids) {
  FoundBodies all =
      FindBodiesInEach(ids, [](Registry& registry, std::span<const std::string> some) {
        std::optional<FoundBodies> found = registry.TryFindBodies(some);
        if (found.has_value()) return *std::move(found);
        return FoundBodies{0, std::vector<std::shared_ptr<const Body>>(some.size()),
                           absl::UnavailableError("it would have to wait")};
      });
  return all.status.ok() ? std::optional(std::move(all)) : std::nullopt;
}

bool Shards::has_bodies() const {
  return std::ranges::any_of(registries_, [](const auto& one) { return one->has_bodies(); });
}

ShardsSizes Shards::Sizes() const {
  ShardsSizes sizes;
  for (size_t shard = 0; shard < size(); ++shard) {
    const RegistrySizes part = at(shard).Sizes();
    sizes.revisions.push_back({shard, part.store_revision});
    sizes.hull_count += part.hull_count;
    sizes.vertex_count += part.vertex_count;
    sizes.body_count += part.body_count;
  }
  return sizes;
}

HoldStatistics Shards::Holds() const {
  HoldStatistics worst;
  for (const auto& registry : registries_) {
    const HoldStatistics part = registry->Holds();
    worst.longest = std::max(worst.longest, part.longest);
    worst.most_lookups = std::max(worst.most_lookups, part.most_lookups);
  }
  return worst;
}

CacheStatistics Shards::Cache() const {
  CacheStatistics sum;
  for (const auto& registry : registries_) {
    const CacheStatistics part = registry->Cache();
    sum.bytes += part.bytes;
    sum.reading_bytes += part.reading_bytes;
    sum.writing_bytes += part.writing_bytes;
    sum.limit_bytes += part.limit_bytes;
    sum.hits += part.hits;
    sum.misses += part.misses;
    sum.loads += part.loads;
    sum.grown += part.grown;
    sum.evictions += part.evictions;
    sum.damaged += part.damaged;
  }
  return sum;
}

CommitStatistics Shards::Commits() const {
  CommitStatistics sum;
  for (const auto& registry : registries_) {
    const CommitStatistics part = registry->Commits();
    sum.batches += part.batches;
    sum.changes += part.changes;
    sum.failed_batches += part.failed_batches;
    sum.failing |= part.failing;
    sum.holds += part.holds;
  }
  return sum;
}

StoreFailures Shards::failures() const {
  StoreFailures sum;
  for (const auto& registry : registries_) {
    const StoreFailures part = registry->store().failures();
    sum.write += part.write;
    sum.sync += part.sync;
    sum.read += part.read;
  }
  return sum;
}

std::optional<StoreDisk> Shards::disk() const {
  std::optional<StoreDisk> sum;
  for (const auto& registry : registries_) {
    const std::optional<StoreDisk> part = registry->store().disk();
    if (!part.has_value()) continue;
    if (!sum.has_value()) {
      sum = part;
      continue;
    }
    sum->bytes += part->bytes;
    sum->log_bytes += part->log_bytes;
    sum->stalls += part->stalls;
    sum->is_stalled |= part->is_stalled;
    // The least that one of them has.
    if (part->free_bytes.has_value()) {
      sum->free_bytes = std::min(sum->free_bytes.value_or(UINT64_MAX), *part->free_bytes);
    }
  }
  return sum;
}

void Shards::SetMetrics(StoreMetrics& metrics) {
  for (const auto& registry : registries_) registry->SetMetrics(metrics);
}

void Shards::EndWatches() {
  for (const auto& registry : registries_) registry->EndWatches();
}

}  // namespace hulld::server
