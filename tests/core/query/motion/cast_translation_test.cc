#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/query/floating/facet_entry.h"
#include "core/query/floating/path_cast.h"
#include "core/query/motion/pair_at.h"
#include "tests/core/query/motion/motion_check.h"
#include "tests/test_size.h"

namespace hulld {
namespace path_cast_test {

MotionOptions WithCertificate() {
  MotionOptions options;
  options.want_certificate = true;
  return options;
}

// Counts of the outcomes of a sweep.
struct Counts {
  int separated = 0;
  int meeting = 0;
  // Decided by the cast or the entry alone.
  int by_cast = 0;
  int by_entry = 0;
};

// Checks that the cast and the entry do not contradict a proof in rationals.
void Check(const OwnMoving& a, const OwnMoving& b, Counts& counts) {
  const MovingHull moving_a = a.moving();
  const MovingHull moving_b = b.moving();
  const absl::StatusOr<FirstContact> proven =
      FindFirstContact(moving_a, moving_b, WithCertificate());
  ASSERT_TRUE(proven.ok());
  ASSERT_TRUE(ContactIsProven(a, b, *proven));
  const absl::StatusOr<FirstContact> quick = FindFirstContact(moving_a, moving_b);
  ASSERT_TRUE(quick.ok());
  EXPECT_EQ(quick->relation, proven->relation);
  EXPECT_EQ(quick->separated_until, proven->separated_until);
  EXPECT_EQ(quick->contact_time, proven->contact_time);
  const bool meets = proven->relation != Relation::kSeparated;
  ++(meets ? counts.meeting : counts.separated);

  const PairAt at_start(moving_a, moving_b, 0);
  const FloatPair& start = at_start.pair();
  const RelativePath path(start, moving_a.X_WB, moving_b.X_WB);
  if (!start.usable() || !IsFilterSize(path.size)) return;
  const PathCast cast = CastPath(start, path);
  EXPECT_LE(cast.separated_until, proven->separated_until);
  if (cast.outcome == PathCast::Outcome::kSeparated) {
    EXPECT_FALSE(meets);
    ++counts.by_cast;
  }
  if (cast.outcome != PathCast::Outcome::kFacet) return;
  const std::optional<BetweenTimes> entry =
      FindEntry(start, path, moving_a.X_WB, moving_b.X_WB, cast.facet);
  if (!entry) return;
  ++counts.by_entry;
  EXPECT_EQ(proven->relation, Relation::kOverlapping);
  EXPECT_EQ(entry->before, proven->separated_until);
  EXPECT_EQ(entry->after, proven->contact_time);
}

Motion Passing(Random& random, double reach) {
  Motion motion = {RandomPose(random, 0), {}};
  const std::vector<Vector> way = RandomOnSphere(random, 2, 1.5 * reach);
  motion.start.t = way[0];
  motion.end = {motion.start.q, Vector(random.Real(0.2, 2) * way[1] - way[0])};
  return motion;
}

TEST(PathCast, RandomPairsAgreeWithTheirProofs) {
  Random random(TestSeed(1));
  for (const int vertices : {4, 8, 14, 60}) {
    SCOPED_TRACE(vertices);
    Counts counts;
    for (int round = 0; round < TestSize(60, 20); ++round) {
      SCOPED_TRACE(round);
      const Pose X_WA = RandomPose(random, 0.5);
      const OwnMoving a(RandomOnSphere(random, vertices, 1), {X_WA, X_WA});
      const OwnMoving b(RandomOnSphere(random, vertices, 1), Passing(random, 2.5));
      Check(a, b, counts);
      if (HasFatalFailure()) return;
    }
    EXPECT_GT(counts.separated, TestSize(5, 1));
    EXPECT_GT(counts.meeting, TestSize(15, 4));
    // Few pairs need the exact steps.
    EXPECT_GE(counts.by_cast + 1, counts.separated);
    EXPECT_GE(counts.by_entry + 2, counts.meeting);
  }
}

TEST(PathCast, RandomRaysAgreeWithTheirProofs) {
  Random random(TestSeed(2));
  Counts counts;
  for (int round = 0; round < 200; ++round) {
    SCOPED_TRACE(round);
    const Pose X_WA = RandomPose(random, 0.5);
    const OwnMoving a(RandomOnSphere(random, 30, 1), {X_WA, X_WA});
    Motion ray = Passing(random, 1.5);
    ray.start.q = ray.end.q = {1, 0, 0, 0};
    Check(a, OwnMoving({{0, 0, 0}}, ray), counts);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(counts.separated, 20);
  EXPECT_GT(counts.meeting, 50);
  EXPECT_GE(counts.by_cast + 2, counts.separated);
  EXPECT_GE(counts.by_entry + 4, counts.meeting);
}

// Slivers, needles, and distant offsets: the bounds are wide compared with the shapes.
TEST(PathCast, IllShapedPairsAgreeWithTheirProofs) {
  Random random(TestSeed(3));
  Counts counts;
  for (int round = 0; round < 150; ++round) {
    SCOPED_TRACE(round);
    const double thin = std::ldexp(1.0, -random.Between(0, 60));
    const double scale = std::ldexp(1.0, random.Between(-250, 250));
    const auto shape = [&](int count) {
      std::vector<Vector> points = RandomOnSphere(random, count, scale);
      for (Vector& p : points) p.z() *= thin;
      return points;
    };
    Pose X_WA = RandomPose(random, 0.1);
    X_WA.t *= scale;
    Motion motion = Passing(random, 2);
    motion.start.t *= scale;
    motion.end.t *= scale;
    if (round % 3 == 0) {
      const Vector far = scale * std::ldexp(1.0, random.Between(10, 50)) * Vector(1, -2, 1);
      X_WA.t += far;
      motion.start.t += far;
      motion.end.t += far;
    }
    // Common rotations make faces and edges parallel.
    if (round % 2 == 0) motion.start.q = motion.end.q = X_WA.q;
    Check(OwnMoving(shape(10), {X_WA, X_WA}), OwnMoving(shape(6), motion), counts);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(counts.separated, 10);
  EXPECT_GT(counts.meeting, 30);
  EXPECT_GT(counts.by_entry, 10);
}

// Paths that enter boxes through the middle of a face, across its diagonal, edge, or corner.
TEST(PathCast, SymmetricBoxesAgreeWithTheirProofs) {
  Random random(TestSeed(4));
  std::vector<Vector> cube;
  for (int i = 0; i < 8; ++i) {
    cube.push_back({i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0});
  }
  Counts counts;
  for (int round = 0; round < 120; ++round) {
    SCOPED_TRACE(round);
    Motion motion;
    motion.start.t = 3 * LatticeVector(random, 1) + LatticeVector(random, 2);
    motion.end.t = -motion.start.t + LatticeVector(random, round % 3 == 0 ? 6 : round % 3);
    const std::vector<Vector> point = {{0, 0, 0}};
    Check(OwnMoving(cube, {}), OwnMoving(round % 2 == 0 ? cube : point, motion), counts);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(counts.separated, 3);
  EXPECT_GT(counts.meeting, 50);
}

}  // namespace path_cast_test
}  // namespace hulld
