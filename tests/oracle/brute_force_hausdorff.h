#ifndef HULLD_TESTS_ORACLE_BRUTE_FORCE_HAUSDORFF_H_
#define HULLD_TESTS_ORACLE_BRUTE_FORCE_HAUSDORFF_H_

#include <span>

#include "tests/oracle/exact_integers.h"

namespace hulld::oracle {

// Whether the hull of `outer` holds that of `inner` and the Hausdorff distance of the two is at
// most `bound`, exactly; an infinite bound leaves the first question. `inner` and `outer` are
// finite points, those of `outer` the vertices of its hull. The distance is the largest of a vertex
// of `outer` from the hull of `inner`. Cost: O(m n^3) exact operations for n inner and m outer
// points, for about 40 and 40.
bool IsNestedWithin(std::span<const Point> inner, std::span<const Point> outer, double bound);

}  // namespace hulld::oracle

#endif  // HULLD_TESTS_ORACLE_BRUTE_FORCE_HAUSDORFF_H_
