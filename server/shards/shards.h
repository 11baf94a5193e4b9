#ifndef HULLD_SERVER_SHARDS_SHARDS_H_
#define HULLD_SERVER_SHARDS_SHARDS_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/process/metrics.h"
#include "server/process/worker_pool.h"
#include "server/registry/registry.h"
#include "server/settings/config.h"
#include "server/shards/known_in_shards.h"
#include "server/shards/shard_types.h"
#include "server/shards/shards_watch.h"
#include "server/shards/slots.h"
#include "server/store/store.h"

namespace hulld::server {

// The hulls and bodies of one server, spread by ID over one store or several, each with a registry
// of its own: its revisions, its commits, its watches. What is about one ID goes to the registry of
// that ID. With one shard, everything goes to its registry, as if this class were not there.
//
// What is about several shards is put together here from parts, each of one revision of its store.
// No change is made in two at once. A read of several that is to be linearizable is proven to be of
// one instant by looking again; where it never is, changes are held back for a moment
// (shards_read.cc). Thread-safe.
class Shards {
 public:
  // What spreads IDs: the shard of each slot.
  using ShardOfSlot = std::array<uint16_t, kSlots>;

  // One shard.
  Shards(Store& store, const Limits& limits, WorkerPool& writers,
         std::optional<PoolMetrics> preparers = std::nullopt,
         std::optional<PoolMetrics> loaders = std::nullopt);
  // Each store has the same share of --memory-limit; --max-hulls holds over all. writers: those of
  // each store; may be one for all. The rest is as in Registry. Requires a shard of `stores` for
  // each slot, and writers for each store.
  Shards(std::span<Store* const> stores, const ShardOfSlot& shard_of_slot, const Limits& limits,
         std::span<WorkerPool* const> writers, std::optional<PoolMetrics> preparers = std::nullopt,
         std::optional<PoolMetrics> loaders = std::nullopt);
  Shards(const Shards&) = delete;
  Shards& operator=(const Shards&) = delete;

  // Registry::Load of each.
  absl::Status Load();

  size_t size() const { return registries_.size(); }
  // The shard of an ID, and its registry. Cost: SlotOf, and nothing where there is one.
  size_t shard_of(std::string_view id) const {
    return registries_.size() == 1 ? 0 : shard_of_slot_[SlotOf(id)];
  }
  Registry& of(std::string_view id) { return *registries_[shard_of(id)]; }
  Registry& at(size_t shard) { return *registries_[shard]; }
  const Registry& at(size_t shard) const { return *registries_[shard]; }
  // The ID of each shard's store, and of the store that has this ID. They stay the same.
  std::span<const std::string> store_ids() const { return store_ids_; }
  const std::string& store_id_of(std::string_view id) const { return store_ids_[shard_of(id)]; }
  // What all stores have in common: their kind, and how durable they are.
  const Store& any_store() const { return registries_.front()->store(); }

  // With the memory limit in force, of all.
  const Limits& limits() const { return limits_; }
  // For what a call holds for long (MemoryCharge): the budgets of all take turns.
  MemoryBudget& memory() {
    if (registries_.size() == 1) return registries_.front()->memory();
    return registries_[next_budget_++ % registries_.size()]->memory();
  }
  // RESOURCE_EXHAUSTED: more is held for this use, in all shards together, than its share of
  // --memory-limit.
  absl::Status CheckMemory(MemoryUse use);

  // As those of Registry; those about several shards are fresh one after the other, and promise no
  // common instant.
  absl::Status AwaitOthers(const std::function<bool()>& should_stop);
  absl::StatusOr<std::chrono::nanoseconds> AwaitFresh(const ShardsFreshness& freshness,
                                                      const std::function<bool()>& should_stop);
  std::optional<std::chrono::nanoseconds> TryFresh(const ShardsFreshness& freshness);
  // As Registry::StartFresh for a call that names these, of all their shards at once; `done` is
  // called once, perhaps on this thread, with the first that failed.
  bool StartFresh(std::span<const std::string> ids, const ShardsFreshness& freshness,
                  std::function<void(const absl::Status&)> done);
  // In the byte order of the IDs, across shards.
  absl::StatusOr<ShardsHullPage> List(const std::string& prefix, const std::string& after,
                                      size_t page_size,
                                      const std::function<bool()>& should_stop = {});
  absl::StatusOr<ShardsBodyPage> ListBodies(const std::string& prefix, const std::string& after,
                                            size_t page_size,
                                            const std::function<bool()>& should_stop = {});
  // As those of Registry, but for the revision, which is none.
  FoundBodies FindBodies(std::span<const std::string> ids,
                         const std::function<bool()>& should_stop);
  std::optional<FoundBodies> TryFindBodies(std::span<const std::string> ids);
  bool has_bodies() const;

