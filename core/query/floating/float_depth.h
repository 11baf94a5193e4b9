#ifndef HULLD_CORE_QUERY_FLOATING_FLOAT_DEPTH_H_
#define HULLD_CORE_QUERY_FLOATING_FLOAT_DEPTH_H_

#include <span>
#include <vector>

#include "core/query/floating/float_pair.h"
#include "core/query/terms/separation_bounds.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// The penetration depth of two overlapping hulls, in floating point, by an expanding polytope (van
// den Bergen 2001): the facet of a growing polytope of vertices of A - B that is nearest to the
// origin is expanded by the vertex farthest along its normal, until the goal is met.
//
// Proven whatever the expansion does: the depth is at most the reach of A - B along any unit
// vector. And when no triangle of the closed surface is turned inwards as seen from the origin, and
// none comes nearer to it than r, its winding number about the origin is at least 1, hence the same
// throughout the ball of radius r, which therefore is inside A - B: the depth is at least r. The
// signs of the triangles are exact for the computed vertices; that these err by less than r keeps
// the winding number.
//
// `start`: four pairs whose differences are the corners of a tetrahedron, as a rule round the
// origin; or none. The bounds may miss the goal; then `vertices` gets the pairs of all vertices of
// the polytope. Requires pair.usable(), and the relation OVERLAPPING (unchecked: otherwise the
// lower bound is 0).
SeparationBounds BoundDepth(const FloatPair& pair, std::span<const VertexPair> start,
                            const SeparationGoal& goal, bool want_point,
                            std::vector<VertexPair>& vertices);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_FLOAT_DEPTH_H_
