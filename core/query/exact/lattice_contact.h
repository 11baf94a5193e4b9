#ifndef HULLD_CORE_QUERY_EXACT_LATTICE_CONTACT_H_
#define HULLD_CORE_QUERY_EXACT_LATTICE_CONTACT_H_

#include <array>
#include <optional>

#include "core/numeric/vector.h"
#include "core/query/floating/float_pair.h"
#include "core/query/floating/float_search.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

struct LatticeContact {
  // From A toward B: n.w <= 0 for all w in A - B.
  Vector axis = Vector::Zero();
  // The hull of their differences contains 0.
  std::array<VertexPair, 3> pairs = {};
};

// Proves in doubles, without rounding, that the hulls touch where a floating-point search ended.
// Requires a pair on a lattice: hulls turned by quarter or third turns, with coordinates and a
// difference of translations that are multiples of a power of two, at most 2^51 times as large. The
// contact is either between two vertices, each the only farthest one along the axis, or in a plane
// perpendicular to a coordinate axis. Returns nothing for other pairs and contacts. Cost: a fifth
// of SearchExactly's.
std::optional<LatticeContact> FindLatticeContact(const FloatPair& pair,
                                                 const FloatSearchResult& end);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_EXACT_LATTICE_CONTACT_H_
