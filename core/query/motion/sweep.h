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

// Decides whether two hulls meet, and whether they overlap, at some time of a translation. With C =
// A - B at the middle of the motion, and 2 h the displacement of B relative to A, the pair meets at
// a time in [0, 1] if and only if the sum of C and the segment from -h to h contains the origin;
// and if C is solid, it overlaps at a time if and only if the sum contains it in its interior.
// `middle`: the pair at time 1/2. `half`: h in units of that pair, not zero. CANCELLED:
// should_stop, which may be empty, returned true.
absl::StatusOr<SweptRelation> FindSweptRelation(ExactPair& middle, const IntegerVector& half,
                                                const std::function<bool()>& should_stop);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_SWEEP_H_
