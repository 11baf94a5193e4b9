#ifndef HULLD_SERVER_SHARDS_SHARD_POOLS_H_
#define HULLD_SERVER_SHARDS_SHARD_POOLS_H_

#include <cstddef>
#include <memory>
#include <vector>

#include "server/process/metrics.h"
#include "server/process/worker_pool.h"

namespace hulld::server {

// Threads for work that may wait for a store: each shard has its own, and calls that may concern
// several have others. So a store that does not answer holds up calls that ask about it, and not
// calls that ask about one hull of another. With one shard all of them are one pool.
class ShardPools {
 public:
  // threads: how many each pool has. metrics: told the sum of all. Requires shards > 0, threads >
  // 0.
  ShardPools(size_t shards, int threads, const PoolMetrics& metrics) {
    const size_t pools = shards == 1 ? 1 : shards + 1;
    for (size_t i = 0; i < pools; ++i) {
      pools_.push_back(std::make_unique<WorkerPool>(threads, metrics));
    }
  }

  // The pool for calls about IDs of this shard alone.
  WorkerPool& of(size_t shard) { return *pools_[shard]; }
  WorkerPool& of_several() { return *pools_.back(); }
  // The pool of each shard, in their order, and at the end, where there are several shards, the
  // pool for calls about several.
  std::vector<WorkerPool*> all() const {
    std::vector<WorkerPool*> pools;
    for (const auto& pool : pools_) pools.push_back(pool.get());
    return pools;
  }
  // Tasks that wait for a thread.
  size_t waiting() const {
    size_t waiting = 0;
    for (const auto& pool : pools_) waiting += pool->waiting();
    return waiting;
  }

 private:
  std::vector<std::unique_ptr<WorkerPool>> pools_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_SHARDS_SHARD_POOLS_H_
