#include "server/registry/memory/hull_loader.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <string>
#include <utility>

#include "core/numeric/orientation.h"
#include "server/contract/stopped_call.h"
#include "server/process/synchronization.h"
#include "server/store/store_errors.h"

namespace hulld::server {
namespace {

// Whether a few of the points span space. May say false of points that do.
bool SpanSpace(std::span<const Vector> points) {
  const size_t third = points.size() / 3;
  return third > 0 && std::ranges::any_of(points, [&](const Vector& point) {
           return Orient3d(points[0], points[third], points[2 * third], point) != 0;
         });
}

absl::StatusOr<std::vector<Vector>> LoadPoints(Store& store, const StoredHull& stored) {
  absl::StatusOr<std::vector<Vector>> points = store.LoadVertices(stored);
  if (!points.ok()) return points;
  const std::string& id = stored.record.hull_id;
  const uint64_t expected = stored.layout.base_vertices + stored.layout.delta_vertices;
  if (points->size() != expected || expected < stored.record.vertex_count) {
    return DamagedHull(
        id, absl::StrCat("it has ", points->size(), " points of ", expected,
                         ", and its record says ", stored.record.vertex_count, " vertices"));
  }
  if (!std::ranges::all_of(*points, [](const Vector& point) { return point.allFinite(); })) {
    return DamagedHull(id, "one of its points is not finite");
  }
  // A LiveHull relies on the dimension.
  if (stored.record.dimension == 3 && SpanSpace(*points)) return points;
  const absl::Status built = BuildHull(stored.record, *points, {}).status();
  if (!built.ok()) return built;
  return points;
}

// Hulls that several threads load: each takes the next one.
class LoadJob {
 public:
  LoadJob(Store& store, std::span<const StoredHull> stored)
      : store_(store), stored_(stored.begin(), stored.end()), loaded_(stored.size(), Cancelled()) {}

  size_t size() const { return stored_.size(); }

  // Until none is left to begin. Once should_stop, which may be empty, says so, none is loaded.
  void Work(const std::function<bool()>& should_stop) {
    for (size_t i = next_++; i < size(); i = next_++) {
      if (!is_stopped_) loaded_[i] = LoadLive(store_, stored_[i]);
      if (Stopped(should_stop)) is_stopped_ = true;
      const std::lock_guard lock(mutex_);
      if (++ended_ == size()) all_ended_.notify_all();
    }
  }

  // Waits for those that others began.
  std::vector<absl::StatusOr<std::shared_ptr<LiveHull>>> Take() {
    std::unique_lock lock(mutex_);
    while (ended_ < size()) all_ended_.wait(lock);
    return std::move(loaded_);
  }

 private:
  Store& store_;
  const std::vector<StoredHull> stored_;
  // Each is written by the thread that took it, and read once all have ended.
  std::vector<absl::StatusOr<std::shared_ptr<LiveHull>>> loaded_;
  std::atomic<size_t> next_ = 0;
  std::atomic<bool> is_stopped_ = false;
  Mutex mutex_;
  ConditionVariable all_ended_;
  size_t ended_ = 0;
};

}  // namespace

absl::StatusOr<std::shared_ptr<LiveHull>> LoadLive(Store& store, const StoredHull& stored) {
  absl::StatusOr<std::vector<Vector>> points = LoadPoints(store, stored);
  if (!points.ok()) return points.status();
  return std::make_shared<LiveHull>(*std::move(points), stored.record.dimension);
}

std::vector<absl::StatusOr<std::shared_ptr<LiveHull>>> LoadLives(
    Store& store, std::span<const StoredHull> stored, WorkerPool& helpers,
    const std::function<bool()>& should_stop) {
  // So many small hulls take longer than to wake a thread.
  constexpr size_t kWorthAThread = 8;
  const auto job = std::make_shared<LoadJob>(store, stored);
  const size_t shares = std::min<size_t>(helpers.threads(), stored.size() / kWorthAThread);
  for (size_t i = 0; i < shares; ++i) helpers.Submit([job] { job->Work({}); });
  job->Work(should_stop);
  return job->Take();
}

absl::StatusOr<std::unique_ptr<HullBuilder>> BuildHull(const HullRecord& record,
                                                       std::span<const Vector> points,
                                                       const std::function<bool()>& should_stop) {
  auto builder = std::make_unique<HullBuilder>();
  AddLimits limits;
  limits.should_stop = should_stop;
  const absl::StatusOr<PointCounts> added = builder->Add(points, limits);
  if (absl::IsCancelled(added.status())) return added.status();
  if (added.ok() && builder->vertex_count() == record.vertex_count &&
      builder->dimension() == record.dimension) {
    return builder;
  }
  if (!added.ok()) return DamagedHull(record.hull_id, std::string(added.status().message()));
  return DamagedHull(record.hull_id,
                     absl::StrCat("its points make a hull of dimension ", builder->dimension(),
                                  " with ", builder->vertex_count(), " vertices, not ",
                                  record.dimension, " with ", record.vertex_count));
}

}  // namespace hulld::server
