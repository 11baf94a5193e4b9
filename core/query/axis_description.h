#ifndef HULLD_CORE_QUERY_AXIS_DESCRIPTION_H_
#define HULLD_CORE_QUERY_AXIS_DESCRIPTION_H_

#include <optional>

#include "core/numeric/integer.h"
#include "core/numeric/vector.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/terms/axis.h"
#include "core/query/terms/certificate.h"

namespace hulld {

// Describes an axis n (world frame): its direction rounded to unit length, the exact support
// features of A and B, and its kind. The kind follows from the features: the normal of a whole
// facet (of A first), the cross product of two edges, otherwise FLAT if A - B is flat, and GENERAL
// if it is not. Requires: n not zero, and n.(a - b) <= 0 throughout (unchecked: the search has just
// proven this). Cost: O(V) and a scan of the facets.
SeparatingAxis DescribeAxis(ExactPair& pair, const IntegerVector& n);

// Returns the axis of a decision, or the direction of a certificate, as integers, exactly; none if
// the hulls overlap.
std::optional<IntegerVector> ExactAxis(const ExactDirection& axis);

// Returns n rounded to unit length, within an angle of kUnitDirectionAngle. Requires: n not zero.
Vector UnitDirection(const IntegerVector& n);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_AXIS_DESCRIPTION_H_
