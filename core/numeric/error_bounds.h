#ifndef HULLD_CORE_NUMERIC_ERROR_BOUNDS_H_
#define HULLD_CORE_NUMERIC_ERROR_BOUNDS_H_

#include "core/numeric/exponent_limits.h"

// Every floating-point error bound of core, with its derivation. All bounds assume IEEE doubles,
// round to nearest, gradual underflow (no FTZ/DAZ), no contraction to FMA, and exponents within the
// bound's range in exponent_limits.h. Gappa proves them from the scripts in proofs/;
// proofs/README.md lists the scripts and the steps proven by hand. The numbers in the scripts may
// be slightly smaller.
namespace hulld {

// Unit roundoff: |fl(x op y) - x op y| <= u |x op y| without underflow.
inline constexpr double kUnitRoundoff = 0x1p-53;
inline constexpr double kFloatUnitRoundoff = 0x1p-24;  // of floats

// The 3x3 determinant of rounded coordinate differences has the sign of fl(det) if |fl(det)| >
// fl(factor * fl(permanent)), without underflow. The error itself may be larger, up to 8 u
// permanent: rounding the last sum preserves the sign, so the bound omits it. Proven: Shewchuk
// 1997, Adaptive Precision Floating-Point Arithmetic, table 2 (o3derrboundA).
inline constexpr double kOrient3dErrorFactor = (7 + 56 * kUnitRoundoff) * kUnitRoundoff;

// The 2x2 counterpart, with an error of up to 4 u permanent. Proven: Shewchuk 1997 (ccwerrboundA).
inline constexpr double kOrient2dErrorFactor = (3 + 16 * kUnitRoundoff) * kUnitRoundoff;

// The plane of a triangle a, b, c in floating point, with edges e = b - a and f = c - a: the normal
// n = e x f errs by at most 8 u |e||f| per component (|.| the largest component), hence n . (p - a)
// by 24 u |e||f| (|p| + |a|); the products and sums of n . p - fl(n . a) err by (18 + 6) u |e||f|
// (|p| + |a|). The total is 48 u |e||f| (|p| + |a|) without underflow; 64 u leaves slack for
// rounding the bound itself. Proven.
inline constexpr double kPlaneErrorFactor = 64 * kUnitRoundoff;

// The slope of that bound, kPlaneErrorFactor |e||f|, is stored as a float that must not be below
// the exact slope. The product and the multiplication by this factor round once each, by u; the
// conversion to a float, normal between kPlaneMinSlope and kPlaneMaxSlope, loses at most 2^-24. 1 +
// 2^-20 outweighs all three: 2^-20 > 2^-24 + 2^-43 + 2 u. Proven.
inline constexpr double kPlaneSlopeRoundUp = 1 + 0x1p-20;

// The side of a facet's plane on which the audit finds a point (audit.cc): n . (p - a), n the exact
// normal as doubles of at most 2^63 that each err by 2^-52 * 2^63 = 2 u 2^63 (ToScaledDoubles).
// Differences have relative error u; the product with n and the two sums after it add 3 u: 6 u 2^63
// |p - a| in total, |.| the sum of absolute components, with a relative rounding error of 3 u of
// its own. 32 u leaves slack for the rest. Times 2^63 |p - a|. Proven.
inline constexpr double kAuditErrorFactor = 32 * kUnitRoundoff;

// y . (A x B) for differences y, A, B of doubles, with |A|, |B|, |y| at most D: the error is at
// most 48 u D^3 as above; 64 u leaves slack. For D between kTripleProductMin and kTripleProductMax.
// Proven.
inline constexpr double kTripleProductErrorFactor = 64 * kUnitRoundoff;

// The largest relative error with which a direction map rejects points; its error is computed from
// its reaches (see DirectionMap::Finish).
inline constexpr double kDirectionMapMaxError = 0x1p-8;

// The distance |p - (s e + t f)| for differences p, e, f of doubles and s, t in [0, 1] with rounded
// sum at most 1 (exact sum at most 1 + u): components err by at most 4 u (|p| + |e| + |f|), the
// norm by sqrt(3) of that and 8 u of itself; a sum of s and t above 1 by u moves the point by at
// most 2 u (|e| + |f|). 32 u covers these errors, and kMinPositive covers underflow, here and in
// the scaling of the coordinates. Proven.
inline constexpr double kSubsetDistanceErrorFactor = 32 * kUnitRoundoff;

// Queries in floating point: S is the size of a pair, |.| the largest absolute component, and all
// bounds hold for S between kFilterMinSize and kFilterMaxSize.

// Entries of the rotation matrix R(q)/|q|^2, computed from a q with its largest component within
// [kQuaternionMin, kQuaternionMax], or scaled into [1/2, 1) by a power of two. Each numerator is a
// sum of at most 4 products (error at most 3 u |q|^2), the squared norm has relative error at most
// 3 u, its reciprocal one rounding more, their product one: |error| <= 8 u + 50 u^2, because no
// entry exceeds 1. If q is itself a product of two quaternions, with each component rounded once
// (pose_product.h), a numerator changes by 2 u |q|^2 and the squared norm by 2 u of itself, 4 u of
// an entry: 12 u + 100 u^2 < 16 u in total. If its first factor is interpolated
// (kInterpolationMinRemainder), each component of the product errs by 2 * 18 u^2 |q_P| more, at
// most 2^-7 u |q|, and entries by 8 times that. Proven.
inline constexpr double kRotationEntryError = 16 * kUnitRoundoff;

// The translation of a product of two poses, R(q) t_P / |q|^2 + t_B in double-double arithmetic
// (double_double.h). The numerators of the entries are sums of four exact products, within 9 u^2
// |q|^2; the squared norm is within 9 u^2 of itself, their quotient within 17 u^2: entries, at most
// 1, err by 35 u^2. Products with t_P err by 5 u^2 more, two sums of them, at most 3 |t_P|, by 3
// u^2 each: 138 u^2 |t_P|; the last sum by 3 u^2 (3 |t_P| + |t_B|). The total is below 150 u^2
// (|t_P| + |t_B|); 256 u^2 leaves slack for higher powers of u. Times |t_P| + |t_B|, |.| the
// largest component. Proven.
inline constexpr double kProductTranslationError = 256 * kUnitRoundoff * kUnitRoundoff;

// The translation of a product of poses at a time of a motion. Interpolation adds an error of e =
// 18 u^2 to each component of q, whose largest component m is at most |q|. This changes the
// numerators of the entries and the squared norm by at most 4 e |q|, so entries change by 8 e / m
// and the translation by 432 u^2 / m |t_P|. Products of components err by 5 u^2 of themselves: 10
// u^2 per entry, 30 u^2 |t_P| in total. Interpolating t_B between x0 and x1 adds 9 u^2 (|x0| +
// |x1|). Both are within the slack of kProductTranslationError. Times |t_P| / m. Proven.
inline constexpr double kProductTurnError = 512 * kUnitRoundoff * kUnitRoundoff;

// The difference of two translations, at least one of which belongs to a product of poses. The
// difference of the rounded parts is exact as a sum of two doubles; the difference of the
// remainders errs by u of 2 u (|t_A| + |t_B|) at most, and sums by u of themselves. Beyond the
// errors of the translations, this is at most 8 u^2 (|t_A| + |t_B|) and u of the result. If
// everything but the last is below u S, the difference errs by 2 u S instead of the u |t| below;
// the slack of each bound covers this. Proven.
inline constexpr double kProductOffsetError = 8 * kUnitRoundoff * kUnitRoundoff;

// A Minkowski vertex w = R_A a - R_B b - (t_B - t_A): each rotated component errs by at most 3 * 16
// u M (matrix) and 3 u * 3 M (products and sums), that is 57 u M; the difference of translations by
// u |t|; two subtractions by at most 2 u times 3 M_A + 3 M_B + |t|. The total is at most 64 u S per
// component; 128 u leaves slack. Proven.
inline constexpr double kMinkowskiErrorFactor = 128 * kUnitRoundoff;

// The maximum of n . w over all w: the direction rotated into a hull's frame errs by at most 3 * 16
// u |n| + 9 u |n| = 57 u |n| per component (|n| the largest component of n), hence the dot product
// by at most 3 * 57 u |n| M, and its own rounding by 3 u * 3 sqrt(3) |n| M < 16 u |n| M: 187 u |n|
// M in total. The translation's part errs by at most 12 u |n| |t|, the final sums by at most 11 u
// |n| S. The total is below 200 u |n| S; 512 u leaves room for a direction that itself errs by up
// to 16 u |n| per component (sqrt(3) * 16 * 3 u |n| M < 84 u |n| M more). Proven.
//
// Small pairs rotate the vertices instead (small_pair.h), with the same total. A rotated vertex
// errs by 57 u M per component, so its value by 171 u |n| M. Values are rounded by 16 u |n| S, and
// the vertex number in the low 4 bits of a value, at most 3 |n| S in magnitude, changes it by 16
// units in the last place, 96 u |n| S. The largest value found is therefore below the true one by
// at most (171 + 16 + 96) u |n| S, and the value of its rotated vertices by (96 + 16) u |n| S more.
// The value is then computed from their difference, at most 4 S: rounding the difference and moving
// B take 3 * 7 u |n| S, the product 36 u |n| S. The total is below 460 u |n| S. Proven.
inline constexpr double kSupportErrorFactor = 512 * kUnitRoundoff;

// det[w1, w2, w3] of computed Minkowski vertices with components at most W and errors at most d =
// 128 u S each, W <= 4 S. A 3x3 determinant is at most 4 W^3, so a value above 24 W^2 d needs W > 6
// d. In that case the change by errors, 18 W^2 d + 18 W d^2 + 6 d^3, is at most 21.2 W^2 d, and
// rounding, 6 * 5 u W^3 with u W <= d / 32, less than W^2 d. Times W^2 d. Proven.
inline constexpr double kTetrahedronErrorFactor = 24;

// det[u, v, w] with each column a computed Minkowski vertex, the difference of two, or the ray,
// with components at most W <= 8 S and errors at most 2.1 d. A value above 64 W^2 d needs W > 16 d.
// In that case the change by errors, 18 W^2 (2.1 d) + 18 W (2.1 d)^2 + 6 (2.1 d)^3, is at most 43
// W^2 d, and rounding, 30 u W^3 with u W <= d / 16, at most 2 W^2 d. Times W^2 d. Proven.
inline constexpr double kDifferencesErrorFactor = 64;

// The ray's direction times a computed Minkowski vertex, both with components at most W <= 4 S and
// errors at most d: 6 W d + 3 d^2 and rounding of 9 u W^2 <= W d / 3; a value above 8 W d needs W >
// 2 d. Times W d. Proven.
inline constexpr double kRayErrorFactor = 8;

// The cross product of two computed edges with components at most e and f and ends that err by at
// most d each as above: |error| <= 2 (2.1 d (e + f) + (2.1 d)^2) + 6 u e f, and u f <= 4 u S <= d /
// 32. Times d (e + f + 3 d). Proven.
inline constexpr double kNormalErrorFactor = 5;

// The gap between two hulls along a computed normal n that errs by at most h per component, over
// Minkowski vertices with components at most 4 S: 3 (h 4 S + |n| d) + rounding of at most 60 u |n|
// S <= |n| d / 2. As kGapNormalFactor h S + kGapPositionFactor |n| d. Proven.
inline constexpr double kGapNormalFactor = 12.5;
inline constexpr double kGapPositionFactor = 4;

// A value n . v in a hull's own frame, n with components at most sqrt(3) |n_W|: products and sums
// err by at most 3 u * 3 sqrt(3) |n_W| M < 16 u |n_W| M. The factor is twice that: two values that
// differ by more compare correctly, as a support map guarantees. Times |n_W| M. Proven.
inline constexpr double kSupportBlurFactor = 32 * kUnitRoundoff;

// The lead of a point over another at the best corner of a square of directions (s, t, 1), |s|, |t|
// at most 1 + 2^-20 (support_map.h): five terms of differences of at most E. The differences err by
// u E each, the products by u E, the sums by 4 u * 5 E: below 32 u E in total. The factor is twice
// that, because underflow adds less. Times E. Proven.
inline constexpr double kLeadErrorFactor = 64 * kUnitRoundoff;

// The distance of a vertex from the hull's center: the difference errs by u of itself, the norm by
// at most 8 u. Proven.
inline constexpr double kRadiusRoundUp = 1 + 16 * kUnitRoundoff;

// Bounding spheres: the distance of their centers errs by sqrt(3) * 128 u S, the sum of the radii
// (at most 4 S in total) by 4 u S; squares by 4 u of themselves each. As kSphereErrorFactor S and a
// factor kSphereSquareRoundUp. Proven.
inline constexpr double kSphereErrorFactor = 256 * kUnitRoundoff;
inline constexpr double kSphereSquareRoundUp = 1 + 16 * kUnitRoundoff;

// Bounds about a hull's center c (center_bounds.h). They exist only if the radius R, the largest |v
// - c|, and the least reach from c along a corner's direction are at least kCenterMinRadius M. At
// a corner, the support value errs by 64 u M (16 u M, the blur 32 u M, n . c and the difference) <=
// 2^-27 R. The point p proven to be inside is off the corner's ray by e <= 6 u M, so the gauge g is
// at most (1 + e g_max) / t for p at t, with g_max <= (1 + 2^-29) / least t and g <= (1 + 2^-30) /
// t. Interpolation errs by 8 u of the direction and 10 u of the mean, rotation of the direction
// into the hull's frame by 57 u. The margin covers these errors for the support function, times R
// and the largest component of the direction; and for the gauge, the errors relative to the gauge
// itself. Proven.
inline constexpr double kCenterMinRadius = 0x1p-20;
inline constexpr double kCenterMargin = 0x1p-20;

// n . (a - b) over all vertices against the support functions along n about the centers, with n the
// computed difference of the centers, which errs by 128 u S per component: 384 u |n| S; n . n, at
// most 3 sqrt(3) |n| S, errs by 16 u |n| S, the sums by 22 u |n| S. Times |n| S. Proven.
inline constexpr double kCenterSupportFactor = 512 * kUnitRoundoff;

// The gauge of a hull along the true difference n of the centers in its frame, against the gauge
// along the computed one: the difference errs by 128 u S per component, rotated by sqrt(3) times
// that; the rotation by 57 u |n|, the interpolation by 8 sqrt(3) u |n|, |n| <= sqrt(3) S: 345 u S.
// Times S and the largest gauge. The points c_A + s n of A with s < 1 / g_A and c_B - t n of B with
// t < 1 / g_B then meet inside both if 1 / g_A + 1 / g_B > 1; kCenterProductRoundUp covers rounding
// in that comparison. Proven.
inline constexpr double kCenterGaugeFactor = 512 * kUnitRoundoff;
inline constexpr double kCenterProductRoundUp = 1 + 16 * kUnitRoundoff;

// A direction with components that err by h: a value n . v in a hull's own frame changes by at most
// sqrt(3) h * sqrt(3) M, so two values may change their order if they differ by less than 6 h M.
// Times h S. Proven.
inline constexpr double kDirectionErrorFactor = 8;

// A point p + s (q - p) + t (r - p) of a triangle of computed Minkowski vertices, with weights in
// [0, 1] and a rounded sum of at most 1: the vertices err by d = 128 u S per component, weights
// with an exact sum above 1 by 2 u move the point by 2 u * 8 S, rounding moves it by at most 8 u *
// 8 S; times sqrt(3) for the norm, at most 2.1 (128 + 80) u S. Times S. Proven.
inline constexpr double kNearPointErrorFactor = 512 * kUnitRoundoff;

// Signed separation. A point v = sum of l_i w_i over at most three computed Minkowski vertices,
// with computed weights l_i >= 0 and a sum within 8 u of 1: the vertices err by 128 u S per
// component, the products and sums by 5 u * 4 S, dividing by the sum of the weights moves v by 8 u
// * 4 S. A point of A - B therefore lies within sqrt(3) * 180 u S = 312 u S of v; the norm of v, at
// most 7 S, errs by 8 u of itself: 368 u S. The bound also holds per point of A or B. Times S.
// Proven.
inline constexpr double kCombinationErrorFactor = 448 * kUnitRoundoff;

// The reach of A - B along a computed unit vector n (length within 8 u of 1), from a support value
// with its error 512 u S: the value is at most 7 S, so the length costs 56 u S, the rounding of the
// sum 7 u S. Times S. Proven.
inline constexpr double kReachErrorFactor = 640 * kUnitRoundoff;

// The least of n . p over the corners p of a triangle of computed Minkowski vertices, with n a unit
// vector as above, against the distance of the triangle of the true vertices from the origin: the
// vertices err by sqrt(3) * 128 u S, the length by 56 u S, products and sums by 4 u * 7 S, the
// difference by 7 u S: 313 u S. Times S. Proven.
inline constexpr double kTriangleDistanceErrorFactor = 384 * kUnitRoundoff;

// The gap between two boxes along an axis of one of them, each box in the frame of its own body
// (box_gap.h); M the largest absolute coordinate of a body's boxes, t the translation between the
// bodies, S = M_X + M_Y + |t|. Entries of the product of two computed rotations err by 2 sqrt(3) *
// 16 u and their own rounding, 3 u: 59 u. The translation, rotated into the frame of X, errs by 57
// u |t| as above and 3 u |t| of the difference; a center by 3 * 59 u M, 9 u M from its rotation and
// 2 u M of its own. The step between the centers, at most 5 S, therefore errs by 200 u S and its
// sums by 12 u S. Rotated into the frame of Y: 3 * 212 u S, 3 * 59 u * 5 S and 9 u * 5 S: below
// 1600 u S. Half widths err like centers. The total is below 2000 u S, also for the corners of a
// box that contains a rotated one. Times S, for S between kFilterMinSize and kFilterMaxSize.
// Proven.
inline constexpr double kBoxGapErrorFactor = 4096 * kUnitRoundoff;

// A Bernstein coefficient of |q(t)|^2 (n . p(t) - c) over the vertices of a hull in motion
// (moving_plane.h), with w the larger of |q|^2 at both ends, x the larger translation, and n and c
// the larger of both ends. Both quaternions err by (1 + 2^-8) u of their length. The bilinear form
// of two of them on n sums at most 6 w |n|_2 of terms that err by 10.1 u of themselves: 105 u w |n|
// per component; the mean of six of them, for degree 4, adds 9 u w |n|. Times a vertex: 3 * 114 u w
// |n| M; the support value itself errs by 32 u w |n| M (kSupportBlurFactor). n . x errs by 15 u
// |n||x|, products of quaternions by 6 u w, so their quartic by 45 u w |n||x|; that of c, by u |c|
// of a mean, by 11 u w |c|; sums of at most 6 w |n| M + 3 w |n||x| + w |c| by 2 u of that. The
// total is below 400 u w (|n| (M + |x|) + |c|). If the plane then ends at an earlier time, its
// share of the interval and one minus it err by 3 u, the new n and c by 8 u of |n| and |c|: 24 u w
// |n| (M + |x|) + 8 u w |c| more, within the rest of the factor. Proven.
inline constexpr double kMotionPlaneErrorFactor = 512 * kUnitRoundoff;

// The same coefficient for a piece of a body, with the position y of its frame in the body. A
// direction, with errors of 114 u w |n| per component and a length of at most sqrt(3) w |n|, is
// rotated into that frame: sqrt(3) * 114 u w |n|, entries add 3 * 16 u w |n|, sums 6 u w |n|, below
// 252 u w |n| in total. Times a vertex: 756 u w |n| M, and 32 u w |n| M of the support value. The
// direction times y errs by 3 * 114 u w |n||y| and 9 u w |n||y|. The final sums err by 3 u of 3 w
// |n| (M + |y| + |x|). The total is below 900 u w (|n| (M + |y| + |x|) + |c|). Proven.
inline constexpr double kPiecePlaneErrorFactor = 1024 * kUnitRoundoff;

// The gap of two translating hulls at a time, along a computed unit direction n: the gap at the
// start, plus the time times n.d for the difference d of their displacements. S is the size of the
// pair at the start, D the sum of the largest components of both displacements. d errs by 2 u D per
// component, by 4 u D along n; products and sums by 10 u D; the final sums by 2 u of 7 S + 2 D. If
// the gap at the start is that of balls, the difference of their centers errs by sqrt(3) * 128 u S
// along n, its products and sums by 9 u S, and the radii, at most 4 S together, by 10 u of that.
// The total is below 300 u (S + D). Proven.
inline constexpr double kTranslatedGapErrorFactor = 512 * kUnitRoundoff;

// The time (n . p) / (n . d) at which the path of a vertex p of A - B along d crosses the plane of
// a facet, in double-double arithmetic (facet_entry.cc). Rotations are multiplied by the squared
// norm N, at most 4, of their scaled quaternions: entries err by 9 u^2 N. X and Y are the sizes of
// the edges, exact in the frame of one hull, times the norm of its rotation. Edges err by (27 + 15
// + 18) u^2 X < 64 u^2 X per component and are at most sqrt(3) X. Their cross product n errs by
// (474 + 18) u^2 X Y and is at most 3 X Y. n . (N R a) errs by 3 (853 + 180 + 26) u^2 X Y N M and
// by 94 u^2 X Y N M of sums, its quotient by N by 26 u^2 of itself, at most 136 u^2 X Y M more:
// 3410 u^2 X Y M. n . (t_B - t_A) errs by 1580 u^2 X Y |t|, the sums by less than 60 u^2 X Y S: n .
// p errs by less than 3500 u^2 X Y S. With L the sum of the largest components of both
// displacements, d errs by 3 u^2 L, and n . d by less than 1610 u^2 X Y L. If the computed |n . d|
// is above twice that, the quotient of the computed values errs by at most 2 (3500 S + 1610 |time|
// L) u^2 X Y / |n . d|, its rounding by 17 u^2 |time|, which is less than 160 |time| L u^2 X Y / |n
// . d|. The total is below 7000 u^2 X Y (S + |time| L) / |n . d|; 8192 u^2 leaves slack for the
// rounding of the bound. Times X Y (S + |time| L) / |n . d|, for S + L between kEntryMinSize and
// kEntryMaxSize and edges of at least kEntryMinEdge. Proven.
inline constexpr double kEntryTimeErrorFactor = 8192 * kUnitRoundoff * kUnitRoundoff;

// The length of a computed unit direction is at most 1 + 8 u, by that of its rounding; the product
// with a radius errs by u more. The margins r |n| of the plane above, with |n| the larger of both
// ends, enter its bound like c; an earlier end adds 3 u to the length. Proven.
inline constexpr double kUnitLengthRoundUp = 1 + 16 * kUnitRoundoff;

// The sign of det[p, q, r], p . ((q - p) x (r - p)), for computed Minkowski vertices in a unit with
// S < 2: a vertex errs by 256 u per component and is at most 2 sqrt(3), an edge by 520 u and is at
// most 4 sqrt(3), because translations cancel in it. The normal, at most 96, therefore errs by 2 *
// 520 u * 2 * 6.93 and 4 u * 48: below 14700 u; its product with p by 3 * 3.47 * 14700 u and 3 * 96
// * 256 u; products, sums and the length by less than 18000 u. The total is below 245000 u, and
// 2^18 u is 262144 u. A value above that is certainly positive. Proven.
inline constexpr double kMinOutward = 0x1p-35;

// The angle between a direction of integers and its rounding to unit length (UnitDirection), in
// radians. Components err by 2 u of the largest (kScaledDoublesError), so the vector by 2 sqrt(3) u
// of its length. Normalization divides all components by one number, with an error of u each: 4.5 u
// in total. Proven.
inline constexpr double kUnitDirectionAngle = 8 * kUnitRoundoff;

// The angle between the nearest point z of A - B and another point p of A - B, seen from the
// origin: z . p >= |z|^2 because A - B is convex, so the cosine is at least |z| / |p| >= 1 - w, and
// the angle at most sqrt(2 w) (1 + w / 4). For w <= 2^-40 this factor covers the second term and
// the rounding of w and of the root. Times sqrt(2 w). Proven.
inline constexpr double kNearestAngleRoundUp = 1 + 0x1p-30;

// A rational number or its square root, with 60 bits or more, rounded to a double: u of itself and
// less than 2^-60. The bound is twice that, plus the least double for gradual underflow. Proven.
inline constexpr double kRoundedRelativeError = 2 * kUnitRoundoff;

// Comparison of the distances |offset| / |n| of two planes with integer coefficients from the
// origin, in doubles: offset and components err by 2 u of themselves (ToScaledDouble), squares by 5
// u, their sum, of positive terms, by 7 u, the root by 4.5 u, the quotient by 7.5 u. Two distances
// therefore compare correctly if they differ by more than 16 u of the larger, including the
// rounding of the subtraction. 2^-40, which is 2^13 u, is not tuned: closer distances are compared
// exactly, and are usually equal. Times the larger. Proven.
inline constexpr double kDepthKeyErrorFactor = 0x1p-40;

// Hull center: the sum of the sixths of six vertices. Sixths err by u M in total, the sums by 3 u
// M: at most 7 u M beyond the exact mean, within the slack of kMinkowskiErrorFactor (64 u S). The
// same holds for the mean of up to ten inner vertices: nine sums of values up to 10 M, 90 u M / 10,
// and a division: 11 u M. Proven.

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_ERROR_BOUNDS_H_
