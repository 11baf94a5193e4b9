#ifndef HULLD_CORE_HULL_SIMPLIFICATION_SIMPLIFY_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_SIMPLIFY_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>

#include "core/hull/hull.h"

namespace hulld {

// How far to simplify: until one of the two says enough. At least one must be given.
struct SimplifyTarget {
  // 0: any number.
  size_t max_vertices = 0;
  // The caller's length unit. 0: any error.
  double max_error = 0;
  // Polled often; true ends the simplification with CANCELLED. May be empty.
  std::function<bool()> should_stop;
};

// A hull that stands for another, and what it is worth.
struct SimplifiedHull {
  Hull hull;
  // Proven: the Hausdorff distance between this hull and the one it stands for is at most this.
  double error = 0;
};

// A hull inside the given one, its vertices a subset of the given one's, chosen farthest first.
//
// With max_vertices alone: that many vertices. With max_error alone: as few as the choice needs for
// an error within it. With both: whichever comes first, so look at the error achieved. A hull that
// already satisfies the target is returned as it is, with error 0. Errors: INVALID_ARGUMENT: no
// target, a negative or non-finite max_error, or fewer vertices than the dimension needs. Cost: O(m
// (m + V)) for m vertices chosen of V.
absl::StatusOr<SimplifiedHull> SimplifyInside(const Hull& hull, const SimplifyTarget& target);

// A hull that encloses the given one, exactly for the doubles returned: planes that support the
// given hull, along the facet normals of an inside simplification, are intersected, and the corners
// rounded outwards until every vertex is inside by exact signs. Flat hulls are enclosed in their
// axis-aligned box. The target is as for SimplifyInside; at least 8 vertices must be allowed.
absl::StatusOr<SimplifiedHull> SimplifyOutside(const Hull& hull, const SimplifyTarget& target);

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_SIMPLIFY_H_
