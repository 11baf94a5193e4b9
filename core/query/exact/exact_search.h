#ifndef HULLD_CORE_QUERY_EXACT_EXACT_SEARCH_H_
#define HULLD_CORE_QUERY_EXACT_EXACT_SEARCH_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/numeric/integer.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/terms/relation.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

struct ExactSearchResult {
  Relation relation;
  // Separated and touching: n, world frame, n.(a - b) <= 0 for all a and b, < 0 when separated.
  std::optional<IntegerVector> axis;
  uint64_t directions_tried = 0;
  // Where touching and known: pairs whose differences hold 0 in their hull, with repetitions.
  std::vector<VertexPair> pairs;
};

// Decides the relation of two hulls that are not empty, exactly. CANCELLED when should_stop said so
// (it may be empty).
//
// A flat Minkowski difference C, of dimension below 3, has no interior. Its plane or line either
// misses the origin, or C is thickened along coordinate axes outside its span: that leaves the
// position of the origin in the span as it was, and the portal search, which needs an interior,
// applies.
absl::StatusOr<ExactSearchResult> SearchExactly(ExactPair& pair,
                                                const std::function<bool()>& should_stop);

// The span of A - B.
struct MinkowskiSpan {
  int dimension;
  // Dimension 1: a direction along the line. Dimension 2: the plane's normal. Otherwise zero.
  IntegerVector direction;
};
MinkowskiSpan SpanOf(ExactPair& pair);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_EXACT_EXACT_SEARCH_H_
