#ifndef HULLD_CORE_QUERY_BATCH_H_
#define HULLD_CORE_QUERY_BATCH_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <span>
#include <vector>

#include "core/query/collision.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/terms/answer.h"
#include "core/query/terms/query_options.h"

namespace hulld {

// A pair, as indices into a table of placements.
struct PlacedPair {
  uint32_t a;
  uint32_t b;
  friend bool operator==(const PlacedPair&, const PlacedPair&) = default;
};

// Answers every pair in parallel on `threads` OpenMP threads. results[i] belongs to pairs[i] and
// does not depend on the number of threads. After should_stop returns true, the remaining pairs are
// CANCELLED. Requires: indices in range. Memory: 72 bytes for each pair, plus any details requested
// beyond the relation.
std::vector<absl::StatusOr<Answer>> CheckCollisions(std::span<const PlacedHull> placements,
                                                    std::span<const PlacedPair> pairs,
                                                    const QueryOptions& options, int threads);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_BATCH_H_
