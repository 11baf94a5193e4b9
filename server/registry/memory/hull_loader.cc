#include "server/registry/memory/hull_loader.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <string>
#include <utility>

#include "core/numeric/orientation.h"
#include "server/contract/stopped_call.h"
#include "server/process/parallel_loop.h"
#include "server/store/store_errors.h"

namespace hulld::server {
namespace {

// Returns true if a few of the points span space. May return false even if all points together do.
bool SpanSpace(std::span<const Vector> points) {
  const size_t third = points.size() / 3;
  return third > 0 && std::ranges::any_of(points, [&](const Vector& point) {
           return Orient3d(points[0], points[third], points[2 * third], point) != 0;
         });
}

// Maximum number of hulls that a thread loads per step; takes about 50 us for small hulls.
constexpr size_t kMaxPerStep = 16;
// Minimum number of steps of a large load: small steps let all threads finish together.
constexpr size_t kMinSteps = 8;
// Loading this many small hulls takes longer than waking a thread.
constexpr size_t kMinHullsPerThread = 8;

// points: the hull's points as read from the store.
absl::StatusOr<std::shared_ptr<LiveHull>> MakeLive(const StoredHull& stored,
                                                   absl::StatusOr<std::vector<Vector>> points) {
  if (!points.ok()) return points.status();
  const std::string& id = stored.record.hull_id;
  const uint64_t expected = stored.layout.base_vertices + stored.layout.delta_vertices;
  if (points->size() != expected || expected < stored.record.vertex_count) {
    return DamagedHull(id, absl::StrCat("it has ", points->size(), " of ", expected,
                                        " points, and its record states ",
                                        stored.record.vertex_count, " vertices"));
  }
  if (!std::ranges::all_of(*points, [](const Vector& point) { return point.allFinite(); })) {
    return DamagedHull(id, "one of its points is not finite");
  }
  // A LiveHull relies on the dimension.
  if (stored.record.dimension != 3 || !SpanSpace(*points)) {
    const absl::Status built = BuildHull(stored.record, *points, {}).status();
    if (!built.ok()) return built;
  }
  return std::make_shared<LiveHull>(*std::move(points), stored.record.dimension);
}

}  // namespace

absl::StatusOr<std::shared_ptr<LiveHull>> LoadLive(Store& store, const StoredHull& stored) {
  return MakeLive(stored, store.LoadVertices(stored));
}

std::vector<LoadedHull> LoadEach(Store& store, std::span<const StoredHull> hulls, TaskPool& helpers,
                                 const std::function<bool()>& should_stop) {
  // Each element is written by one thread, and read after all have ended.
  std::vector<LoadedHull> loaded(hulls.size(), Cancelled());
  const auto load = [&](size_t begin, size_t end) {
    std::vector<absl::StatusOr<std::vector<Vector>>> points =
        store.LoadVerticesOfEach(hulls.subspan(begin, end - begin));
    for (size_t i = begin; i < end; ++i) {
      loaded[i] = MakeLive(hulls[i], std::move(points[i - begin]));
    }
  };
  ParallelLoop::Run(helpers, std::min(helpers.threads(), hulls.size() / kMinHullsPerThread),
                    hulls.size(), std::clamp<size_t>(hulls.size() / kMinSteps, 1, kMaxPerStep),
                    load, should_stop);
  return loaded;
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
                     absl::StrCat("its points form a hull of dimension ", builder->dimension(),
                                  " with ", builder->vertex_count(), " vertices, not ",
                                  record.dimension, " with ", record.vertex_count));
}

}  // namespace hulld::server
