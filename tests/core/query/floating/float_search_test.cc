#include "core/query/floating/float_search.h"

#include <gtest/gtest.h>

#include <iterator>
#include <span>

#include "core/numeric/simd_path.h"
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

// The inner point is no vertex, so it is not among the pairs, which are hints if nothing is
// decided.
TEST(FloatSearch, AnInnerPointSavesDirectionsOnEverySimdPath) {
  Random random(20261129);
  uint64_t directions[2] = {};
  int verdicts[4] = {};
  for (int round = 0; round < 600; ++round) {
    const int vertices = round % 3 == 0 ? 8 : round % 3 == 1 ? 14 : 100;
    RandomPair hulls(random, vertices, vertices, 1.9);
    // Vertex on vertex: nothing but exact arithmetic decides.
    const bool touches = round % 8 == 0;
    if (touches) {
      hulls.X_WB.t = hulls.hull_a.vertices().back() - hulls.hull_b.vertices().front();
      hulls.b = *PlacedHull::Make(hulls.query_b, hulls.X_WB);
    }
    const FloatPair pair(hulls.a, hulls.b);
    const PlainVector inner = pair.CenterDifference();
    const FloatSearchResult plain = SearchInFloatingPoint(pair, 0, -inner);
    FloatSearchResult found;
    SearchInFloatingPoint(pair, 0, -inner, kEndsAtSign, &inner, found);
    EXPECT_EQ(found.verdict, plain.verdict) << "round " << round;
    ++verdicts[static_cast<int>(found.verdict)];
    directions[0] += plain.directions_tried;
    directions[1] += found.directions_tried;
    for (uint32_t i = 0; i < found.pair_count; ++i) {
      EXPECT_LT(found.pairs[i].a, hulls.query_a.point_count());
      EXPECT_LT(found.pairs[i].b, hulls.query_b.point_count());
    }
    const bool is_undecided = found.verdict == FloatVerdict::kUndecided;
    EXPECT_EQ(found.pair_count > 0, is_undecided) << "round " << round;
    for (const SimdPath path : {SimdPath::kPortable, SimdPath::kAvx2}) {
      if (!UseSimdPath(path)) continue;
      FloatSearchResult other;
      SearchInFloatingPoint(pair, 0, -inner, kEndsAtSign, &inner, other);
      EXPECT_EQ(other.verdict, found.verdict) << "round " << round;
      EXPECT_EQ(other.axis, found.axis) << "round " << round;
      EXPECT_EQ(other.directions_tried, found.directions_tried) << "round " << round;
    }
    UseSimdPath(BestSimdPath());
  }
  EXPECT_LT(directions[1], directions[0]);
  EXPECT_GT(verdicts[static_cast<int>(FloatVerdict::kSeparated)], 50);
  EXPECT_GT(verdicts[static_cast<int>(FloatVerdict::kOverlapping)], 50);
  EXPECT_GT(verdicts[static_cast<int>(FloatVerdict::kUndecided)], 50);
}

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
