// Hulls with radii against brute force in exact arithmetic.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/checks/rounded_check.h"

namespace hulld {
namespace rounded_test {

using Points = std::vector<Vector>;

RoundedShape Shape(const Points& points, double radius, const Vector& t = Vector::Zero()) {
  RoundedShape shape;
  shape.hull = BuildHull(points);
  shape.X_WH.t = t;
  shape.radius = radius;
  return shape;
}

RoundedShape Sphere(double radius, const Vector& center) {
  return Shape({Vector::Zero()}, radius, center);
}

Relation RelationOf(const RoundedShape& a, const RoundedShape& b) {
  return CheckRounded(a, b)->relation;
}

// Expects that the shapes touch, and that the next doubles of a radius decide otherwise.
void ExpectTouch(RoundedCheck& check, RoundedShape a, const RoundedShape& b) {
  ASSERT_EQ(RelationOf(a, b), Relation::kTouching);
  ASSERT_TRUE(check.Verify(a, b));
  const double radius = a.radius;
  a.radius = std::nextafter(radius, kInfinity);
  EXPECT_EQ(RelationOf(a, b), Relation::kOverlapping);
  EXPECT_TRUE(check.Verify(a, b));
  if (radius == 0) return;
  a.radius = std::nextafter(radius, 0);
  EXPECT_EQ(RelationOf(a, b), Relation::kSeparated);
  EXPECT_TRUE(check.Verify(a, b));
}

struct Step {
  Vector offset;
  double length;
};
const std::array<Step, 7> kPythagorean = {{{{3, 4, 0}, 5},
                                           {{0, -5, 12}, 13},
                                           {{1, 2, 2}, 3},
                                           {{-2, 3, 6}, 7},
                                           {{4, -4, 7}, 9},
                                           {{6, 2, -9}, 11},
                                           {{7, 0, 0}, 7}}};

TEST(Rounded, PythagoreanSpheresTouchExactly) {
  RoundedCheck check;
  for (const auto& [offset, length] : kPythagorean) {
    for (const double scale : {1.0, 0x1p-1000, 0x1p900, 3.0}) {
      const Vector center(scale, -2 * scale, scale);
      for (const double part : {0.0, 0.25, 0.5, 1.0}) {
        const RoundedShape a = Sphere(part * length * scale, center);
        const RoundedShape b = Sphere((1 - part) * length * scale, center + scale * offset);
        ExpectTouch(check, a, b);
      }
    }
  }
  EXPECT_GT(check.count(Rung::kExact), 100);
}

// The nearest points are a corner and a corner, an edge and a corner, two crossing edges, a facet
// and a corner.
TEST(Rounded, BoxesAndCapsulesTouchExactly) {
  RoundedCheck check;
  const Points cube = LatticeCube(2, 1);
  for (const auto& [offset, length] : kPythagorean) {
    Vector corner = Vector::Zero();
    for (int i = 0; i < 3; ++i) corner[i] = offset[i] > 0 ? 1 : 0;
    ExpectTouch(check, Shape(cube, length - 0.5), Sphere(0.5, corner + offset));
  }
  // A capsule along z, and one along x at the distance 5, in the plane of 3-4-5.
  const Points along_z = {{0, 0, -2}, {0, 0, 3}};
  ExpectTouch(check, Shape(along_z, 2), Shape({{3, 4, -9}, {3, 4, 9}}, 3));
  ExpectTouch(check, Shape(along_z, 2), Shape({{-6, 5, 1}, {4, 5, 1}}, 3));
  ExpectTouch(check, Shape(cube, 4.5), Shape({{8, 2, 2.5}, {0, 8, -1.5}}, 0.5));
  ExpectTouch(check, Shape(cube, 0.25), Sphere(0.75, {0.5, 0.5, 2}));
  ExpectTouch(check, Shape(cube, 0.25), Shape(cube, 0.5, {1.75, 0.5, 0.5}));
}

TEST(Rounded, RotatedShapesTouchExactly) {
  RoundedCheck check;
  // |q|^2 R has integer entries; the rotation turns (1, 2, 2) into a rational vector of length 3.
  for (const std::array<double, 4>& q : {std::array<double, 4>{2, 1, 2, 1},
                                         {1, 1, 1, 1},
                                         {0x1p-600, 0x1p-600, 0, 0},
                                         {4, 2, 4, 2}}) {
    RoundedShape a = Shape({{0, 0, 0}, {-1, 0, 0}}, 1);
    RoundedShape b = Shape({{1, 2, 2}, {2, 2, 2}}, 2);
    a.X_WH.q = b.X_WH.q = q;
    a.X_WH.t = b.X_WH.t = Vector(1, 0, -1);
    ExpectTouch(check, a, b);
  }
}

TEST(Rounded, IrrationalDistancesLieBetweenDoubles) {
  RoundedCheck check;
  for (const Vector& offset : {Vector(1, 1, 0), Vector(1, 1, 1), Vector(2, 3, 5)}) {
    const double near = std::sqrt(offset.squaredNorm());
    int separated = 0;
    for (const double radius : {std::nextafter(near, 0), near, std::nextafter(near, kInfinity)}) {
      const RoundedShape a = Sphere(radius, Vector::Zero());
      ASSERT_TRUE(check.Verify(a, Sphere(0, offset)));
      separated += RelationOf(a, Sphere(0, offset)) == Relation::kSeparated ? 1 : 0;
    }
    EXPECT_GE(separated, 1);
    EXPECT_LE(separated, 2);
  }
  EXPECT_EQ(check.count(Relation::kTouching), 0);
}

// These sums of radii are not doubles.
TEST(Rounded, TheSumOfTheRadiiIsExact) {
  RoundedCheck check;
  const Vector one(1, 0, 0);
  for (const double rest : {0x1p-53, 0x1p-60, 0x1p-1074}) {
    EXPECT_EQ(RelationOf(Sphere(1, {0, 0, 0}), Sphere(rest, one)), Relation::kOverlapping);
    EXPECT_TRUE(check.Verify(Sphere(1, {0, 0, 0}), Sphere(rest, one)));
    EXPECT_TRUE(check.Verify(Sphere(1 - 0x1p-53, {0, 0, 0}), Sphere(rest, one)));
  }
  EXPECT_EQ(RelationOf(Sphere(1 - 0x1p-53, {0, 0, 0}), Sphere(0x1p-53, one)), Relation::kTouching);
  EXPECT_EQ(RelationOf(Sphere(1 - 0x1p-53, {0, 0, 0}), Sphere(0x1p-54, one)), Relation::kSeparated);
}

TEST(Rounded, TheClearanceIsAddedExactly) {
  const RoundedShape a = Sphere(1, {0, 0, 0});
  const RoundedShape b = Sphere(0x1p-60, {3, 4, 0});
  QueryOptions options;
  options.clearance = 4;
  EXPECT_TRUE(*CheckRounded(a, b, options)->within_clearance);
  options.clearance = std::nextafter(4.0, 0);
  EXPECT_FALSE(*CheckRounded(a, b, options)->within_clearance);
  const RoundedShape exact = Sphere(0x1p-51, {3, 4, 0});
  options.clearance = 4 - 0x1p-51;
  EXPECT_TRUE(*CheckRounded(a, exact, options)->within_clearance);
  options.clearance = std::nextafter(*options.clearance, 0);
  EXPECT_FALSE(*CheckRounded(a, exact, options)->within_clearance);
  options.clearance = -0.5;
  EXPECT_FALSE(*CheckRounded(a, Sphere(4.25, {3, 4, 0}), options)->within_clearance);
  EXPECT_TRUE(*CheckRounded(a, Sphere(4.5, {3, 4, 0}), options)->within_clearance);
  EXPECT_TRUE(*CheckRounded(a, Sphere(4.75, {3, 4, 0}), options)->within_clearance);
}

// Hulls of every dimension on a lattice, so that cores touch, overlap, and are at integer
// distances.
TEST(Rounded, RandomLatticeShapesMatchBruteForce) {
  const uint64_t seed = TestSeed(3101);
  Random random(seed);
  RoundedCheck check;
  for (int round = 0; round < 900; ++round) {
    RoundedShape a = Shape(RandomLatticePoints(random, random.Between(1, 6), 4), 0);
    RoundedShape b = Shape(RandomLatticePoints(random, random.Between(1, 6), 4), 0);
    b.X_WH.t = Vector(random.Between(-5, 5), random.Between(-3, 3), random.Between(-2, 2));
    if (round % 4 == 0) a.X_WH.q = b.X_WH.q = {2, 1, 2, 1};
    if (round % 4 == 1) b.X_WH.q = {0.3, -0.7, 0.1, 1};
    const double unit = std::array{1.0, 0.5, 0x1p-40, 0.1}[random.Below(4)];
    a.radius = unit * random.Between(1, 4);
    b.radius = unit * random.Between(0, 4);
    ASSERT_TRUE(check.Verify(a, b)) << "seed " << seed << " round " << round;
  }
  EXPECT_GT(check.count(Relation::kSeparated), 100);
  EXPECT_GT(check.count(Relation::kTouching), 1);
  EXPECT_GT(check.count(Relation::kOverlapping), 100);
  EXPECT_GT(check.meeting_cores(), 20);
  EXPECT_GT(check.count(Rung::kBounds), 100);
  EXPECT_GT(check.count(Rung::kCached), 100);
  EXPECT_GT(check.count(Rung::kFloatingPoint), 100);
  EXPECT_GT(check.count(Rung::kExact), 5);
}

TEST(Rounded, ExtremesOfScaleMatchBruteForce) {
  RoundedCheck check;
  const double least = std::numeric_limits<double>::denorm_min();
  const double largest = std::numeric_limits<double>::max();
  const Points cube = LatticeCube(2, 1);
  EXPECT_TRUE(check.Verify(Sphere(least, {0, 0, 0}), Sphere(0, {least, 0, 0})));
  EXPECT_TRUE(check.Verify(Sphere(least, {0, 0, 0}), Sphere(least, {least, least, 0})));
  EXPECT_TRUE(check.Verify(Shape(cube, least), Shape(cube, 0, {1, 0, 0})));
  EXPECT_TRUE(check.Verify(Shape(cube, least), Shape(cube, 0, {0.5, 0.25, 0})));
  EXPECT_TRUE(check.Verify(Shape(cube, 1e300), Shape(cube, 1, {3, 4, 5})));
  EXPECT_TRUE(check.Verify(Shape(cube, 1e-300), Shape(cube, 1e-300, {1 + 0x1p-52, 0, 0})));
  EXPECT_TRUE(check.Verify(Sphere(0x1p1000, {0, 0, 0}), Sphere(0, {3 * 0x1p1000, 0, 0})));
  // The sum of the radii exceeds every double.
  const RoundedShape huge = Sphere(largest, {0, 0, 0});
  EXPECT_EQ(RelationOf(huge, huge), Relation::kOverlapping);
  QueryOptions options;
  options.want_separation = options.want_witness = options.want_certificate = true;
  const Answer answer = CheckRounded(huge, huge, options).value();
  EXPECT_EQ(answer.separation->value, -largest);
  EXPECT_EQ(answer.separation->bound, kInfinity);
}

TEST(Rounded, DeepOverlapsOfCoresAddTheirDepthToTheRadii) {
  RoundedCheck check;
  const Points cube = LatticeCube(2, 4);
  for (const Vector& t : {Vector(2, 1, 1), Vector(0, 0, 0), Vector(3.5, 0.5, 0.25)}) {
    EXPECT_TRUE(check.Verify(Shape(cube, 0x1p-30), Shape(cube, 0.25, t)));
  }
  QueryOptions options;
  options.want_separation = options.want_normal = true;
  const Answer answer =
      CheckRounded(Shape(cube, 0.5), Shape(cube, 0.25, {3, 0, 0}), options).value();
  EXPECT_NEAR(answer.separation->value, -1.75, answer.separation->bound);
  EXPECT_EQ(answer.normal->direction, Vector(1, 0, 0));
}

TEST(Rounded, AnEmptyHullStaysEmpty) {
  RoundedShape empty;
  empty.radius = 5;
  QueryOptions options;
  options.want_separation = options.want_witness = true;
  options.clearance = 9;
  const Answer answer = CheckRounded(empty, Sphere(1, {0, 0, 0}), options).value();
  EXPECT_EQ(answer.relation, Relation::kSeparated);
  EXPECT_EQ(answer.separation->value, kInfinity);
  EXPECT_FALSE(*answer.within_clearance);
  EXPECT_FALSE(answer.witness.has_value());
}

TEST(Rounded, TheTextbookMethodRefusesRadii) {
  QueryOptions options;
  options.method = Method::kTextbookSat;
  const Points cube = LatticeCube(2, 1);
  EXPECT_EQ(CheckRounded(Shape(cube, 0), Shape(cube, 1), options).status().message(),
            "the textbook method applies to hulls without a radius; omit one of them");
  EXPECT_TRUE(CheckRounded(Shape(cube, 0), Shape(cube, 0), options).ok());
}

TEST(Rounded, ATolerancePermitsOnlyItsOwnRelation) {
  const Points cube = LatticeCube(2, 1);
  Random random(TestSeed(3102));
  int within = 0;
  for (int round = 0; round < 300; ++round) {
    const RoundedShape a = Shape(cube, 0.25);
    const RoundedShape b = Shape(RandomInBall(random, 6, 1), 0.5, RandomInBall(random, 1, 4)[0]);
    QueryOptions options;
    options.want_separation = true;
    const Answer exact = CheckRounded(a, b, options).value();
    options = {};
    options.tolerance = 0.125;
    const Relation relation = CheckRounded(a, b, options)->relation;
    if (relation == Relation::kWithinTolerance) {
      ++within;
      EXPECT_LE(std::abs(exact.separation->value), 0.125 + exact.separation->bound);
    } else {
      EXPECT_EQ(relation, exact.relation);
    }
  }
  EXPECT_GT(within, 3);
}

// The answers of a cache equal those without, while a capsule moves past a box.
TEST(Rounded, ACacheDoesNotChangeTheRelation) {
  const RoundedShape box = Shape(LatticeCube(2, 2), 0.5);
  RoundedShape capsule = Shape({{0, 0, 0}, {3, 0, 1}}, 0.25);
  PairCache cache;
  int cached = 0;
  for (int step = 0; step <= 200; ++step) {
    capsule.X_WH.t = Vector(-6 + step / 16.0, 2.5 - step / 128.0, 0.5);
    const Answer fresh = CheckRounded(box, capsule).value();
    const Answer answer = CheckRounded(box, capsule, {}, &cache).value();
    EXPECT_EQ(answer.relation, fresh.relation) << step;
    cached += answer.rung == Rung::kCached ? 1 : 0;
  }
  EXPECT_GT(cached, 40);
}

}  // namespace rounded_test
}  // namespace hulld
