#include "tests/oracle/brute_force_relation.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "tests/test_size.h"

namespace hulld::oracle {
namespace brute_force_relation_test {

constexpr int kRounds = TestSize(10000, 1000);

constexpr double kDenormal = 5e-324;

Relation Both(const std::vector<Point>& a, const Placement& X_WA, const std::vector<Point>& b,
              const Placement& X_WB) {
  const WorldPoints points = PlaceInWorld(a, X_WA, b, X_WB);
  const Relation relation = RelationByPolarCone(points);
  EXPECT_EQ(relation, RelationByLinearProgram(points));
  return relation;
}

std::vector<Point> Cube(double half) {
  std::vector<Point> points;
  for (int i = 0; i < 8; ++i) {
    points.push_back({i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half});
  }
  return points;
}

Placement At(double x, double y, double z) { return {{1, 0, 0, 0}, {x, y, z}}; }

TEST(BruteForceRelation, CubesSharingAFaceAnEdgeOrACornerTouch) {
  const std::vector<Point> cube = Cube(1);
  EXPECT_EQ(Both(cube, {}, cube, At(2, 0.5, 0)), Relation::kTouching);
  EXPECT_EQ(Both(cube, {}, cube, At(2, 2, 0)), Relation::kTouching);
  EXPECT_EQ(Both(cube, {}, cube, At(2, 2, -2)), Relation::kTouching);
  EXPECT_EQ(Both(cube, {}, cube, At(std::nextafter(2, 3), 0, 0)), Relation::kSeparated);
  EXPECT_EQ(Both(cube, {}, cube, At(std::nextafter(2, 1), 0, 0)), Relation::kOverlapping);
  EXPECT_EQ(Both(cube, {}, cube, At(2, 2, kDenormal)), Relation::kTouching);
}

TEST(BruteForceRelation, FlatSetsOverlapOnlyWhenTheirDifferenceIsSpatial) {
  const std::vector<Point> square = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  const std::vector<Point> needle = {{0, 0, -1}, {0, 0, 1}};
  const std::vector<Point> point = {{0, 0, 0}};
  EXPECT_EQ(Both(square, {}, square, {}), Relation::kTouching);
  EXPECT_EQ(Both(square, {}, square, At(0, 0, kDenormal)), Relation::kSeparated);
  EXPECT_EQ(Both(square, {}, needle, {}), Relation::kOverlapping);
  EXPECT_EQ(Both(square, {}, needle, At(1, 0, 0)), Relation::kTouching);
  EXPECT_EQ(Both(square, {}, needle, At(0, 0, 1)), Relation::kTouching);
  EXPECT_EQ(Both(square, {}, point, {}), Relation::kTouching);
  EXPECT_EQ(Both(point, {}, point, {}), Relation::kTouching);
  EXPECT_EQ(Both(point, {}, point, At(0, kDenormal, 0)), Relation::kSeparated);
  EXPECT_EQ(Both(needle, {}, needle, {}), Relation::kTouching);
  EXPECT_EQ(Both(needle, {}, needle, At(0, 0, 2)), Relation::kTouching);
  EXPECT_EQ(Both(needle, {}, needle, At(0, 0, 3)), Relation::kSeparated);
  EXPECT_EQ(Both({}, {}, Cube(1), {}), Relation::kSeparated);
  // Two crossing polygons have a spatial difference.
  EXPECT_EQ(Both(square, {}, square, {{1, 1, 0, 0}, {0, 0, 0}}), Relation::kOverlapping);
}

TEST(BruteForceRelation, RotationsAreExactAndScaleFree) {
  // (2, 1, 0, 0) rotates (0, 5, 0) to (0, 3, 4).
  const std::vector<Point> arm = {{0, 0, 0}, {0, 5, 0}};
  const std::vector<Point> tip = {{0, 3, 4}};
  for (double s : {1.0, -3.0, 1e-200, 0.1, kDenormal}) {
    const std::array<double, 4> q = {2 * s, s, 0, 0};
    const bool exact = q[0] == 2 * q[1];
    EXPECT_TRUE(exact);
    EXPECT_EQ(Both(arm, {q, {0, 0, 0}}, tip, {}), Relation::kTouching) << s;
  }
  EXPECT_EQ(Both(arm, {{2, std::nextafter(1, 2), 0, 0}, {}}, tip, {}), Relation::kSeparated);
}

TEST(BruteForceRelation, WorksAcrossTheWholeExponentRange) {
  const std::vector<Point> big = Cube(1e300);
  const std::vector<Point> tiny = Cube(1e-310);
  EXPECT_EQ(Both(big, {}, tiny, {}), Relation::kOverlapping);
  EXPECT_EQ(Both(big, {}, tiny, At(1e300, 0, 0)), Relation::kOverlapping);
  EXPECT_EQ(Both(big, {}, {{1e-310, 0, 0}}, At(1e300, 0, 0)), Relation::kSeparated);
  EXPECT_EQ(Both(big, {}, {{0, 0, 0}}, At(1e300, 0, 0)), Relation::kTouching);
}

// Random sets of all dimensions under small integer poses. The two methods share only the pairwise
// arithmetic, so their agreement is strong evidence that both are correct.
TEST(BruteForceRelation, PolarConeAndLinearProgramAgree) {
  const uint64_t seed = 20240502;
  std::mt19937_64 random(seed);
  const auto below = [&](int n) { return static_cast<int>(random() % n); };
  std::array<int, 3> seen = {};
  for (int round = 0; round < kRounds; ++round) {
    const auto points = [&] {
      std::vector<Point> result(1 + below(7));
      const int flat = below(5);
      for (Point& p : result) {
        p = {double(below(4) - 2), double(below(4) - 2), double(below(4) - 2)};
        if (flat < 2) p[2] = flat;
        if (flat < 1) p[1] = p[0];
      }
      return result;
    };
    const auto placement = [&] {
      Placement result;
      // Mostly quarter turns, because sets of small integers often touch under these.
      const bool quarter_turn = below(4) != 0;
      for (double& q : result.q) q = below(5) - 2;
      if (quarter_turn) result.q = {1.0, double(below(2)), 0, 0};
      if (result.q == std::array<double, 4>{0, 0, 0, 0}) result.q[0] = 1;
      for (double& t : result.t) t = below(5) - 2;
      return result;
    };
    const Relation relation = Both(points(), placement(), points(), placement());
    ASSERT_FALSE(HasFailure()) << "seed " << seed << " round " << round;
    ++seen[static_cast<size_t>(relation)];
  }
  for (int count : seen) EXPECT_GT(count, kRounds / 100);
}

}  // namespace brute_force_relation_test
}  // namespace hulld::oracle
