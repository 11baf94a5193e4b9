#ifndef HULLD_CORE_QUERY_FLOATING_FLOAT_DISTANCE_H_
#define HULLD_CORE_QUERY_FLOATING_FLOAT_DISTANCE_H_

#include "core/query/floating/float_pair.h"
#include "core/query/terms/separation_bounds.h"

namespace hulld {

// Bounds the distance of two separated hulls, in floating point, by the walk of Gilbert, Johnson
// and Keerthi (1988) until the goal is met or rounding ends it. The bounds are **proven**
// independently of the walk: the distance is at most that of any point of A - B, and at least minus
// the reach of A - B along any unit vector. `n`: the initial direction; zero gives no bounds. The
// bounds may miss the goal. Requires: pair.usable().
SeparationBounds BoundDistance(const FloatPair& pair, const Vector& n, const SeparationGoal& goal);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_FLOAT_DISTANCE_H_
