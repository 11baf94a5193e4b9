// Directions of the separation, at configurations for which they are known exactly.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/numeric/error_bounds.h"
#include "core/query/collision.h"
#include "core/query/terms/query_options.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {
namespace normal_test {

using Exact = std::array<int64_t, 3>;

Pose At(double x, double y, double z) {
  Pose pose;
  pose.t = Vector(x, y, z);
  return pose;
}

QueryOptions WantNormal() {
  QueryOptions options;
  options.want_normal = true;
  return options;
}

// Returns true if the direction has unit length and is within its bound of n.
testing::AssertionResult Shows(const Normal& normal, const Exact& n) {
  long double dot = 0;
  long double crossed = 0;
  long double length = 0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const long double d_i = normal.direction[i];
    const long double d_j = normal.direction[j];
    dot += d_i * n[i];
    length += d_i * d_i;
    crossed += (d_i * n[j] - d_j * n[i]) * (d_i * n[j] - d_j * n[i]);
  }
  const long double angle = std::atan2(std::sqrt(crossed), dot);
  if (!(angle <= normal.angle_bound)) {
    return testing::AssertionFailure()
           << normal.direction.transpose() << " is off by " << static_cast<double>(angle)
           << ", not " << normal.angle_bound;
  }
  if (!(normal.angle_bound <= kMaxNormalAngle)) {
    return testing::AssertionFailure() << "bound " << normal.angle_bound;
  }
  if (std::abs(static_cast<double>(length) - 1) > 1e-15) {
    return testing::AssertionFailure() << "length squared " << static_cast<double>(length);
  }
  return testing::AssertionSuccess();
}

// A random integer direction n with two integer directions perpendicular to it and to each other.
struct Frame {
  explicit Frame(Random& random) {
    do {
      for (int64_t& x : n) x = random.Between(-9, 9);
    } while (n == Exact{0, 0, 0});
    u = n[0] == 0 && n[1] == 0 ? Exact{1, 0, 0} : Exact{-n[1], n[0], 0};
    v = {n[1] * u[2] - n[2] * u[1], n[2] * u[0] - n[0] * u[2], n[0] * u[1] - n[1] * u[0]};
  }

  Vector At(double along, double across, double other) const {
    Vector p;
    for (int i = 0; i < 3; ++i) {
      p[i] = along * static_cast<double>(n[i]) + across * static_cast<double>(u[i]) +
             other * static_cast<double>(v[i]);
    }
    return p;
  }

  Exact n;
  Exact u;
  Exact v;
};

// A prism with a facet at height 0, below which it extends far.
Hull Prism(const Frame& frame) {
  std::vector<Vector> points;
  for (const int across : {-64, 64}) {
    for (const int other : {-64, 64}) {
      for (const int along : {0, -64}) points.push_back(frame.At(along, across, other));
    }
  }
  return BuildHull(points);
}

// A corner at the origin, and random points above it.
Hull Tip(const Frame& frame, Random& random) {
  std::vector<Vector> points = {Vector::Zero()};
  for (int i = random.Between(0, 6); i > 0; --i) {
    points.push_back(
        frame.At(random.Between(1, 9), random.Between(-9, 9) / 8.0, random.Between(-9, 9) / 8.0));
  }
  return BuildHull(points);
}

TEST(Normal, IsTheNearestDirectionAndNotAnySeparatingOne) {
  const Hull point = BuildHull(std::vector<Vector>{{0, 0, 0}});
  std::vector<Vector> box = LatticeCube(2, 10);
  const Hull shifted = BuildHull(Shifted(box, Vector(-5, 4, -1)));
  QueryOptions options = WantNormal();
  options.want_axis = true;
  options.want_separation = true;
  const Answer answer = CheckCollision(point, Pose(), shifted, Pose(), options).value();
  EXPECT_TRUE(Shows(*answer.normal, {0, 1, 0}));
  EXPECT_NEAR(answer.separation->value, 4, answer.separation->bound);
  EXPECT_TRUE(Shows(*CheckCollision(shifted, Pose(), point, Pose(), options)->normal, {0, -1, 0}));
}

