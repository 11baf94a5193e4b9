// Bodies in motion, and scenes with every_piece.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "client/verify/answer_check.h"
#include "tests/server/collisions/moving_placements.h"

namespace hulld::server {
namespace moving_placements {

using ::testing::ElementsAre;
using ::testing::StartsWith;

// A cube of size 1 that begins at x.
std::vector<double> CubeFrom(double x) {
  std::vector<double> corners;
  for (int i = 0; i < 8; ++i) {
    corners.insert(corners.end(), {x + (i & 1), 1.0 * (i >> 1 & 1), 1.0 * (i >> 2)});
  }
  return corners;
}

// A body of these hulls, each in the frame of the body.
v1::PutBodyRequest BodyOf(const std::string& id, const std::vector<std::string>& hulls) {
  v1::PutBodyRequest body;
  body.set_body_id(id);
  for (const std::string& hull : hulls) *body.add_pieces() = PlacementOf(hull);
  return body;
}

using MovingBodies = MovingPlacements;

TEST_F(MovingBodies, BodiesMeetWithTheirEarliestPieces) {
  Put("cube", Cube());
  Put("far", CubeFrom(5));
  ASSERT_TRUE(client().PutBody(BodyOf("body", {"far", "cube"})).ok());
  const v1::CheckCollisionResponse left =
      Proven(Pair(PlacementOf("body"), MovingTo(PlacementOf("cube", -3), 3)));
  EXPECT_EQ(left.relation(), kOverlapping);
  EXPECT_EQ(left.first_contact().contact_time(), std::nextafter(1.0 / 3, 1));
  EXPECT_EQ(left.piece_a().index(), 1u);
  EXPECT_FALSE(left.has_piece_b());
  EXPECT_EQ(left.piece_certificates_size(), 2);
  const v1::CheckCollisionResponse right =
      Proven(Pair(MovingTo(PlacementOf("cube", 8), 4), PlacementOf("body")));
  EXPECT_EQ(right.first_contact().contact_time(), 0.5);
  EXPECT_EQ(right.piece_b().index(), 0u);
  const v1::CheckCollisionResponse between =
      Proven(Pair(MovingTo(PlacementOf("body"), 0, 9), PlacementOf("cube", 3)));
  EXPECT_EQ(between.relation(), kSeparated);
  EXPECT_EQ(between.first_contact().separated_until(), 1);
  EXPECT_EQ(between.piece_certificates_size(), 2);
  // Touches one piece first, and overlaps the other later.
  const v1::CheckCollisionResponse both =
      Proven(Pair(MovingTo(PlacementOf("body"), 1.5, 1), PlacementOf("cube", 6, 1)));
  EXPECT_EQ(both.first_contact().contact_time(), 0);
}

TEST_F(MovingBodies, BodiesAreAnsweredLikeTheirPieces) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-4, 4);
  for (int i = 0; i < 6; ++i) {
    std::vector<double> points;
    points.reserve(18);
    for (int k = 0; k < 18; ++k) {
      points.push_back(number(random) / 4 + (k % 3 == i % 3 ? i / 2 : 0));
    }
    Put(absl::StrCat("piece", i), points);
  }
  v1::PutBodyRequest rounded = BodyOf("b", {"piece3", "piece4", "piece5"});
  rounded.mutable_pieces(1)->set_radius(0.125);
  ASSERT_TRUE(client().PutBody(BodyOf("a", {"piece0", "piece1", "piece2"})).ok());
  ASSERT_TRUE(client().PutBody(rounded).ok());
  int counts[v1::Relation_ARRAYSIZE] = {};
  for (int round = 0; round < 24; ++round) {
    const v1::Placement a =
        MovingTo(PlacementOf("a", number(random), number(random)), number(random), number(random));
    v1::Placement b = MovingTo(PlacementOf("b", 2 * number(random), number(random)), number(random),
                               number(random), number(random));
    if (round % 3 != 0) Turn(2, number(random), 0, number(random), b.mutable_end_pose());
    const v1::CheckCollisionResponse whole = Proven(Pair(a, b));
    double until = 1;
    double contact = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        v1::Placement piece_a = a;
        v1::Placement piece_b = b;
        piece_a.set_hull_id(absl::StrCat("piece", i));
        piece_b.set_hull_id(absl::StrCat("piece", 3 + j));
        if (j == 1) piece_b.set_radius(0.125);
        const v1::CheckCollisionResponse one = Check(Pair(piece_a, piece_b));
        if (one.relation() == kSeparated) continue;
        until = std::min(until, one.first_contact().separated_until());
        if (!one.first_contact().has_contact_time()) continue;
        contact = std::min(contact, one.first_contact().contact_time());
      }
    }
    // Brackets of one contact may differ, because rounding depends on the order of the vertices.
    const auto is_near = [](double x, double y) { return std::abs(x - y) <= 0x1p-29; };
    EXPECT_PRED2(is_near, whole.first_contact().separated_until(), until);
    EXPECT_EQ(whole.first_contact().has_contact_time(), std::isfinite(contact));
    if (std::isfinite(contact)) {
      EXPECT_PRED2(is_near, whole.first_contact().contact_time(), contact);
      EXPECT_LE(whole.first_contact().separated_until(), contact);
      EXPECT_LE(until, whole.first_contact().contact_time());
    }
    ++counts[whole.relation()];
    const auto batch = CheckBatch(Batch({a, b}, {0, 1}));
    ASSERT_TRUE(batch.ok()) << batch.status();
    EXPECT_EQ(batch->columns().relations(0), whole.relation());
    EXPECT_PRED2(is_near, batch->columns().separated_until(0), until);
    if (std::isfinite(contact)) {
      EXPECT_EQ(batch->columns().pieces(0), static_cast<int32_t>(whole.piece_a().index()));
      EXPECT_EQ(batch->columns().pieces(1), static_cast<int32_t>(whole.piece_b().index()));
    }
  }
  EXPECT_GT(counts[kSeparated], 3);
  EXPECT_GT(counts[kOverlapping], 3);
}

