#ifndef HULLD_CORE_HULL_SIMPLIFICATION_SIMPLIFY_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_SIMPLIFY_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>

#include "core/hull/hull.h"

namespace hulld {

// Limits of a simplification. Requires: at least one limit.
//
// max_vertices is never exceeded. max_error alone is always met, if necessary by the hull itself,
// with error 0. With both, max_error is met if the method finds a hull within both limits;
// otherwise the result is the best found within max_vertices, so check the achieved error.
struct SimplifyTarget {
  // 0 means no limit.
  size_t max_vertices = 0;
  // In the caller's length unit, finite. 0 means no limit: the error is as small as max_vertices
  // permits.
  double max_error = 0;
  // Polled often; true ends the simplification with CANCELLED. May be empty.
  std::function<bool()> should_stop;
};

// A hull that approximates another one, and its error.
struct SimplifiedHull {
  Hull hull;
  // A **proven** bound, for all finite doubles, on the Hausdorff distance between this hull and the
  // hull that it approximates. Infinite only if the distance may exceed the largest double.
  double error = 0;
};

// Returns a hull inside the given one. Its vertices are a subset of the given hull's, chosen
// farthest first and then, for a solid, spread more evenly if that improves the result.
//
// With max_vertices alone, the result has that many vertices, or all if there are fewer. With
// max_error, it has few vertices for an error of at most max_error, or as many as max_vertices
// permits.
//
// INVALID_ARGUMENT: no limit, a max_error that is negative, infinite or NaN, or fewer vertices than
// needed to preserve the dimension (dimension + 1). CANCELLED: should_stop returned true.
//
// Guarantee: for a given max_error, at most as many vertices as farthest first needs; for a given
// max_vertices, at most its error. For smooth bodies, farthest first alone needs vertices within a
// constant factor of the fewest of any method (Kamenev 1992). **Observed** on spheres: about 1.5
// times the fewest (SimplifyQuality). Cost: O((V + n) log n) for n choices of V vertices of
// round shapes; **observed** two to six times that of farthest first.
absl::StatusOr<SimplifiedHull> SimplifyInside(const Hull& hull, const SimplifyTarget& target);

// Returns a hull that encloses the given one, exactly for the doubles returned: the vertices of an
// inside simplification pushed outwards, or a box. With max_error, it is the hull with the fewest
// vertices found within both limits; otherwise, or if there is none, the hull with the least error.
// Never has more vertices than the hull itself. Errors: as for SimplifyInside, but at least 8
// vertices must be permitted. Cost: one farthest-first order, and about ten hulls of its first
// vertices.
absl::StatusOr<SimplifiedHull> SimplifyOutside(const Hull& hull, const SimplifyTarget& target);

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_SIMPLIFY_H_
