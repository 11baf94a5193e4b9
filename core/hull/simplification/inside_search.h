#ifndef HULLD_CORE_HULL_SIMPLIFICATION_INSIDE_SEARCH_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_INSIDE_SEARCH_H_

#include <cstddef>

#include "core/base/stop_poll.h"
#include "core/hull/hull.h"
#include "core/hull/simplification/subset_hull.h"

namespace hulld {

// Chooses vertices of a hull of dimension 2 or 3: few for a given error, or a given number for a
// small error. max_error: in the caller's length unit; 0 means no limit. max_vertices: from
// dimension + 1 to the hull's number of vertices. If the poll stopped, the result is meaningless.
//
// Chooses vertices farthest first. For a solid, it then spreads seven eighths of these vertices
// more evenly and continues farthest first from there, up to three times, as long as this improves
// the result. Returns the best choice, so the result is never worse than that of farthest first
// alone. Cost: **observed** two to six times that of farthest first.
//
// The vertices are spread by moving all of them at once, several times. Each moves to the position
// that would give their hull the largest volume if all others stayed in place: farthest along the
// sum of the area normals of its facets. This turns the irregular triangles of farthest first into
// nearly equilateral ones, as far as curvature permits, which have the least error for their area.
// Source: Chen and Xu 2004, Optimal Delaunay Triangulations, for the position of maximum volume;
// Lloyd 1982, Least Squares Quantization in PCM, for moving all at once.
VertexChoice ChooseInside(const Hull& hull, double max_error, size_t max_vertices, StopPoll& poll);

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_INSIDE_SEARCH_H_
