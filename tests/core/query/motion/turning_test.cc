#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/query/motion/first_contact.h"
#include "core/query/motion/pair_at.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/query/motion/motion_check.h"
#include "tests/test_size.h"

namespace hulld {
namespace turning_test {

using oracle::Rational;

std::vector<Vector> Box(double x, double y, double z) {
  std::vector<Vector> corners;
  for (int i = 0; i < 8; ++i) corners.push_back({i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z});
  return corners;
}

Motion AtRest(const Vector& t = Vector::Zero()) { return {{{1, 0, 0, 0}, t}, {{1, 0, 0, 0}, t}}; }

// Returns a turn about z from 0 to an angle.
Motion Spinning(double angle, const Vector& from, const Vector& to) {
  return {{{1, 0, 0, 0}, from}, {{std::cos(angle / 2), 0, 0, std::sin(angle / 2)}, to}};
}

FirstContact Find(const OwnMoving& a, const OwnMoving& b, MotionOptions options = {}) {
  options.want_certificate = true;
  absl::StatusOr<FirstContact> contact = FindFirstContact(a.moving(), b.moving(), options);
  EXPECT_TRUE(contact.ok()) << contact.status();
  if (!contact.ok()) return FirstContact();
  EXPECT_TRUE(ContactIsProven(a, b, *contact));
  const absl::StatusOr<FirstContact> mirrored = FindFirstContact(b.moving(), a.moving(), options);
  EXPECT_TRUE(mirrored.ok());
  EXPECT_EQ(mirrored->relation, contact->relation);
  EXPECT_EQ(mirrored->separated_until, contact->separated_until);
  EXPECT_EQ(mirrored->contact_time, contact->contact_time);
  if (contact->contact_time) {
    EXPECT_LE(Rational(*contact->contact_time) - Rational(contact->separated_until),
              Rational(options.max_time_error));
  }
  return *std::move(contact);
}

// Succeeds if no sample contradicts the answer, exactly: separated up to separated_until, or to the
// end if there is no contact.
testing::AssertionResult AgreesWithSamples(const OwnMoving& a, const OwnMoving& b,
                                           const FirstContact& contact, int samples) {
  for (int i = 0; i <= samples; ++i) {
    const Rational t(i, samples);
    if (contact.relation != Relation::kSeparated && t > Rational(contact.separated_until)) break;
    if (contact.contact_time == 0) break;
    if (oracle::RelationAt(a.ForOracle(), b.ForOracle(), t) != oracle::Relation::kSeparated) {
      return testing::AssertionFailure() << "contact at the sample " << t;
    }
  }
  return testing::AssertionSuccess();
}

// Returns the motion between two poses along the shorter of the two rotations.
Motion Between(const Pose& start, Pose end) {
  double dot = 0;
  for (int i = 0; i < 4; ++i) dot += start.q[i] * end.q[i];
  if (dot < 0) {
    for (double& component : end.q) component = -component;
  }
  return {start, end};
}

TEST(Turning, RandomMotionsAgreeWithSamples) {
  Random random(TestSeed(1));
  std::array<int, 4> relations = {};
  for (int round = 0; round < TestSize(60, 15); ++round) {
    SCOPED_TRACE(round);
    // Solid, so that contacts last longer than an instant.
    const OwnMoving a(RandomInBall(random, random.Between(4, 6), 1),
                      Between(RandomPose(random, 0.2), RandomPose(random, 1)));
    const OwnMoving b(RandomInBall(random, random.Between(1, 6), 1),
                      Between(RandomPose(random, 2.5), RandomPose(random, 2.5)));
    const FirstContact contact = Find(a, b);
    ASSERT_NE(contact.relation, Relation::kWithinTolerance);
    ASSERT_TRUE(AgreesWithSamples(a, b, contact, 16));
    ++relations[static_cast<size_t>(contact.relation)];
  }
  EXPECT_GT(relations[static_cast<size_t>(Relation::kSeparated)], TestSize(10, 0));
  EXPECT_GT(relations[static_cast<size_t>(Relation::kOverlapping)], TestSize(5, 0));
}

TEST(Turning, PiecesWithAPoseAgreeWithSamples) {
  Random random(TestSeed(3));
  std::array<int, 4> relations = {};
  for (int round = 0; round < TestSize(72, 18); ++round) {
    SCOPED_TRACE(round);
    const Pose X_AP = round % 4 == 0 ? Pose{{3, 0, 0, 0}, Vector(1, 0, 0)} : RandomPose(random, 1);
    const OwnMoving a(RandomInBall(random, random.Between(4, 6), 1),
                      Between(RandomPose(random, 0.2), RandomPose(random, 1)),
                      round % 5 == 4 ? 0.125 : 0, X_AP);
    const OwnMoving b(RandomInBall(random, random.Between(1, 6), 1),
                      Between(RandomPose(random, 2.5), RandomPose(random, 2.5)), 0,
                      round % 3 == 0 ? Pose() : RandomPose(random, 1));
    const FirstContact contact = Find(a, b);
    ASSERT_NE(contact.relation, Relation::kWithinTolerance);
    ASSERT_TRUE(AgreesWithSamples(a, b, contact, 16));
    ++relations[static_cast<size_t>(contact.relation)];
  }
  EXPECT_GT(relations[static_cast<size_t>(Relation::kSeparated)], TestSize(4, 0));
  EXPECT_GT(relations[static_cast<size_t>(Relation::kOverlapping)], TestSize(3, 0));
}

// A cube on an arm of length 5, which turns about the origin by 90 degrees, meets a wall at y = 4
// with the edge that is farthest along y.
TEST(Turning, APieceOnAnArmMeetsAWallOnTime) {
  const Motion quarter = {{{1, 0, 0, 0}, Vector::Zero()}, {{1, 0, 0, 1}, Vector::Zero()}};
  const OwnMoving arm(Box(1, 1, 1), quarter, 0, {{1, 0, 0, 1}, Vector(5, 0, 0)});
  const OwnMoving wall(Box(9, 1, 9), AtRest({0, 5, 0}));
  const FirstContact contact = Find(arm, wall);
  EXPECT_EQ(contact.relation, Relation::kOverlapping);
  // (6, 1) at the angle a: 6 sin a + cos a = 4; q(t) = (1, 0, 0, t) has tan(a / 2) = t.
  const double angle = std::asin(4 / std::sqrt(37.0)) - std::atan2(1, 6);
  EXPECT_NEAR(*contact.contact_time, std::tan(angle / 2), 1e-8);
  EXPECT_TRUE(AgreesWithSamples(arm, wall, contact, 64));
}

TEST(Turning, PairsAtATimeHaveTheExactRelation) {
  Random random(TestSeed(2));
  std::array<int, 3> relations = {};
  const auto lattice_pose = [&](int most) {
    Pose pose;
    for (double& component : pose.q) component = random.Between(0, 2);
    pose.q[0] += 1;
    for (int i = 0; i < 3; ++i) pose.t[i] = random.Between(-most, most);
    return pose;
  };
  for (int round = 0; round < 240; ++round) {
    SCOPED_TRACE(round);
    const OwnMoving a(RandomLatticePoints(random, 4, 3), {lattice_pose(1), lattice_pose(1)});
    const OwnMoving b(RandomLatticePoints(random, 4, 3), {lattice_pose(3), lattice_pose(3)}, 0,
                      round % 2 == 0 ? Pose() : LatticePiecePose(random, 2));
    for (const double time : {0.5, 1 / 3.0, 0x1p-60}) {
      const Relation expected =
          FromOracle(oracle::RelationAt(a.ForOracle(), b.ForOracle(), Rational(time)));
      const absl::StatusOr<Answer> answer =
          PairAt(a.moving(), b.moving(), time).Check(/*want_certificate=*/false, {});
      ASSERT_TRUE(answer.ok());
      ASSERT_EQ(answer->relation, expected);
      ++relations[static_cast<size_t>(expected)];
    }
  }
  EXPECT_GT(relations[static_cast<size_t>(Relation::kSeparated)], 10);
  EXPECT_GT(relations[static_cast<size_t>(Relation::kOverlapping)], 10);
}

// The corner of a square that turns about z reaches sqrt(2) after an eighth of a turn.
TEST(Turning, ACornerMeetsAWallOnTime) {
  const OwnMoving box(Box(1, 1, 1), Spinning(M_PI / 2, {0, 0, 0}, {0, 0, 0}));
  for (const double distance : {1.1, 1.25, 1.4}) {
    SCOPED_TRACE(distance);
    const OwnMoving wall(Box(0.5, 5, 5), AtRest({distance + 0.5, 0, 0}));
    const FirstContact contact = Find(box, wall);
    ASSERT_TRUE(contact.contact_time.has_value());
    // cos(45 degrees - angle) sqrt(2) = distance; t from (1 - t, 0, 0, 0) + t q1.
    const double angle = M_PI / 4 - std::acos(distance / std::sqrt(2.0));
    const double tangent = std::tan(angle / 2);
    const double time = tangent / (std::sin(M_PI / 4) - tangent * (std::cos(M_PI / 4) - 1));
    EXPECT_NEAR(*contact.contact_time, time, 1e-8);
    EXPECT_TRUE(AgreesWithSamples(box, wall, contact, 64));
  }
}

TEST(Turning, GrazesAreNeitherMissedNorReportedFalsely) {
  const OwnMoving box(Box(1, 1, 1), Spinning(M_PI / 2, {0, 0, 0}, {0, 0, 0}));
  const double reach = std::sqrt(2.0);
  const auto relation_at = [&](double distance) {
    return Find(box, OwnMoving(Box(0.5, 5, 5), AtRest({distance + 0.5, 0, 0}))).relation;
  };
  EXPECT_EQ(relation_at(reach * (1 + 1e-6)), Relation::kSeparated);
  EXPECT_EQ(relation_at(reach * (1 + 1e-8)), Relation::kSeparated);
  EXPECT_EQ(relation_at(reach * (1 - 1e-6)), Relation::kOverlapping);
  EXPECT_EQ(relation_at(reach), Relation::kWithinTolerance);
  // So shallow that the approach is too slow for a bracket of 2^-30.
  MotionOptions options;
  options.max_time_error = 0x1p-26;
  const OwnMoving wall(Box(0.5, 5, 5), AtRest({reach * (1 - 1e-8) + 0.5, 0, 0}));
  EXPECT_EQ(Find(box, wall, options).relation, Relation::kOverlapping);
}

TEST(Turning, MissesBelowTheAccuracyOfPlanesAreWithinTolerance) {
  const OwnMoving box(Box(1, 1, 1), Spinning(M_PI / 2, {0, 0, 0}, {0, 0, 0}));
  const auto passing = [&](double gap) {
    const OwnMoving wall(Box(0.5, 5, 5), AtRest({std::sqrt(2.0) + gap + 0.5, 0, 0}));
    MotionOptions options;
    options.resolution = 1e-3;
    return Find(box, wall, options);
  };
  EXPECT_EQ(passing(1e-4).relation, Relation::kSeparated);
  const FirstContact near = passing(1e-14);
  EXPECT_EQ(near.relation, Relation::kWithinTolerance);
  EXPECT_FALSE(near.contact_time.has_value());
  EXPECT_LT(near.separated_until, 1);
}

// A point moves on a circle about the other hull: the plane of a step comes within the resolution,
// but the pair does not.
TEST(Turning, PairsFartherApartThanTheResolutionAreDecided) {
  const Motion quarter = {{{1, 0, 0, 0}, Vector::Zero()}, {{1, 0, 0, 1}, Vector::Zero()}};
  for (const double resolution : {0.001, 0.02, 0.05, 0.5}) {
    MotionOptions options;
    options.resolution = resolution;
    const FirstContact contact =
        Find(OwnMoving({{0, 0, 0}}, AtRest()), OwnMoving({{1, 0, 0}}, quarter), options);
    EXPECT_EQ(contact.relation, Relation::kSeparated) << resolution;
  }
  for (const double gap : {1e-6, 1e-7}) {
    const FirstContact contact =
        Find(OwnMoving({{0, 0, 0}}, AtRest(), 1), OwnMoving({{1 + gap, 0, 0}}, quarter));
    EXPECT_EQ(contact.relation, Relation::kSeparated) << gap;
  }
}

// No plane can be proven between them at the start.
TEST(Turning, PairsThatStartWithinRoundingOfContactAreAnswered) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double gap : {1e-12, 0x1p-42, 1e-13, 0x1p-50}) {
      SCOPED_TRACE(testing::Message() << "axis " << axis << ", gap " << gap);
      const OwnMoving cube(Box(0.5, 0.5, 0.5), AtRest());
      Motion turning = AtRest((1 + gap) * Vector::Unit(axis));
      turning.end.q[static_cast<size_t>(axis) + 1] = 1;
      EXPECT_NE(Find(cube, OwnMoving(Box(0.5, 0.5, 0.5), turning)).relation,
                Relation::kOverlapping);
      Motion leaving = turning;
      leaving.end.t = 2 * Vector::Unit(axis);
      const FirstContact left = Find(cube, OwnMoving(Box(0.5, 0.5, 0.5), leaving));
      EXPECT_FALSE(left.contact_time.has_value());
      Motion entering = turning;
      entering.end.t = Vector::Zero();
      const FirstContact met = Find(cube, OwnMoving(Box(0.5, 0.5, 0.5), entering));
      EXPECT_EQ(met.relation, Relation::kOverlapping);
      const Motion lifted = {{{1, 0, 0, 0}, (0.625 + gap) * Vector::Unit(axis)},
                             {{1, 0, 0, 0}, 2 * Vector::Unit(axis)}};
      const FirstContact ball = Find(cube, OwnMoving({{0, 0, 0}}, lifted, 0.125));
      EXPECT_FALSE(ball.contact_time.has_value());
    }
  }
}

