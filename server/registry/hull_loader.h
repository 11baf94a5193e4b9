#ifndef HULLD_SERVER_REGISTRY_HULL_LOADER_H_
#define HULLD_SERVER_REGISTRY_HULL_LOADER_H_

#include <absl/status/statusor.h>

#include <functional>
#include <memory>

#include "core/hull/growth/hull_builder.h"
#include "server/store/store.h"

namespace hulld::server {

// The builder of a committed hull, from the vertices that the store keeps of it; the result is
// never null. DATA_LOSS naming the hull: the store is damaged. UNAVAILABLE: it cannot be read.
// CANCELLED: should_stop, which may be empty, said so.
// Cost: that of reading V vertices and adding them to a builder.
absl::StatusOr<std::unique_ptr<HullBuilder>> LoadBuilder(Store& store, const StoredHull& stored,
                                                         const std::function<bool()>& should_stop);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_HULL_LOADER_H_
