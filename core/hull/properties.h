#ifndef HULLD_CORE_HULL_PROPERTIES_H_
#define HULLD_CORE_HULL_PROPERTIES_H_

#include <absl/status/statusor.h>

#include <array>
#include <functional>

#include "core/hull/hull.h"
#include "core/numeric/rational.h"

namespace hulld {

// Properties of a hull in its own frame, for density 1, in powers of the caller's length unit. Each
// has a proven bound; a value beyond the largest double saturates and has an infinite bound.
// Volume, centroid, and inertia are the doubles nearest to the exact values, and exact if the bound
// is 0.
struct HullProperties {
  // Length^3. 0 if the dimension is less than 3.
  Rounded volume;
  // Surface area, length^2. For a polygon, the area of both sides, which is the limit for solids
  // that become flat. 0 if the dimension is less than 2. The bound is 2^-52 of the value, or the
  // least double.
  Rounded area;
  // The mean position over the volume of a solid, the area of a polygon, or the length of a
  // segment.
  std::array<Rounded, 3> centroid;
  // Inertia tensor about the centroid, length^5: xx, yy, zz, xy, xz, yz, where xx is the integral
  // of y^2 + z^2, and xy is minus the integral of x y. 0 if the dimension is less than 3.
  std::array<Rounded, 6> inertia;
};

// Computes the properties in integers and rounds once. Requires: hull not empty. CANCELLED:
// should_stop, which may be empty, returned true. Cost: O(V) exact operations, 14 to 19 us for each
// triangle of the surface (**observed**); O(1) memory.
absl::StatusOr<HullProperties> ComputeProperties(const Hull& hull,
                                                 const std::function<bool()>& should_stop = {});

}  // namespace hulld

#endif  // HULLD_CORE_HULL_PROPERTIES_H_
