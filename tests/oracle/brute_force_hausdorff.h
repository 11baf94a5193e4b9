#ifndef HULLD_TESTS_ORACLE_BRUTE_FORCE_HAUSDORFF_H_
#define HULLD_TESTS_ORACLE_BRUTE_FORCE_HAUSDORFF_H_

#include <span>

#include "tests/oracle/exact_integers.h"

namespace hulld::oracle {

// Returns true if the hull of `outer` contains the hull of `inner` and their Hausdorff distance is
// at most `bound`, exactly. An infinite bound checks containment only. Requires: finite points;
// `outer` contains only vertices of its hull. The distance is the largest distance of a vertex of
// `outer` from the hull of `inner`. Cost: O(m n^3) exact operations for n inner and m outer points,
// for about 40 of each.
bool IsNestedWithin(std::span<const Point> inner, std::span<const Point> outer, double bound);

}  // namespace hulld::oracle

#endif  // HULLD_TESTS_ORACLE_BRUTE_FORCE_HAUSDORFF_H_
