#ifndef HULLD_SERVER_REGISTRY_MEMORY_HULL_LOADER_H_
#define HULLD_SERVER_REGISTRY_MEMORY_HULL_LOADER_H_

#include <absl/status/statusor.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/query/placed/live_hull.h"
#include "server/process/synchronization.h"
#include "server/process/worker_pool.h"
#include "server/store/store.h"

namespace hulld::server {

// Loads a committed hull from its stored points, ready for queries and growth. The points include
// at least its vertices, and none outside it. The result is never null. Checks the number and
// dimension of the points; that they form the hull described by the record is checked by later
// builds. DATA_LOSS naming the hull: the store is damaged. UNAVAILABLE: it cannot be read. Cost:
// O(n); building the hull if it is flat.
absl::StatusOr<std::shared_ptr<LiveHull>> LoadLive(Store& store, const StoredHull& stored);

// A batch of hulls loaded together, by free threads of a pool and by the thread that asks for the
// results; each takes a few hulls per step. Thread-safe except for Finish.
class LoadJob {
 public:
  using Loaded = absl::StatusOr<std::shared_ptr<LiveHull>>;

  // Store and pool must outlive the tasks that Start submits, which end soon after Finish.
  LoadJob(Store& store, std::vector<StoredHull> hulls);
  // Starts loading on the threads of the pool, without blocking.
  static std::shared_ptr<LoadJob> Start(Store& store, std::vector<StoredHull> hulls,
                                        WorkerPool& helpers);

  const std::vector<StoredHull>& hulls() const { return hulls_; }
  // Returns LoadLive of each hull, in order: loads the hulls that no thread has taken and waits for
  // the rest. Remaining hulls get CANCELLED after should_stop, which may be empty and is called
  // only on this thread, returns true. Call at most once.
  std::vector<Loaded> Finish(const std::function<bool()>& should_stop);

 private:
  void Work(const std::function<bool()>& should_stop);
  void LoadSome(std::span<const uint32_t> some);

  Store& store_;
  const std::vector<StoredHull> hulls_;
  // Hulls in the order of loading, and the end of each part.
  std::vector<uint32_t> order_;
  std::vector<uint32_t> ends_;
  // Each element is written by the thread that took it, and read after all threads have ended.
  std::vector<Loaded> loaded_;
  std::atomic<size_t> next_ = 0;
  std::atomic<bool> is_stopped_ = false;
  Mutex mutex_;
  ConditionVariable all_ended_;
  // Number of finished parts.
  size_t ended_ = 0;
};

// Returns a builder with the hull of these points; never null. DATA_LOSS naming the hull: the
// points contradict the record. CANCELLED: should_stop, which may be empty, returned true. Cost:
// adding n points to a builder.
absl::StatusOr<std::unique_ptr<HullBuilder>> BuildHull(const HullRecord& record,
                                                       std::span<const Vector> points,
                                                       const std::function<bool()>& should_stop);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_MEMORY_HULL_LOADER_H_
