#ifndef HULLD_SERVER_REGISTRY_HULL_LOADER_H_
#define HULLD_SERVER_REGISTRY_HULL_LOADER_H_

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "server/store/store.h"

namespace hulld::server {

// The points that the store keeps of a committed hull: at least its vertices, and none outside it.
// Their number and dimension are checked; whether they make the hull that the record describes is
// left to whatever builds it of them. DATA_LOSS naming the hull: the store is damaged. UNAVAILABLE:
// it cannot be read. Cost: O(n), but that of building the hull where it is flat.
absl::StatusOr<std::vector<Vector>> LoadPoints(Store& store, const StoredHull& stored);

// A builder that holds the hull of these points; the result is never null. DATA_LOSS naming the
// hull: they do not make what the record says. CANCELLED: should_stop, which may be empty, said so.
// Cost: that of adding n points to a builder.
absl::StatusOr<std::unique_ptr<HullBuilder>> BuildHull(const HullRecord& record,
                                                       std::span<const Vector> points,
                                                       const std::function<bool()>& should_stop);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_HULL_LOADER_H_
