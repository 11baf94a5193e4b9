#ifndef HULLD_CORE_HULL_SURFACE_SURFACE_CHECK_H_
#define HULLD_CORE_HULL_SURFACE_SURFACE_CHECK_H_

#include <span>

#include "core/base/check.h"
#include "core/hull/surface/surface.h"
#include "core/hull/surface/vertex_table.h"

namespace hulld {

// Checks of the invariants of a surface, each stated for a triangle and its neighbors. Both return
// null if all hold, otherwise a description of the violated invariant.

// Checks the triangles with the given IDs: they are alive; their corners are three live vertices
// that span a plane; their neighbors are alive, link back, and traverse the common edge in the
// opposite direction; no neighbor's opposite corner lies above (exact signs); the center of the
// map of directions, if any, lies strictly below; their rounded plane contains their corners within
// its error; edges marked flat are flat on both sides. Also checks that the counts of vertices,
// triangles and free IDs agree (Euler). Cost: O(triangles given), some five exact signs each.
const char* FindDefect(const Surface& surface, const VertexTable& vertices,
                       std::span<const TriangleId> ids);

// Checks the triangles created by an insertion like FindDefect. Also checks that each has the new
// vertex `apex` as its last corner, that they turn about the apex exactly once, in any order, and
// that the edges opposite to the apex are flat if and only if they are marked so. Requires: at
// least one triangle.
const char* FindStarDefect(const Surface& surface, const VertexTable& vertices,
                           std::span<const TriangleId> star, VertexId apex);

// Aborts the process if the whole surface has a defect. No-op with NDEBUG. Cost: O(F).
void DcheckSurface(const Surface& surface, const VertexTable& vertices);

// Aborts the process if the triangles created by an insertion have a defect. No-op with NDEBUG.
// Cost: O(triangles created).
inline void DcheckStar([[maybe_unused]] const Surface& surface,
                       [[maybe_unused]] const VertexTable& vertices,
                       [[maybe_unused]] std::span<const TriangleId> star,
                       [[maybe_unused]] VertexId apex) {
#ifndef NDEBUG
  const char* const defect = FindStarDefect(surface, vertices, star, apex);
  if (defect != nullptr) CheckFailed(__FILE__, __LINE__, defect);
#endif
}

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SURFACE_SURFACE_CHECK_H_
