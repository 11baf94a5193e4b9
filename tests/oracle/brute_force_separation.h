#ifndef HULLD_TESTS_ORACLE_BRUTE_FORCE_SEPARATION_H_
#define HULLD_TESTS_ORACLE_BRUTE_FORCE_SEPARATION_H_

#include <span>

#include "tests/oracle/brute_force_relation.h"
#include "tests/oracle/exact_integers.h"

namespace hulld::oracle {

// Absolute separation of two hulls, exactly: its square is numerator / denominator times the square
// of `unit` over ruler_squared.
struct SquaredLength {
  Integer numerator;
  Integer denominator;
  // A length, and the square of its image at the scale of the integers.
  double unit = 1;
  Integer ruler_squared;
};

// Returns the distance of the hulls of two point sets: the least distance from the origin to any
// vertex, edge, or triangle of differences of points. Cost: O(n^3) for n differences, for at most
// about 50.
SquaredLength BruteForceDistance(std::span<const Point> a, const Placement& X_WA,
                                 std::span<const Point> b, const Placement& X_WB);
// Returns the penetration depth of two overlapping hulls: the least distance from the origin to any
// plane through three differences with all differences on one side.
SquaredLength BruteForceDepth(std::span<const Point> a, const Placement& X_WA,
                              std::span<const Point> b, const Placement& X_WB);

// Returns true if the length is within `bound` of |value|. Requires: finite numbers.
bool IsWithin(const SquaredLength& length, double value, double bound);
// Returns the sign of the length minus a finite threshold >= 0.
int Compare(const SquaredLength& length, double threshold);
// Returns the sign of sign * length minus the exact sum of finite terms.
int CompareSum(int sign, const SquaredLength& length, std::span<const double> terms);

}  // namespace hulld::oracle

#endif  // HULLD_TESTS_ORACLE_BRUTE_FORCE_SEPARATION_H_