TEST(Turning, TheBracketIsAsNarrowAsRequested) {
  const OwnMoving box(Box(1, 1, 1), Spinning(M_PI / 2, {0, 0, 0}, {0, 0, 0}));
  const OwnMoving wall(Box(0.5, 5, 5), AtRest({1.25 + 0.5, 0, 0}));
  for (const double error : {1.0, 0x1p-10, 0x1p-30, 0x1p-34}) {
    SCOPED_TRACE(error);
    MotionOptions options;
    options.max_time_error = error;
    EXPECT_EQ(Find(box, wall, options).relation, Relation::kOverlapping);
  }
}

TEST(Turning, ContactAtTheEndsIsExact) {
  const OwnMoving floor(Box(5, 5, 1), AtRest());
  // The hull lands flat on the floor exactly at the end: a turn of 90 degrees about x with q1 = (1,
  // 1, 0, 0).
  const OwnMoving lands(Box(1, 1, 1), {{{1, 0, 0, 0}, {0, 0, 6}}, {{1, 1, 0, 0}, {0, 0, 2}}});
  const FirstContact end = Find(floor, lands);
  EXPECT_EQ(end.relation, Relation::kTouching);
  EXPECT_EQ(end.contact_time, 1);
  const OwnMoving leaves(Box(1, 1, 1), {{{1, 1, 0, 0}, {0, 0, 2}}, {{1, 0, 0, 0}, {0, 0, 6}}});
  const FirstContact start = Find(floor, leaves);
  EXPECT_EQ(start.relation, Relation::kTouching);
  EXPECT_EQ(start.contact_time, 0);
  EXPECT_EQ(start.separated_until, 0);
}

