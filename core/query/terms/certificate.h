#ifndef HULLD_CORE_QUERY_TERMS_CERTIFICATE_H_
#define HULLD_CORE_QUERY_TERMS_CERTIFICATE_H_

#include <utility>
#include <variant>
#include <vector>

#include "core/numeric/integer.h"
#include "core/numeric/vector.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// A direction of any length, exact as given: in doubles if these suffice, otherwise in integers.
using ExactDirection = std::variant<std::monostate, Vector, IntegerVector>;

// A proof of a relation. Independent code can check it in O(V) exact operations from the vertices
// and the poses.
//
// SEPARATED: a direction n, world frame, with max n.A < min n.B. TOUCHING: n not zero, max n.A <=
// min n.B, and at most four pairs; the hull of their differences contains 0. OVERLAPPING: no
// direction, and at most six pairs; the hull of their differences contains 0 strictly inside
// (Steinitz 1913).
//
// Rounded hulls, with A and B their cores and r > 0 the sum of their radii. SEPARATED: min n.B -
// max n.A > r |n|. TOUCHING: min n.B - max n.A = r |n|, and at most three pairs; the hull of their
// differences has a point within r of 0. OVERLAPPING: no direction, and at most four pairs; the
// hull of their differences has a point nearer to 0 than r.
struct Certificate {
  ExactDirection direction;
  std::vector<VertexPair> pairs;
};

// Returns the proof for (B, A) of a proof for (A, B).
inline Certificate Mirrored(Certificate certificate) {
  if (Vector* n = std::get_if<Vector>(&certificate.direction)) *n = -*n;
  if (IntegerVector* n = std::get_if<IntegerVector>(&certificate.direction)) *n = -*n;
  for (VertexPair& pair : certificate.pairs) std::swap(pair.a, pair.b);
  return certificate;
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_CERTIFICATE_H_
