#ifndef HULLD_CORE_HULL_SIMPLIFICATION_TRIANGLE_DISTANCE_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_TRIANGLE_DISTANCE_H_

#include "core/numeric/vector.h"

namespace hulld {

// A number that the distance from p to the triangle a, b, c certainly does not exceed, and mostly
// is within some units in the last place of. Proven for all finite input whose result is finite;
// the triangle may be degenerate. Cost: some 30 ns.
double DistanceToTriangleBound(const Vector& a, const Vector& b, const Vector& c, const Vector& p);

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_TRIANGLE_DISTANCE_H_
