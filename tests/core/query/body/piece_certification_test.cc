#include "core/query/body/piece_certification.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/query/body/body_search.h"
#include "tests/core/checks/certificate_bridge.h"
#include "tests/core/query/body/own_body.h"
#include "tests/core/query/body/rational_world.h"
#include "tests/test_size.h"

namespace hulld {
namespace piece_certification_test {

using testing::HasSubstr;

QueryOptions Certified() {
  QueryOptions options;
  options.want_certificate = true;
  return options;
}

// Returns true if the minimal axis-aligned boxes of both intersect.
bool DoBoxesMeet(const oracle::WorldPoints& world) {
  if (world.a.empty() || world.b.empty()) return false;
  for (int k = 0; k < 3; ++k) {
    const auto less = [k](const auto& p, const auto& q) { return p[k] < q[k]; };
    const auto [low_a, high_a] = std::minmax_element(world.a.begin(), world.a.end(), less);
    const auto [low_b, high_b] = std::minmax_element(world.b.begin(), world.b.end(), less);
    if ((*high_a)[k] < (*low_b)[k] || (*high_b)[k] < (*low_a)[k]) return false;
  }
  return true;
}

oracle::Relation ForOracle(Relation relation) { return static_cast<oracle::Relation>(relation); }

// Adds pieces large relative to their distances, so that many boxes meet.
void FillLarge(Random& random, int pieces, OwnBody* body) {
  for (int i = 0; i < pieces; ++i) {
    Pose pose = At(random.Between(-4, 4), random.Between(-3, 3), 0);
    if (i % 2 == 0) pose.q = {1, 1.0 * random.Between(-1, 1), 0, 1.0 * random.Between(-1, 1)};
    const int points = i % 4 == 3 ? 0 : random.Between(2, 8);
    body->Add(RandomLatticePoints(random, points, 4), pose);
  }
  body->Finish();
}

struct Proven {
  size_t certificates = 0;
  size_t settled = 0;
};

// Expects that the certificates prove the relation, by rational numbers alone.
void ExpectProof(const OwnBody& a, const Pose& X_WA, const OwnBody& b, const Pose& X_WB,
                 const BodyAnswer& answer, Proven* proven) {
  EXPECT_FALSE(answer.answer.certificate.has_value());
  std::map<std::pair<uint32_t, uint32_t>, const PieceCertificate*> given;
  for (const PieceCertificate& of : answer.certificates) {
    const bool is_new = given.emplace(std::pair(of.pieces.a, of.pieces.b), &of).second;
    EXPECT_TRUE(is_new);
  }
  Relation strongest = Relation::kSeparated;
  for (uint32_t i = 0; i < a.pieces.size(); ++i) {
    for (uint32_t j = 0; j < b.pieces.size(); ++j) {
      const oracle::WorldPoints world =
          RationalWorld(a.hulls[i], {X_WA, a.pieces[i].X_BP}, b.hulls[j], {X_WB, b.pieces[j].X_BP});
      const auto found = given.find({i, j});
      if (found == given.end()) {
        if (answer.answer.relation == Relation::kOverlapping) continue;
        EXPECT_FALSE(DoBoxesMeet(world)) << i << " " << j;
        ++proven->settled;
        continue;
      }
      const PieceCertificate& of = *found->second;
      EXPECT_EQ(oracle::FaultOf(ToOracle(of.certificate), ForOracle(of.relation), world), "");
      strongest = std::max(strongest, of.relation);
      ++proven->certificates;
    }
  }
  EXPECT_EQ(strongest, answer.answer.relation);
  if (answer.answer.relation == Relation::kOverlapping) {
    ASSERT_EQ(answer.certificates.size(), 1u);
    EXPECT_EQ(answer.certificates[0].pieces, *answer.pieces);
  }
  EXPECT_TRUE(std::is_sorted(answer.certificates.begin(), answer.certificates.end(),
                             [](const PieceCertificate& p, const PieceCertificate& q) {
                               return std::pair(p.pieces.a, p.pieces.b) <
                                      std::pair(q.pieces.a, q.pieces.b);
                             }));
}

TEST(PieceCertification, ProvesEveryRelation) {
  Random random(TestSeed(4));
  std::array<int, 3> relations = {};
  Proven proven;
  for (int round = 0; round < TestSize(420, 80); ++round) {
    OwnBody a, b;
    FillLarge(random, random.Between(1, 4), &a);
    FillLarge(random, random.Between(1, 4), &b);
    Pose X_WA = At(random.Between(-3, 3), random.Between(-3, 3), random.Between(-3, 3));
    X_WA.q = {2, 1, 0, 1};
    Pose X_WB = X_WA;
    if (round % 4 == 0) X_WB.q = {1, 0.1, 1, 0};
    // Bodies with equal poses meet as lattices do.
    if (round % 3 != 0) X_WB.t += Vector(random.Between(-4, 4), random.Between(-4, 4), 0);
    QueryOptions options = Certified();
    // Also with the smallest separation; its pair is found differently.
    options.want_separation = round % 2 == 0;
    const auto answer = CheckBodies(a.Placed(X_WA), b.Placed(X_WB), options);
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_EQ(answer->answer.separation.has_value(), options.want_separation);
    ++relations[static_cast<size_t>(answer->answer.relation)];
    ExpectProof(a, X_WA, b, X_WB, *answer, &proven);
  }
  for (const int count : relations) EXPECT_GT(count, TestSize(3, 0));
  EXPECT_GT(proven.certificates, uint64_t{TestSize(100, 20)});
  EXPECT_GT(proven.settled, uint64_t{TestSize(200, 40)});
}

// When floating point overflows, boxes cover all of space or are far too large: then pairs are
// certified instead of omitted.
TEST(PieceCertification, RoundingLeavesNoPairOut) {
  Proven proven;
  for (const double scale : {1e-310, 1e-160, 1e-30, 1.0, 1e150, 1e306}) {
    OwnBody a, b;
    // Large translations that cancel, for hulls far smaller than their rounding errors.
    const double far = scale * 1e15;
    const bool cancels = scale < 1e290;
    a.Add(Scaled(LatticeCube(2, 1), scale), cancels ? At(far, far, 0) : Pose());
    a.Add({}, Pose());
    a.Finish();
    b.Add(Scaled(LatticeCube(2, 1), scale), At(0, 0, 0));
    b.Finish();
    Pose X_WA = cancels ? At(-far, -far, 0) : Pose();
    if (cancels) X_WA.q = {1, 0, 0, 0x1p-60};
    for (const double step : {0.0, 1.0, 1.5}) {
      const Pose X_WB = At(step * scale, 0, 0);
      const auto answer = CheckBodies(a.Placed(X_WA), b.Placed(X_WB), Certified());
      ASSERT_TRUE(answer.ok()) << answer.status();
      ExpectProof(a, X_WA, b, X_WB, *answer, &proven);
    }
  }
  EXPECT_GT(proven.certificates, 10u);
}

// Two cubes that share a face, far from the origins of their bodies, which are as far from the
// world's: the poses are equal, but their products round differently.
TEST(PieceCertification, TranslationsThatCancelLeaveNoPairOut) {
  Random random(TestSeed(5));
  Proven proven;
  for (int round = 0; round < 30; ++round) {
    const double far = 1e20 * random.Real(1, 2);
    OwnBody a, b;
    a.Add(LatticeCube(2, 1), At(far, far, far));
    a.Finish();
    std::vector<Vector> beside = LatticeCube(2, 1);
    for (Vector& p : beside) p.x() += 1;
    b.Add(beside, At(far, far, far));
    b.Finish();
    Pose X_WA = At(-far, -far, -far);
    X_WA.q = {1, 0x1p-81 * random.Between(-1000, 1000), 0x1p-81 * random.Between(-1000, 1000), 0};
    Pose X_WB = X_WA;
    for (double& component : X_WB.q) component *= 3;
    const auto answer = CheckBodies(a.Placed(X_WA), b.Placed(X_WB), Certified());
    ASSERT_TRUE(answer.ok()) << answer.status();
    ExpectProof(a, X_WA, b, X_WB, *answer, &proven);
  }
  EXPECT_EQ(proven.certificates, 30u);
}

TEST(PieceCertification, HullsAreBodiesOfOnePiece) {
  OwnBody pair;
  pair.Add(LatticeCube(2, 1), At(0, 0, 0));
  pair.Add(LatticeCube(2, 1), At(5, 0, 0));
  pair.Finish();
  const Hull cube = BuildHull(LatticeCube(2, 1));
  const QueryHull query_cube(cube);
  const QueryBody hull(query_cube);
  const auto answer = CheckBodies(PlacedBody(hull, At(4, 0, 0)), pair.Placed(Pose()), Certified());
  EXPECT_EQ(answer->answer.relation, Relation::kTouching);
  ASSERT_EQ(answer->certificates.size(), 1u);
  EXPECT_EQ(answer->certificates[0].pieces, (PiecePair{0, 1}));
}

TEST(PieceCertification, NothingIsCertifiedIfBoxesSettleAllPairs) {
  OwnBody grid, none;
  FillGrid(4, 2, &grid);
  none.Finish();
  for (const Pose& X_WB : {At(100, 0, 0), At(1.5, 0, 0)}) {
    const auto answer = CheckBodies(grid.Placed(Pose()), grid.Placed(X_WB), Certified());
    EXPECT_EQ(answer->answer.relation == Relation::kSeparated, answer->certificates.empty());
  }
  const auto empty = CheckBodies(none.Placed(Pose()), grid.Placed(Pose()), Certified());
  ASSERT_TRUE(empty.ok());
  EXPECT_TRUE(empty->certificates.empty());
}

TEST(PieceCertification, MoreThanTheLimitIsRefusedBeforeAnyIsMade) {
  OwnBody grid;
  FillGrid(4, 1, &grid);
  // Faces, edges and corners touch.
  const Pose X_WB = At(4, 0, 0);
  QueryOptions options = Certified();
  const auto all = CheckBodies(grid.Placed(Pose()), grid.Placed(X_WB), options);
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all->certificates.size(), 100u);
  options.max_piece_certificates = 100;
  EXPECT_TRUE(CheckBodies(grid.Placed(Pose()), grid.Placed(X_WB), options).ok());
  options.max_piece_certificates = 99;
  const auto refused = CheckBodies(grid.Placed(Pose()), grid.Placed(X_WB), options);
  EXPECT_TRUE(absl::IsResourceExhausted(refused.status()));
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("more than 99 pairs of pieces"));
}

TEST(PieceCertification, StopsAtAPoll) {
  OwnBody grid;
  FillGrid(4, 1, &grid);
  QueryOptions options = Certified();
  int polls = 0;
  options.should_stop = [&] {
    ++polls;
    return false;
  };
  ASSERT_TRUE(CheckBodies(grid.Placed(Pose()), grid.Placed(At(4, 0, 0)), options).ok());
  const int all = polls;
  // From the first pair on, and at the end.
  for (const int last : {all / 2, all - 1}) {
    polls = 0;
    options.should_stop = [&] { return ++polls > last; };
    EXPECT_TRUE(absl::IsCancelled(
        CheckBodies(grid.Placed(Pose()), grid.Placed(At(4, 0, 0)), options).status()));
  }
}

}  // namespace piece_certification_test
}  // namespace hulld
