#include "client/packed_placements.h"

#include <absl/container/flat_hash_map.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hulld {
namespace {

// Widens single-precision coordinates because all shapes share one block.
void AddShape(const v1::PointBlock& points, v1::PackedPlacements* packed) {
  google::protobuf::RepeatedField<double>* const xyz =
      packed->mutable_shape_points()->mutable_xyz();
  xyz->MergeFrom(points.xyz());
  xyz->Add(points.xyz_float().begin(), points.xyz_float().end());
  packed->add_shape_sizes(static_cast<uint32_t>(points.xyz_size() + points.xyz_float_size()) / 3);
}

void AddPose(const v1::Pose& pose, google::protobuf::RepeatedField<double>* poses) {
  for (const double number : NumbersOf(pose)) poses->Add(number);
}

}  // namespace

std::array<double, 7> NumbersOf(const v1::Pose& pose) {
  const v1::Quaternion& q = pose.rotation();
  const v1::Vector3& t = pose.translation();
  return {pose.has_rotation() ? q.w() : 1, q.x(), q.y(), q.z(), t.x(), t.y(), t.z()};
}

v1::Pose PoseOf(std::span<const double, 7> numbers) {
  v1::Pose pose;
  v1::Quaternion& q = *pose.mutable_rotation();
  q.set_w(numbers[0]);
  q.set_x(numbers[1]);
  q.set_y(numbers[2]);
  q.set_z(numbers[3]);
  v1::Vector3& t = *pose.mutable_translation();
  t.set_x(numbers[4]);
  t.set_y(numbers[5]);
  t.set_z(numbers[6]);
  return pose;
}

v1::PackedPlacements PackPlacements(
    const google::protobuf::RepeatedPtrField<v1::Placement>& placements) {
  v1::PackedPlacements packed;
  packed.mutable_hulls()->Reserve(placements.size());
  packed.mutable_poses()->Reserve(7 * placements.size());
  absl::flat_hash_map<std::string_view, uint32_t> index_of;
  // Serialized points.
  absl::flat_hash_map<std::string, uint32_t> shape_of;
  // Placements with an inline shape, and its index.
  std::vector<std::pair<int, uint32_t>> shaped;
  const bool moves = std::any_of(placements.begin(), placements.end(),
                                 [](const v1::Placement& one) { return one.has_end_pose(); });
  for (const v1::Placement& placement : placements) {
    if (placement.has_points()) {
      const auto [known, is_new] = shape_of.emplace(
          placement.points().SerializeAsString(), static_cast<uint32_t>(packed.shape_sizes_size()));
      if (is_new) AddShape(placement.points(), &packed);
      shaped.emplace_back(packed.hulls_size(), known->second);
      packed.add_hulls(0);
    } else {
      const auto [known, is_new] =
          index_of.emplace(placement.hull_id(), static_cast<uint32_t>(packed.hull_ids_size()));
      if (is_new) packed.add_hull_ids(placement.hull_id());
      packed.add_hulls(known->second);
    }
    AddPose(placement.pose(), packed.mutable_poses());
    packed.add_radii(placement.radius());
    if (!moves) continue;
    AddPose(placement.has_end_pose() ? placement.end_pose() : placement.pose(),
            packed.mutable_end_poses());
  }
  const auto is_zero = [](double radius) { return radius == 0; };
  if (std::all_of(packed.radii().begin(), packed.radii().end(), is_zero)) packed.clear_radii();
  const auto id_count = static_cast<uint32_t>(packed.hull_ids_size());
  for (const auto& [i, shape] : shaped) packed.set_hulls(i, id_count + shape);
  return packed;
}

}  // namespace hulld
