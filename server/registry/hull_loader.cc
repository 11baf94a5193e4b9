#include "server/registry/hull_loader.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <string>
#include <vector>

#include "server/contract/error_info.h"

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
  return WithReason(
      absl::DataLossError(absl::StrCat(
          "hull \"", record.hull_id, "\" is damaged in the store (",
          added.ok() ? absl::StrCat("its points make a hull of dimension ", builder->dimension(),
                                    " with ", builder->vertex_count(), " vertices, not ",
                                    record.dimension, " with ", record.vertex_count)
                     : std::string(added.status().message()),
          "); delete it and append it anew, or restore a backup")),
      v1::ERROR_REASON_HULL_DAMAGED, {{"hull_id", record.hull_id}});
}

}  // namespace hulld::server
