#ifndef HULLD_SERVER_REGISTRY_MEMORY_HULL_LOADER_H_
#define HULLD_SERVER_REGISTRY_MEMORY_HULL_LOADER_H_

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/query/placed/live_hull.h"
#include "server/process/task_pool.h"
#include "server/store/store.h"

namespace hulld::server {

// Loads a committed hull from its stored points, ready for queries and growth. The points include
// all of its vertices, and none outside it. The result is never null. Checks the number and
// dimension of the points; later builds check that they form the hull described by the record.
// DATA_LOSS naming the hull: the store is damaged. UNAVAILABLE: it cannot be read. Cost: O(n);
// building the hull if it is flat.
absl::StatusOr<std::shared_ptr<LiveHull>> LoadLive(Store& store, const StoredHull& stored);

using LoadedHull = absl::StatusOr<std::shared_ptr<LiveHull>>;

// Returns LoadLive of each hull, in order. Free threads of `helpers` load a few hulls per step, and
// so does this thread. The remaining hulls get CANCELLED after should_stop, which may be empty and
// is called only on this thread, returns true.
std::vector<LoadedHull> LoadEach(Store& store, std::span<const StoredHull> hulls, TaskPool& helpers,
                                 const std::function<bool()>& should_stop);

// Returns a builder with the hull of these points; never null. DATA_LOSS naming the hull: the
// points contradict the record. CANCELLED: should_stop, which may be empty, returned true. Cost:
// adding n points to a builder.
absl::StatusOr<std::unique_ptr<HullBuilder>> BuildHull(const HullRecord& record,
                                                       std::span<const Vector> points,
                                                       const std::function<bool()>& should_stop);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_MEMORY_HULL_LOADER_H_