  // As Registry::Refresh. A read that is linearizable and concerns several shards is of one
  // instant; it looks twice, which costs two round trips where stores are shared, three times where
  // the hulls of one shard change all the time. Where those of two do, it looks once more after
  // kLooks while nothing is committed to all shards of the call but one.
  // also: IDs whose shards belong to the call, too; as_of names them. holds: asked after each look,
  // without locks, whether what the caller found in those shards before it is still so; ABORTED
  // when it is not. Both may be empty.
  absl::StatusOr<ShardsResolved> Refresh(std::span<const std::string> ids, KnownInShards& known,
                                         const std::function<bool()>& should_stop,
                                         const ShardsPlan& plan,
                                         std::span<const std::string> also = {},
                                         const std::function<bool()>& holds = {});
  // As Registry::TryResolve.
  std::optional<ShardsResolved> TryResolve(std::span<const std::string> ids,
                                           const ShardsPlan& plan);
  absl::StatusOr<const Hull*> Canonical(const HullView& view,
                                        const std::function<bool()>& should_stop) {
    return of(view.record.hull_id).Canonical(view, should_stop);
  }

  // As those of Registry.
  absl::StatusOr<std::shared_ptr<ShardsWatch>> OpenWatch(const WatchTarget& target,
                                                         const ShardsWatchStart& start,
                                                         std::function<void()> on_ready);
  void EndWatches();

  // Sums.
  ShardsSizes Sizes() const;
  HoldStatistics Holds() const;
  CacheStatistics Cache() const;
  CommitStatistics Commits() const;
  StoreFailures failures() const;
  std::optional<StoreDisk> disk() const;
  void SetMetrics(StoreMetrics& metrics);

  // Looks of one read before it holds changes back; a choice.
  static constexpr int kLooks = 8;

  // For tests: called each time when a read of several shards has looked up hulls of one, or holds.
  void OnPart(std::function<void()> on_part) { on_part_ = std::move(on_part); }

 private:
  using Part = KnownInShards::Part;
  // What was found in each part at one time.
  struct Look {
    std::chrono::nanoseconds staleness{0};
    std::vector<Resolved> parts;
    // KnownHulls::lookups of each.
    std::vector<uint64_t> lookups;
  };

  FoundBodies FindBodiesInEach(
      std::span<const std::string> ids,
      const std::function<FoundBodies(Registry&, std::span<const std::string>)>& find);
  void Begin(std::span<const std::string> ids, std::span<const std::string> also,
             KnownInShards& known) const;
  absl::StatusOr<std::chrono::nanoseconds> AwaitFreshIn(std::span<const size_t> shards,
                                                        const ShardsFreshness& freshness,
                                                        const std::function<bool()>& should_stop);
  absl::StatusOr<Look> LookOnce(KnownInShards& known, const std::function<bool()>& should_stop,
                                const ShardsPlan& plan, const std::function<bool()>& holds);
  absl::StatusOr<Look> LookAt(KnownInShards& known, std::span<const size_t> to_ask,
                              const std::function<bool()>& should_stop, const ShardsPlan& plan);
  absl::StatusOr<Look> LookWhileHeld(KnownInShards& known, const std::function<bool()>& should_stop,
                                     const ShardsPlan& plan);
  absl::StatusOr<Look> LookUntilOneInstant(KnownInShards& known, Look before,
                                           const std::function<bool()>& should_stop,
                                           ShardsPlan plan, const std::function<bool()>& holds);
  static bool HasChanged(const Look& before, const Look& now, size_t part);
  static ShardsResolved Join(std::span<const std::string> ids, const KnownInShards& known,
                             Look look);

  Limits limits_;
  const ShardOfSlot shard_of_slot_;
  std::vector<std::string> store_ids_;
  std::atomic<size_t> next_budget_ = 0;
  std::function<void()> on_part_;
  std::vector<std::unique_ptr<Registry>> registries_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_SHARDS_SHARDS_H_
