#ifndef HULLD_CORE_HULL_GROWTH_CANONICAL_SNAPSHOT_H_
#define HULLD_CORE_HULL_GROWTH_CANONICAL_SNAPSHOT_H_

#include <optional>
#include <span>

#include "core/base/stop_poll.h"
#include "core/hull/hull.h"
#include "core/hull/surface/surface.h"
#include "core/hull/surface/vertex_table.h"

namespace hulld {

// Convert the stages of a builder into canonical snapshots: vertices sorted, coplanar triangles
// merged exactly, facets and edges sorted. Functions with a poll return nullopt if it stopped.
// Cost: O(V log V), or O(V) if the x coordinates of the vertices are spread out; and an exact sign
// for each pair of neighbors with a common apex.

// Requires: at most two vertices, in lexicographic order (unchecked; AuditHull detects violations).
Hull SnapshotOfEnds(const VertexTable& vertices, std::span<const VertexId> ends);
// Requires: at least three vertices of a strictly convex polygon, in order, in either orientation
// (unchecked; AuditHull detects violations).
std::optional<Hull> SnapshotOfPolygon(const VertexTable& vertices, std::span<const VertexId> loop,
                                      StopPoll& poll);
std::optional<Hull> SnapshotOf(const VertexTable& vertices, const Surface& surface, StopPoll& poll);

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_CANONICAL_SNAPSHOT_H_
