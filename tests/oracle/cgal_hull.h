#ifndef HULLD_TESTS_ORACLE_CGAL_HULL_H_
#define HULLD_TESTS_ORACLE_CGAL_HULL_H_

#include <span>
#include <vector>

#include "tests/oracle/exact_integers.h"

namespace hulld::oracle {

// Returns true if CGAL was available at build time; tests that need it skip otherwise.
bool CgalIsAvailable();

// Returns the extreme points of a point set of dimension 3, in lexicographic order, by CGAL's
// quickhull with exact predicates. Requires: CgalIsAvailable(); differences of coordinates, and
// products of four of them, that neither overflow nor underflow: within about 1e+-70.
std::vector<Point> CgalExtremePoints(std::span<const Point> points);

}  // namespace hulld::oracle

#endif  // HULLD_TESTS_ORACLE_CGAL_HULL_H_