TEST(Turning, FlatShapesPointsAndSegmentsMeet) {
  const OwnMoving needle({{-1, 0, 0}, {1, 0, 0}}, Spinning(M_PI / 2, {0, 0, 0}, {0, 0, 0}));
  const OwnMoving other({{0.5, 0.5, -1}, {0.5, 0.5, 1}}, AtRest());
  const FirstContact crossing = Find(needle, other);
  // Two segments only touch, at an irrational time, so that no double shows the contact.
  EXPECT_EQ(crossing.relation, Relation::kWithinTolerance);
  const OwnMoving slab(Box(0.1, 0.1, 1), AtRest({0.5, 0.5, 0}));
  const FirstContact cut = Find(needle, slab);
  EXPECT_EQ(cut.relation, Relation::kOverlapping);
  EXPECT_TRUE(AgreesWithSamples(needle, slab, cut, 64));
  const OwnMoving point({{1, 0, 0}}, Spinning(M_PI / 2, {0, 0, 0}, {0, 0, 0}));
  EXPECT_EQ(Find(point, slab).relation, Relation::kSeparated);
}

TEST(Turning, LongRotationsAreCovered) {
  const OwnMoving blade(Box(2, 0.1, 0.1), Spinning(1.9 * M_PI / 2 * 2, {0, 0, 0}, {0, 0, 0}));
  const OwnMoving beyond(Box(0.1, 0.1, 0.1), AtRest({0, -2.5, 0}));
  EXPECT_EQ(Find(blade, beyond).relation, Relation::kSeparated);
  const OwnMoving hit(Box(0.1, 0.1, 0.1), AtRest({-1, -1, 0}));
  EXPECT_EQ(Find(blade, hit).relation, Relation::kOverlapping);
}

