#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "core/query/collision.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/checks/relation_check.h"
#include "tests/test_size.h"

namespace hulld {
namespace near_contact_test {

constexpr int kRounds = TestSize(600, 30);
constexpr int kStride = TestSize(1, 37);

Relation Query(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB) {
  return CheckCollision(a, X_WA, b, X_WB).value().relation;
}

// Moves B along a line from overlap to separation and bisects the change of the relation, down to
// two translations that are a few units in the last place apart: the hardest generic queries, in
// which no coordinate is special. The bisection trusts core; the oracle then provides the expected
// answers.
class Narrowing {
 public:
  Narrowing(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB, const Vector& line)
      : a_(a), b_(b), X_WA_(X_WA), start_(X_WB), line_(line) {}

  // Returns the pose of B at this fraction of the line.
  Pose At(double fraction) const {
    Pose pose = start_;
    pose.t += fraction * line_;
    return pose;
  }

  // Returns the last fraction, to 2^-53 of the line, at which the hulls still meet.
  double Run() const {
    double low = 0;
    double high = 1;
    for (int step = 0; step < 53; ++step) {
      const double middle = (low + high) / 2;
      (Query(a_, X_WA_, b_, At(middle)) == Relation::kSeparated ? high : low) = middle;
    }
    return low;
  }

