#include "server/store/sealed_hull.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "server/contract/status_map.h"
#include "server/store/store_errors.h"
#include "server/store/store_keys.h"

namespace hulld::server {

absl::StatusOr<StoredHull> UnsealStoredHull(const std::string& hull_id, std::string_view sealed) {
  const absl::StatusOr<std::string_view> value = Unseal(HullKey(hull_id), sealed);
  absl::StatusOr<StoredHull> hull = value.ok() ? DecodeStoredHull(hull_id, *value) : value.status();
  if (!hull.ok()) return DamagedHull(hull_id, std::string(hull.status().message()));
  return hull;
}

absl::StatusOr<uint64_t> UnsealSequence(const std::string& hull_id, std::string_view key,
                                        std::string_view sealed) {
  const absl::StatusOr<std::string_view> value = Unseal(key, sealed);
  absl::StatusOr<uint64_t> sequence = value.ok() ? DecodeNumber(*value) : value.status();
  if (sequence.ok()) return sequence;
  return DamagedHull(hull_id, absl::StrCat("a writer's sequence: ", sequence.status().message()));
}

absl::StatusOr<StoredBody> UnsealStoredBody(const std::string& body_id, std::string_view sealed) {
  const absl::StatusOr<std::string_view> value = Unseal(BodyKey(body_id), sealed);
  absl::StatusOr<StoredBody> body = value.ok() ? DecodeStoredBody(body_id, *value) : value.status();
  if (!body.ok()) return DamagedBody(body_id, std::string(body.status().message()));
  return body;
}

VertexAssembly::VertexAssembly(const StoredHull& hull) : hull_(hull) {
  vertices_.reserve(hull.layout.base_vertices + hull.layout.delta_vertices);
}

absl::Status VertexAssembly::AddBasePart(const absl::StatusOr<std::string_view>& value) {
  const uint32_t part = next_part_++;
  absl::Status status = value.status();
  if (value.ok()) {
    status =
        value->empty() ? absl::DataLossError("it is empty") : AppendVertices(*value, &vertices_);
    base_vertices_ = vertices_.size();
  }
  if (status.ok()) return status;
  return Prefixed(absl::StrCat("part ", part, " of its base: "), status);
}

absl::Status VertexAssembly::AddDelta(uint64_t revision,
                                      const absl::StatusOr<std::string_view>& value) {
  ++deltas_;
  const absl::Status status = value.ok() ? AppendVertices(*value, &vertices_) : value.status();
  if (status.ok()) return status;
  return Prefixed(absl::StrCat("its delta of revision ", revision, ": "), status);
}

absl::Status VertexAssembly::Check() const {
  const VertexLayout& layout = hull_.layout;
  if (base_vertices_ != layout.base_vertices) {
    return absl::DataLossError(
        absl::StrCat("its base has ", base_vertices_, " vertices, not ", layout.base_vertices));
  }
  const uint64_t delta_vertices = vertices_.size() - base_vertices_;
  if (deltas_ == layout.delta_count && delta_vertices == layout.delta_vertices) {
    return absl::OkStatus();
  }
  return absl::DataLossError(absl::StrCat("it has ", deltas_, " deltas with ", delta_vertices,
                                          " vertices, not ", layout.delta_count, " with ",
                                          layout.delta_vertices));
}

absl::StatusOr<std::vector<Vector>> VertexAssembly::Finish(absl::Status status) && {
  if (status.ok()) status = Check();
  if (absl::IsDataLoss(status)) {
    return DamagedHull(hull_.record.hull_id, std::string(status.message()));
  }
  if (!status.ok()) return status;
  return std::move(vertices_);
}

}  // namespace hulld::server