TEST_F(MovingBodies, FlawedCertificatesOfMovingBodiesAreRejected) {
  Put("cube", Cube());
  Put("far", CubeFrom(5));
  ASSERT_TRUE(client().PutBody(BodyOf("body", {"far", "cube"})).ok());
  v1::CheckCollisionRequest request =
      Pair(PlacementOf("body"), MovingTo(PlacementOf("cube", -3), 3));
  request.mutable_wanted()->set_certificate(true);
  const v1::CheckCollisionResponse response = Check(request);
  const Client connected = client();
  const auto verdict_without = [&](const std::function<void(v1::CheckCollisionResponse*)>& spoil) {
    v1::CheckCollisionResponse flawed = response;
    spoil(&flawed);
    const auto checked = AnswerChecker(connected).Check(request, flawed);
    return checked.ok() ? checked->verdict : Verdict::kCannotCheck;
  };
  EXPECT_EQ(verdict_without([](auto*) {}), Verdict::kValid);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(
        verdict_without([i](auto* r) { r->mutable_piece_certificates()->DeleteSubrange(i, 1); }),
        Verdict::kInvalid);
    EXPECT_EQ(
        verdict_without([i](auto* r) { r->mutable_piece_certificates(i)->clear_intervals(); }),
        Verdict::kInvalid);
  }
  EXPECT_EQ(verdict_without([](auto* r) { r->set_relation(v1::RELATION_TOUCHING); }),
            Verdict::kInvalid);
  EXPECT_EQ(verdict_without([](auto* r) { r->mutable_first_contact()->set_separated_until(0.4); }),
            Verdict::kInvalid);
  EXPECT_EQ(verdict_without([](auto* r) { r->mutable_piece_a()->set_index(0); }),
            Verdict::kInvalid);
}