 private:
  const Hull& a_;
  const Hull& b_;
  const Pose& X_WA_;
  Pose start_;
  Vector line_;
};

TEST(NearContact, GenericPairsNearContactMatchTheOracle) {
  const uint64_t seed = TestSeed(901);
  Random random(seed);
  RelationCheck check;
  for (int round = 0; round < kRounds; ++round) {
    const double scale = std::array{1e-6, 1.0, 1e6}[round % 3];
    const Vector offset = Vector::Constant(round % 2 ? 1e6 : 0);
    // A hull's own frame may be far away, which reduces the floating-point stage's accuracy.
    const Vector local = Vector::Constant(round % 5 == 0 ? 1e5 * scale : 0);
    const auto hull = [&] {
      return BuildHull(Shifted(RandomInBall(random, random.Between(2, 12), scale), local));
    };
    const auto pose = [&] {
      Pose result;
      for (double& q : result.q) q = random.Real(-1, 1);
      result.t = offset;
      return result;
    };
    const Hull a = hull();
    const Hull b = hull();
    const Pose X_WA = pose();
    Pose X_WB = pose();
    if (local != Vector::Zero()) X_WB.q = X_WA.q;
    const Vector line =
        Vector(random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1)).normalized() * 5 * scale;
    if (Query(a, X_WA, b, X_WB) == Relation::kSeparated) continue;
    const Narrowing narrowing(a, X_WA, b, X_WB, line);
    const double brink = narrowing.Run();
    // From the boundary outwards and inwards, across the bounds of the floating-point stage.
    for (double step : {0.0, 0x1p-53, 0x1p-52, 0x1p-48, 0x1p-44, 0x1p-40}) {
      for (double sign : {-1.0, 1.0}) {
        const Pose there = narrowing.At(brink + sign * step);
        ASSERT_TRUE(check.Verify(a, X_WA, b, there, OracleRelation(a, X_WA, b, there)))
            << "seed " << seed << " round " << round << " step " << sign * step;
      }
    }
  }
  EXPECT_GT(check.queries(), kRounds * 4);
  EXPECT_GT(check.count(Relation::kSeparated), check.queries() / 4);
  EXPECT_GT(check.count(Relation::kOverlapping), check.queries() / 4);
  EXPECT_GT(check.count(Rung::kFloatingPoint), check.queries() / 10);
  EXPECT_GT(check.count(Rung::kExact), check.queries() / 4);
}

// Hulls that are tiny relative to their distance from the origin of their frames, down to a few
// units in the last place: a rotation's rounding exceeds their size. Under a common pose the
// relation is that of the integer sets about the origin.
TEST(NearContact, TinyHullsFarFromTheirOriginMatchTheOracle) {
  const uint64_t seed = TestSeed(903);
  Random random(seed);
  RelationCheck check;
  for (int round = 0; round < 5 * kRounds; ++round) {
    const std::vector<Vector> a = RandomLatticePoints(random, random.Between(1, 8), 4);
    const std::vector<Vector> b =
        Shifted(RandomLatticePoints(random, random.Between(1, 8), 4),
                Vector(random.Between(-4, 4), random.Between(-3, 3), random.Between(-1, 1)));
    const double unit = std::ldexp(1.0, -random.Between(20, 50));
    const Vector origin(1.5, -1.25, 1.75);
    Pose pose;
    for (double& q : pose.q) q = random.Real(-1, 1);
    pose.t = Vector(random.Real(-1, 1), random.Real(-1, 1), 1e6);
    const Relation expected = OracleRelation(BuildHull(a), Pose(), BuildHull(b), Pose());
    const Hull tiny_a = BuildHull(Shifted(Scaled(a, unit), origin));
    const Hull tiny_b = BuildHull(Shifted(Scaled(b, unit), origin));
    ASSERT_TRUE(check.Verify(tiny_a, pose, tiny_b, pose, expected))
        << "seed " << seed << " round " << round;
  }
  for (Relation relation : {Relation::kSeparated, Relation::kTouching, Relation::kOverlapping}) {
    EXPECT_GT(check.count(relation), check.queries() / 40) << Name(relation);
  }
  EXPECT_GT(check.count(Rung::kFloatingPoint), check.queries() / 10);
  EXPECT_GT(check.count(Rung::kExact), check.queries() / 4);
}

// Returns the number of queries of the next test: HULLD_NEAR_CONTACT_QUERIES in the environment
// (a million in manual runs); few by default.
int QueryCount() {
  const char* given = std::getenv("HULLD_NEAR_CONTACT_QUERIES");
  return given != nullptr ? std::atoi(given) : kRounds;
}

// Adjacent lattice hulls of all dimensions, some coordinates moved by an ulp, at poses of small
// integers, with arbitrary scale: touching, missing, and overlapping by zero, by an ulp, or by a
// rounding of the pose.
TEST(NearContact, RandomQueriesMatchTheOracle) {
  const uint64_t seed = TestSeed(904);
  Random random(seed);
  RelationCheck check;
  for (int query = 0; query < QueryCount(); ++query) {
    const double scale = std::ldexp(1.0, random.Between(-900, 900));
    const auto points = [&](const Vector& offset) {
      std::vector<Vector> result =
          Scaled(Shifted(RandomLatticePoints(random, random.Between(1, 12), 3), offset), scale);
      for (Vector& p : result) {
        if (random.Below(6) != 0) continue;
        double& coordinate = p[random.Below(3)];
        coordinate = std::nextafter(coordinate, random.Below(2) == 0 ? -INFINITY : INFINITY);
      }
      return result;
    };
    Pose X_WA, X_WB;
    for (double& q : X_WA.q) q = random.Between(-3, 3);
    if (X_WA.q == std::array<double, 4>{0, 0, 0, 0}) X_WA.q[0] = 1;
    X_WB.q = X_WA.q;
    X_WA.t = X_WB.t = scale * Vector(random.Between(-1000, 1000), 1e6, random.Real(-1, 1));
    const Hull a = BuildHull(points(Vector::Zero()));
    const Hull b = BuildHull(
        points(Vector(random.Between(-2, 2), random.Between(-2, 2), random.Between(-2, 2))));
    const Relation expected = OracleRelation(a, X_WA, b, X_WB);
    ASSERT_TRUE(check.Verify(a, X_WA, b, X_WB, expected, RelationCheck::kSearchOnly))
        << "seed " << seed << " query " << query;
  }
  for (Relation relation : {Relation::kSeparated, Relation::kTouching, Relation::kOverlapping}) {
    RecordProperty(Name(relation), check.count(relation));
    EXPECT_GT(check.count(relation), check.queries() / 40) << Name(relation);
  }
  RecordProperty("spheres", check.count(Rung::kBounds));
  RecordProperty("floating_point", check.count(Rung::kFloatingPoint));
  RecordProperty("exact", check.count(Rung::kExact));
  EXPECT_GT(check.count(Rung::kBounds), check.queries() / 100);
  EXPECT_GT(check.count(Rung::kFloatingPoint), check.queries() / 10);
  EXPECT_GT(check.count(Rung::kExact), check.queries() / 10);
}

// Solids with the cube's symmetry, whole and flat, in units of four.
std::vector<Hull> SymmetricSolids() {
  std::vector<Vector> cube, octahedron, cuboctahedron, dodecahedron, truncated, square, segment;
  for (const Vector& p : LatticeCube(5, 1)) {
    const Vector q = p - Vector::Constant(2);
    Vector sorted = q.cwiseAbs();
    std::sort(sorted.begin(), sorted.end());
    if (sorted == Vector(2, 2, 2)) cube.push_back(q);
    if (sorted == Vector(0, 0, 2)) octahedron.push_back(2 * q);
    if (sorted == Vector(0, 2, 2)) cuboctahedron.push_back(q);
    if (sorted == Vector(0, 0, 2) || sorted == Vector(1, 1, 1)) dodecahedron.push_back(q);
    if (sorted == Vector(0, 1, 2)) truncated.push_back(q);
    if (sorted == Vector(2, 2, 2) && q.z() > 0) square.emplace_back(q.x(), q.y(), 0);
  }
  segment = {{-2, -2, 0}, {2, 2, 0}};
  std::vector<Hull> hulls;
  for (const auto& points :
       {cube, octahedron, cuboctahedron, dodecahedron, truncated, square, segment}) {
    hulls.push_back(BuildHull(points));
  }
  hulls.push_back(BuildHull(std::vector<Vector>{{0, 0, 0}}));
  return hulls;
}

// All integer translations in an octant: rays from center to center meet vertices, edges, and
// facets of the difference exactly, and no refinement may cycle.
TEST(NearContact, SymmetricSolidsOnALatticeMatchTheOracle) {
  const uint64_t seed = TestSeed(902);
  Random random(seed);
  RelationCheck check;
  const std::vector<Hull> solids = SymmetricSolids();
  const std::array<double, 4> turns[] = {{1, 0, 0, 0}, {1, 1, 0, 0}, {1, 1, 1, 1},
                                         {0, 1, 1, 0}, {2, 1, 0, 0}, {3, 1, 1, 1}};
  int query = random.Below(kStride);
  for (size_t i = 0; i < solids.size(); ++i) {
    for (size_t j = i; j < solids.size(); ++j) {
      for (const Vector& t : LatticeCube(5, 2)) {
        if (++query % kStride != 0) continue;
        Pose X_WA, X_WB;
        X_WA.q = turns[random.Below(4)];
        X_WB.q = turns[random.Below(6)];
        X_WB.t = t;
        const Relation expected = OracleRelation(solids[i], X_WA, solids[j], X_WB);
        ASSERT_TRUE(check.Verify(solids[i], X_WA, solids[j], X_WB, expected))
            << "seed " << seed << " solids " << i << ", " << j << " t " << t.transpose();
      }
    }
  }
  for (Relation relation : {Relation::kSeparated, Relation::kTouching, Relation::kOverlapping}) {
    EXPECT_GT(check.count(relation), check.queries() / 40) << Name(relation);
  }
}

// Shallow cones with many vertices: the supporting facets differ slightly, and all signs are small.
TEST(NearContact, BluntConesTipToTipMatchTheirConstruction) {
  RelationCheck check;
  for (double height : {1.0, 1e-3, 1e-7, 1e-12}) {
    std::vector<Vector> cone = {{0, 0, 0}};
    for (int k = 0; k < 60; ++k) cone.emplace_back(std::cos(0.1 * k), std::sin(0.1 * k), -height);
    std::vector<Vector> opposite;
    for (const Vector& p : cone) opposite.emplace_back(p.y(), p.x(), -p.z());
    const Hull a = BuildHull(cone);
    const Hull b = BuildHull(opposite);
    Pose X_WA, X_WB;
    X_WA.q = X_WB.q = {0.3, -0.9, 0.44, 0.1};
    X_WA.t = X_WB.t = Vector(7, 1e6, -0.3);
    EXPECT_TRUE(check.Verify(a, X_WA, b, X_WB, Relation::kTouching, RelationCheck::kSearchOnly))
        << height;
    X_WA.q = X_WB.q = {1, 0, 0, 0};
    X_WA.t = X_WB.t = Vector::Zero();
    for (double step : {5e-324, 1e-300, 1e-17, 1e-13}) {
      X_WB.t.z() = step;
      EXPECT_TRUE(check.Verify(a, X_WA, b, X_WB, Relation::kSeparated, RelationCheck::kSearchOnly))
          << height << " apart by " << step;
      X_WB.t.z() = -step;
      EXPECT_TRUE(
          check.Verify(a, X_WA, b, X_WB, Relation::kOverlapping, RelationCheck::kSearchOnly))
          << height << " deep by " << step;
    }
  }
}

}  // namespace near_contact_test
}  // namespace hulld
