#ifndef HULLD_TESTS_BENCH_QUERIES_EXACT_TRUTH_H_
#define HULLD_TESTS_BENCH_QUERIES_EXACT_TRUTH_H_

#include <vector>

#include "tests/bench/queries/query_method.h"
#include "tests/oracle/brute_force_relation.h"

namespace hulld::bench {

// Returns the relation over the reals, by tests/oracle, which shares no code with core. Cost: about
// a millisecond for 8 vertices, much more for hundreds.
inline oracle::Relation OracleRelation(const std::deque<Hull>& hulls,
                                       const QuerySet::Query& query) {
  const auto points = [](const Hull& hull) {
    std::vector<oracle::Point> result;
    for (const Vector& v : hull.vertices()) result.push_back({v.x(), v.y(), v.z()});
    return result;
  };
  const auto placement = [](const Pose& pose) {
    return oracle::Placement{pose.q, {pose.t.x(), pose.t.y(), pose.t.z()}};
  };
  return oracle::BruteForceRelation(points(hulls[query.hull_a]), placement(query.X_WA),
                                    points(hulls[query.hull_b]), placement(query.X_WB));
}

inline Verdict OracleVerdict(const std::deque<Hull>& hulls, const QuerySet::Query& query) {
  return OracleRelation(hulls, query) == oracle::Relation::kSeparated ? Verdict::kApart
                                                                      : Verdict::kColliding;
}

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_QUERIES_EXACT_TRUTH_H_
