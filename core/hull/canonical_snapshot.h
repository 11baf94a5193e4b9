#ifndef HULLD_CORE_HULL_CANONICAL_SNAPSHOT_H_
#define HULLD_CORE_HULL_CANONICAL_SNAPSHOT_H_

#include <span>

#include "core/hull/hull.h"
#include "core/hull/surface.h"
#include "core/hull/vertex_table.h"

namespace hulld {

// Turn the stages of a builder into canonical snapshots: vertices sorted, coplanar triangles merged
// exactly, facets and edges sorted. Cost: O(V log V), and one exact sign for each edge of a
// surface.

// At most two vertices, in lexicographic order.
Hull SnapshotOfEnds(const VertexTable& vertices, std::span<const VertexId> ends);
// A strictly convex polygon, its vertices in order, either way round.
Hull SnapshotOfPolygon(const VertexTable& vertices, std::span<const VertexId> loop);
Hull SnapshotOf(const VertexTable& vertices, const Surface& surface);

}  // namespace hulld

#endif  // HULLD_CORE_HULL_CANONICAL_SNAPSHOT_H_
