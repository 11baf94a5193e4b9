#ifndef HULLD_CORE_HULL_SIMPLIFICATION_SIMPLIFY_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_SIMPLIFY_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>

#include "core/hull/hull.h"

namespace hulld {

// How far to simplify. At least one limit must be given.
//
// max_vertices is never exceeded. max_error alone is always kept, if need be by the hull itself,
// whose error is 0. With both, max_error is kept where the method finds a hull within both;
// otherwise the answer is the best that it finds within max_vertices, so look at the error
// achieved.
struct SimplifyTarget {
  // 0: any number.
  size_t max_vertices = 0;
  // The caller's length unit, finite. 0: no limit, so as small an error as max_vertices allows.
  double max_error = 0;
  // Polled often; true ends the simplification with CANCELLED. May be empty.
  std::function<bool()> should_stop;
};

// A hull that stands for another, and what it is worth.
struct SimplifiedHull {
  Hull hull;
  // Proven, for all finite doubles: the Hausdorff distance between this hull and the one it stands
  // for is at most this. Infinite only where the distance may be beyond the largest double.
  double error = 0;
};

// A hull inside the given one, its vertices a subset of the given one's, chosen farthest first and
// then, for a solid, spread more evenly.
//
// With max_vertices alone: that many vertices, or all. With max_error: few vertices for an error
// within it, or as many as max_vertices lets be. Guaranteed: never more vertices for an error, nor
// a larger error for max_vertices, than choosing farthest first. For smooth bodies that alone needs
// vertices within a constant of the fewest that any method can do with (Kamenev 1992); on spheres
// this needs less than 1.5 times the fewest (observed: SimplifyQuality). Errors: INVALID_ARGUMENT:
// no limit, a max_error that is negative, infinite or NaN, or fewer vertices than the dimension
// needs to be kept (dimension + 1). CANCELLED. Cost: O((V + n) log n) for n choices of V vertices
// of round shapes; two to six times that of choosing farthest first (observed).
absl::StatusOr<SimplifiedHull> SimplifyInside(const Hull& hull, const SimplifyTarget& target);

// A hull that encloses the given one, exactly for the doubles returned: the vertices of inside
// simplifications pushed outwards, or the planes that support the given hull along their facets, or
// a box, whichever is best: the one with fewest vertices of those within both limits when max_error
// is given, otherwise the one with the least error. Never more vertices than the hull itself.
// Errors: as for SimplifyInside, but at least 8 vertices must be allowed. Cost: some ten
// simplifications inside.
absl::StatusOr<SimplifiedHull> SimplifyOutside(const Hull& hull, const SimplifyTarget& target);

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_SIMPLIFY_H_