TEST(Normal, CubesAreApartOrDeepAlongTheirAxes) {
  const Hull cube = BuildHull(LatticeCube(2, 1));
  const struct {
    Pose X_WB;
    Exact n;
  } kCases[] = {{At(1.5, 0.25, 0), {1, 0, 0}},     {At(-7, 0, 0.5), {-1, 0, 0}},
                {At(4, 5, 0), {3, 4, 0}},          {At(3, 3, -2), {2, 2, -1}},
                {At(0, 0, 1), {0, 0, 1}},          {At(0.25, -1, 0.5), {0, -1, 0}},
                {At(0.75, 0.25, 0), {1, 0, 0}},    {At(0.5, 0.5, -0.875), {0, 0, -1}},
                {At(0x1p-40, 0, 0), {1, 0, 0}},    {At(0, 1 + 0x1p-50, 0), {0, 1, 0}},
                {At(0, 1 - 0x1p-50, 0), {0, 1, 0}}};
  for (const auto& [X_WB, n] : kCases) {
    const Answer answer = CheckCollision(cube, Pose(), cube, X_WB, WantNormal()).value();
    EXPECT_TRUE(Shows(*answer.normal, n)) << X_WB.t.transpose();
    EXPECT_FALSE(answer.separation.has_value());
  }
}

// The tip of B stands above, on, or in the facet of A, in a common rotated frame.
TEST(Normal, MatchesIntegerDirections) {
  const uint64_t seed = TestSeed(721);
  Random random(seed);
  int exact = 0;
  int floating = 0;
  for (int round = 0; round < 400; ++round) {
    const Frame frame(random);
    const Hull prism = Prism(frame);
    const Hull tip = Tip(frame, random);
    const double scale = std::array{1.0, 1.0, 0x1p-900, 0x1p-20, 0x1p900}[random.Below(5)];
    const double height =
        std::array{0.0, 10000.0, 1.0, 0x1p-20, 0x1p-43, -0x1p-40, -0.5, -1.0}[random.Below(8)];
    const Hull a = BuildHull(Scaled({prism.vertices().begin(), prism.vertices().end()}, scale));
    const Hull b = BuildHull(Scaled({tip.vertices().begin(), tip.vertices().end()}, scale));
    const Pose X_WB{{1, 0, 0, 0}, scale * frame.At(height, 0, 0)};
    const Answer answer = CheckCollision(a, Pose(), b, X_WB, WantNormal()).value();
    ASSERT_EQ(answer.relation, height > 0    ? Relation::kSeparated
                               : height == 0 ? Relation::kTouching
                                             : Relation::kOverlapping);
    ASSERT_TRUE(Shows(*answer.normal, frame.n)) << "seed " << seed << " round " << round;
    ++(answer.normal->angle_bound == kUnitDirectionAngle ? exact : floating);
    const Answer mirrored = CheckCollision(b, X_WB, a, Pose(), WantNormal()).value();
    EXPECT_EQ(mirrored.normal->direction, -answer.normal->direction);
    EXPECT_EQ(mirrored.normal->angle_bound, answer.normal->angle_bound);
  }
  EXPECT_GT(exact, 100);
  EXPECT_GT(floating, 20);
}

TEST(Normal, FollowsARotationOfBoth) {
  Random random(TestSeed(722));
  for (int round = 0; round < 100; ++round) {
    const Frame frame(random);
    // |q|^2 R has integer entries.
    Pose X_WA;
    X_WA.q = {2, 1, 2, 1};
    X_WA.t = Vector(random.Between(-9, 9), random.Between(-9, 9), 1);
    constexpr int64_t kRows[3][3] = {{0, 0, 10}, {8, 6, 0}, {-6, 8, 0}};
    Exact n = {0, 0, 0};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) n[i] += kRows[i][j] * frame.n[j];
    }
    const std::vector<Vector> tip = {frame.At(0, 0, 0), frame.At(1, 0.5, 0), frame.At(1, 0, 0.5)};
    for (const double height : {50.0, 0x1p-30, 0.0, -0.25}) {
      const Hull b = BuildHull(Shifted(tip, frame.At(height, 0, 0)));
      const Answer answer = CheckCollision(Prism(frame), X_WA, b, X_WA, WantNormal()).value();
      EXPECT_TRUE(Shows(*answer.normal, n)) << "round " << round << " height " << height;
    }
  }
}

// The depths of two facets differ by less than the rounding error. Exact arithmetic chooses the
// nearer facet.
TEST(Normal, DistinguishesFacetsOfNearlyEqualDepth) {
  const Hull cube = BuildHull(Shifted(LatticeCube(2, 2), Vector::Constant(-1)));
  const Hull point = BuildHull(std::vector<Vector>{{0, 0, 0}, {0x1p-60, 0, 0}});
  const double step = 0x1p-53;
  const Normal right =
      *CheckCollision(cube, Pose(), point, At(0.5 + step, 0.5, 0), WantNormal())->normal;
  EXPECT_TRUE(Shows(right, {1, 0, 0}));
  const Normal up =
      *CheckCollision(cube, Pose(), point, At(0.5, 0.5 + 2 * step, 0), WantNormal())->normal;
  EXPECT_TRUE(Shows(up, {0, 1, 0}));
}

