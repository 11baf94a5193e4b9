#ifndef HULLD_TESTS_BENCH_QUERIES_ACCURACY_SUITE_H_
#define HULLD_TESTS_BENCH_QUERIES_ACCURACY_SUITE_H_

#include <deque>
#include <string>
#include <vector>

#include "core/hull/hull.h"
#include "tests/bench/queries/query_sets.h"

namespace hulld::bench {

// 4640 difficult queries on small hulls of 4 to 32 vertices: ellipsoids, boxes, prisms, needles,
// plates, polygons, and boxes with nearly parallel edges. The hulls are as near to contact as
// doubles allow, or separated or overlapping by 1e-3 to 1e-15 of their size. Their sizes are 1e-6,
// 1, and 1e6; some are 1e6 times their size away from the origin. Queries of the kind "contact"
// touch exactly: a vertex, edge, or facet meets another.
//
// Every library receives the same geometry: rotations are rounded into the points, and a pose is an
// exact translation.
struct AccuracySuite {
  std::deque<Hull> hulls;
  std::vector<QuerySet::Query> queries;
  // Parallel to queries: the kind of each.
  std::vector<std::string> kinds;
};

// Fixed seeds: the same suite each time. `stride`: only every stride-th query.
AccuracySuite MakeAccuracySuite(size_t stride = 1);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_QUERIES_ACCURACY_SUITE_H_
