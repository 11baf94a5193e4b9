#include "server/registry/hull_loader.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <string>
#include <vector>

#include "server/store/store_errors.h"

namespace hulld::server {

absl::StatusOr<std::unique_ptr<HullBuilder>> LoadBuilder(Store& store, const StoredHull& stored,
                                                         const std::function<bool()>& should_stop) {
  auto builder = std::make_unique<HullBuilder>();
  const HullRecord& record = stored.record;
  if (record.vertex_count == 0) return builder;
  const absl::StatusOr<std::vector<Vector>> vertices = store.LoadVertices(stored);
  if (!vertices.ok()) return vertices.status();
  AddLimits limits;
  limits.should_stop = should_stop;
  const absl::StatusOr<PointCounts> added = builder->Add(*vertices, limits);
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
