#ifndef HULLD_TESTS_ORACLE_BRUTE_FORCE_RELATION_H_
#define HULLD_TESTS_ORACLE_BRUTE_FORCE_RELATION_H_

#include <array>
#include <span>
#include <vector>

#include "tests/oracle/exact_integers.h"

namespace hulld::oracle {

enum class Relation { kSeparated, kTouching, kOverlapping };

// p_W = R(q) p / |q|^2 + t over the reals, q = (w, x, y, z) finite and not zero.
struct Placement {
  std::array<double, 4> q = {1, 0, 0, 0};
  Point t = {0, 0, 0};
};

// Both point sets in the world, at one common positive scale that makes all coordinates integers.
struct WorldPoints {
  std::vector<IntegerVector> a;
  std::vector<IntegerVector> b;
};
WorldPoints PlaceInWorld(std::span<const Point> a, const Placement& X_WA, std::span<const Point> b,
                         const Placement& X_WB);

// Returns the relation of the hulls of two finite point sets, exactly, by two independent methods:
// the polar cone of all pairwise differences (at most about 200 of them), and exact linear
// programs.
Relation RelationByPolarCone(const WorldPoints& points);
Relation RelationByLinearProgram(const WorldPoints& points);

// Returns the relation of placed points, by the method that is faster for their number.
Relation BruteForceRelation(std::span<const Point> a, const Placement& X_WA,
                            std::span<const Point> b, const Placement& X_WB);

}  // namespace hulld::oracle

#endif  // HULLD_TESTS_ORACLE_BRUTE_FORCE_RELATION_H_
