#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/query/collision.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {
namespace tolerance_test {

Pose At(double x, double y, double z) {
  Pose pose;
  pose.t = Vector(x, y, z);
  return pose;
}

Answer Query(const Hull& a, const Hull& b, const Pose& X_WB, double tolerance) {
  QueryOptions options;
  options.tolerance = tolerance;
  return CheckCollision(a, Pose(), b, X_WB, options).value();
}

// A cube of side 1 next to one at distance `gap`, or overlapping it by -gap: |separation| = |gap|.
TEST(Tolerance, IsUsedOnlyWhereTheSeparationIsWithinIt) {
  const Hull cube = BuildHull(LatticeCube(2, 1));
  std::array<int, 4> seen = {};
  for (const double tolerance : {1e-3, 0.1, 0.25}) {
    for (const double gap :
         {-0.5, -0.3, -0.2, -0.05, -1e-4, -1e-17, 0.0, 1e-17, 1e-4, 0.05, 0.2, 0.3, 0.5}) {
      // Exact: 1 + gap may round, and the distance is the rounded value.
      const double offset = 1 + gap;
      const double separation = offset - 1;
      for (const Pose& X : {At(offset, 0, 0), At(0, -offset, 0), At(offset, 0.25, 0.125)}) {
        const Relation exact = Query(cube, cube, X, 0).relation;
        const Relation relation = Query(cube, cube, X, tolerance).relation;
        ++seen[static_cast<size_t>(relation)];
        if (relation != Relation::kWithinTolerance) {
          EXPECT_EQ(relation, exact) << gap;
        } else {
          EXPECT_LE(std::abs(separation), tolerance);
        }
        EXPECT_NE(exact, Relation::kWithinTolerance);
      }
    }
  }
  EXPECT_GT(seen[static_cast<size_t>(Relation::kSeparated)], 10);
  EXPECT_GT(seen[static_cast<size_t>(Relation::kOverlapping)], 5);
  EXPECT_GT(seen[static_cast<size_t>(Relation::kWithinTolerance)], 10);
}

// Near contact, the tolerance avoids the exact rung, which touching would otherwise require.
TEST(Tolerance, AvoidsExactArithmeticInContact) {
  Random random(TestSeed(811));
  int spared = 0;
  for (int round = 0; round < 40; ++round) {
    const Hull ball = BuildHull(RandomOnSphere(random, 20 + 10 * round, 1));
    double lowest = 0;
    for (const Vector& v : ball.vertices()) lowest = std::min(lowest, v.z());
    std::vector<Vector> corners;
    for (const double x : {-2.0, 2.0}) {
      for (const double y : {-2.0, 2.0}) {
        for (const double z : {lowest, -4.0}) corners.emplace_back(x, y, z);
      }
    }
    const Hull plate = BuildHull(corners);
    ASSERT_EQ(Query(ball, plate, Pose(), 0).relation, Relation::kTouching);
    ASSERT_EQ(Query(ball, plate, Pose(), 0).rung, Rung::kExact);
    const Answer answer = Query(ball, plate, Pose(), 1e-6);
    EXPECT_TRUE(answer.relation == Relation::kWithinTolerance ||
                answer.relation == Relation::kTouching);
    spared += answer.rung == Rung::kFloatingPoint;
  }
  EXPECT_GT(spared, 35);
}

// |separation| is at most the distance of any vertex pair and, if the hulls overlap, at most their
// reach along any direction: WITHIN_TOLERANCE must never contradict the exact relation of hulls
// moved apart, or together, by slightly more than the tolerance.
TEST(Tolerance, IsNeverClaimedBeyondTheTolerance) {
  Random random(TestSeed(812));
  int within = 0;
  for (int round = 0; round < 3000; ++round) {
    const Hull a = BuildHull(RandomOnSphere(random, random.Between(1, 30), 1));
    const Hull b = BuildHull(RandomOnSphere(random, random.Between(1, 30), 1));
    const double distance = random.Real(0, 2.5);
    const Vector u = RandomOnSphere(random, 1, 1)[0];
    const double tolerance = random.Real(0.01, 0.5);
    Pose X;
    X.t = distance * u;
    if (Query(a, b, X, tolerance).relation != Relation::kWithinTolerance) continue;
    ++within;
    // B grown by a cube that contains the ball of radius `tolerance` (1 + 1e-9) touches or overlaps
    // A.
    std::vector<Vector> grown;
    const double r = tolerance * (1 + 1e-9);
    for (const Vector& v : b.vertices()) {
      for (int corner = 0; corner < 8; ++corner) {
        grown.push_back(v + Vector(corner & 1 ? r : -r, corner & 2 ? r : -r, corner & 4 ? r : -r));
      }
    }
    EXPECT_NE(Query(a, BuildHull(grown), X, 0).relation, Relation::kSeparated) << "round " << round;
  }
  EXPECT_GT(within, 100);
}

}  // namespace tolerance_test
}  // namespace hulld
