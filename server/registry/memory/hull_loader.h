#ifndef HULLD_SERVER_REGISTRY_MEMORY_HULL_LOADER_H_
#define HULLD_SERVER_REGISTRY_MEMORY_HULL_LOADER_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/query/placed/live_hull.h"
#include "server/process/shared_loop.h"
#include "server/process/task_pool.h"
#include "server/store/store.h"

namespace hulld::server {

// Loads a committed hull from its stored points, ready for queries and growth. The points include
// all of its vertices, and none outside it. The result is never null. Checks the number and
// dimension of the points; later builds check that they form the hull described by the record.
// DATA_LOSS naming the hull: the store is damaged. UNAVAILABLE: it cannot be read. Cost: O(n);
// building the hull if it is flat.
absl::StatusOr<std::shared_ptr<LiveHull>> LoadLive(Store& store, const StoredHull& stored);

// A batch of hulls loaded together, by idle threads of a pool and by the thread that requests the
// results; each loads a few hulls per step.
class LoadJob {
 public:
  using Loaded = absl::StatusOr<std::shared_ptr<LiveHull>>;

  // Starts loading on the threads of the pool, without blocking. Finish must be called.
  LoadJob(Store& store, std::vector<StoredHull> hulls, TaskPool& helpers);
  LoadJob(const LoadJob&) = delete;
  LoadJob& operator=(const LoadJob&) = delete;

  const std::vector<StoredHull>& hulls() const { return hulls_; }
  // Returns LoadLive of each hull, in order: loads the hulls that no thread has taken and waits for
  // the rest. Remaining hulls get CANCELLED after should_stop, which may be empty and is called
  // only on this thread, returns true. Call once.
  std::vector<Loaded> Finish(const std::function<bool()>& should_stop);

 private:
  void LoadPart(size_t part);

  Store& store_;
  const std::vector<StoredHull> hulls_;
  // Hulls in the order of loading, and the end of each part.
  std::vector<uint32_t> order_;
  std::vector<uint32_t> ends_;
  // Each element is written by the thread that took it, and read after all threads have ended.
  std::vector<Loaded> loaded_;
  std::shared_ptr<SharedLoop> loop_;
};

// Returns a builder with the hull of these points; never null. DATA_LOSS naming the hull: the
// points contradict the record. CANCELLED: should_stop, which may be empty, returned true. Cost:
// adding n points to a builder.
absl::StatusOr<std::unique_ptr<HullBuilder>> BuildHull(const HullRecord& record,
                                                       std::span<const Vector> points,
                                                       const std::function<bool()>& should_stop);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_MEMORY_HULL_LOADER_H_