TEST_F(MovingBodies, PiecesWithPosesOfTheirOwnMove) {
  Put("cube", Cube());
  v1::PutBodyRequest body = BodyOf("body", {"cube", "cube"});
  // By a quarter turn about z of any length: a cube from x = 3 to 4.
  v1::Pose* const pose = body.mutable_pieces(1)->mutable_pose();
  Turn(3, 0, 0, 3, pose);
  pose->mutable_translation()->set_x(4);
  ASSERT_TRUE(client().PutBody(body).ok());

  const v1::Placement coming = MovingTo(PlacementOf("cube", 8), 0);
  const v1::CheckCollisionResponse one = Proven(Pair(PlacementOf("body"), coming));
  EXPECT_EQ(one.relation(), kOverlapping);
  EXPECT_EQ(one.first_contact().contact_time(), 0.5);
  EXPECT_EQ(one.first_contact().separated_until(), 0.5);
  EXPECT_EQ(one.piece_a().index(), 1u);
  EXPECT_EQ(one.piece_certificates_size(), 2);
  const v1::CheckCollisionResponse moved =
      Proven(Pair(MovingTo(PlacementOf("body"), -8), PlacementOf("cube", -2)));
  EXPECT_EQ(moved.first_contact().contact_time(), 0.125);
  EXPECT_EQ(moved.piece_a().index(), 0u);
  const v1::CheckCollisionResponse through =
      Proven(Pair(MovingTo(PlacementOf("body"), 0, 9), PlacementOf("cube", 1.5)));
  EXPECT_EQ(through.relation(), kSeparated);
  // The far piece, on an arm of length 4, turns into a cube that starts at y = 3.5 with its corner
  // (4, 1): 4 sin a + cos a = 3.5 at tan(a / 2) = t.
  v1::Placement turning = PlacementOf("body");
  Turn(1, 0, 0, 1, turning.mutable_end_pose());
  const v1::CheckCollisionResponse turned = Proven(Pair(turning, PlacementOf("cube", 1.75, 3.5)));
  EXPECT_EQ(turned.relation(), kOverlapping);
  EXPECT_EQ(turned.piece_a().index(), 1u);
  const double angle = std::asin(3.5 / std::sqrt(17.0)) - std::atan2(1, 4);
  EXPECT_NEAR(turned.first_contact().contact_time(), std::tan(angle / 2), 1e-8);

  const auto batch = CheckBatch(
      Batch({PlacementOf("body"), coming, PlacementOf("cube"), turning}, {0, 1, 1, 2, 3, 1}));
  ASSERT_TRUE(batch.ok()) << batch.status();
  EXPECT_EQ(batch->columns().pair_problems_size(), 0);
  EXPECT_EQ(batch->columns().contact_times(0), 0.5);
  EXPECT_EQ(batch->columns().pieces(0), 1);
  EXPECT_EQ(batch->columns().contact_times(1), 0.875);
  v1::FindCollisionsRequest scene;
  *scene.add_placements() = PlacementOf("body", 0, 0);
  *scene.add_placements() = coming;
  *scene.add_placements() = PlacementOf("cube", 0, 9);
  scene.mutable_wanted()->set_certificate(true);
  const auto found = Find(scene);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_THAT(found->pairs(), ElementsAre(0, 1));
  EXPECT_EQ(found->columns().contact_times(0), 0.5);

  *body.add_pieces() = MovingTo(PlacementOf("cube"), 1);
  EXPECT_THAT(MessageOf(client().PutBody(body).status()),
              StartsWith("pieces[2].end_pose is set; a piece cannot move"));
}

// Quarter turns and translations of these points are exact in doubles, so that a posed piece is
// also a hull in the body's frame.
TEST_F(MovingBodies, PosedPiecesAreAnsweredLikeHullsInTheFrameOfTheBody) {
  std::mt19937 random(5);
  const auto between = [&](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
  };
  for (const std::string name : {"a", "b"}) {
    v1::PutBodyRequest posed = BodyOf(name + "-posed", {});
    v1::PutBodyRequest plain = BodyOf(name + "-plain", {});
    for (int piece = 0; piece < 3; ++piece) {
      const std::string id = absl::StrCat(name, piece);
      v1::Placement placement = PlacementOf(id, between(-2, 2), between(-2, 2));
      if (piece > 0) Turn(5, 0, 0, piece == 1 ? 5 : -5, placement.mutable_pose());
      placement.set_radius(piece == 2 ? 0.25 : 0);
      const v1::Vector3& t = placement.pose().translation();
      std::vector<double> points;
      std::vector<double> moved;
      for (int i = 0; i < 5; ++i) {
        const double x = between(-3072, 3072) / 1024.0;
        const double y = between(-3072, 3072) / 1024.0;
        const double z = between(-3072, 3072) / 1024.0;
        points.insert(points.end(), {x, y, z});
        const double turned_x = piece == 0 ? x : piece == 1 ? -y : y;
        const double turned_y = piece == 0 ? y : piece == 1 ? x : -x;
        moved.insert(moved.end(), {turned_x + t.x(), turned_y + t.y(), z});
      }
      Put(id, points);
      Put(id + "-moved", moved);
      *posed.add_pieces() = placement;
      *plain.add_pieces() = PlacementOf(id + "-moved");
      plain.mutable_pieces(piece)->set_radius(placement.radius());
    }
    ASSERT_TRUE(client().PutBody(posed).ok());
    ASSERT_TRUE(client().PutBody(plain).ok());
  }
  int counts[v1::Relation_ARRAYSIZE] = {};
  for (int round = 0; round < 24; ++round) {
    SCOPED_TRACE(round);
    v1::Placement a =
        MovingTo(PlacementOf("a-posed", between(-9, 9), between(-9, 9)), between(-9, 9), 0, 1);
    v1::Placement b = MovingTo(PlacementOf("b-posed", between(-9, 9), between(-9, 9)),
                               between(-9, 9), between(-9, 9));
    if (round % 2 == 0) Turn(2, 0, between(-1, 1), 1, b.mutable_end_pose());
    const v1::CheckCollisionResponse posed = Proven(Pair(a, b));
    a.set_hull_id("a-plain");
    b.set_hull_id("b-plain");
    const v1::CheckCollisionResponse plain = Proven(Pair(a, b));
    EXPECT_EQ(posed.relation(), plain.relation());
    EXPECT_NEAR(posed.first_contact().separated_until(), plain.first_contact().separated_until(),
                0x1p-29);
    EXPECT_EQ(posed.first_contact().has_contact_time(), plain.first_contact().has_contact_time());
    EXPECT_NEAR(posed.first_contact().contact_time(), plain.first_contact().contact_time(),
                0x1p-29);
    ++counts[posed.relation()];
  }
  EXPECT_GT(counts[kSeparated], 3);
  EXPECT_GT(counts[kOverlapping], 3);
}

