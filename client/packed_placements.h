#ifndef HULLD_CLIENT_PACKED_PLACEMENTS_H_
#define HULLD_CLIENT_PACKED_PLACEMENTS_H_

#include <google/protobuf/repeated_field.h>

#include <array>
#include <span>

#include "hulld/v1/collision.pb.h"

namespace hulld {

// Returns the numbers of a pose: quaternion w x y z, then translation x y z. Missing parts default
// to those of the identity.
std::array<double, 7> NumbersOf(const v1::Pose& pose);

// Returns the pose with these numbers.
v1::Pose PoseOf(std::span<const double, 7> numbers);

// Returns the same placements in the same order, with each hull ID and each inline shape stored
// only once: about 60 bytes per placement instead of 100, and many times faster to parse on the
// server.
v1::PackedPlacements PackPlacements(
    const google::protobuf::RepeatedPtrField<v1::Placement>& placements);

}  // namespace hulld

#endif  // HULLD_CLIENT_PACKED_PLACEMENTS_H_
