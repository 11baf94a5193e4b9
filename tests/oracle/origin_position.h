#ifndef HULLD_TESTS_ORACLE_ORIGIN_POSITION_H_
#define HULLD_TESTS_ORACLE_ORIGIN_POSITION_H_

#include <span>

#include "tests/oracle/exact_integers.h"

namespace hulld::oracle {

// Position of the origin relative to a closed convex set; interior and boundary are taken in R^3.
enum class OriginPosition { kOutside, kBoundary, kInside };

// Locates the origin relative to the hull of the points, by enumerating the extreme rays of the
// polar cone {n : n.p >= 0 for all p}. If the points span R^3, each extreme ray is a cross product
// of two of them; the origin is inside iff the cone has no extreme ray, and outside iff the sum of
// the rays is positive on every point. If the points span a subspace, the method applies in that
// subspace. No points: outside. Cost: O(n^3) at worst, for at most about 200 points.
OriginPosition LocateByPolarCone(std::span<const IntegerVector> points);

// Locates the origin relative to the Minkowski difference A - B, by exact linear programs over
// convex weights: outside iff no convex combinations of A and B are equal; inside iff the
// differences positively span R^3. Cost: O(n) per pivot, for thousands of points.
OriginPosition LocateInDifference(std::span<const IntegerVector> a,
                                  std::span<const IntegerVector> b);

}  // namespace hulld::oracle

#endif  // HULLD_TESTS_ORACLE_ORIGIN_POSITION_H_
