#ifndef HULLD_CORE_QUERY_TERMS_AXIS_H_
#define HULLD_CORE_QUERY_TERMS_AXIS_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "core/numeric/vector.h"

namespace hulld {

enum class AxisKind {
  kFacetA,    // normal of a facet of A
  kFacetB,    // normal of a facet of B
  kEdgeEdge,  // cross product of an edge of A and an edge of B
  kFlat,      // a direction that only flat Minkowski differences need
  kGeneral,   // a support direction found by search
};

// The vertices of one hull that are farthest along an axis.
struct Feature {
  std::vector<uint32_t> vertices;  // indices into Hull::vertices(), ascending
  std::optional<uint32_t> facet;   // when the feature is a whole facet
};

// A direction (world frame) from A toward B, with max n.A <= min n.B over the reals. `direction`
// is n rounded to unit length.
//
// FACET_A and FACET_B refer to a line: as in the textbook, which tests each line once, the
// direction may be the facet's outward normal or its negative. The features belong to the
// direction.
struct SeparatingAxis {
  Vector direction;
  AxisKind kind;
  Feature feature_a;  // where A reaches farthest along n
  Feature feature_b;  // where B reaches least far
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_AXIS_H_
