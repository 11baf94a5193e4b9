#ifndef HULLD_TESTS_ORACLE_BRUTE_FORCE_HULL_H_
#define HULLD_TESTS_ORACLE_BRUTE_FORCE_HULL_H_

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "tests/oracle/exact_integers.h"

namespace hulld::oracle {

// A convex hull in canonical form: vertices in lexicographic order, -0 as +0; facets are maximal
// polygons of vertex indices, each from its lowest vertex, counter-clockwise from outside, sorted.
// Dimension 2: one facet, its second vertex lower than its last. Dimension 1: one edge. Edges are
// sorted pairs, the lower index first.
struct ConvexHull {
  int dimension = -1;
  std::vector<Point> vertices;
  std::vector<std::vector<uint32_t>> facets;
  std::vector<std::pair<uint32_t, uint32_t>> edges;
  friend bool operator==(const ConvexHull&, const ConvexHull&) = default;
};

// Returns the hull of finite points, exactly. A point is a vertex iff a plane through it leaves all
// other points strictly on one side. A facet is the set of vertices on a plane through three
// vertices that has no vertex on one of its sides. Cost: O(n^4) exact operations, for about 40
// points.
ConvexHull BruteForceHull(std::span<const Point> points);

}  // namespace hulld::oracle

#endif  // HULLD_TESTS_ORACLE_BRUTE_FORCE_HULL_H_
