#include "client/packed_placements.h"

#include <absl/container/flat_hash_map.h>

#include <cstdint>
#include <string_view>

namespace hulld {

v1::PackedPlacements PackPlacements(
    const google::protobuf::RepeatedPtrField<v1::Placement>& placements) {
  v1::PackedPlacements packed;
  packed.mutable_hulls()->Reserve(placements.size());
  packed.mutable_poses()->Reserve(7 * placements.size());
  absl::flat_hash_map<std::string_view, uint32_t> index_of;
  for (const v1::Placement& placement : placements) {
    const auto [known, is_new] =
        index_of.emplace(placement.hull_id(), static_cast<uint32_t>(packed.hull_ids_size()));
    if (is_new) packed.add_hull_ids(placement.hull_id());
    packed.add_hulls(known->second);
    const v1::Quaternion& q = placement.pose().rotation();
    const v1::Vector3& t = placement.pose().translation();
    packed.add_poses(placement.pose().has_rotation() ? q.w() : 1);
    for (const double number : {q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) packed.add_poses(number);
  }
  return packed;
}

}  // namespace hulld
