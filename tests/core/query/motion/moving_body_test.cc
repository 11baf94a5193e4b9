#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/query/motion/moving_body_search.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/query/body/own_body.h"
#include "tests/core/query/motion/motion_check.h"
#include "tests/test_size.h"

namespace hulld {
namespace moving_body_test {

using oracle::Rational;

// A body in motion, and each of its pieces as a separate hull in motion.
struct OwnMovingBody {
  explicit OwnMovingBody(const Motion& X_WB, double radius_in = 0)
      : motion(X_WB), radius(radius_in) {}

  // Requires: radii whose sum is a double.
  void Add(const std::vector<Vector>& points, double piece_radius = 0, const Pose& X_BP = {}) {
    body.Add(points, X_BP, piece_radius);
    if (!points.empty()) pieces.emplace_back(points, motion, radius + piece_radius, X_BP);
  }
  MovingBody moving() {
    if (!body.query) body.Finish();
    return {*body.query, motion, radius};
  }

  Motion motion;
  double radius;
  OwnBody body;
  // The nonempty pieces.
  std::vector<OwnMoving> pieces;
};

Motion Translation(const Vector& from, const Vector& to) {
  return {{{1, 0, 0, 0}, from}, {{1, 0, 0, 0}, to}};
}

Motion RandomMotion(Random& random, double length, bool turns) {
  Motion motion;
  for (Pose* pose : {&motion.start, &motion.end}) {
    for (int i = 0; i < 3; ++i) pose->t[i] = random.Real(-length, length);
    pose->q = {2, 0, 0, 0};
    for (int i = 1; turns && i < 4; ++i) pose->q[i] = random.Real(-1, 1);
  }
  return motion;
}

// Returns the fault of the certificates of an answer, or an empty string.
std::string FaultOf(const OwnMovingBody& a, const OwnMovingBody& b, const BodyContact& found) {
  const Rational until(found.contact.separated_until);
  const bool meets = found.contact.contact_time.has_value();
  size_t next = 0;
  for (uint32_t i = 0; i < a.pieces.size(); ++i) {
    for (uint32_t j = 0; j < b.pieces.size(); ++j) {
      const oracle::MovingPoints points_a = a.pieces[i].ForOracle();
      const oracle::MovingPoints points_b = b.pieces[j].ForOracle();
      if (points_a.points.empty() || points_b.points.empty()) continue;
      if (next == found.of_body.certificates.size()) return until == 0 ? "" : "too few";
      const PieceCertificate& certificate = found.of_body.certificates[next];
      if (certificate.pieces != PiecePair{i, j}) {
        if (until == 0) continue;
        return "not in order";
      }
      ++next;
      const std::string fault =
          oracle::FaultOf(points_a, points_b, ToOracle(certificate.intervals), until, meets);
      if (!fault.empty()) return fault;
      const bool decides = meets && found.of_body.pieces == certificate.pieces;
      if (decides != (certificate.relation != Relation::kSeparated)) return "wrong pair decides";
      if (!decides) continue;
      FirstContact contact = found.contact;
      contact.intervals = certificate.intervals;
      contact.certificate = certificate.certificate;
      const auto proven = ContactIsProven(a.pieces[i], b.pieces[j], contact);
      if (!proven) return proven.message();
    }
  }
  return next == found.of_body.certificates.size() ? "" : "too many";
}

TEST(MovingBody, MeetsWhenItsEarliestPieceMeets) {
  Random random(TestSeed(1));
  std::array<int, 4> relations = {};
  int ended_early = 0;
  for (int round = 0; round < TestSize(60, 16); ++round) {
    SCOPED_TRACE(round);
    const bool turns = round % 2 == 1;
    OwnMovingBody a(RandomMotion(random, 2, turns && round % 4 == 1), round % 8 == 7 ? 0.125 : 0);
    OwnMovingBody b(RandomMotion(random, 2.5, turns));
    for (OwnMovingBody* body : {&a, &b}) {
      const int pieces = random.Between(1, 4);
      for (int i = 0; i < pieces; ++i) {
        std::vector<Vector> points = RandomInBall(random, random.Between(4, 6), 0.75);
        Pose X_BP = At(i - 1, 0, 0);
        if (round % 3 != 0) X_BP.q = RandomPose(random, 0).q;
        if (round % 3 == 1) {
          for (Vector& p : points) p += X_BP.t;
          X_BP = Pose();
        }
        body->Add(points, round % 5 == 4 && i == 1 ? 0.25 : 0, X_BP);
      }
    }
    MotionOptions options;
    options.want_certificate = true;
    const absl::StatusOr<BodyContact> found = FindFirstContact(a.moving(), b.moving(), options);
    ASSERT_TRUE(found.ok()) << found.status();
    double until = 1;
    std::optional<double> contact_time;
    Relation strongest = Relation::kSeparated;
    for (uint32_t i = 0; i < a.pieces.size(); ++i) {
      for (uint32_t j = 0; j < b.pieces.size(); ++j) {
        const auto one = FindFirstContact(a.moving().Piece(i), b.moving().Piece(j));
        ASSERT_TRUE(one.ok()) << one.status();
        if (one->relation == Relation::kSeparated) continue;
        until = std::min(until, one->separated_until);
        if (!one->contact_time) continue;
        contact_time = std::min(contact_time.value_or(1), *one->contact_time);
        strongest = std::max(strongest, one->relation);
      }
    }
    EXPECT_EQ(found->contact.separated_until, until);
    EXPECT_EQ(found->contact.contact_time, contact_time);
    if (!turns && contact_time) {
      EXPECT_EQ(found->contact.relation, strongest);
    }
    EXPECT_EQ(FaultOf(a, b, *found), "");
    ++relations[static_cast<size_t>(found->contact.relation)];

    // A search that ends early.
    for (const double latest : {0.125, 0.25, 0.5}) {
      options.latest = latest;
      const absl::StatusOr<BodyContact> early = FindFirstContact(a.moving(), b.moving(), options);
      ASSERT_TRUE(early.ok()) << early.status();
      EXPECT_EQ(FaultOf(a, b, *early), "");
      if (until <= latest) {
        EXPECT_EQ(early->contact.separated_until, until);
      } else {
        EXPECT_GT(early->contact.separated_until, latest);
        ended_early += early->contact.separated_until < until;
      }
    }

    const absl::StatusOr<BodyContact> swapped = FindFirstContact(b.moving(), a.moving());
    ASSERT_TRUE(swapped.ok()) << swapped.status();
    EXPECT_EQ(swapped->contact.relation, found->contact.relation);
    EXPECT_EQ(swapped->contact.separated_until, until);
    EXPECT_EQ(swapped->contact.contact_time, contact_time);
  }
  EXPECT_GT(relations[static_cast<size_t>(Relation::kSeparated)], TestSize(5, 0));
  EXPECT_GT(relations[static_cast<size_t>(Relation::kOverlapping)], TestSize(5, 0));
  EXPECT_GT(ended_early, TestSize(5, 0));
}

// The point meets a triangle and a cube at time 1/2, and overlaps only the cube.
TEST(MovingBody, TheStrongestOfSimultaneousContactsDecides) {
  OwnMovingBody wall(Translation({0, 0, 0}, {0, 0, 0}));
  wall.Add({{1, -5, -5}, {1, 5, -5}, {1, 0, 5}});
  wall.Add(LatticeCube(2, 1));
  OwnMovingBody probe(Translation({2, 0.5, 0.5}, {0, 0.5, 0.5}));
  probe.Add({{0, 0, 0}});
  const absl::StatusOr<BodyContact> found = FindFirstContact(wall.moving(), probe.moving());
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found->contact.contact_time, 0.5);
  EXPECT_EQ(found->contact.relation, Relation::kOverlapping);
  EXPECT_EQ(found->of_body.pieces, (PiecePair{1, 0}));
}

// The first piece is within rounding of contact from the start.
TEST(MovingBody, APieceThatIsNearlyTouchedHidesNoContactOfAnother) {
  OwnMovingBody stairs(Translation({0, 0, 0}, {0, 0, 0}));
  stairs.Add(LatticeCube(2, 1));
  std::vector<Vector> step = LatticeCube(2, 1);
  for (Vector& corner : step) corner += Vector(1.5, 0, 1);
  stairs.Add(step);
  OwnMovingBody cube(
      {{{1, 0, 0, 0}, {0, 0, 1 + 0x1p-43}}, {{1, 0, 0, 0.1}, {1.5, 0, 1 + 0x1p-43}}});
  cube.Add(LatticeCube(2, 1));
  const absl::StatusOr<BodyContact> found = FindFirstContact(stairs.moving(), cube.moving());
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ(found->contact.relation, Relation::kOverlapping);
  EXPECT_EQ(found->of_body.pieces, (PiecePair{1, 0}));
  EXPECT_NEAR(*found->contact.contact_time, 0.33482644, 1e-8);
}

TEST(MovingBody, EmptyBodiesAndPiecesNeverMeet) {
  OwnMovingBody empty(Translation({0, 0, 0}, {1, 0, 0}));
  OwnMovingBody hollow(Translation({0, 0, 0}, {1, 0, 0}));
  hollow.Add({});
  OwnMovingBody cube(Translation({0, 0, 0}, {0, 0, 0}));
  cube.Add(LatticeCube(2, 1));
  MotionOptions options;
  options.want_certificate = true;
  for (OwnMovingBody* other : {&empty, &hollow}) {
    const absl::StatusOr<BodyContact> found =
        FindFirstContact(other->moving(), cube.moving(), options);
    ASSERT_TRUE(found.ok());
    EXPECT_EQ(found->contact.relation, Relation::kSeparated);
    EXPECT_EQ(found->contact.separated_until, 1);
    EXPECT_TRUE(found->of_body.certificates.empty());
  }
}

// Each pair of pieces against brute force over event times.
TEST(MovingBody, TranslationsOfPosedPiecesAreExact) {
  Random random(TestSeed(2));
  std::array<int, 3> relations = {};
  for (int round = 0; round < TestSize(50, 15); ++round) {
    SCOPED_TRACE(round);
    OwnMovingBody a(Translation({0, 0, 0}, LatticeVector(random, 2)));
    const Vector from = LatticeVector(random, 7);
    OwnMovingBody b(Translation(from, Vector(LatticeVector(random, 1) - from)));
    a.motion.start.q = a.motion.end.q = LatticePiecePose(random, 0).q;
    b.motion.start.q = {1, 2, 2, 0};
    b.motion.end.q = {2, 4, 4, 0};
    for (OwnMovingBody* body : {&a, &b}) {
      for (int i = 0; i < 2; ++i) {
        body->Add(RandomLatticePoints(random, random.Between(2, 4), 4), 0,
                  LatticePiecePose(random, 2));
      }
    }
    std::optional<Rational> first;
    Relation strongest = Relation::kSeparated;
    for (const OwnMoving& piece_a : a.pieces) {
      for (const OwnMoving& piece_b : b.pieces) {
        const oracle::TranslationContact expected =
            oracle::BruteForceTranslation(piece_a.ForOracle(), piece_b.ForOracle());
        strongest = std::max(strongest, FromOracle(expected.relation));
        if (expected.first && (!first || *expected.first < *first)) first = expected.first;
      }
    }
    MotionOptions options;
    options.want_certificate = true;
    const absl::StatusOr<BodyContact> found = FindFirstContact(a.moving(), b.moving(), options);
    ASSERT_TRUE(found.ok()) << found.status();
    EXPECT_EQ(found->contact.relation, strongest);
    EXPECT_EQ(found->contact.contact_time.has_value(), first.has_value());
    if (first) {
      EXPECT_TRUE(IsBracketOf(found->contact, *first));
    }
    EXPECT_EQ(FaultOf(a, b, *found), "");
    ++relations[static_cast<size_t>(strongest)];
  }
  EXPECT_GT(relations[static_cast<size_t>(Relation::kSeparated)], TestSize(4, 0));
  EXPECT_GT(relations[static_cast<size_t>(Relation::kOverlapping)], TestSize(4, 0));
}

TEST(MovingBody, TooManyCertificatesAreRefused) {
  OwnMovingBody a(Translation({0, 0, 0}, {1, 0, 0}));
  OwnMovingBody b(Translation({5, 0, 0}, {5, 0, 0}));
  for (int i = 0; i < 3; ++i) {
    a.Add(LatticeCube(2, 1));
    b.Add(LatticeCube(2, 1));
  }
  MotionOptions options;
  options.max_piece_certificates = 8;
  EXPECT_TRUE(FindFirstContact(a.moving(), b.moving(), options).ok());
  options.want_certificate = true;
  EXPECT_TRUE(
      absl::IsResourceExhausted(FindFirstContact(a.moving(), b.moving(), options).status()));
  options.max_piece_certificates = 9;
  EXPECT_EQ(FindFirstContact(a.moving(), b.moving(), options)->of_body.certificates.size(), 9u);
}

TEST(MovingBody, StopsOnRequest) {
  OwnMovingBody a(Translation({0, 0, 0}, {1, 0, 0}));
  a.Add(LatticeCube(2, 1));
  MotionOptions options;
  options.should_stop = [] { return true; };
  EXPECT_TRUE(absl::IsCancelled(FindFirstContact(a.moving(), a.moving(), options).status()));
}

}  // namespace moving_body_test
}  // namespace hulld
