#ifndef HULLD_CORE_NUMERIC_EXPONENT_LIMITS_H_
#define HULLD_CORE_NUMERIC_EXPONENT_LIMITS_H_

#include <limits>

// The exponent range of each stage of core, with its derivation. Outside its range a stage leaves
// the decision to the next one. Differences of doubles overflow near 2^1024, Dekker's product
// splits by multiplying with 2^27 + 1 and overflows above 2^996, and a product that underflows errs
// by up to 2^-1075. The relative error bounds are in error_bounds.h.
namespace hulld {

// The largest finite double, and the least positive one.
inline constexpr double kLargestDouble = std::numeric_limits<double>::max();
inline constexpr double kMinDouble = std::numeric_limits<double>::denorm_min();

// Above the exponent of any double's lowest bit.
inline constexpr int kAboveAllExponents = 1024;

// The contribution of underflow to the bounds of Orient2d and Orient3d. A product that underflows
// errs by at most 2^-1075; sums never err by underflow. 2x2: two products. 3x3 with differences of
// at most D: six products times D, and three products: (6 D + 3) 2^-1075 and roundings of these,
// less than (D + 1) times this constant. If D < 1 and the nine components are themselves products
// that may have underflowed, each enters two products of two: 18 2^-1075 more, which the bound
// covers. Proven.
inline constexpr double kUnderflowError = 0x1p-1070;

// Differences of doubles up to this in magnitude do not overflow. Proven.
inline constexpr double kLargestDifferenceable = 0x1p1022;

// If a permanent of Orient3d is below this, neither it nor the bound derived from it has
// overflowed. Proven.
inline constexpr double kPermanentMax = 0x1p1000;

// Expansion arithmetic of degree-3 polynomials in coordinate differences is exact if every non-zero
// coordinate is at least kExpansionMin in magnitude (its lowest bit is then at least 2^-358, so
// every product of three is a multiple of 2^-1074) and none exceeds kExpansionMax (differences
// below 2^331, sums of products below 2^996, so that splitting cannot overflow). Proven.
inline constexpr double kExpansionMin = 0x1p-306;
inline constexpr double kExpansionMax = 0x1p330;

// The plane of a triangle (see kPlaneErrorFactor): its bound is stored as a float per |p| + |a|.
// Outside this range of slopes, e and f are first scaled by powers of two to |e|, |f| in [1/2, 1).
// With that, and |p| + |a| between kPlaneMinCoordinate and kPlaneMaxCoordinate, no product
// overflows (2^166 * 2^600), and underflow, at most 2^-1070 in total, is below 2^-50 of the slack,
// 16 u |e||f| (|p| + |a|) >= 2^-1011. Outside these ranges a plane is never certain. Proven.
inline constexpr double kPlaneMinSlope = 0x1p-120;
inline constexpr double kPlaneMaxSlope = 0x1p120;
inline constexpr double kPlaneMinCoordinate = 0x1p-960;
inline constexpr double kPlaneMaxCoordinate = 0x1p600;

// y . (A x B) with |A|, |B|, |y| at most D (see kTripleProductErrorFactor): nothing overflows or
// underflows for D within these. Proven.
inline constexpr double kTripleProductMin = 0x1p-300;
inline constexpr double kTripleProductMax = 0x1p300;

// A direction map divides half its resolution, at most 2^13, by distances from its center, and
// multiplies distances by gauges, which are reciprocals of distances. For distances within these
// limits, in floats, no quotient overflows, and no product overflows or loses a bit by underflow.
// Proven.
inline constexpr float kMapMinDistance = 0x1p-60f;
inline constexpr float kMapMaxDistance = 0x1p60f;

// The audit's filter, n . p with |n| at most 2^63 and a bound of 2^15 |p|, runs for |p| between
// these limits. Three products that underflow, 2^-1075 each, are far below the bound, and no
// product and no sum of them exceeds 2^63 |p|. Proven.
inline constexpr double kAuditMinOffset = 0x1p-930;
inline constexpr double kAuditMaxOffset = 0x1p960;

// An enclosure divides unit normals by the reach of their planes, at unit scale, and takes cross
// products of differences of the quotients. For a reach of at least this, quotients are at most
// 2^300, the cross products below 2^604, their sums below 2^640, and nothing overflows. Proven.
inline constexpr double kDualMinReach = 0x1p-300;

// The contribution of underflow to the distance from a triangle (see kSubsetDistanceErrorFactor)
// and to a radius. Proven.
inline constexpr double kMinPositive = 0x1p-1060;

// Queries in floating point. S is the size of a pair: M_A + M_B + |t_B - t_A|, where M is a hull's
// largest absolute coordinate and |.| the largest absolute component. The stage runs only for S
// between kFilterMinSize and kFilterMaxSize, with directions whose largest component is between
// kDirectionMin and kDirectionMax. Nothing then overflows: the largest quantities are a cube of 8
// S, 2^909, and a direction times 8 S, 2^703. Underflow is negligible: the least bounds are 24 W^2
// d with W > 6 d and d = 128 u S (see kTetrahedronErrorFactor), at least 2^-1029, and 512 u |n| S,
// at least 2^-744; a product that underflows errs by 2^-1075, far below their slack. Proven.
inline constexpr double kFilterMinSize = 0x1p-300;
inline constexpr double kFilterMaxSize = 0x1p300;
inline constexpr double kDirectionMin = 0x1p-400;
inline constexpr double kDirectionMax = 0x1p400;
inline constexpr bool IsFilterSize(double size) {
  return size >= kFilterMinSize && size <= kFilterMaxSize;
}
inline constexpr bool IsFilterDirection(double largest_component) {
  return largest_component >= kDirectionMin && largest_component <= kDirectionMax;
}

// Range of the largest component of a quaternion that is used unscaled: no sum of four of its
// squares overflows, and no significant square underflows. Proven.
inline constexpr double kQuaternionMin = 0x1p-100;
inline constexpr double kQuaternionMax = 0x1p100;

// Composition of poses in double-double arithmetic (pose_product.h). Translations up to
// kProductMaxTranslation, added, are split without overflow. If the largest component of a
// quaternion is in [1/2, 1), components below kProductMinComponent are omitted: entries change by
// less than 2^-127, far below the slack of kProductTranslationError. Components of translations
// below a quarter of kProductUnderflow are omitted as well, which the bound includes. Non-zero
// entries are then above 2^-400, and no significant product underflows. Proven.
inline constexpr double kProductMaxTranslation = 0x1p400;
inline constexpr double kProductMinComponent = 0x1p-130;
inline constexpr double kProductUnderflow = 0x1p-600;

// The interpolated quaternion of a motion, (1 - t) q0 + t q1 with components up to 1, in
// double-double arithmetic (Interpolated), which errs by at most 18 u^2. If the largest component
// of the result is at least this, the error is below 2^-8 u of it. Proven.
inline constexpr double kInterpolationMinRemainder = 0x1p-40;

// Planes of pairs in motion (see kMotionPlaneErrorFactor): the largest absolute coordinate of a
// hull plus that of its translations is at most the maximum, so that nothing overflows. A smaller
// one than the minimum counts as the minimum in the bound, which is then at least 2^-825, far above
// what products lose by underflow. Proven.
inline constexpr double kMotionMinSize = 0x1p-700;
inline constexpr double kMotionMaxSize = 0x1p900;

// The time at which a path crosses a facet (see kEntryTimeErrorFactor): underflow loses at most
// 2^-1074, multiplied by at most two sizes and small factors, below 2^-800; the bound, times the
// slope, is at least 2^13 u^2 times the least sizes of two edges and a pair, 2^-473. Proven.
inline constexpr double kEntryMinSize = 0x1p-100;
inline constexpr double kEntryMaxSize = 0x1p100;
inline constexpr double kEntryMinEdge = 0x1p-140;

// Above this, the bound of a gap along a textbook axis is itself accurate: it is far above the
// underflow threshold. Proven.
inline constexpr double kGapMinBound = 0x1p-900;

// A squared length above this has lost at most 3 * 2^-1075 to underflow, far less than a unit in
// its last place. Proven.
inline constexpr double kRadiusSquareMin = 0x1p-1000;

// Floating-point distances of planes from the origin that differ by less than this may have
// underflowed. Proven.
inline constexpr double kDepthKeyMin = 0x1p-1000;

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_EXPONENT_LIMITS_H_
