#include "tests/oracle/brute_force_hausdorff.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/oracle/brute_force_hull.h"
#include "tests/oracle/brute_force_separation.h"

namespace hulld::oracle {
namespace {

// True if every vertex of the hull of both sets is in `outer`.
bool Contains(std::span<const Point> outer, std::span<const Point> inner) {
  std::vector<Point> all(outer.begin(), outer.end());
  all.insert(all.end(), inner.begin(), inner.end());
  const ConvexHull hull = BruteForceHull(all);
  return std::all_of(hull.vertices.begin(), hull.vertices.end(), [&](const Point& v) {
    return std::find(outer.begin(), outer.end(), v) != outer.end();
  });
}

}  // namespace

bool IsNestedWithin(std::span<const Point> inner, std::span<const Point> outer, double bound) {
  if (!Contains(outer, inner)) return false;
  if (std::isinf(bound)) return true;
  return std::all_of(outer.begin(), outer.end(), [&](const Point& v) {
    // A vertex of the outer hull is never strictly inside the inner one.
    return Compare(BruteForceDistance(std::span(&v, 1), {}, inner, {}), bound) <= 0;
  });
}

}  // namespace hulld::oracle