TEST(Turning, RadiiBringTheContactForward) {
  // A sphere that moves along x meets a sphere at rest when their centers are 2 apart.
  const std::vector<Vector> center = {{0, 0, 0}};
  const OwnMoving sphere(center, {{{1, 0, 0, 0}, {6, 0, 0}}, {{1, 0, 0, 0}, {0, 0, 0}}}, 1.5);
  const FirstContact spheres = Find(OwnMoving(center, AtRest(), 0.5), sphere);
  EXPECT_EQ(spheres.relation, Relation::kOverlapping);
  EXPECT_NEAR(*spheres.contact_time, 2.0 / 3, 1e-9);
  // A sphere offset by slightly less than the sum of the radii meets; by slightly more, it misses.
  const auto beside = [&](double y) {
    return Find(OwnMoving(center, AtRest({0, y, 0}), 0.5), sphere).relation;
  };
  EXPECT_EQ(beside(1.999), Relation::kOverlapping);
  EXPECT_EQ(beside(2.001), Relation::kSeparated);
  // A turning box with rounded corners reaches farther by the radius.
  const OwnMoving rounded(Box(1, 1, 1), Spinning(M_PI / 2, {0, 0, 0}, {0, 0, 0}), 0.25);
  const auto relation_at = [&](double distance) {
    return Find(rounded, OwnMoving(Box(0.5, 5, 5), AtRest({distance + 0.5, 0, 0}))).relation;
  };
  EXPECT_EQ(relation_at(std::sqrt(2.0) + 0.2499), Relation::kOverlapping);
  EXPECT_EQ(relation_at(std::sqrt(2.0) + 0.2501), Relation::kSeparated);
}