TEST(Normal, OtherOptionsDoNotChangeIt) {
  Random random(TestSeed(723));
  for (int round = 0; round < 40; ++round) {
    const Hull a = BuildHull(RandomInBall(random, 40, 1));
    const Hull b = BuildHull(RandomInBall(random, 40, 1));
    const Pose X_WB = At(random.Real(0, 3), 0.1, 0.2);
    QueryOptions all = WantNormal();
    all.want_separation = all.want_witness = all.want_axis = all.want_certificate = true;
    all.clearance = 0.5;
    const Answer more = CheckCollision(a, Pose(), b, X_WB, all).value();
    QueryOptions others = all;
    others.want_normal = false;
    const Answer rest = CheckCollision(a, Pose(), b, X_WB, others).value();
    EXPECT_FALSE(rest.normal.has_value());
    EXPECT_EQ(more.separation->value, rest.separation->value);
    EXPECT_EQ(more.separation->bound, rest.separation->bound);
    EXPECT_EQ(more.witness->p_WA, rest.witness->p_WA);
    // Two directions, each within its bound of the same one.
    const Normal alone = *CheckCollision(a, Pose(), b, X_WB, WantNormal())->normal;
    EXPECT_LE((alone.direction - more.normal->direction).norm(),
              alone.angle_bound + more.normal->angle_bound + 1e-15);
    // The witness points lie along it.
    const Vector between = (more.witness->p_WB - more.witness->p_WA) *
                           (more.relation == Relation::kOverlapping ? -1 : 1);
    EXPECT_GE(between.normalized().dot(alone.direction), 1 - 1e-9);
  }
}

TEST(Normal, EmptyHullsAndQueriesWithAToleranceHaveNone) {
  const Hull cube = BuildHull(LatticeCube(2, 1));
  EXPECT_FALSE(CheckCollision(cube, Pose(), Hull(), Pose(), WantNormal())->normal.has_value());
  QueryOptions options = WantNormal();
  options.tolerance = 1;
  EXPECT_EQ(CheckCollision(cube, Pose(), cube, Pose(), options).status().message(),
            "tolerance is 1, but want_normal needs the exact relation; omit one of them");
  options.tolerance = 0;
  options.method = Method::kTextbookSat;
  EXPECT_TRUE(
      Shows(*CheckCollision(cube, Pose(), cube, At(0, 0.75, 0), options)->normal, {0, 1, 0}));
}

// Integers find the normal if no bound in floating point suffices for the separation.
TEST(Normal, FloatingPointIsWithinItsBoundOfIntegers) {
  const uint64_t seed = TestSeed(20261127);
  SCOPED_TRACE(seed);
  Random random(seed);
  constexpr int kRounds = 400;
  int in_floating_point[2] = {};
  int counts[2] = {};
  for (int round = 0; round < kRounds; ++round) {
    const double scale = std::ldexp(1.0, random.Between(-40, 40));
    const auto hull = [&] {
      return BuildHull(Scaled(RandomOnSphere(random, random.Between(6, 30), 1), scale));
    };
    const Hull a = hull();
    const Hull b = hull();
    Pose X_WA;
    Pose X_WB;
    for (double& q : X_WA.q) q = random.Real(-1, 1);
    for (double& q : X_WB.q) q = random.Real(-1, 1);
    X_WB.t = scale * random.Real(0.2, 2.5) * RandomOnSphere(random, 1, 1)[0];
    const auto found = CheckCollision(a, X_WA, b, X_WB, WantNormal());
    QueryOptions options = WantNormal();
    options.want_separation = true;
    options.max_error = 0;
    const auto exact = CheckCollision(a, X_WA, b, X_WB, options);
    ASSERT_TRUE(found.ok() && exact.ok());
    ASSERT_EQ(exact->normal->angle_bound, kUnitDirectionAngle);
    const Vector& n = found->normal->direction;
    const Vector& truth = exact->normal->direction;
    EXPECT_GT(n.dot(truth), 0);
    EXPECT_LE(n.cross(truth).norm(), found->normal->angle_bound + 2 * kUnitDirectionAngle)
        << Describe(a, X_WA, b, X_WB);
    EXPECT_NEAR(n.norm(), 1, 1e-15);
    const int kind = found->relation == Relation::kSeparated ? 1 : 0;
    ++counts[kind];
    in_floating_point[kind] += found->normal->angle_bound > kUnitDirectionAngle ? 1 : 0;
  }
  for (const int kind : {0, 1}) {
    EXPECT_GT(counts[kind], kRounds / 8);
    EXPECT_GT(2 * in_floating_point[kind], counts[kind]);
  }
}

}  // namespace normal_test
}  // namespace hulld
