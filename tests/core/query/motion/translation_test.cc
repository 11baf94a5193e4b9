#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/query/motion/first_contact.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/query/motion/motion_check.h"

namespace hulld {
namespace translation_test {

using oracle::Rational;

Motion Straight(const Vector& from, const Vector& to, std::array<double, 4> q = {1, 0, 0, 0}) {
  return {{q, from}, {q, to}};
}

std::vector<Vector> Cube(double half) {
  std::vector<Vector> corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back({i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half});
  }
  return corners;
}

MotionOptions WithCertificate() {
  MotionOptions options;
  options.want_certificate = true;
  return options;
}

FirstContact Find(const OwnMoving& a, const OwnMoving& b) {
  absl::StatusOr<FirstContact> contact =
      FindFirstContact(a.moving(), b.moving(), WithCertificate());
  EXPECT_TRUE(contact.ok()) << contact.status();
  if (!contact.ok()) return FirstContact();
  EXPECT_TRUE(ContactIsProven(a, b, *contact));
  const absl::StatusOr<FirstContact> mirrored =
      FindFirstContact(b.moving(), a.moving(), WithCertificate());
  EXPECT_TRUE(mirrored.ok());
  EXPECT_EQ(mirrored->relation, contact->relation);
  EXPECT_EQ(mirrored->separated_until, contact->separated_until);
  EXPECT_EQ(mirrored->contact_time, contact->contact_time);
  EXPECT_TRUE(ContactIsProven(b, a, *mirrored));
  return *std::move(contact);
}

// Counts of the outcomes of a sweep.
struct Counts {
  std::array<int, 3> relations = {};
  int exact = 0;
  int between = 0;
};

void CheckAgainstBruteForce(const OwnMoving& a, const OwnMoving& b, Counts& counts) {
  const oracle::TranslationContact expected =
      oracle::BruteForceTranslation(a.ForOracle(), b.ForOracle());
  const FirstContact contact = Find(a, b);
  ASSERT_EQ(contact.relation, FromOracle(expected.relation));
  ++counts.relations[static_cast<size_t>(contact.relation)];
  if (!expected.first) {
    EXPECT_EQ(contact.separated_until, 1);
    EXPECT_FALSE(contact.contact_time.has_value());
    return;
  }
  ASSERT_TRUE(IsBracketOf(contact, *expected.first));
  ++(contact.separated_until == *contact.contact_time ? counts.exact : counts.between);
}

TEST(Translation, LatticePairsAgreeWithBruteForce) {
  Random random(TestSeed(1));
  Counts counts;
  for (int round = 0; round < 400; ++round) {
    SCOPED_TRACE(round);
    const OwnMoving a(RandomLatticePoints(random, random.Between(1, 4), 3),
                      Straight({0, 0, 0}, LatticeVector(random, 2)));
    const OwnMoving b(RandomLatticePoints(random, random.Between(1, 3), 4),
                      Straight(LatticeVector(random, 5), LatticeVector(random, 5)));
    CheckAgainstBruteForce(a, b, counts);
    if (HasFatalFailure()) return;
  }
  for (const int count : counts.relations) EXPECT_GT(count, 4);
  EXPECT_GT(counts.exact, 4);
  EXPECT_GT(counts.between, 10);
}

TEST(Translation, TurnedPairsAgreeWithBruteForce) {
  Random random(TestSeed(2));
  Counts counts;
  for (int round = 0; round < 25; ++round) {
    SCOPED_TRACE(round);
    const std::array<double, 4> q_A = {1, 1, 0, 0};
    const std::array<double, 4> q_B = {static_cast<double>(random.Between(1, 3)), 1,
                                       static_cast<double>(random.Between(-2, 2)), 0};
    const OwnMoving a(RandomLatticePoints(random, 4, 4),
                      Straight(LatticeVector(random, 1), LatticeVector(random, 2), q_A));
    const OwnMoving b(RandomLatticePoints(random, 3, 4),
                      Straight(LatticeVector(random, 5), LatticeVector(random, 5), q_B));
    CheckAgainstBruteForce(a, b, counts);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(counts.relations[static_cast<size_t>(Relation::kOverlapping)], 2);
}

TEST(Translation, PiecesWithAPoseAgreeWithBruteForce) {
  Random random(TestSeed(4));
  Counts counts;
  for (int round = 0; round < 80; ++round) {
    SCOPED_TRACE(round);
    const std::array<double, 4> q_A = LatticePiecePose(random, 0).q;
    const std::array<double, 4> q_B = round % 2 == 0 ? q_A : LatticePiecePose(random, 0).q;
    const Pose X_AP = LatticePiecePose(random, 1);
    Pose X_BP = LatticePiecePose(random, 1);
    // A common rotation makes faces and edges parallel.
    if (round % 4 == 0) X_BP.q = X_AP.q;
    if (round % 5 == 4) X_BP = Pose();
    const Vector from = LatticeVector(random, 6);
    const OwnMoving a(RandomLatticePoints(random, random.Between(2, 4), 4),
                      Straight({0, 0, 0}, LatticeVector(random, 1), q_A), 0, X_AP);
    const OwnMoving b(RandomLatticePoints(random, random.Between(1, 3), 4),
                      Straight(from, Vector(LatticeVector(random, 1) - from), q_B), 0, X_BP);
    CheckAgainstBruteForce(a, b, counts);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(counts.relations[static_cast<size_t>(Relation::kSeparated)], 4);
  EXPECT_GT(counts.relations[static_cast<size_t>(Relation::kOverlapping)], 4);
  EXPECT_GT(counts.between, 4);
}

// The contact of a point with a polygon, or of two segments, lasts only an instant; most are
// between doubles.
TEST(Translation, InstantaneousContactsAreFound) {
  Random random(TestSeed(3));
  Counts counts;
  for (int round = 0; round < 60; ++round) {
    SCOPED_TRACE(round);
    const bool is_ray = round % 2 == 0;
    std::vector<Vector> polygon = {LatticeVector(random, 4), LatticeVector(random, 4)};
    if (is_ray) polygon.push_back(LatticeVector(random, 4));
    std::vector<Vector> other = {Vector::Zero()};
    if (!is_ray) other.push_back(LatticeVector(random, 3));
    // Aims at a point of the polygon.
    Vector target = Vector::Zero();
    for (const Vector& p : polygon) target += p;
    const Vector from = LatticeVector(random, 7);
    const Vector to = from + 2 * (target / static_cast<double>(polygon.size()) - from);
    const OwnMoving a(polygon, Straight({0, 0, 0}, {0, 0, 0}));
    const OwnMoving b(other, Straight(from, Vector(to.array().round())));
    CheckAgainstBruteForce(a, b, counts);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(counts.relations[static_cast<size_t>(Relation::kTouching)], 10);
}

TEST(Translation, CubesMeetAtTheTimeOfTheirFaces) {
  const OwnMoving a(Cube(1), Straight({0, 0, 0}, {0, 0, 0}));
  const OwnMoving half(Cube(1), Straight({4, 0, 0}, {0, 0, 0}));
  const FirstContact exact = Find(a, half);
  EXPECT_EQ(exact.relation, Relation::kOverlapping);
  EXPECT_EQ(exact.separated_until, 0.5);
  EXPECT_EQ(exact.contact_time, 0.5);
  const OwnMoving third(Cube(1), Straight({3, 0, 0}, {0, 0, 0}));
  const FirstContact between = Find(a, third);
  EXPECT_EQ(between.relation, Relation::kOverlapping);
  EXPECT_TRUE(IsBracketOf(between, Rational(1, 3)));
}

TEST(Translation, GrazingPairsTouch) {
  const OwnMoving a(Cube(1), Straight({0, 0, 0}, {0, 0, 0}));
  // Along a face, along an edge, and across a corner between two doubles.
  const OwnMoving face(Cube(1), Straight({5, 2, 0}, {-5, 2, 0}));
  EXPECT_EQ(Find(a, face).relation, Relation::kTouching);
  EXPECT_TRUE(IsBracketOf(Find(a, face), Rational(3, 10)));
  const OwnMoving edge(Cube(1), Straight({5, 2, 2}, {-5, 2, 2}));
  EXPECT_EQ(Find(a, edge).relation, Relation::kTouching);
  const OwnMoving corner(Cube(1), Straight({3, 1, 2}, {0, 4, 2}));
  const FirstContact brief = Find(a, corner);
  EXPECT_EQ(brief.relation, Relation::kTouching);
  EXPECT_TRUE(IsBracketOf(brief, Rational(1, 3)));
  // A graze moved away by the smallest possible amount misses.
  const OwnMoving apart(Cube(1), Straight({5, std::nextafter(2.0, 3.0), 0}, {-5, 2.5, 0}));
  EXPECT_EQ(Find(a, apart).relation, Relation::kSeparated);
}

TEST(Translation, ContactAtTheEndsIsExact) {
  const OwnMoving a(Cube(1), Straight({0, 0, 0}, {0, 0, 0}));
  const FirstContact leaves = Find(a, OwnMoving(Cube(1), Straight({2, 0, 0}, {5, 0, 0})));
  EXPECT_EQ(leaves.relation, Relation::kTouching);
  EXPECT_EQ(leaves.contact_time, 0);
  EXPECT_EQ(leaves.separated_until, 0);
  const FirstContact enters = Find(a, OwnMoving(Cube(1), Straight({2, 0, 0}, {1, 0, 0})));
  EXPECT_EQ(enters.relation, Relation::kOverlapping);
  EXPECT_EQ(enters.contact_time, 0);
  const FirstContact arrives = Find(a, OwnMoving(Cube(1), Straight({5, 0, 0}, {2, 0, 0})));
  EXPECT_EQ(arrives.relation, Relation::kTouching);
  EXPECT_EQ(arrives.contact_time, 1);
  EXPECT_EQ(arrives.separated_until, 1);
  const double near = std::nextafter(2.0, 3.0);
  const FirstContact misses = Find(a, OwnMoving(Cube(1), Straight({5, 0, 0}, {near, 0, 0})));
  EXPECT_EQ(misses.relation, Relation::kSeparated);
}

TEST(Translation, PairsAtRestHaveTheRelationOfTheirPoses) {
  const OwnMoving a(Cube(1), Straight({0, 0, 0}, {3, 3, 3}));
  for (const double x : {1.0, 2.0, 3.0}) {
    // Both move by the same amount.
    const FirstContact contact = Find(a, OwnMoving(Cube(1), Straight({x, 0, 0}, {x + 3, 3, 3})));
    EXPECT_EQ(contact.relation, x < 2    ? Relation::kOverlapping
                                : x == 2 ? Relation::kTouching
                                         : Relation::kSeparated);
    EXPECT_EQ(contact.separated_until, x <= 2 ? 0 : 1);
  }
}

TEST(Translation, EqualRotationsOfOtherLengthAreTranslations) {
  const Motion motion = {{{1, 1, 0, 0}, {4, 0, 0}}, {{3, 3, 0, 0}, {0, 0, 0}}};
  EXPECT_TRUE(IsTranslation(motion));
  const OwnMoving a(Cube(1), Straight({0, 0, 0}, {0, 0, 0}));
  EXPECT_EQ(Find(a, OwnMoving(Cube(1), motion)).contact_time, 0.5);
  EXPECT_FALSE(IsTranslation({{{1, 1, 0, 0}, {}}, {{3, std::nextafter(3.0, 4.0), 0, 0}, {}}}));
}

TEST(Translation, ExtremeScalesAreExact) {
  for (const double scale : {1e-300, 1e-150, 1e-20, 1e20, 1e150, 1e300}) {
    SCOPED_TRACE(scale);
    const OwnMoving a(Scaled(Cube(1), scale), Straight({0, 0, 0}, {0, 0, 0}));
    const OwnMoving b(Scaled(Cube(1), scale),
                      Straight(Vector(scale * Vector(8, 1, 0)), Vector(scale * Vector(0, 1, 0))));
    const FirstContact contact = Find(a, b);
    EXPECT_EQ(contact.relation, Relation::kOverlapping);
    EXPECT_EQ(contact.contact_time, 0.75);
    // Shapes of widely different sizes.
    const OwnMoving speck(Scaled(Cube(1), scale * 1e-100 * 1e100 * 0x1p-60),
                          Straight(Vector(scale * Vector(0, 8, 0)), Vector::Zero()));
    EXPECT_EQ(Find(a, speck).relation, Relation::kOverlapping);
  }
  // A time near 0, where doubles are dense.
  const OwnMoving a(Cube(1), Straight({0, 0, 0}, {0, 0, 0}));
  const OwnMoving fast(Cube(1), Straight({2 + 0x1p-40, 0, 0}, {-1e150, 0, 0}));
  const FirstContact early = Find(a, fast);
  EXPECT_EQ(early.relation, Relation::kOverlapping);
  EXPECT_LT(*early.contact_time, 1e-150);
}

// Beyond the range of floating point, only exact queries find the contact.
TEST(Translation, ScaledPairsMeetAtTheSameTime) {
  const std::vector<Vector> triangle = {{9, -6, -1}, {-13, -5, 9}, {-1, 4, -3}};
  const std::vector<Vector> solid = {{3, 0, -5}, {5, -5, -5}, {-5, 2, -2}, {0, -2, 2}, {3, -4, 1}};
  for (const int exponent : {-900, -300, 0, 280, 300, 900}) {
    SCOPED_TRACE(exponent);
    const double scale = std::ldexp(1.0, exponent);
    const OwnMoving a(Scaled(triangle, scale), Straight(Vector(scale * Vector(-8, 3, 11)),
                                                        Vector(scale * Vector(4, 0, -4))));
    const Pose rest = {{3, 2, -1, -1}, scale * Vector(3, 1, 3)};
    const FirstContact contact = Find(a, OwnMoving(Scaled(solid, scale), {rest, rest}));
    EXPECT_EQ(contact.relation, Relation::kOverlapping);
    EXPECT_EQ(contact.separated_until, 0.4505591524426133);
    EXPECT_EQ(contact.contact_time, 0.45055915244261335);
  }
}

TEST(Translation, ScaledPiecesMeetAtTheSameTime) {
  Random random(TestSeed(5));
  for (int round = 0; round < 6; ++round) {
    const Pose X_AP = LatticePiecePose(random, 1);
    const Pose X_BP = LatticePiecePose(random, 1);
    const auto find = [&](int exponent) {
      const double scale = std::ldexp(1.0, exponent);
      const auto moving = [&](const Motion& motion, const Pose& piece) {
        const auto scaled = [&](const Pose& pose) { return Pose{pose.q, scale * pose.t}; };
        return OwnMoving(Scaled(Cube(4), scale), {scaled(motion.start), scaled(motion.end)}, 0,
                         scaled(piece));
      };
      return Find(moving(Straight({0, 0, 0}, {1, 2, 3}, {1, 2, 0, 2}), X_AP),
                  moving(Straight({20, 1, 0}, {-20, 1, 3}), X_BP));
    };
    const FirstContact unscaled = find(0);
    EXPECT_EQ(unscaled.relation, Relation::kOverlapping);
    for (const int exponent : {-900, -300, 300, 900}) {
      SCOPED_TRACE(exponent);
      const FirstContact contact = find(exponent);
      EXPECT_EQ(contact.relation, Relation::kOverlapping);
      EXPECT_EQ(contact.separated_until, unscaled.separated_until);
      EXPECT_EQ(contact.contact_time, unscaled.contact_time);
    }
  }
}

TEST(Translation, DistantOffsetsCostNoAccuracy) {
  const Vector far(0x1p40, -0x1p41, 0x1p40);
  const OwnMoving a(Cube(1), Straight(far, Vector(far + Vector(1, 0, 0))));
  const OwnMoving b(Cube(1),
                    Straight(Vector(far + Vector(4, 1, 1)), Vector(far + Vector(2, 1, 1))));
  EXPECT_TRUE(IsBracketOf(Find(a, b), Rational(2, 3)));
  // A piece far from the origin of its body, back near the origin.
  const Pose X_AP = {{1, 1, 0, 0}, far};
  const Pose X_WA = {{1, -1, 0, 0}, -Vector(far.x(), far.z(), -far.y())};
  const OwnMoving piece(Cube(1), {X_WA, {X_WA.q, X_WA.t + Vector(1, 0, 0)}}, 0, X_AP);
  const OwnMoving near(Cube(1), Straight({4, 1, 1}, {2, 1, 1}));
  EXPECT_TRUE(IsBracketOf(Find(piece, near), Rational(2, 3)));
}

TEST(Translation, LargeHullsAgreeWithTheirSupport) {
  const std::vector<Vector> sphere = FibonacciSphere(2000);
  const OwnMoving a(sphere, Straight({0, 0, 0}, {0, 0, 0}));
  const OwnMoving b(sphere, Straight({5, 0.3, 0.1}, {0, 0, 0}, {1, 0.2, 0.3, 0.1}));
  absl::StatusOr<FirstContact> contact = FindFirstContact(a.moving(), b.moving());
  ASSERT_TRUE(contact.ok());
  EXPECT_EQ(contact->relation, Relation::kOverlapping);
  EXPECT_EQ(std::nextafter(contact->separated_until, 2.0), *contact->contact_time);
  EXPECT_NEAR(*contact->contact_time, 0.6, 0.01);
}

TEST(Translation, EmptyHullsAreSeparated) {
  const OwnMoving a({}, Straight({0, 0, 0}, {1, 0, 0}));
  const OwnMoving b(Cube(1), Straight({0, 0, 0}, {1, 0, 0}));
  const absl::StatusOr<FirstContact> contact = FindFirstContact(a.moving(), b.moving());
  ASSERT_TRUE(contact.ok());
  EXPECT_EQ(contact->relation, Relation::kSeparated);
  EXPECT_EQ(contact->separated_until, 1);
}

TEST(Motion, InvalidMotionsAreRefused) {
  const OwnMoving a(Cube(1), Straight({0, 0, 0}, {1, 0, 0}));
  const auto message_of = [&](const Motion& motion) {
    return std::string(
        FindFirstContact(a.moving(), OwnMoving(Cube(1), motion).moving()).status().message());
  };
  Motion vanishing = Straight({5, 0, 0}, {6, 0, 0});
  vanishing.end.q = {-2, 0, 0, 0};
  EXPECT_NE(message_of(vanishing).find("opposite"), std::string::npos);
  // Not exactly opposite, so the rotation does not vanish.
  vanishing.end.q = {-2, 1e-300, 0, 0};
  EXPECT_TRUE(ValidateMotion(vanishing).ok());
  Motion invalid = Straight({5, 0, 0}, {6, 0, 0});
  invalid.end.t.y() = kInfinity;
  EXPECT_EQ(message_of(invalid), "b: end.translation.y is infinite");
  MotionOptions options;
  options.max_time_error = 0;
  EXPECT_EQ(FindFirstContact(a.moving(), a.moving(), options).status().code(),
            absl::StatusCode::kInvalidArgument);
  options.max_time_error = 1;
  options.resolution = -1;
  EXPECT_EQ(FindFirstContact(a.moving(), a.moving(), options).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(Motion, SearchesStop) {
  MotionOptions options;
  options.should_stop = [] { return true; };
  const OwnMoving a(Cube(1), Straight({0, 0, 0}, {1, 0, 0}));
  const OwnMoving straight(Cube(1), Straight({5, 0, 0}, {0, 0, 0}));
  const OwnMoving turning(Cube(1), {{{1, 0, 0, 0}, {5, 0, 0}}, {{1, 1, 0, 0}, {0, 0, 0}}});
  for (const OwnMoving* b : {&straight, &turning}) {
    EXPECT_EQ(FindFirstContact(a.moving(), b->moving(), options).status().code(),
              absl::StatusCode::kCancelled);
  }
}

}  // namespace translation_test
}  // namespace hulld
