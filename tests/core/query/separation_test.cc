#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "core/query/collision.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/checks/separation_check.h"
#include "tests/test_size.h"

namespace hulld {
namespace separation_test {

constexpr int kRounds = TestSize(1200, 240);
constexpr int kLargeRounds = TestSize(40, 4);

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLargest = std::numeric_limits<double>::max();
constexpr double kLeast = std::numeric_limits<double>::denorm_min();

Pose At(double x, double y, double z) {
  Pose pose;
  pose.t = Vector(x, y, z);
  return pose;
}

Pose RandomPose(Random& random, double reach) {
  Pose pose;
  for (double& q : pose.q) q = random.Real(-1, 1);
  for (int k = 0; k < 3; ++k) pose.t[k] = random.Real(-reach, reach);
  return pose;
}

Answer Query(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB,
             std::optional<double> max_error = std::nullopt) {
  return CheckCollision(a, X_WA, b, X_WB, WantSeparation(max_error)).value();
}

TEST(Separation, CubesHaveTheExpectedLengths) {
  const Hull cube = BuildHull(LatticeCube(2, 1));
  SeparationCheck check;
  const struct {
    Pose X_WB;
    double separation;
  } kCases[] = {{At(1.5, 0, 0), 0.5},       {At(4, 5, 0), 5},
                {At(3, 3, 2), 3},           {At(1, 0.5, 0.5), 0},
                {At(1, 1, 1), 0},           {At(0, 0, 0), -1},
                {At(0.75, 0.25, 0), -0.25}, {At(0.5, 0.5, 0.875), -0.125}};
  for (const auto& [X_WB, separation] : kCases) {
    const Answer exact = Query(cube, Pose(), cube, X_WB, 0);
    EXPECT_EQ(exact.separation->value, separation);
    EXPECT_LE(exact.separation->bound, 0x1p-51 * std::abs(separation));
    const Answer answer = Query(cube, Pose(), cube, X_WB);
    EXPECT_NEAR(answer.separation->value, separation, 1e-11);
    EXPECT_TRUE(check.Verify(cube, Pose(), cube, X_WB));
    EXPECT_TRUE(check.Verify(cube, Pose(), cube, X_WB, 0));
  }
}

TEST(Separation, EmptyHullsAreInfinitelyFar) {
  const Hull cube = BuildHull(LatticeCube(2, 1));
  QueryOptions options = WantSeparation();
  options.clearance = kInfinity;
  const Answer answer = CheckCollision(cube, Pose(), Hull(), Pose(), options).value();
  EXPECT_EQ(answer.separation->value, kInfinity);
  EXPECT_FALSE(answer.witness.has_value());
  EXPECT_EQ(answer.within_clearance, false);
}

TEST(Separation, OutOfRangeValuesSaturate) {
  const Hull far_left = BuildHull(std::vector<Vector>{{-kLargest, 0, 0}, {-kLargest, 1, 0}});
  const Hull far_right = BuildHull(std::vector<Vector>{{kLargest, 0, 0}});
  const Answer far = Query(far_left, Pose(), far_right, Pose());
  EXPECT_EQ(far.separation->value, kLargest);
  EXPECT_EQ(far.separation->bound, kInfinity);
  const Hull slab = BuildHull(std::vector<Vector>{{-kLargest, -kLargest, -kLargest},
                                                  {kLargest, -kLargest, -kLargest},
                                                  {0, kLargest, -kLargest},
                                                  {0, 0, kLargest}});
  const Answer deep = Query(slab, Pose(), slab, Pose());
  EXPECT_EQ(deep.relation, Relation::kOverlapping);
  EXPECT_LT(deep.separation->value, -1e308);
  EXPECT_GT(deep.separation->bound, 0);
}

TEST(Separation, TheSmallestDoubleKeepsItsSign) {
  const Hull point = BuildHull(std::vector<Vector>{{0, 0, 0}});
  const Answer near = Query(point, Pose(), point, At(kLeast, 0, 0));
  EXPECT_EQ(near.separation->value, kLeast);
  // Rotated, it is a third of that along each axis; a length that no double represents.
  const Hull needle = BuildHull(std::vector<Vector>{{0, 0, 0}, {1, 1, 1}});
  Pose turned;
  turned.q = {1, 0.3, 0.2, 0.1};
  const Answer tiny = Query(needle, turned, point, At(kLeast, 0, 0), 0);
  EXPECT_EQ(tiny.relation, Relation::kSeparated);
  EXPECT_EQ(tiny.separation->value, kLeast);
  EXPECT_GT(tiny.separation->bound, 0);
}

std::vector<Vector> SmallSet(Random& random, int most) {
  return random.Below(2) ? RandomLatticePoints(random, random.Between(1, most), 4)
                         : RandomFlatPoints(random, random.Between(1, most), random.Below(4));
}

// Half of the pairs share a pose and a vertex: touching, or overlapping if B reaches into A.
TEST(Separation, SmallHullsOfEveryDimensionMatchBruteForce) {
  const uint64_t seed = TestSeed(711);
  Random random(seed);
  SeparationCheck check;
  for (int round = 0; round < kRounds; ++round) {
    const double scale = std::array{1e-300, 1e-30, 1.0, 1.0, 1.0, 1e30, 1e290}[random.Below(7)];
    const Vector middle = Vector::Constant(-1.5);
    const std::vector<Vector> first = Shifted(SmallSet(random, 6), middle);
    std::vector<Vector> second = Shifted(SmallSet(random, 6), middle);
    const Pose X_WA = RandomPose(random, scale);
    Pose X_WB = X_WA;
    if (random.Below(2)) {
      second = Shifted(second, first[random.Below(first.size())] - second[0]);
    } else {
      X_WB = RandomPose(random, scale);
    }
    const Hull a = BuildHull(Scaled(first, scale));
    const Hull b = BuildHull(Scaled(second, scale));
    std::optional<double> max_error;
    if (random.Below(3) == 0) max_error = random.Below(2) ? 0 : 1e-3 * scale;
    ASSERT_TRUE(check.Verify(a, X_WA, b, X_WB, max_error)) << "seed " << seed << " round " << round;
  }
  for (const Relation r : {Relation::kSeparated, Relation::kTouching, Relation::kOverlapping}) {
    EXPECT_GT(check.count(r), kRounds / 40) << Name(r);
  }
  EXPECT_GT(check.exact_count(), kRounds / 5);
  EXPECT_GT(check.float_count(), kRounds / 20);
}

// Needles, plates, and offsets in the poses and in the hulls' own frames, which only exact
// arithmetic handles.
TEST(Separation, NeedlesPlatesAndOffsetsMatchBruteForce) {
  const uint64_t seed = TestSeed(712);
  Random random(seed);
  SeparationCheck check;
  for (int round = 0; round < kRounds / 2; ++round) {
    const double local = std::array{0.0, 0.0, 1e6, 1e15}[random.Below(4)];
    const auto points = [&] {
      std::vector<Vector> set = RandomInCube(random, random.Between(2, 6), 1);
      const Vector stretch(1, std::pow(10.0, random.Between(-9, 0)),
                           std::pow(10.0, random.Between(-9, 0)));
      for (Vector& p : set) p = p.cwiseProduct(stretch);
      return Shifted(set, Vector(local, -local, 0));
    };
    Pose X_WA = RandomPose(random, 1);
    Pose X_WB = random.Below(2) ? X_WA : RandomPose(random, 1);
    const Vector offset = Vector::Constant(std::array{0.0, 1e6, 1e15}[random.Below(3)]);
    X_WA.t += offset;
    X_WB.t += offset;
    ASSERT_TRUE(check.Verify(BuildHull(points()), X_WA, BuildHull(points()), X_WB))
        << "seed " << seed << " round " << round;
  }
  EXPECT_GT(check.count(Relation::kSeparated), kRounds / 40);
  EXPECT_GT(check.count(Relation::kOverlapping), kRounds / 240);
  EXPECT_GT(check.exact_count(), kRounds / 120);
  EXPECT_GT(check.float_count(), kRounds / 120);
}

// True if two answers to one query can both be right.
testing::AssertionResult Agree(const Separation& a, const Separation& b) {
  if (std::abs(a.value - b.value) <= a.bound + b.bound) return testing::AssertionSuccess();
  return testing::AssertionFailure()
         << a.value << " +- " << a.bound << ", " << b.value << " +- " << b.bound;
}

// Hulls too large for brute force: floating point against the exact walk, which the tests above
// check.
TEST(Separation, FloatingPointAgreesWithExactArithmeticOnLargerHulls) {
  const uint64_t seed = TestSeed(713);
  Random random(seed);
  int overlapping = 0;
  int in_floating_point = 0;
  for (int round = 0; round < kLargeRounds; ++round) {
    const int n = std::array{16, 64, 300}[round % 3];
    const Hull a = BuildHull(round % 2 ? RandomOnSphere(random, n, 1) : RandomInCube(random, n, 1));
    const Hull b = BuildHull(RandomInBall(random, n, 1));
    const Pose X_WA = RandomPose(random, 0.1);
    const Pose X_WB = RandomPose(random, random.Below(2) ? 0.9 : 4);
    const Answer rough = Query(a, X_WA, b, X_WB);
    const Answer exact = Query(a, X_WA, b, X_WB, 0);
    EXPECT_TRUE(Agree(*rough.separation, *exact.separation))
        << "seed " << seed << " round " << round;
    EXPECT_LE(rough.separation->bound, 1e-12 * (4 + std::abs(rough.separation->value)));
    EXPECT_LE(exact.separation->bound, 0x1p-51 * std::abs(exact.separation->value));
    const double apart = (rough.witness->p_WA - rough.witness->p_WB).norm();
    EXPECT_NEAR(apart, std::abs(exact.separation->value), 1e-11);
    overlapping += rough.relation == Relation::kOverlapping;
    in_floating_point += rough.separation->bound > exact.separation->bound;
  }
  EXPECT_GT(overlapping, kLargeRounds / 5);
  EXPECT_GE(in_floating_point, kLargeRounds - 1);
}

TEST(Separation, ACacheChangesNeitherValueNorBound) {
  const uint64_t seed = TestSeed(714);
  Random random(seed);
  int cached = 0;
  for (int round = 0; round < kLargeRounds; ++round) {
    const Hull hulls[2] = {BuildHull(RandomInBall(random, 60, 1)),
                           BuildHull(RandomInBall(random, 60, 1))};
    const QueryHull a(hulls[0]);
    const QueryHull b(hulls[1]);
    const PlacedHull placed_a = PlacedHull::Make(a, RandomPose(random, 0.1)).value();
    Pose X_WB = RandomPose(random, 1.2);
    PairCache cache;
    for (int step = 0; step < 5; ++step) {
      X_WB.t.x() += 0.01;
      const PlacedHull placed_b = PlacedHull::Make(b, X_WB).value();
      const Answer warm = CheckCollision(placed_a, placed_b, WantSeparation(), &cache).value();
      const Answer cold = CheckCollision(placed_a, placed_b, WantSeparation()).value();
      EXPECT_EQ(warm.separation->value, cold.separation->value);
      EXPECT_EQ(warm.separation->bound, cold.separation->bound);
      cached += warm.rung == Rung::kCached;
    }
  }
  EXPECT_GT(cached, kLargeRounds);
}

// SmallHullsOfEveryDimensionMatchBruteForce checks the errors.
TEST(Separation, AContactPointNeedsExactArithmeticOnlyIfItsErrorMustBeLeast) {
  const Hull cube = BuildHull(LatticeCube(2, 1));
  const Hull wedge = BuildHull(std::vector<Vector>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  SeparationCheck check;
  for (const Hull* b : {&cube, &wedge}) {
    // On a face, on an edge, and at a corner; in a body's frame and far from it.
    for (const Vector& t : {Vector(0.25, 0.125, 1), Vector(-0.375, 1, 1), Vector(1, 1, 1)}) {
      for (const Vector& far : {Vector(0, 0, 0), Vector(-1000, 3, 0.5)}) {
        Pose X_WA;
        X_WA.q = {1, 2, 0, 0};
        X_WA.t = far;
        Pose X_WB = X_WA;
        // A rotation by 2 atan(2) about x, exactly.
        X_WB.t += Vector(t.x(), -0.6 * t.y() - 0.8 * t.z(), 0.8 * t.y() - 0.6 * t.z());
        EXPECT_TRUE(check.Verify(cube, X_WA, *b, X_WB));
        const Pose unrotated = At(far.x() + t.x(), far.y() + t.y(), far.z() + t.z());
        const Pose origin = At(far.x(), far.y(), far.z());
        EXPECT_TRUE(check.Verify(cube, origin, *b, unrotated));
        const Answer answer = Query(cube, origin, *b, unrotated);
        const Answer exact = Query(cube, origin, *b, unrotated, 0);
        ASSERT_EQ(answer.relation, Relation::kTouching);
        EXPECT_EQ(answer.witness->p_WA, answer.witness->p_WB);
        EXPECT_GT(answer.witness->error, exact.witness->error);
        EXPECT_LE(answer.witness->error, 4e-12);
      }
    }
  }
}

TEST(Separation, TheTextbookMethodReturnsTheSame) {
  const Hull cube = BuildHull(LatticeCube(2, 1));
  QueryOptions textbook = WantSeparation();
  textbook.method = Method::kTextbookSat;
  for (const double x : {0.3, 1.0, 1.7}) {
    const Answer expected = Query(cube, Pose(), cube, At(x, 0.1, 0));
    const Answer answer = CheckCollision(cube, Pose(), cube, At(x, 0.1, 0), textbook).value();
    EXPECT_EQ(answer.separation->value, expected.separation->value);
    EXPECT_EQ(answer.witness->p_WB, expected.witness->p_WB);
  }
}

TEST(Separation, MeaninglessOptionsAreRefused) {
  const Hull cube = BuildHull(LatticeCube(2, 1));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto message = [&](auto change) {
    QueryOptions options;
    change(options);
    const absl::Status status = CheckCollision(cube, Pose(), cube, Pose(), options).status();
    return status.code() == absl::StatusCode::kInvalidArgument ? std::string(status.message())
                                                               : status.ToString();
  };
  EXPECT_EQ(message([&](QueryOptions& o) { o.tolerance = nan; }),
            "tolerance is NaN; it must be a length of at least 0");
  EXPECT_EQ(message([&](QueryOptions& o) { o.tolerance = -1; }),
            "tolerance is -1; it must be a length of at least 0");
  EXPECT_EQ(message([&](QueryOptions& o) { o.max_error = nan; }),
            "max_error is NaN; it must be a length of at least 0");
  EXPECT_EQ(message([&](QueryOptions& o) { o.max_error = -0.5; }),
            "max_error is -0.5; it must be a length of at least 0");
  EXPECT_EQ(message([&](QueryOptions& o) { o.clearance = nan; }), "clearance is NaN");
  const auto with_tolerance = [&](auto change) {
    return message([&](QueryOptions& o) {
      o.tolerance = 1;
      change(o);
    });
  };
  const std::string start = "tolerance is 1, but ";
  const std::string rest = " needs the exact relation; omit one of them";
  EXPECT_EQ(with_tolerance([](QueryOptions& o) { o.want_separation = true; }),
            start + "want_separation" + rest);
  EXPECT_EQ(with_tolerance([](QueryOptions& o) { o.want_certificate = true; }),
            start + "want_certificate" + rest);
  EXPECT_EQ(with_tolerance([](QueryOptions& o) { o.clearance = 0; }), start + "clearance" + rest);
  EXPECT_EQ(with_tolerance([](QueryOptions& o) { o.method = Method::kTextbookSat; }),
            start + "the textbook method" + rest);
  EXPECT_EQ(message([](QueryOptions& o) { o.max_error = kInfinity; }), "OK");
}

// A disc pierced at its center: all sides of the difference are equally near, so the search for the
// depth visits all of them.
class PiercedDisc : public testing::Test {
 protected:
  static constexpr int kCorners = 2048;

  static Hull Disc() {
    std::vector<Vector> points;
    for (int i = 0; i < kCorners; ++i) {
      const double angle = 2 * M_PI * i / kCorners;
      points.emplace_back(std::cos(angle), std::sin(angle), 0);
    }
    return BuildHull(points);
  }

  absl::StatusOr<Answer> Query(const QueryOptions& options) const {
    return CheckCollision(disc_, Pose(), needle_, Pose(), options);
  }

  const Hull disc_ = Disc();
  const Hull needle_ = BuildHull(std::vector<Vector>{Vector(0, 0, -2), Vector(0, 0, 2)});
};

TEST_F(PiercedDisc, TheSearchForItsDepthPollsOften) {
  uint64_t polls = 0;
  uint64_t most = UINT64_MAX;
  QueryOptions options = WantSeparation(0);
  options.should_stop = [&] { return ++polls >= most; };
  const absl::StatusOr<Answer> answer = Query(options);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_NEAR(answer->separation->value, -1, 1e-5);
  // The exact search polls at each corner, and so often that a stop may come anywhere in it.
  EXPECT_GT(polls, kCorners);
  const uint64_t all = polls;
  for (most = 1; most < all; most *= 2) {
    polls = 0;
    EXPECT_TRUE(absl::IsCancelled(Query(options).status()));
    EXPECT_EQ(polls, most);
  }
}

TEST_F(PiercedDisc, TheSearchForItsDepthStaysWithinItsMemoryLimit) {
  QueryOptions options = WantSeparation(0);
  options.max_depth_bytes = 100 << 20;
  EXPECT_TRUE(Query(options).ok());
  options.max_depth_bytes = 1 << 20;
  const absl::Status refused = Query(options).status();
  EXPECT_TRUE(absl::IsResourceExhausted(refused));
  EXPECT_TRUE(IsDepthTooLarge(refused));
  EXPECT_NE(refused.message().find("more than 1048576 bytes"), std::string::npos) << refused;
  // Floating point needs little.
  options.max_error = 1e-6;
  EXPECT_TRUE(Query(options).ok());
}

}  // namespace separation_test
}  // namespace hulld
