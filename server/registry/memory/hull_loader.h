#ifndef HULLD_SERVER_REGISTRY_MEMORY_HULL_LOADER_H_
#define HULLD_SERVER_REGISTRY_MEMORY_HULL_LOADER_H_

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/query/placed/live_hull.h"
#include "server/process/worker_pool.h"
#include "server/store/store.h"

namespace hulld::server {

// A committed hull, ready for questions and for growth, of the points that the store keeps of it:
// at least its vertices, and none outside it. The result is never null. Their number and dimension
// are checked; whether they make the hull that the record describes is left to whatever builds it
// of them. DATA_LOSS naming the hull: the store is damaged. UNAVAILABLE: it cannot be read. Cost:
// O(n), but that of building the hull where it is flat.
absl::StatusOr<std::shared_ptr<LiveHull>> LoadLive(Store& store, const StoredHull& stored);

// LoadLive of each, in their order, by this thread and by those of `helpers` that are free: it does
// not wait for one that has not begun. CANCELLED for those that are left when should_stop, which
// may be empty and is asked by this thread alone, says so.
std::vector<absl::StatusOr<std::shared_ptr<LiveHull>>> LoadLives(
    Store& store, std::span<const StoredHull> stored, WorkerPool& helpers,
    const std::function<bool()>& should_stop);

// A builder that holds the hull of these points; the result is never null. DATA_LOSS naming the
// hull: they do not make what the record says. CANCELLED: should_stop, which may be empty, said so.
// Cost: that of adding n points to a builder.
absl::StatusOr<std::unique_ptr<HullBuilder>> BuildHull(const HullRecord& record,
                                                       std::span<const Vector> points,
                                                       const std::function<bool()>& should_stop);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_MEMORY_HULL_LOADER_H_
