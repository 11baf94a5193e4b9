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

// A committed hull, ready for questions and for growth, of the points that the store keeps of it:
// at least its vertices, and none outside it. The result is never null. Their number and dimension
// are checked; whether they make the hull that the record describes is left to whatever builds it
// of them. DATA_LOSS naming the hull: the store is damaged. UNAVAILABLE: it cannot be read. Cost:
// O(n), but that of building the hull where it is flat.
absl::StatusOr<std::shared_ptr<LiveHull>> LoadLive(Store& store, const StoredHull& stored);

// Hulls that are read from the store together, by threads of a pool that are free and by the one
// that asks for the results, each of which takes a few at a time. Thread-safe, but for Finish.
class LoadJob {
 public:
  using Loaded = absl::StatusOr<std::shared_ptr<LiveHull>>;

  // Store and pool must outlive what Start submits, which ends soon after Finish.
  LoadJob(Store& store, std::vector<StoredHull> hulls);
  // Has the threads of the pool begin; nobody needs to wait for them.
  static std::shared_ptr<LoadJob> Start(Store& store, std::vector<StoredHull> hulls,
                                        WorkerPool& helpers);

  const std::vector<StoredHull>& hulls() const { return hulls_; }
  // LoadLive of each, in their order: loads what nobody has begun, and waits for what others have.
  // CANCELLED for those that are left when should_stop, which may be empty and is asked by this
  // thread alone, says so. Once.
  std::vector<Loaded> Finish(const std::function<bool()>& should_stop);

 private:
  void Work(const std::function<bool()>& should_stop);
  void LoadSome(std::span<const uint32_t> some);

  Store& store_;
  const std::vector<StoredHull> hulls_;
  // In the order in which they are loaded, and where the parts end that a thread takes.
  std::vector<uint32_t> order_;
  std::vector<uint32_t> ends_;
  // Each is written by the thread that took it, and read once all have ended.
  std::vector<Loaded> loaded_;
  std::atomic<size_t> next_ = 0;
  std::atomic<bool> is_stopped_ = false;
  Mutex mutex_;
  ConditionVariable all_ended_;
  // Parts.
  size_t ended_ = 0;
};

// A builder that holds the hull of these points; the result is never null. DATA_LOSS naming the
// hull: they do not make what the record says. CANCELLED: should_stop, which may be empty, said so.
// Cost: that of adding n points to a builder.
absl::StatusOr<std::unique_ptr<HullBuilder>> BuildHull(const HullRecord& record,
                                                       std::span<const Vector> points,
                                                       const std::function<bool()>& should_stop);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_MEMORY_HULL_LOADER_H_
