#ifndef HULLD_CORE_HULL_SIMPLIFICATION_TRIANGLE_DISTANCE_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_TRIANGLE_DISTANCE_H_

#include "core/numeric/vector.h"

namespace hulld {

// How far a point is from a triangle: a number that the distance certainly does not exceed, and
// mostly is within some units in the last place of; and about where the nearest point is.
struct TriangleDistance {
  double bound;
  Vector nearest;
};

// From p to the triangle a, b, c, which may be degenerate. Proven for coordinates of at most 2^1000
// in magnitude, even where each errs by 2^-1075 from being scaled. Cost: some 30 ns.
TriangleDistance DistanceToTriangle(const Vector& a, const Vector& b, const Vector& c,
                                    const Vector& p);

inline double DistanceToTriangleBound(const Vector& a, const Vector& b, const Vector& c,
                                      const Vector& p) {
  return DistanceToTriangle(a, b, c, p).bound;
}

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_TRIANGLE_DISTANCE_H_
