#ifndef HULLD_CORE_NUMERIC_ORIENTATION_H_
#define HULLD_CORE_NUMERIC_ORIENTATION_H_

#include <array>
#include <cstdint>

#include "core/numeric/vector.h"

namespace hulld {

// Returns the sign of det[b-a, c-a, d-a]: +1 if d lies on the side that the normal (b-a) x (c-a)
// points to, 0 if the four points are coplanar, -1 otherwise. Exact for all finite input.
//
// Stages: points that share a coordinate are coplanar. A floating-point filter with a proven bound
// decides almost all others. Next, the same filter runs relative to one of the points; this decides
// if points lie close together and, after scaling by a power of two, at extreme magnitudes.
// Integers of fixed size decide if all coordinates, on one scale, fit into 60 bits. Expansions
// decide if the exponents, after scaling by a power of two, lie within the range of kExpansionMin
// and kExpansionMax. Integers of arbitrary size decide the rest. Cost: ~10 ns by the filter; ~30 ns
// from the nearest point or in fixed size; ~1 us by expansions; several us by integers of arbitrary
// size, growing with the spread of exponents. Source: Shewchuk 1997, Adaptive Precision
// Floating-Point Arithmetic.
//
// Laws, for all finite points:
// (1) Antisymmetry: exchanging two of the points negates the sign.
// (2) Permutation: an even permutation of the points keeps the sign.
// (3) Translation: adding one vector to all four points keeps the sign, if doubles represent the
//     four sums exactly.
int Orient3d(const Vector& a, const Vector& b, const Vector& c, const Vector& d);

// The coordinates kept by a projection onto a coordinate plane, in order.
struct CoordinatePlane {
  int first;
  int second;
};

// Returns the sign of det[b-a, c-a] in a coordinate plane: +1 if a, b, c turn counter-clockwise
// there. Exact for all finite input.
int Orient2d(const Vector& a, const Vector& b, const Vector& c, CoordinatePlane plane);

// Returns a coordinate plane onto which the triangle a, b, c projects with non-zero area,
// counter-clockwise or not; first < 0 if the three points are collinear. Exact for all finite
// input.
CoordinatePlane ProjectionOf(const Vector& a, const Vector& b, const Vector& c);

// Number of signs decided by each stage on this thread since it started. Tests use it to check that
// every stage is reached.
struct OrientationCounts {
  uint64_t filter = 0;
  uint64_t nearest_filter = 0;
  uint64_t fixed_point = 0;
  uint64_t expansion = 0;
  uint64_t integer = 0;
};
OrientationCounts ThreadOrientationCounts();

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_ORIENTATION_H_
