#include "core/query/terms/pose_product.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/numeric/error_bounds.h"
#include "core/query/collision.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/terms/motion.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/query/body/rational_world.h"
#include "tests/test_size.h"

namespace hulld {
namespace pose_product_test {

Pose RandomPose(Random& random, double length) {
  Pose pose;
  for (double& component : pose.q) component = random.Real(-1, 1);
  for (int i = 0; i < 3; ++i) pose.t[i] = random.Real(-length, length);
  return pose;
}

// Integers, so that contact is frequent and exact.
Pose LatticePose(Random& random) {
  Pose pose;
  do {
    for (double& component : pose.q) component = random.Between(-2, 2);
  } while (pose.q == std::array<double, 4>{0, 0, 0, 0});
  for (int i = 0; i < 3; ++i) pose.t[i] = random.Between(-1, 1);
  return pose;
}

Relation RelationOf(const Hull& a, const PoseChain& X_WA, const Hull& b, const PoseChain& X_WB,
                    Rung* rung = nullptr) {
  const QueryHull query_a(a);
  const QueryHull query_b(b);
  const PoseProduct product_a(X_WA[0], X_WA[1]);
  const PoseProduct product_b(X_WB[0], X_WB[1]);
  const PlacedHull placed_a(query_a, product_a);
  const PlacedHull placed_b(query_b, product_b);
  const absl::StatusOr<Answer> answer = CheckCollision(placed_a, placed_b, QueryOptions());
  const absl::StatusOr<Answer> mirrored = CheckCollision(placed_b, placed_a, QueryOptions());
  EXPECT_TRUE(answer.ok() && mirrored.ok());
  EXPECT_EQ(answer->relation, mirrored->relation);
  EXPECT_EQ(answer->rung, mirrored->rung);
  // Results that need the exact pair agree.
  QueryOptions everything;
  everything.want_axis = true;
  everything.want_separation = true;
  everything.want_witness = true;
  const absl::StatusOr<Answer> full = CheckCollision(placed_a, placed_b, everything);
  EXPECT_TRUE(full.ok());
  EXPECT_EQ(full->relation, answer->relation);
  if (rung != nullptr) *rung = answer->rung;
  return answer->relation;
}

TEST(PoseProduct, RoundsWithinItsBounds) {
  Random random(TestSeed(1));
  const Hull cube = BuildHull(LatticeCube(2, 1));
  const QueryHull query_cube(cube);
  for (int round = 0; round < TestSize(300, 50); ++round) {
    Pose outer = RandomPose(random, std::ldexp(1.0, random.Between(-300, 300)));
    Pose inner = RandomPose(random, std::ldexp(1.0, random.Between(-300, 300)));
    if (round % 3 == 0) outer.q[random.Below(4)] *= std::ldexp(1.0, -random.Between(20, 900));
    if (round % 5 == 0) inner.q[random.Below(4)] *= std::ldexp(1.0, -random.Between(20, 900));
    if (round % 7 == 0) outer.q = {std::ldexp(1.0, random.Between(-900, 900)), 0, 0, 0};
    if (round % 11 == 0) inner.q = {random.Real(1, 2), 0, 0, 0};
    if (round % 13 == 0) inner.t = Vector(0, 5e-324, -0x1p-1060);
    const PoseProduct product(outer, inner);
    const PlacedHull placed(query_cube, product);
    const RationalPoint t = Placed({outer, inner}, RationalPoint{0, 0, 0});
    for (int i = 0; i < 3; ++i) {
      const Rational error =
          t[i] - Rational(product.rounded().t[i]) - Rational(product.translation_rest()[i]);
      EXPECT_LE(abs(error), Rational(product.translation_error())) << round;
    }
    for (int j = 0; j < 3; ++j) {
      RationalPoint unit = {0, 0, 0};
      unit[j] = 1;
      const RationalPoint column = Placed({outer, inner}, unit);
      for (int i = 0; i < 3; ++i) {
        const Rational error = column[i] - t[i] - Rational(placed.R_WH()(i, j));
        EXPECT_LE(abs(error), Rational(kRotationEntryError)) << round;
      }
    }
  }
}

TEST(PoseProduct, TimesOfAMotionRoundWithinTheirBounds) {
  Random random(TestSeed(7));
  const Hull cube = BuildHull(LatticeCube(2, 1));
  const QueryHull query_cube(cube);
  int finite = 0;
  for (int round = 0; round < TestSize(300, 60); ++round) {
    SCOPED_TRACE(round);
    const double length = std::ldexp(1.0, random.Between(-300, 300));
    Motion motion = {RandomPose(random, length), RandomPose(random, length)};
    Pose inner = RandomPose(random, std::ldexp(1.0, random.Between(-300, 300)));
    double time = random.Unit();
    // Opposite but for one component, so that the rotation nearly vanishes at half time.
    if (round % 3 == 0) {
      for (int i = 0; i < 4; ++i) motion.end.q[i] = -motion.start.q[i];
      motion.end.q[random.Below(4)] += std::ldexp(random.Real(0.5, 1), -random.Between(1, 60));
      time = 0.5;
    }
    if (round % 5 == 0) motion.end.q[random.Below(4)] *= std::ldexp(1.0, random.Between(-900, 900));
    if (round % 7 == 0) inner.q = {-2, 0, 0, 0};
    if (round % 11 == 0) inner.t = Vector::Zero();
    if (round % 13 == 0) inner.q[random.Below(4)] *= 0x1p-300;
    if (round % 17 == 0) time = random.Real(0, 0x1p-60);
    if (!ValidateMotion(motion).ok()) continue;
    const PoseProduct product(motion, time, inner);
    const Rational t(time);
    std::array<Rational, 4> q;
    for (int i = 0; i < 4; ++i) {
      q[i] = (1 - t) * Rational(motion.start.q[i]) + t * Rational(motion.end.q[i]);
    }
    const std::array<RationalPoint, 3> outer = RationalRotation(q);
    const std::array<RationalPoint, 3> turn = RationalRotation(inner.q);
    const PlacedHull placed(query_cube, product);
    const auto turned = [&](int i, const RationalPoint& p) {
      return outer[i][0] * p[0] + outer[i][1] * p[1] + outer[i][2] * p[2];
    };
    finite += std::isfinite(product.translation_error()) ? 1 : 0;
    for (int i = 0; i < 3; ++i) {
      if (std::isfinite(product.translation_error())) {
        const Rational x = (1 - t) * Rational(motion.start.t[i]) + t * Rational(motion.end.t[i]);
        const Rational error = x + turned(i, ToRational(inner.t)) -
                               Rational(product.rounded().t[i]) -
                               Rational(product.translation_rest()[i]);
        EXPECT_LE(abs(error), Rational(product.translation_error()));
      }
      for (int j = 0; j < 3; ++j) {
        const Rational entry = turned(i, {turn[0][j], turn[1][j], turn[2][j]});
        EXPECT_LE(abs(entry - Rational(placed.R_WH()(i, j))), Rational(kRotationEntryError));
      }
    }
  }
  EXPECT_GT(finite, 40);
}

TEST(PoseProduct, WithoutAPieceItEqualsThePoseOfTheBody) {
  Random random(TestSeed(2));
  const Pose pose = RandomPose(random, 10);
  const PoseProduct product(pose, Pose());
  EXPECT_EQ(product.rounded().q, pose.q);
  EXPECT_EQ(product.rounded().t, pose.t);
  EXPECT_EQ(product.translation_rest(), Vector(Vector::Zero()));
  EXPECT_EQ(product.translation_error(), 0);
}

TEST(PoseProduct, TwoTranslationsAddUpExactly) {
  Pose outer, inner;
  outer.t = Vector(1, 0x1p60, 3);
  inner.t = Vector(0x1p-70, 1, -3);
  const PoseProduct product(outer, inner);
  EXPECT_EQ(product.rounded().t, Vector(1, 0x1p60, 0));
  EXPECT_EQ(product.translation_rest(), Vector(0x1p-70, 1, 0));
  EXPECT_EQ(product.translation_error(), 0);
}

// Two cubes that share a face in the frame of a rotated body: in the world, doubles represent
// hardly any of their corners. The least step of a cube, far below the rounding of the product,
// separates them or makes them overlap.
TEST(PoseProduct, ContactIsThatOfTheUnroundedProduct) {
  Random random(TestSeed(3));
  const Hull cube = BuildHull(LatticeCube(2, 1));
  int steps = 0;
  for (int round = 0; round < 60; ++round) {
    const Pose body = RandomPose(random, round % 2 == 0 ? 10 : 1e9);
    Pose left, right;
    left.t = Vector(0.25, 1, 2);
    right.t = left.t + Vector(1, 0, 0);
    EXPECT_EQ(RelationOf(cube, {body, left}, cube, {body, right}), Relation::kTouching);
    right.t.x() = std::nextafter(1.25, 2);
    EXPECT_EQ(RelationOf(cube, {body, left}, cube, {body, right}), Relation::kSeparated);
    right.t.x() = std::nextafter(1.25, 0);
    EXPECT_EQ(RelationOf(cube, {body, left}, cube, {body, right}), Relation::kOverlapping);
    // In the world that step is lost.
    const PoseProduct product(body, right);
    right.t.x() = 1.25;
    if (round % 2 == 1 && product.rounded().t == PoseProduct(body, right).rounded().t) ++steps;
  }
  EXPECT_GT(steps, 20);
}

TEST(PoseProduct, RelationsAgreeWithRationalArithmetic) {
  Random random(TestSeed(4));
  std::array<int, 3> relations = {};
  std::array<int, kRungCount> rungs = {};
  for (int round = 0; round < 400; ++round) {
    const Hull a = BuildHull(RandomLatticePoints(random, random.Between(2, 8), 3));
    const Hull b = BuildHull(RandomLatticePoints(random, random.Between(2, 8), 3));
    const PoseChain X_WA = {LatticePose(random), LatticePose(random)};
    PoseChain X_WB = {LatticePose(random), LatticePose(random)};
    // In one frame contact is frequent.
    if (round % 8 != 0) X_WB[0] = X_WA[0];
    if (round % 4 != 0) X_WB[1].q = X_WA[1].q;
    Rung rung;
    const Relation relation = RelationOf(a, X_WA, b, X_WB, &rung);
    ASSERT_EQ(relation, RationalRelation(a, X_WA, b, X_WB)) << round;
    ++relations[static_cast<size_t>(relation)];
    ++rungs[static_cast<size_t>(rung)];
  }
  for (const int count : relations) EXPECT_GT(count, 10);
  EXPECT_GT(rungs[static_cast<size_t>(Rung::kExact)], 20);
  EXPECT_GT(rungs[static_cast<size_t>(Rung::kFloatingPoint)], 20);
}

// Quaternions of full and of widely spread bits, so that no narrow integers hold the product.
TEST(PoseProduct, WideProductsAreExactToo) {
  Random random(TestSeed(5));
  const Hull cube = BuildHull(LatticeCube(2, 1));
  for (int round = 0; round < 40; ++round) {
    Pose body = RandomPose(random, 4);
    Pose inner = RandomPose(random, 0);
    inner.t = Vector(0, 0, 0);
    if (round % 2 == 0) body.q[1] *= 0x1p-80;
    // Both pieces have one rotation: one cube stands on the other's face.
    Pose top = inner;
    const Hull shifted = BuildHull(Shifted(LatticeCube(2, 1), Vector(1, 0.5, 0)));
    ASSERT_EQ(RelationOf(cube, {body, inner}, shifted, {body, top}), Relation::kTouching);
    top.t = Vector(random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1));
    const Hull tetrahedron =
        BuildHull(std::vector<Vector>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
    ASSERT_EQ(RelationOf(tetrahedron, {body, inner}, tetrahedron, {body, top}),
              RationalRelation(tetrahedron, {body, inner}, tetrahedron, {body, top}));
  }
}

TEST(PoseProduct, ExtremesOfScaleAgreeWithRationalArithmetic) {
  Random random(TestSeed(6));
  const std::array<double, 8> scales = {0x1p-1060, 1e-300, 1e-150, 1e-20, 1, 1e20, 1e150, 1e307};
  for (int round = 0; round < TestSize(120, 20); ++round) {
    const double size_a = scales[random.Below(8)];
    const double size_b = scales[random.Below(8)];
    const auto a = BuildHull(Scaled(RandomLatticePoints(random, 5, 3), size_a / 4));
    const auto b = BuildHull(Scaled(RandomLatticePoints(random, 5, 3), size_b / 4));
    PoseChain X_WA = {LatticePose(random), LatticePose(random)};
    PoseChain X_WB = {LatticePose(random), LatticePose(random)};
    for (Pose* pose : {&X_WA[0], &X_WA[1], &X_WB[0], &X_WB[1]}) {
      pose->t *= scales[random.Below(8)] / 4;
      const double scale = scales[1 + random.Below(6)];
      for (double& component : pose->q) component *= scale;
    }
    if (round % 2 == 0) X_WB[0] = X_WA[0];
    ASSERT_EQ(RelationOf(a, X_WA, b, X_WB), RationalRelation(a, X_WA, b, X_WB)) << round;
  }
}

}  // namespace pose_product_test
}  // namespace hulld
