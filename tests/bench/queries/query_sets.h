#ifndef HULLD_TESTS_BENCH_QUERIES_QUERY_SETS_H_
#define HULLD_TESTS_BENCH_QUERIES_QUERY_SETS_H_

#include <deque>
#include <string>
#include <vector>

#include "core/hull/hull.h"
#include "core/query/placed/placed_hull.h"

namespace hulld::bench {

// Distance of the hulls of a query, relative to the sum of their radii.
enum class Regime {
  kFar,      // bounding spheres are 0.5 to 2 apart
  kClose,    // 1 to 5 % apart along the line of centers
  kGap,      // 1e-6 apart
  kTouch,    // as near to contact as doubles allow
  kContact,  // exactly touching, vertex to vertex
  kGraze,    // 1e-6 deep
  kDeep,     // halfway from contact to coinciding centers
};
inline constexpr Regime kRegimes[] = {Regime::kFar,   Regime::kClose,   Regime::kGap,
                                      Regime::kTouch, Regime::kContact, Regime::kGraze,
                                      Regime::kDeep};
const char* Name(Regime regime);

// Distinct queries on distinct hulls.
struct QuerySet {
  std::string name;
  std::deque<Hull> hulls;
  std::deque<QueryHull> query_hulls;
  struct Query {
    size_t hull_a;
    size_t hull_b;
    Pose X_WA;
    Pose X_WB;
  };
  std::vector<Query> queries;
  // Parallel to queries.
  std::vector<PlacedHull> a;
  std::vector<PlacedHull> b;
};

// Returns hulls by name. Fixed seeds: the same name and regime yield the same queries.
//
//   "sphere:V"  V random points on an ellipsoid with axes between 0.5 and 1.5, at random poses
//   "ur5"       the links of the robot arm in HULLD_DATA (../shared/data), at random poses;
//               no queries if missing
//   "mating:V"  kContact only: parts of about V vertices (blocks for 8), face on face without a
//               rotation, like stacked boxes and assembled parts
//
// In kContact, coordinates are multiples of 2^-40 and rotations map the axes onto each other, so
// that every library receives the same geometry. In other regimes, libraries that need a rotation
// matrix round it; except in kTouch, the error is far below the distance to contact.
QuerySet MakeQuerySet(const std::string& name, Regime regime, size_t count);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_QUERIES_QUERY_SETS_H_
