#ifndef HULLD_TESTS_BENCH_TRADE_TRADE_QUERIES_H_
#define HULLD_TESTS_BENCH_TRADE_TRADE_QUERIES_H_

#include <cstddef>
#include <deque>
#include <vector>

#include "core/hull/hull.h"
#include "tests/bench/queries/query_sets.h"

namespace hulld::bench {

// Queries about pairs of given hulls, with equally many per level. A distance to contact is along a
// random direction and relative to the sum of the pair's radii.
//
//   ordinary:      far, close (1 to 5 %), 1e-3 apart, half-way deep, 1e-3 deep
//   near contact:  1e-6 deep and apart, likewise 1e-9, 1e-12, 1e-15, and as little as doubles allow
//   depth:         half-way deep, 1e-3 deep, 1e-6 deep
//
// Half of the pairs are at the origin, where translations are finest, and half are about 100 radii
// away from it, as in a scene. Every method receives the same geometry: random rotations are
// rounded into the points, and a pose is an exact translation.
struct TradeQueries {
  static constexpr size_t kLevels = 15;

  struct Range {
    size_t first;
    size_t count;
  };
  std::deque<Hull> hulls;
  std::vector<QuerySet::Query> queries;
  Range ordinary;
  Range near_contact;
  Range depth;
  // Mean radius of the hulls: the unit of relative values without a pair.
  double size;
};

// Requires: at least one hull, none empty. Fixed seeds.
TradeQueries MakeTradeQueries(const std::vector<Hull>& hulls, size_t per_level);

// Returns the hulls used if the user has none: ellipsoids of 64 points, boxes, and prisms of 12
// sides.
std::vector<Hull> MakeOwnHulls();

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_TRADE_TRADE_QUERIES_H_
