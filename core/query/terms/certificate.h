#ifndef HULLD_CORE_QUERY_TERMS_CERTIFICATE_H_
#define HULLD_CORE_QUERY_TERMS_CERTIFICATE_H_

#include <cstdint>
#include <variant>
#include <vector>

#include "core/numeric/integer.h"
#include "core/numeric/vector.h"

namespace hulld {

// A vertex of A and a vertex of B, by index into Hull::vertices(); it stands for the point a - b of
// A - B.
struct VertexPair {
  uint32_t a;
  uint32_t b;
  friend bool operator==(const VertexPair&, const VertexPair&) = default;
};

// What makes a relation checkable in O(V) exact operations by code that trusts nothing, from the
// vertices and the poses.
//
// SEPARATED: the direction n, world frame, with max n.A < min n.B. TOUCHING: n not zero, max n.A <=
// min n.B, and at most four pairs whose differences hold 0 in their hull. OVERLAPPING: no
// direction, and at most six pairs whose differences hold 0 strictly inside their hull (Steinitz
// 1913). The direction is exact as it stands, of any length: doubles where these suffice, else
// integers.
struct Certificate {
  std::variant<std::monostate, Vector, IntegerVector> direction;
  std::vector<VertexPair> pairs;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_CERTIFICATE_H_