TEST(Turning, RoundedPairsAtRestHaveTheRelationOfTheirPoses) {
  for (const double scale : {1.0, 0x1p-1000, 0x1p1000}) {
    SCOPED_TRACE(scale);
    const OwnMoving a(Scaled(Box(1, 1, 1), scale), AtRest());
    // The rotation of B is the same at all times. The distance to the corner of A is 5.
    const Vector t = scale * Vector(4, 5, 0);
    const Motion at_rest = {{{1, 0, 0, 0}, t}, {{3, 0, 0, 0}, t}};
    for (const double radius : {std::nextafter(5.0, 0.0), 5.0, std::nextafter(5.0, 6.0)}) {
      const FirstContact contact = Find(a, OwnMoving({{0, 0, 0}}, at_rest, radius * scale));
      EXPECT_EQ(contact.relation, radius < 5    ? Relation::kSeparated
                                  : radius == 5 ? Relation::kTouching
                                                : Relation::kOverlapping);
      EXPECT_EQ(contact.separated_until, radius < 5 ? 1 : 0);
      EXPECT_EQ(contact.contact_time, radius < 5 ? std::nullopt : std::optional(0.0));
    }
  }
}

TEST(Turning, ExtremeScalesKeepTheRelation) {
  for (const double scale : {1e-150, 1e-60, 1e60, 1e150}) {
    SCOPED_TRACE(scale);
    const OwnMoving box(Scaled(Box(1, 1, 1), scale), Spinning(M_PI / 2, {0, 0, 0}, {0, 0, 0}));
    const OwnMoving near(Scaled(Box(0.5, 5, 5), scale), AtRest({1.75 * scale, 0, 0}));
    const FirstContact contact = Find(box, near);
    EXPECT_EQ(contact.relation, Relation::kOverlapping);
    const OwnMoving far(Scaled(Box(0.5, 5, 5), scale), AtRest({2 * scale, 0, 0}));
    EXPECT_EQ(Find(box, far).relation, Relation::kSeparated);
  }
}

