#ifndef HULLD_CORE_QUERY_AXIS_DESCRIPTION_H_
#define HULLD_CORE_QUERY_AXIS_DESCRIPTION_H_

#include "core/numeric/integer.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/terms/axis.h"

namespace hulld {

// Names an axis n (world frame): its direction rounded to unit length, the features of A and B that
// it supports, exactly, and its kind by these: the normal of a whole facet (of A first), the cross
// product of two edges, otherwise FLAT when A - B is flat, and GENERAL when it is not. Requires n
// not zero, and n.(a - b) <= 0 throughout (unchecked: this is what the search has just proven).
// Cost: O(V) and a scan of the facets.
SeparatingAxis DescribeAxis(ExactPair& pair, const IntegerVector& n);

// n rounded to unit length. Requires n not zero.
Vector UnitDirection(const IntegerVector& n);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_AXIS_DESCRIPTION_H_
