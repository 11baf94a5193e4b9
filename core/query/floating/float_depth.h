#ifndef HULLD_CORE_QUERY_FLOATING_FLOAT_DEPTH_H_
#define HULLD_CORE_QUERY_FLOATING_FLOAT_DEPTH_H_

#include <span>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/query/floating/float_pair.h"
#include "core/query/terms/separation_bounds.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// Bounds the penetration depth of two overlapping hulls, in floating point, by an expanding
// polytope (van den Bergen 2001). Repeatedly takes the facet nearest to the origin of a growing
// polytope of vertices of A - B and expands it by the vertex farthest along its normal, until the
// goal is met.
//
// The bounds are **proven** independently of the expansion. The depth is at most the reach of A - B
// along any unit vector. If no triangle of the closed surface is oriented inwards as seen from the
// origin, and none comes nearer to it than r, the winding number about the origin is at least 1. It
// is constant throughout the ball of radius r, so the ball is inside A - B and the depth is at
// least r. The orientations are exact for the computed vertices; vertex errors below r preserve the
// winding number.
//
// `start`: four pairs whose differences are the corners of a tetrahedron, usually around the
// origin; may be empty. The bounds may miss the goal; `vertices` then receives the pairs of all
// vertices of the polytope. If the poll stopped, the result is meaningless. Requires:
// pair.usable(), and the relation OVERLAPPING (unchecked: otherwise the lower bound is 0).
SeparationBounds BoundDepth(const FloatPair& pair, std::span<const VertexPair> start,
                            const SeparationGoal& goal, bool want_point, StopPoll& poll,
                            std::vector<VertexPair>& vertices);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_FLOAT_DEPTH_H_
