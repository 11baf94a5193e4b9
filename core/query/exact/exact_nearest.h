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

// Finds it exactly, for hulls of every dimension: Gilbert, Johnson and Keerthi's walk (1988) in
// integers. A part (vertex, edge, triangle) of A - B is kept of which the nearest point is strictly
// inside; the farthest vertex towards the origin is added until there is none farther. The distance
// decreases strictly, so that no part comes twice and the walk ends. Directions have degree at most
// 3 in the coordinates. `seed`: pairs to start from; may be empty. Requires at most four of them.
// CANCELLED when should_stop, which may be empty, said so.
absl::StatusOr<ExactNearest> FindNearestExactly(ExactPair& pair, std::span<const VertexPair> seed,
                                                const std::function<bool()>& should_stop);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_EXACT_EXACT_NEAREST_H_
