#ifndef HULLD_CORE_QUERY_EXACT_EXACT_NEAREST_H_
#define HULLD_CORE_QUERY_EXACT_EXACT_NEAREST_H_

#include <absl/status/statusor.h>

#include <functional>
#include <span>
#include <vector>

#include "core/numeric/integer.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// A point of A - B as a convex combination: the sum of weights[i] times the difference of pairs[i],
// over weight_sum. All weights are positive; at most four pairs.
struct ExactCombination {
  std::vector<VertexPair> pairs;
  std::vector<Integer> weights;
  Integer weight_sum;
};

// The point of A - B that is nearest to the origin.
struct ExactNearest {
  ExactCombination point;
  // Its squared distance from the origin is numerator / denominator, in squared units of the pair.
  Integer numerator;
  Integer denominator;
};

// Returns a positive multiple of the point.
IntegerVector PointOf(ExactPair& pair, const ExactCombination& combination);

// Finds the exact nearest point, for hulls of every dimension, by the walk of Gilbert, Johnson and
// Keerthi (1988) in integers. Keeps a part (vertex, edge, triangle) of A - B with its nearest point
// strictly inside, and adds the farthest vertex toward the origin until no vertex is farther. The
// distance decreases strictly, so no part recurs and the walk terminates. Directions have degree at
// most 3 in the coordinates. `seed`: initial pairs; may be empty. `half`: if not null, the
// search is over the sum of A - B and the segment from -half to half, and a pair stands for one of
// two points. Requires: at most four initial pairs. CANCELLED: should_stop, which may be empty,
// returned true.
absl::StatusOr<ExactNearest> FindNearestExactly(ExactPair& pair, std::span<const VertexPair> seed,
                                                const std::function<bool()>& should_stop,
                                                const IntegerVector* half = nullptr);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_EXACT_EXACT_NEAREST_H_
