#ifndef HULLD_CORE_QUERY_TERMS_CERTIFICATE_H_
#define HULLD_CORE_QUERY_TERMS_CERTIFICATE_H_

#include <variant>
#include <vector>

#include "core/numeric/integer.h"
#include "core/numeric/vector.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// What makes a relation checkable in O(V) exact operations by code that trusts nothing, from the
// vertices and the poses.
//
// SEPARATED: the direction n, world frame, with max n.A < min n.B. TOUCHING: n not zero, max n.A <=
// min n.B, and at most four pairs whose differences hold 0 in their hull. OVERLAPPING: no
// direction, and at most six pairs whose differences hold 0 strictly inside their hull (Steinitz
// 1913). The direction is exact as it stands, of any length: doubles where these suffice, otherwise
// integers.
struct Certificate {
  std::variant<std::monostate, Vector, IntegerVector> direction;
  std::vector<VertexPair> pairs;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_CERTIFICATE_H_
