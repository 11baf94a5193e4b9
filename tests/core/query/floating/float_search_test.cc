#include "core/query/floating/float_search.h"

#include <gtest/gtest.h>

#include <iterator>
#include <span>

#include "core/query/collision.h"
#include "core/query/floating/float_distance.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"

namespace hulld::float_search_test {
namespace {

// Returns the distance of a triangle in A - B, in which the search of a separated pair ended.
double DistanceAtEnd(const FloatPair& pair, const FloatSearchResult& found) {
  const VertexPair pairs[] = {found.pairs[0], found.pairs[found.pair_count > 1 ? 1 : 0],
                              found.pairs[found.pair_count - 1]};
  return DistanceOfTriangle(pair, pairs);
}

// Two hulls of random points on unit spheres. B is shifted by 1.5 to `farthest` along x, and by up
// to 1 along y and z.
struct RandomPair {
  RandomPair(Random& random, int vertices_a, int vertices_b, double farthest)
      : hull_a(BuildHull(RandomOnSphere(random, vertices_a, 1))),
        hull_b(BuildHull(RandomOnSphere(random, vertices_b, 1))) {
    X_WB.t = Vector(random.Real(1.5, farthest), random.Real(-1, 1), random.Real(-1, 1));
    b = *PlacedHull::Make(query_b, X_WB);
  }

  const Hull hull_a;
  const Hull hull_b;
  const QueryHull query_a{hull_a};
  const QueryHull query_b{hull_b};
  Pose X_WB;
  PlacedHull a = *PlacedHull::Make(query_a, Pose());
  PlacedHull b = *PlacedHull::Make(query_b, Pose());
};

// Half the width is the error, so the end of the search may be twice as far from the nearest point.
TEST(FloatSearch, ASeparatedPairIsSearchedUntilTheErrorIsReached) {
  Random random(20261127);
  constexpr double kSize = 2;
  constexpr double kErrors[] = {kEndsAtSign, kSize / 4, 1e-2, 1e-4, 0};
  uint64_t directions[std::size(kErrors)] = {};
  for (int round = 0; round < 400; ++round) {
    const int vertices = round % 2 == 0 ? 8 : 100;
    const RandomPair hulls(random, vertices, vertices, 2);
    QueryOptions options;
    options.want_separation = true;
    const Answer answer = *CheckCollision(hulls.a, hulls.b, options);
    if (answer.relation != Relation::kSeparated) continue;
    const FloatPair pair(hulls.a, hulls.b);
    for (size_t i = 0; i < std::size(kErrors); ++i) {
      const FloatSearchResult found =
          SearchInFloatingPoint(pair, 0, -pair.CenterDifference(), kErrors[i]);
      ASSERT_EQ(found.verdict, FloatVerdict::kSeparated);
      ASSERT_LE(found.pair_count, 3);
      directions[i] += found.directions_tried;
      if (kErrors[i] == kEndsAtSign) continue;
      EXPECT_LE(DistanceAtEnd(pair, found), answer.separation->value + 2 * kErrors[i] + 1e-12)
          << "round " << round << " error " << kErrors[i];
    }
  }
  for (size_t i = 1; i < std::size(kErrors); ++i) EXPECT_GT(directions[i], directions[i - 1]) << i;
}

// The bounds from the end of a search contain the distance, whatever part of the simplex is kept,
// and are as close as those of a walk if it is the whole one.
TEST(FloatSearch, TheEndOfASearchBoundsTheDistance) {
  Random random(20261128);
  int counts[4] = {};
  for (int round = 0; round < 400; ++round) {
    const RandomPair hulls(random, 4 + round % 5, round % 2 == 0 ? 8 : 100, 3);
    const FloatPair pair(hulls.a, hulls.b);
    const FloatSearchResult found = SearchInFloatingPoint(pair, 0, -pair.CenterDifference(), 0);
    if (found.verdict != FloatVerdict::kSeparated) continue;
    ++counts[found.pair_count];
    SeparationGoal close;
    close.relative_error = 1e-12;
    close.size = 2;
    const SeparationBounds walked = BoundDistance(pair, found.axis, {}, close);
    ASSERT_TRUE(close.Met(walked.low, walked.high)) << "round " << round;
    SeparationGoal any;
    any.absolute_error = 1e9;
    for (uint32_t count = 1; count <= found.pair_count; ++count) {
      const std::span<const VertexPair> simplex = std::span(found.pairs).first(count);
      const SeparationBounds bounds = BoundDistance(pair, found.axis, simplex, any, found.reach);
      EXPECT_LE(bounds.low, walked.high) << "round " << round;
      EXPECT_GE(bounds.high, walked.low) << "round " << round;
      double sum = 0;
      for (uint32_t i = 0; i < bounds.point.count; ++i) {
        EXPECT_GE(bounds.point.weights[i], 0);
        sum += bounds.point.weights[i];
      }
      EXPECT_NEAR(sum, 1, 1e-15);
      if (count < found.pair_count) continue;
      EXPECT_TRUE(close.Met(bounds.low, bounds.high)) << "round " << round;
    }
  }
  for (int count = 1; count <= 3; ++count) EXPECT_GT(counts[count], 0) << count;
}

}  // namespace
}  // namespace hulld::float_search_test
