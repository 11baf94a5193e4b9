#ifndef HULLD_CORE_HULL_SIMPLIFICATION_TRIANGLE_DISTANCE_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_TRIANGLE_DISTANCE_H_

#include "core/numeric/vector.h"

namespace hulld {

// The distance of a point from a triangle: an upper bound, usually within a few units in the last
// place; and the approximate nearest point.
struct TriangleDistance {
  double bound;
  Vector nearest;
};

// Returns the distance from p to the triangle a, b, c, which may be degenerate. **Proven** for
// coordinates of at most 2^1000 in magnitude, even if each errs by 2^-1075 from scaling. Cost: ~30
// ns.
TriangleDistance DistanceToTriangle(const Vector& a, const Vector& b, const Vector& c,
                                    const Vector& p);

inline double DistanceToTriangleBound(const Vector& a, const Vector& b, const Vector& c,
                                      const Vector& p) {
  return DistanceToTriangle(a, b, c, p).bound;
}

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_TRIANGLE_DISTANCE_H_