TEST_F(MovingBodies, EveryPieceGivesARowToEachPairOfPieces) {
  Put("cube", Cube());
  v1::PutBodyRequest row;
  row.set_body_id("row");
  for (int i = 0; i < 5; ++i) *row.add_pieces() = PlacementOf("cube", 2 * i);
  ASSERT_TRUE(client().PutBody(row).ok());
  const std::vector<v1::Placement> placements = {PlacementOf("row"), PlacementOf("row", 0.5, 0.25),
                                                 PlacementOf("cube", 4, -1),
                                                 PlacementOf("cube", 4, -1.5)};
  for (const double clearance : {-1.0, 0.0, 0.5}) {
    SCOPED_TRACE(clearance);
    v1::FindCollisionsRequest request;
    for (const v1::Placement& one : placements) *request.add_placements() = one;
    request.set_every_piece(true);
    request.mutable_wanted()->set_separation(true);
    request.mutable_wanted()->set_certificate(true);
    if (clearance >= 0) request.mutable_wanted()->set_clearance(clearance);
    const auto scene = Find(request);
    ASSERT_TRUE(scene.ok()) << scene.status();
    // Brute force: each piece as a hull at its place.
    const auto pieces_of = [&](uint32_t i) {
      std::vector<v1::Placement> pieces;
      for (int k = 0; k < (i < 2 ? 5 : 1); ++k) {
        const v1::Vector3& t = placements[i].pose().translation();
        pieces.push_back(PlacementOf("cube", t.x() + 2 * k, t.y()));
      }
      return pieces;
    };
    std::vector<std::tuple<uint32_t, uint32_t, int, int, v1::Relation>> expected;
    for (uint32_t a = 0; a < 4; ++a) {
      for (uint32_t b = a + 1; b < 4; ++b) {
        const auto pieces_a = pieces_of(a);
        const auto pieces_b = pieces_of(b);
        for (size_t i = 0; i < pieces_a.size(); ++i) {
          for (size_t j = 0; j < pieces_b.size(); ++j) {
            v1::CheckCollisionRequest one = Pair(pieces_a[i], pieces_b[j]);
            if (clearance >= 0) one.mutable_wanted()->set_clearance(clearance);
            const v1::CheckCollisionResponse answer = Check(one);
            const bool is_found =
                clearance >= 0 ? answer.within_clearance() : answer.relation() != kSeparated;
            if (!is_found) continue;
            expected.emplace_back(a, b, a < 2 ? static_cast<int>(i) : -1,
                                  b < 2 ? static_cast<int>(j) : -1, answer.relation());
          }
        }
      }
    }
    std::vector<std::tuple<uint32_t, uint32_t, int, int, v1::Relation>> found;
    const v1::AnswerColumns& columns = scene->columns();
    found.reserve(static_cast<size_t>(columns.relations_size()));
    for (int i = 0; i < columns.relations_size(); ++i) {
      found.emplace_back(scene->pairs(2 * i), scene->pairs(2 * i + 1), columns.pieces(2 * i),
                         columns.pieces(2 * i + 1), columns.relations(i));
    }
    EXPECT_EQ(found, expected);
    EXPECT_GT(found.size(), 6u);
    const v1::SceneTotals& totals = scene->totals();
    EXPECT_EQ(totals.separated() + totals.touching() + totals.overlapping(), found.size());
    EXPECT_EQ(columns.separations_size(), static_cast<int>(found.size()));
  }
  v1::FindCollisionsRequest limited;
  *limited.add_placements() = PlacementOf("row");
  limited.set_every_piece(true);
  limited.set_limit(1);
  EXPECT_THAT(MessageOf(Find(limited).status()),
              StartsWith("every_piece and limit cannot be combined"));
}

}  // namespace moving_placements
}  // namespace hulld::server
