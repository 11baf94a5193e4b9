#ifndef HULLD_CORE_QUERY_MOTION_SWEEP_H_
#define HULLD_CORE_QUERY_MOTION_SWEEP_H_

#include <absl/status/statusor.h>

#include <functional>
#include <optional>

#include "core/numeric/integer.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/terms/relation.h"

namespace hulld {

// The relation of two translations over all times, exactly.
struct SweptRelation {
  Relation relation = Relation::kSeparated;
  // Separated: n.(a - b) < 0 at all times.
  std::optional<IntegerVector> axis;
};

// Returns the strongest relation of two hulls over all times of a translation. Let C be A - B at
// time 1/2, let 2 h be the displacement of B relative to A, and let S be the Minkowski sum of C and
// the segment from -h to h. The pair meets at some time if and only if S contains the origin. If C
// is solid, the pair overlaps at some time if and only if the interior of S contains the origin.
// `middle`: the pair at time 1/2. `half`: h in units of that pair, not zero. CANCELLED:
// should_stop, which may be empty, returned true.
absl::StatusOr<SweptRelation> FindSweptRelation(ExactPair& middle, const IntegerVector& half,
                                                const std::function<bool()>& should_stop);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_SWEEP_H_
