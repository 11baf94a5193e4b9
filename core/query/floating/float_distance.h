#ifndef HULLD_CORE_QUERY_FLOATING_FLOAT_DISTANCE_H_
#define HULLD_CORE_QUERY_FLOATING_FLOAT_DISTANCE_H_

#include <cmath>
#include <span>

#include "core/query/floating/float_pair.h"
#include "core/query/terms/separation_bounds.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// Bounds the distance of two separated hulls, in floating point, by the walk of Gilbert, Johnson
// and Keerthi (1988) until the goal is met or rounding ends it. The bounds are **proven**
// independently of the walk: the distance is at most that of any point of A - B, and at least minus
// the reach of A - B along any unit vector. `n`: the initial direction; zero gives no bounds.
// `start`: pairs where the walk begins, for example those where a search of the relation ended; at
// most three, may be empty. `reach`: FloatSearchResult::reach along n, if known; if it and `start`
// meet the goal, the walk is skipped. The bounds may miss the goal. Requires: pair.usable().
SeparationBounds BoundDistance(const FloatPair& pair, const Vector& n,
                               std::span<const VertexPair> start, const SeparationGoal& goal,
                               double reach = INFINITY);

// Returns the vector from the point of A - B in `bounds` to the origin; zero if it is unknown.
Vector TowardOrigin(const FloatPair& pair, const SeparationBounds& bounds);

// Returns a **proven** lower bound on the distance of two hulls, from their gap along n; negative
// if n shows no gap. Requires: n not zero, and pair.usable().
double DistanceAlong(const FloatPair& pair, const Vector& n);
// Returns a **proven** upper bound on the distance, from the point nearest to the origin of the
// triangle of the differences of three pairs, which may be equal. Requires: pair.usable().
double DistanceOfTriangle(const FloatPair& pair, const VertexPair* pairs);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_FLOAT_DISTANCE_H_
