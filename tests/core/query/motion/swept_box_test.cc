#include "core/query/motion/swept_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/query/scene/scene.h"
#include "tests/core/query/motion/motion_check.h"
#include "tests/test_size.h"

namespace hulld {
namespace swept_box_test {

using oracle::Rational;

// Returns -1 if the boxes are disjoint at each time up to `until`, 0 if they meet at one time only,
// and 1 otherwise. Computed in rationals.
int BruteForceMeeting(const MovingBox& a, const MovingBox& b, double until = 1) {
  Rational begin = 0;
  Rational end(until);
  for (int axis = 0; axis < 3; ++axis) {
    for (const auto& [upper, lower] : {std::pair(&a, &b), std::pair(&b, &a)}) {
      const Rational first = Rational(upper->start.high[axis]) - Rational(lower->start.low[axis]);
      const Rational last = Rational(upper->end.high[axis]) - Rational(lower->end.low[axis]);
      if (first < 0 && last < 0) return -1;
      if (first < 0) begin = std::max(begin, Rational(first / (first - last)));
      if (last < 0) end = std::min(end, Rational(first / (first - last)));
    }
  }
  return begin > end ? -1 : begin == end ? 0 : 1;
}

MovingBox PointInMotion(const Vector& from, const Vector& to) { return {{from, from}, {to, to}}; }

struct Counts {
  int apart = 0;
  int touching = 0;
  int needless = 0;
  // Times before the boxes meet.
  int later = 0;
};

void Check(const MovingBox& a, const MovingBox& b, Counts& counts) {
  const int expected = BruteForceMeeting(a, b);
  EXPECT_EQ(MayMeet(a, b), MayMeet(b, a));
  if (expected >= 0) {
    EXPECT_TRUE(MayMeet(a, b));
  }
  for (const double until : {0.0, 0.25, 0.5, 0.75}) {
    const int early = BruteForceMeeting(a, b, until);
    if (early >= 0) {
      EXPECT_TRUE(MayMeet(a, b, until)) << until;
    }
    counts.later += expected >= 0 && early < 0 && !MayMeet(a, b, until);
  }
  counts.touching += expected == 0;
  counts.apart += expected < 0;
  counts.needless += expected < 0 && MayMeet(a, b);
}

// Rays through corners and edges of boxes, along faces, and just next to them, at any scale. Thirds
// force rounding in every difference.
TEST(SweptBox, NoPairThatMeetsIsDropped) {
  Random random(TestSeed(1));
  for (const double scale : {0x1p-1070, 1e-300, 1e-100, 1 / 3.0, 1.0, 1e100, 1e300, 0x1p1019}) {
    SCOPED_TRACE(scale);
    Counts counts;
    for (int round = 0; round < TestSize(3000, 300); ++round) {
      const Vector low = scale * LatticeVector(random, 3);
      const Vector size = scale * LatticeVector(random, 2).cwiseAbs();
      const MovingBox box = {{low, low + size}, {low, low + size}};
      // Aims at a corner, an edge, or a face.
      Vector target;
      for (int axis = 0; axis < 3; ++axis) {
        target[axis] = low[axis] + size[axis] * random.Below(3) / 2;
      }
      if (round % 3 == 1) target += scale * LatticeVector(random, 1);
      const Vector step = scale * LatticeVector(random, 3);
      Vector from = target - step;
      Vector to = target + step * random.Below(3);
      if (round % 3 == 0) {
        const int axis = random.Below(3);
        from[axis] = std::nextafter(from[axis], random.Below(2) == 0 ? -kInfinity : kInfinity);
      }
      Check(PointInMotion(from, to), box, counts);
      // Both move.
      const Vector shift = scale * LatticeVector(random, 2);
      Check(PointInMotion(from, to + shift),
            {box.start, {box.end.low + shift, box.end.high + shift}}, counts);
    }
    EXPECT_GT(counts.apart, TestSize(100, 10));
    EXPECT_GT(counts.touching, TestSize(50, 5));
    EXPECT_GT(counts.later, TestSize(100, 10));
    EXPECT_LT(counts.needless, counts.apart / 2);
  }
}

TEST(SweptBox, ExtremesOfRangeAreKept) {
  constexpr double kLargest = std::numeric_limits<double>::max();
  const MovingBox all = {Box::All(), Box::All()};
  const MovingBox none = {Box::Empty(), Box::Empty()};
  const MovingBox ray = PointInMotion(Vector::Constant(-kLargest), Vector(kLargest, kLargest, 0));
  EXPECT_TRUE(MayMeet(ray, all));
  EXPECT_TRUE(MayMeet(all, all));
  EXPECT_TRUE(
      MayMeet(ray, PointInMotion(Vector(0, 0, -kLargest / 2), Vector(0, 0, -kLargest / 2))));
  EXPECT_FALSE(MayMeet(ray, none));
  EXPECT_FALSE(MayMeet(none, all));
  EXPECT_FALSE(MayMeet(none, none));
}

TEST(SweptBox, ObliqueRaysPassBoxesWithinTheBoxAroundThem) {
  const MovingBox ray = PointInMotion({0, 0, 0}, {10, 10, 10});
  const Box beside = {Vector(1, 8, 1), Vector(2, 9, 2)};
  EXPECT_TRUE(ray.Around().Meets(beside));
  EXPECT_FALSE(MayMeet(ray, {beside, beside}));
  EXPECT_TRUE(
      MayMeet(ray, {{Vector(1, 1, 1), Vector(2, 9, 2)}, {Vector(1, 1, 1), Vector(2, 9, 2)}}));
}

TEST(SweptBox, TurningHullsAreCandidatesOnlyWhileTheyMayMeet) {
  Random random(TestSeed(3));
  int met = 0;
  int later = 0;
  int apart = 0;
  for (int round = 0; round < 300; ++round) {
    SCOPED_TRACE(round);
    const OwnMoving a(RandomInBall(random, 5, 1), {RandomPose(random, 4), RandomPose(random, 4)});
    const OwnMoving b(RandomInBall(random, 5, 1), {RandomPose(random, 4), RandomPose(random, 4)});
    const MovingBox box_a = MovingBoxOf(a.moving());
    const MovingBox box_b = MovingBoxOf(b.moving());
    const absl::StatusOr<FirstContact> contact = FindFirstContact(a.moving(), b.moving());
    ASSERT_TRUE(contact.ok()) << contact.status();
    if (contact->contact_time) {
      ++met;
      EXPECT_TRUE(MayMeet(box_a, box_b, *contact->contact_time));
      later += !MayMeet(box_a, box_b, contact->separated_until / 2);
    } else {
      apart += box_a.Around().Meets(box_b.Around()) && !MayMeet(box_a, box_b);
    }
  }
  EXPECT_GT(met, 10);
  EXPECT_GT(later, 5);
  EXPECT_GT(apart, 20);
}

// A scene of moving points and hulls: the candidates are all pairs that meet, and few others.
TEST(SweptBox, ScenesInMotionMissNoContact) {
  Random random(TestSeed(2));
  std::vector<OwnMoving> movings;
  constexpr int kRays = 60;
  constexpr int kHulls = 60;
  for (int i = 0; i < kRays + kHulls; ++i) {
    const Vector from = LatticeVector(random, 6);
    if (i < kRays) {
      movings.emplace_back(std::vector<Vector>{{0, 0, 0}},
                           Motion{{{1, 0, 0, 0}, from}, {{1, 0, 0, 0}, LatticeVector(random, 6)}});
    } else {
      Motion motion = {RandomPose(random, 0), {}};
      motion.start.t = from;
      motion.end = motion.start;
      if (i % 3 == 0) motion.end.t = LatticeVector(random, 6);
      if (i % 5 == 0) motion.end.q = {1, 0, 0.5, 0};
      movings.emplace_back(RandomLatticePoints(random, random.Between(1, 8), 2), motion);
    }
  }
  std::vector<PlacedHull> placed;
  std::vector<MovingBox> boxes;
  std::vector<uint32_t> groups;
  for (int i = 0; i < kRays + kHulls; ++i) {
    const MovingHull moving = movings[i].moving();
    placed.emplace_back(moving.hull, moving.X_WB.start);
    boxes.push_back(MovingBoxOf(moving));
    groups.push_back(i < kRays ? 0 : 1);
  }
  const std::vector<GroupPair> ignored = {{0, 0}};
  for (const bool with_groups : {false, true}) {
    SceneOptions options;
    if (with_groups) {
      options.groups = groups;
      options.ignored_groups = ignored;
    }
    const absl::StatusOr<SceneSearch> scene = SceneSearch::Make(placed, options, boxes);
    ASSERT_TRUE(scene.ok()) << scene.status();
    int candidates = 0;
    int around = 0;
    int meetings = 0;
    for (uint32_t a = 0; a < scene->size(); ++a) {
      SceneCandidates gathered;
      gathered.Start(*scene, a);
      while (!gathered.Gather(3)) {
      }
      std::vector<uint32_t> found;
      while (const std::optional<uint32_t> b = gathered.Next()) found.push_back(*b);
      EXPECT_TRUE(std::ranges::is_sorted(found));
      candidates += static_cast<int>(found.size());
      for (uint32_t b = a + 1; b < placed.size(); ++b) {
        if (with_groups && b < kRays) continue;
        around += boxes[a].Around().Meets(boxes[b].Around());
        const absl::StatusOr<FirstContact> contact =
            FindFirstContact(movings[a].moving(), movings[b].moving());
        ASSERT_TRUE(contact.ok());
        if (contact->relation == Relation::kSeparated) continue;
        ++meetings;
        EXPECT_TRUE(std::ranges::binary_search(found, b)) << a << " and " << b;
      }
    }
    EXPECT_GT(meetings, 20);
    EXPECT_LT(3 * candidates, 2 * around);
  }
}

}  // namespace swept_box_test
}  // namespace hulld
