#ifndef HULLD_CORE_QUERY_EXACT_EXACT_DEPTH_H_
#define HULLD_CORE_QUERY_EXACT_EXACT_DEPTH_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <span>

#include "core/query/exact/exact_nearest.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// Finds the exact point of the boundary of A - B that is nearest to the origin, by an expanding
// polytope in integers. Repeatedly takes the facet of a growing polytope of vertices of A - B with
// the plane nearest to the origin, planes with the origin outside first, and expands it by the
// vertex farthest along its normal. If no vertex is farther, the plane supports A - B, and no part
// of the boundary is nearer. Every step adds a vertex, so the search terminates. Requires: the
// relation OVERLAPPING; otherwise no tetrahedron is found, or the final plane has the origin
// outside, and the process aborts. `seed`: initial pairs, which save steps. CANCELLED: should_stop,
// which may be empty, returned true. RESOURCE_EXHAUSTED: DepthTooLarge.
absl::StatusOr<ExactNearest> FindDepthExactly(ExactPair& pair, std::span<const VertexPair> seed,
                                              uint64_t max_bytes,
                                              const std::function<bool()>& should_stop);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_EXACT_EXACT_DEPTH_H_