// Outside the size range of planes, no bracket is as narrow as requested.
TEST(Turning, RoundedShapesOfExtremeSizeAreRefused) {
  for (const double scale : {0x1p-800, 0x1p920}) {
    std::vector<Vector> cube = Box(0.5, 0.5, 0.5);
    for (Vector& corner : cube) corner *= scale;
    const OwnMoving a(cube, AtRest(), 0.5 * scale);
    const OwnMoving b(
        cube,
        {{{1, 0, 0, 0}, scale * Vector(5, 0.3, 0.2)}, {{1, 0, 0, 0}, scale * Vector(-1, 0.3, 0.2)}},
        0.5 * scale);
    const absl::Status status = FindFirstContact(a.moving(), b.moving()).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
  }
}

TEST(Turning, PosesAndRadiiOfPiecesAreValidated) {
  const OwnMoving cube(Box(1, 1, 1), AtRest());
  MovingHull placed = cube.moving();
  placed.X_BH.q = {0, 0, 0, 0};
  EXPECT_TRUE(absl::IsInvalidArgument(FindFirstContact(placed, cube.moving()).status()));
  MovingHull piece = cube.moving();
  for (const double radius : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    piece.piece_radius = radius;
    EXPECT_TRUE(absl::IsInvalidArgument(FindFirstContact(cube.moving(), piece).status()));
  }
}

// q(t) vanishes if and only if q1 = -s q0. Near that case, it makes nearly half a turn at once.
TEST(Turning, OnlyRotationsThatVanishAreInvalid) {
  const OwnMoving far(Box(1, 1, 1), AtRest({0, 0, 9}));
  for (const std::array<double, 4>& q0 :
       {std::array<double, 4>{1, 0, 0, 0}, {0.1, 0.7, -0.3, 0.5}}) {
    for (const double scale : {1.0, 2.0}) {
      Motion motion = {{q0, Vector::Zero()}, {q0, Vector::Zero()}};
      for (double& component : motion.end.q) component *= -scale;
      EXPECT_TRUE(absl::IsInvalidArgument(ValidateMotion(motion)));
      const OwnMoving vanishing(Box(1, 2, 3), motion);
      EXPECT_TRUE(
          absl::IsInvalidArgument(FindFirstContact(vanishing.moving(), far.moving()).status()));
      for (size_t i = 0; i < 4; ++i) {
        SCOPED_TRACE(testing::Message() << q0[0] << " " << scale << " " << i);
        if (q0[i] == 0 && i > 1) continue;
        Motion nearly = motion;
        nearly.end.q[i] = std::nextafter(nearly.end.q[i], 9);
        // If q0 has a single component, a multiple of its axis is also opposite.
        EXPECT_EQ(ValidateMotion(nearly).ok(), !(q0[0] == 1 && i == 0));
        nearly.end.q[i] = motion.end.q[i] + (q0[i] == 0 ? 1e-9 : 1e-9 * scale);
        if (!ValidateMotion(nearly).ok()) continue;
        EXPECT_EQ(Find(OwnMoving(Box(1, 2, 3), nearly), far).relation, Relation::kSeparated);
      }
    }
  }
}

TEST(Turning, RotationsThatNearlyVanishAreRefusedOrDecided) {
  // q(t) makes half a turn within about 1e-16 of the motion.
  const Motion flip = {{{1, 0, 0, 0}, {0, 0, 0}}, {{-1, 1e-16, 0, 0}, {0, 0, 0}}};
  ASSERT_TRUE(ValidateMotion(flip).ok());
  const OwnMoving b(Box(1, 1, 1), AtRest({0, 0, 4.5}));
  for (const Pose& X_AP : {Pose(), Pose{{1, 2, 2, 0}, Vector(1, 0, 0)}}) {
    const OwnMoving a(Box(1, 2, 3), flip, 0, X_AP);
    const absl::StatusOr<FirstContact> contact = FindFirstContact(a.moving(), b.moving());
    if (!contact.ok()) {
      EXPECT_EQ(contact.status().code(), absl::StatusCode::kInvalidArgument);
    }
  }
}

}  // namespace turning_test
}  // namespace hulld
