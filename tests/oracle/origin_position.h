#ifndef HULLD_TESTS_ORACLE_ORIGIN_POSITION_H_
#define HULLD_TESTS_ORACLE_ORIGIN_POSITION_H_

#include <span>

#include "tests/oracle/exact_integers.h"

namespace hulld::oracle {

// Where the origin is, relative to a closed convex set; interior and boundary are those of R^3.
enum class OriginPosition { kOutside, kBoundary, kInside };

// The origin against the hull of the points, by enumerating the extreme rays of the polar cone
// {n : n.p >= 0 for all p}. With the points spanning R^3, each extreme ray is a cross product of
// two of them; the origin is inside iff there is none, and outside iff their sum is positive on
// every point. Where the points span less, the same in that subspace. No points: outside.
// Cost: O(n^3) at worst, for at most about 200 points.
OriginPosition LocateByPolarCone(std::span<const IntegerVector> points);

// The origin against the Minkowski difference A - B, by exact linear programs over convex weights:
// outside iff no convex combinations of A and B agree; inside iff the differences positively span
// R^3. Cost: O(n) per pivot, for thousands of points.
OriginPosition LocateInDifference(std::span<const IntegerVector> a,
                                  std::span<const IntegerVector> b);

}  // namespace hulld::oracle

#endif  // HULLD_TESTS_ORACLE_ORIGIN_POSITION_H_
