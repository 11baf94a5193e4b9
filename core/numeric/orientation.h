#ifndef HULLD_CORE_NUMERIC_ORIENTATION_H_
#define HULLD_CORE_NUMERIC_ORIENTATION_H_

#include <array>
#include <cstdint>

#include "core/numeric/vector.h"

namespace hulld {

// Sign of det[b-a, c-a, d-a]: +1 when d lies on the side that the normal (b-a) x (c-a) points to, 0
// when the four points are coplanar, -1 otherwise. Exact for all finite input: a floating-point
// filter with a proven bound decides almost always. For the rest, the same filter decides where
// points lie close together, seen from one of these, and at extreme magnitudes, where a power of
// two brings them into range; integers of fixed size decide what they can hold, 60 bits a
// coordinate on one scale; expansions what is left within the exponent range of kExpansionMin and
// kExpansionMax, where a power of two brings all points whose exponents lie no further apart;
// integers of any size everything else. Cost: ~10 ns; ~30 ns from the nearest point or in fixed
// size; ~1 us by expansions; by integers some us, growing with the spread of exponents. Source:
// Shewchuk 1997, Adaptive Precision Floating-Point Arithmetic.
int Orient3d(const Vector& a, const Vector& b, const Vector& c, const Vector& d);

// The coordinates that a projection onto a coordinate plane keeps, first and second.
struct CoordinatePlane {
  int first;
  int second;
};

// Sign of det[b-a, c-a] in a coordinate plane: +1 when a, b, c turn counter-clockwise there. Exact
// for all finite input.
int Orient2d(const Vector& a, const Vector& b, const Vector& c, CoordinatePlane plane);

// A coordinate plane onto which the triangle a, b, c projects with non-zero area, counter-clockwise
// or not; first < 0 when the three points are collinear. Exact for all finite input.
CoordinatePlane ProjectionOf(const Vector& a, const Vector& b, const Vector& c);

// How many signs each stage decided on this thread since it started: tests see that every stage is
// reached.
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
