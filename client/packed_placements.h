#ifndef HULLD_CLIENT_PACKED_PLACEMENTS_H_
#define HULLD_CLIENT_PACKED_PLACEMENTS_H_

#include <google/protobuf/repeated_field.h>

#include "hulld/v1/collision.pb.h"

namespace hulld {

// The same placements, each hull named once, in the order in which they come: some 60 bytes each
// instead of a hundred, which a server reads many times as fast.
v1::PackedPlacements PackPlacements(
    const google::protobuf::RepeatedPtrField<v1::Placement>& placements);

}  // namespace hulld

#endif  // HULLD_CLIENT_PACKED_PLACEMENTS_H_
