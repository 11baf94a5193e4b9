#ifndef HULLD_CORE_QUERY_EXACT_EXACT_DEPTH_H_
#define HULLD_CORE_QUERY_EXACT_EXACT_DEPTH_H_

#include <absl/status/statusor.h>

#include <functional>
#include <span>

#include "core/query/exact/exact_nearest.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// The point of the boundary of A - B that is nearest to the origin, exactly: the expanding polytope
// in integers. The facet of a growing polytope of vertices of A - B whose plane is nearest to the
// origin, planes that have the origin outside first, is expanded by the vertex farthest along its
// normal, until there is none farther: then the plane supports A - B, and no part of the boundary
// is nearer. Every step adds a vertex, so it ends. Requires the relation OVERLAPPING: otherwise no
// tetrahedron is found, or the plane found has the origin outside, and the process ends. `seed`:
// pairs to start from, which save steps. CANCELLED when should_stop said so (it may be empty).
absl::StatusOr<ExactNearest> FindDepthExactly(ExactPair& pair, std::span<const VertexPair> seed,
                                              const std::function<bool()>& should_stop);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_EXACT_EXACT_DEPTH_H_
