// The queries on which tests/bench counts wrong answers, by library: hulld gives none.

#include "tests/bench/queries/accuracy_suite.h"

#include <gtest/gtest.h>

#include <map>

#include "core/query/collision.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/test_size.h"

namespace hulld {
namespace accuracy_suite_test {

TEST(AccuracySuite, EveryQueryIsAnsweredExactly) {
  constexpr size_t kStride = TestSize(1, 11);
  constexpr size_t kQueries = TestSize(4640, 422);
  const bench::AccuracySuite suite = bench::MakeAccuracySuite(kStride);
  ASSERT_EQ(suite.queries.size(), kQueries);
  std::map<Relation, size_t> relations;
  std::map<Rung, size_t> rungs;
  for (size_t i = 0; i < suite.queries.size(); ++i) {
    const bench::QuerySet::Query& query = suite.queries[i];
    const Hull& a = suite.hulls[query.hull_a];
    const Hull& b = suite.hulls[query.hull_b];
    const absl::StatusOr<Answer> answer = CheckCollision(a, query.X_WA, b, query.X_WB);
    ASSERT_TRUE(answer.ok()) << answer.status();
    const Relation expected = OracleRelation(a, query.X_WA, b, query.X_WB);
    EXPECT_EQ(Name(answer->relation), std::string(Name(expected)))
        << suite.kinds[i] << ", query " << i << "\n"
        << Describe(a, query.X_WA, b, query.X_WB);
    ++relations[expected];
    ++rungs[answer->rung];
  }
  // The suite has the intended mix: every relation, many beyond floating point.
  EXPECT_GT(relations[Relation::kSeparated], kQueries / 3);
  EXPECT_GT(relations[Relation::kTouching], kQueries / 20);
  EXPECT_GT(relations[Relation::kOverlapping], kQueries / 3);
  EXPECT_GT(rungs[Rung::kFloatingPoint], kQueries / 4);
  EXPECT_GT(rungs[Rung::kExact], kQueries / 10);
}

}  // namespace accuracy_suite_test
}  // namespace hulld
