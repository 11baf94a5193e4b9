#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/query/collision.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/checks/relation_check.h"
#include "tests/test_size.h"

namespace hulld {
namespace random_relation_test {

constexpr int kRounds = TestSize(20000, 2000);

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Small integer sets of every dimension, about one in twenty empty.
std::vector<Vector> SmallSet(Random& random) {
  const int n = random.Below(20) == 0 ? 0 : random.Between(1, 8);
  if (random.Below(3) == 0) {
    std::vector<Vector> points;
    const Vector u(random.Between(-1, 1), random.Between(-1, 1), random.Between(-1, 1));
    const Vector v(random.Between(-1, 1), random.Between(-1, 1), random.Between(-1, 1));
    for (int i = 0; i < n; ++i) points.push_back(u * random.Between(-1, 1) + v * random.Below(2));
    return points;
  }
  return Shifted(RandomLatticePoints(random, n, 5), Vector(-2, -2, -2));
}

Pose SmallPose(Random& random) {
  Pose pose;
  switch (random.Below(4)) {
    case 0:
      break;
    case 1:
      pose.q = {1, 0, 0, 0};
      pose.q[1 + random.Below(3)] = random.Between(-1, 1);
      break;
    default:
      for (double& q : pose.q) q = random.Between(-3, 3);
      if (pose.q == std::array<double, 4>{0, 0, 0, 0}) pose.q[0] = 1;
  }
  for (int k = 0; k < 3; ++k) pose.t[k] = random.Between(-4, 4) * 0.5;
  return pose;
}

// Moves B so that a vertex of B that is lowest in some direction lies on a highest vertex of A:
// under a common pose they touch if the shift is exact.
void MoveIntoContact(Random& random, const std::vector<Vector>& a, std::vector<Vector>& b) {
  if (a.empty() || b.empty()) return;
  const Vector direction(random.Between(-2, 2), random.Between(-2, 2), 0.5 + random.Below(2));
  const auto less = [&](const Vector& p, const Vector& q) {
    return direction.dot(p) < direction.dot(q);
  };
  const Vector highest = *std::max_element(a.begin(), a.end(), less);
  const Vector lowest = *std::min_element(b.begin(), b.end(), less);
  b = Shifted(std::move(b), highest - lowest);
}

// Two sets and their poses, in contact in a third of the cases.
struct Query {
  std::vector<Vector> a;
  std::vector<Vector> b;
  Pose X_WA;
  Pose X_WB;
};

Query SmallQuery(Random& random) {
  Query query = {SmallSet(random), SmallSet(random), SmallPose(random), SmallPose(random)};
  if (random.Below(3) == 0) {
    MoveIntoContact(random, query.a, query.b);
    query.X_WB = query.X_WA;
  }
  return query;
}

Pose Scaled(Pose pose, double scale) {
  pose.t *= scale;
  return pose;
}

TEST(RandomRelation, SmallIntegerHullsMatchTheOracle) {
  const uint64_t seed = TestSeed(501);
  Random random(seed);
  RelationCheck check;
  for (int round = 0; round < kRounds; ++round) {
    const Query query = SmallQuery(random);
    const Hull a = BuildHull(query.a);
    const Hull b = BuildHull(query.b);
    const Relation expected = OracleRelation(a, query.X_WA, b, query.X_WB);
    ASSERT_TRUE(check.Verify(a, query.X_WA, b, query.X_WB, expected))
        << "seed " << seed << " round " << round;
  }
  for (Relation relation : {Relation::kSeparated, Relation::kTouching, Relation::kOverlapping}) {
    EXPECT_GT(check.count(relation), kRounds / 20) << Name(relation);
  }
  EXPECT_GT(check.count(Rung::kFloatingPoint), kRounds / 10);
  EXPECT_GT(check.count(Rung::kExact), kRounds / 50);
  // The textbook reaches each kind that names features.
  for (AxisKind kind : {AxisKind::kFacetA, AxisKind::kFacetB, AxisKind::kEdgeEdge}) {
    EXPECT_GT(check.textbook_count(kind), kRounds / 100) << Name(kind);
  }
}

// A common power of two, and any multiple of a quaternion, change nothing.
TEST(RandomRelation, ScalesAndQuaternionMultiplesChangeNothing) {
  const uint64_t seed = TestSeed(502);
  Random random(seed);
  RelationCheck check;
  for (int round = 0; round < kRounds / 4; ++round) {
    auto [a, b, X_WA, X_WB] = SmallQuery(random);
    const Relation expected = OracleRelation(BuildHull(a), X_WA, BuildHull(b), X_WB);
    // Coordinates are multiples of 1/2 below 8: exact from 2^-1073 to 2^1020.
    const double scale = std::ldexp(1.0, random.Between(-1073, 1020));
    for (double& q : X_WA.q) q *= std::array{-1.0, 3.0, 0x1p-1074, 0x1p1020}[round % 4];
    for (double& q : X_WB.q) q *= std::array{7.0, 1.0, 0x1p500, 0x1p-500, -0x1p-1060}[round % 5];
    ASSERT_TRUE(check.Verify(BuildHull(hulld::Scaled(a, scale)), Scaled(X_WA, scale),
                             BuildHull(hulld::Scaled(b, scale)), Scaled(X_WB, scale), expected))
        << "seed " << seed << " round " << round;
  }
}

// Nearly degenerate: rounded coordinates, and steps of a unit in the last place.
TEST(RandomRelation, NearlyDegenerateHullsMatchTheOracle) {
  const uint64_t seed = TestSeed(503);
  Random random(seed);
  RelationCheck check;
  for (int round = 0; round < kRounds / 8; ++round) {
    const double scale = std::array{0.1, 1.0, 1.0 / 3, 1e-160, 1e160}[round % 5];
    const auto nudge = [&](double& x) {
      if (random.Below(8) == 0) x = std::nextafter(x, random.Below(2) ? kInfinity : -kInfinity);
    };
    const Query query = SmallQuery(random);
    const auto rounded = [&](const std::vector<Vector>& exact) {
      std::vector<Vector> points = hulld::Scaled(exact, scale);
      for (Vector& p : points) {
        for (int k = 0; k < 3; ++k) nudge(p[k]);
      }
      return BuildHull(points);
    };
    const auto nudged = [&](const Pose& exact) {
      Pose pose = Scaled(exact, scale);
      if (random.Below(4) == 0) nudge(pose.t[random.Below(3)]);
      if (random.Below(4) == 0) nudge(pose.q[random.Below(4)]);
      return pose;
    };
    const Hull a = rounded(query.a);
    const Hull b = rounded(query.b);
    const Pose X_WA = nudged(query.X_WA);
    const Pose X_WB = nudged(query.X_WB);
    ASSERT_TRUE(check.Verify(a, X_WA, b, X_WB, OracleRelation(a, X_WA, b, X_WB)))
        << "seed " << seed << " round " << round;
  }
  for (Relation relation : {Relation::kSeparated, Relation::kTouching, Relation::kOverlapping}) {
    EXPECT_GT(check.count(relation), check.queries() / 50) << Name(relation);
  }
}

// Coordinates, translations, and quaternions of widely different magnitudes, to the ends of the
// range of doubles.
TEST(RandomRelation, MixedMagnitudesMatchTheOracle) {
  const uint64_t seed = TestSeed(504);
  Random random(seed);
  const double magnitudes[] = {0,      1,       -1,     1e-310, -5e-324, 1e300,
                               -1e300, 1.7e308, 1e-160, 1e160,  -3e-150, 0x1p-537};
  const auto any = [&] { return magnitudes[random.Below(std::size(magnitudes))]; };
  for (int round = 0; round < kRounds / 80; ++round) {
    const auto hull = [&] {
      std::vector<Vector> points;
      for (int n = random.Between(1, 6); n > 0; --n) points.emplace_back(any(), any(), any());
      return BuildHull(points);
    };
    const auto pose = [&] {
      Pose result;
      if (random.Below(2)) {
        for (double& q : result.q) q = any();
        if (result.q == std::array<double, 4>{0, 0, 0, 0}) result.q[2] = 1e-310;
      }
      result.t = Vector(any(), any(), any());
      return result;
    };
    const Hull a = hull();
    const Hull b = hull();
    const Pose X_WA = pose();
    const Pose X_WB = pose();
    const Relation expected = OracleRelation(a, X_WA, b, X_WB);
    for (Method method : {Method::kCertifiedSearch, Method::kTextbookSat}) {
      QueryOptions options;
      options.method = method;
      const absl::StatusOr<Answer> answer = CheckCollision(a, X_WA, b, X_WB, options);
      ASSERT_TRUE(answer.ok()) << answer.status();
      ASSERT_EQ(Name(answer->relation), Name(expected))
          << "seed " << seed << " round " << round << " textbook "
          << (method == Method::kTextbookSat) << "\n"
          << Describe(a, X_WA, b, X_WB);
    }
  }
}

// Generic poses of generic hulls: floating point decides nearly all.
TEST(RandomRelation, GenericHullsMatchTheOracle) {
  const uint64_t seed = TestSeed(505);
  Random random(seed);
  RelationCheck check;
  for (int round = 0; round < kRounds / 20; ++round) {
    const Hull a = BuildHull(RandomInBall(random, random.Between(4, 20), 1));
    const Hull b = BuildHull(RandomInBall(random, random.Between(4, 20), 1));
    const auto pose = [&] {
      Pose result;
      for (double& q : result.q) q = random.Real(-1, 1);
      result.t = Vector(random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1)) * 1.2;
      return result;
    };
    const Pose X_WA = pose();
    const Pose X_WB = pose();
    ASSERT_TRUE(check.Verify(a, X_WA, b, X_WB, OracleRelation(a, X_WA, b, X_WB)))
        << "seed " << seed << " round " << round;
  }
  EXPECT_GT(check.count(Rung::kFloatingPoint), check.queries());
  EXPECT_GT(check.count(Relation::kSeparated), check.queries() / 10);
  EXPECT_GT(check.count(Relation::kOverlapping), check.queries() / 10);
}

}  // namespace random_relation_test
}  // namespace hulld
