#ifndef HULLD_CORE_HULL_SURFACE_SURFACE_CHECK_H_
#define HULLD_CORE_HULL_SURFACE_SURFACE_CHECK_H_

#include <span>

#include "core/base/check.h"
#include "core/hull/surface/surface.h"
#include "core/hull/surface/vertex_table.h"

namespace hulld {

// Checks of a surface by laws that every one obeys, each stated for a triangle and its neighbours.
// Both return null when all hold, otherwise the law that is broken, in words.

// Checks the triangles with the given IDs: they are alive; their corners are three vertices that
// live and span a plane; their neighbours are alive, link back, and run along the common edge the
// other way; no neighbour's opposite corner lies above (exact signs); the center of the map of
// directions, where there is one, lies strictly below; their rounded plane holds their corners
// within its error; edges that are said to be flat are, on both sides. Also that the counts of
// vertices, triangles and free IDs agree (Euler). Cost: O(triangles given), some five exact signs
// each.
const char* FindDefect(const Surface& surface, const VertexTable& vertices,
                       std::span<const TriangleId> ids);

// Checks the triangles that an insertion created: as FindDefect, and that each has the new vertex
// `apex` as its last corner, that they turn about the apex once, in whatever order they are given,
// and that the edges opposite to the apex are flat exactly where they are said to be. Requires a
// triangle.
const char* FindStarDefect(const Surface& surface, const VertexTable& vertices,
                           std::span<const TriangleId> star, VertexId apex);

// Ends the process when the whole surface has a defect. Does nothing with NDEBUG. Cost: O(F).
void DcheckSurface(const Surface& surface, const VertexTable& vertices);

// Ends the process when the triangles that an insertion created have a defect. Does nothing with
// NDEBUG. Cost: O(triangles created).
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
