#include "core/query/body/body_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "core/query/collision.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/query/body/own_body.h"
#include "tests/core/query/body/rational_world.h"

namespace hulld {
namespace body_search_test {

using testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

int Strength(Relation relation) { return static_cast<int>(relation); }

QueryOptions Detailed() {
  QueryOptions options;
  options.want_separation = true;
  options.want_witness = true;
  options.want_normal = true;
  options.want_axis = true;
  options.want_analysis = true;
  return options;
}

TEST(BodySearch, RelationIsTheStrongestOfAllPairsOfPieces) {
  Random random(TestSeed(1));
  std::array<int, 3> relations = {};
  const auto move = [](int round, Random& from, Pose* X_WB) {
    if (round % 3 == 0) X_WB->t += Vector(from.Between(-6, 6), from.Between(-6, 6), 0);
  };
  for (int round = 0; round < 120; ++round) {
    OwnBody a, b;
    Fill(random, random.Between(1, 12), &a);
    Fill(random, random.Between(1, 12), &b);
    // Bodies with equal rotations meet as lattices do.
    Pose X_WA = At(random.Between(-3, 3), random.Between(-3, 3), random.Between(-3, 3));
    X_WA.q = {2, 1, 0, 1};
    Pose X_WB = X_WA;
    if (round % 4 == 0) X_WB.q = {1, 0, 1, 0};
    move(round, random, &X_WB);
    Relation strongest = Relation::kSeparated;
    std::vector<std::vector<Relation>> of(a.pieces.size());
    for (size_t i = 0; i < a.pieces.size(); ++i) {
      for (size_t j = 0; j < b.pieces.size(); ++j) {
        of[i].push_back(RationalRelation(a.hulls[i], {X_WA, a.pieces[i].X_BP}, b.hulls[j],
                                         {X_WB, b.pieces[j].X_BP}));
        if (Strength(of[i][j]) > Strength(strongest)) strongest = of[i][j];
      }
    }
    const absl::StatusOr<BodyAnswer> answer =
        CheckBodies(a.Placed(X_WA), b.Placed(X_WB), QueryOptions());
    ASSERT_TRUE(answer.ok());
    ASSERT_EQ(answer->answer.relation, strongest) << round;
    ++relations[static_cast<size_t>(strongest)];
    ASSERT_EQ(answer->pieces.has_value(), strongest != Relation::kSeparated);
    if (answer->pieces) {
      EXPECT_EQ(of[answer->pieces->a][answer->pieces->b], strongest);
    }

    const absl::StatusOr<BodyAnswer> detailed =
        CheckBodies(a.Placed(X_WA), b.Placed(X_WB), Detailed());
    ASSERT_TRUE(detailed.ok());
    EXPECT_EQ(detailed->answer.relation, strongest);
    if (detailed->pieces) {
      EXPECT_EQ(of[detailed->pieces->a][detailed->pieces->b], strongest);
    }
  }
  for (const int count : relations) EXPECT_GT(count, 3);
}

// Every pair of pieces is decided with the sum of four radii.
TEST(BodySearch, RadiiOfBodiesAndPiecesAddUp) {
  Random random(TestSeed(8));
  std::array<int, 3> relations = {};
  for (int round = 0; round < 300; ++round) {
    OwnBody a, b;
    for (OwnBody* const body : {&a, &b}) {
      for (int i = random.Between(1, 3); i > 0; --i) {
        body->Add(RandomLatticePoints(random, random.Between(1, 3), 2),
                  At(random.Between(-3, 3), random.Between(-3, 3), random.Between(-3, 3)),
                  random.Between(0, 2) / 4.0);
      }
      body->Finish();
    }
    const PlacedBody placed_a = a.Placed(At(0, 0, 0), 0.25);
    const PlacedBody placed_b = b.Placed(At(random.Between(-8, 8), random.Between(-3, 3), 0), 0.5);
    Relation strongest = Relation::kSeparated;
    double least = kInfinity;
    for (uint32_t i = 0; i < a.pieces.size(); ++i) {
      for (uint32_t j = 0; j < b.pieces.size(); ++j) {
        // The sums are exact.
        const PlacedHull piece_a(a.query_hulls[i], a.pieces[i].X_BP, 0.25 + a.pieces[i].radius);
        Pose X_WP = b.pieces[j].X_BP;
        X_WP.t += placed_b.X_WB().t;
        const PlacedHull piece_b(b.query_hulls[j], X_WP, 0.5 + b.pieces[j].radius);
        const Answer answer = CheckCollision(piece_a, piece_b, Detailed()).value();
        if (Strength(answer.relation) > Strength(strongest)) strongest = answer.relation;
        least = std::min(least, answer.separation->value);
      }
    }
    const auto quick = CheckBodies(placed_a, placed_b, QueryOptions());
    EXPECT_EQ(quick->answer.relation, strongest) << round;
    const auto detailed = CheckBodies(placed_a, placed_b, Detailed());
    EXPECT_EQ(detailed->answer.relation, strongest) << round;
    EXPECT_NEAR(detailed->answer.separation->value, least, detailed->answer.separation->bound);
    EXPECT_EQ(CheckBodies(placed_b, placed_a, Detailed())->answer.separation->value,
              detailed->answer.separation->value);
    QueryOptions proven;
    proven.want_certificate = true;
    EXPECT_EQ(CheckBodies(placed_a, placed_b, proven)->answer.relation, strongest);
    ++relations[static_cast<size_t>(strongest)];
  }
  for (const int count : relations) EXPECT_GT(count, 1);
}

TEST(BodySearch, SwappingTheBodiesMirrorsTheAnswer) {
  Random random(TestSeed(2));
  for (int round = 0; round < 40; ++round) {
    OwnBody a, b;
    Fill(random, random.Between(1, 30), &a);
    Fill(random, random.Between(1, 30), &b);
    const Pose X_WB = At(random.Between(-7, 7), random.Between(-7, 7), 0);
    for (const QueryOptions& options : {QueryOptions(), Detailed()}) {
      BodyCounts counts, mirrored_counts;
      const auto answer = CheckBodies(a.Placed(Pose()), b.Placed(X_WB), options, &counts);
      const auto mirrored =
          CheckBodies(b.Placed(X_WB), a.Placed(Pose()), options, &mirrored_counts);
      ASSERT_TRUE(answer.ok() && mirrored.ok());
      EXPECT_EQ(answer->answer.relation, mirrored->answer.relation);
      EXPECT_EQ(counts.pairs, mirrored_counts.pairs);
      EXPECT_EQ(counts.boxes, mirrored_counts.boxes);
      ASSERT_EQ(answer->pieces.has_value(), mirrored->pieces.has_value());
      if (!answer->pieces) continue;
      EXPECT_EQ(*answer->pieces, (PiecePair{mirrored->pieces->b, mirrored->pieces->a}));
      if (!options.want_separation) continue;
      EXPECT_EQ(answer->answer.separation->value, mirrored->answer.separation->value);
      EXPECT_EQ(answer->answer.separation->bound, mirrored->answer.separation->bound);
      EXPECT_EQ(answer->answer.witness->p_WA, mirrored->answer.witness->p_WB);
      EXPECT_EQ(answer->answer.normal->direction, -mirrored->answer.normal->direction);
    }
  }
}

TEST(BodySearch, SeparationIsTheMinimumOverAllPairs) {
  Random random(TestSeed(3));
  QueryOptions wanted;
  wanted.want_separation = true;
  std::array<int, 3> relations = {};
  for (int round = 0; round < 60; ++round) {
    OwnBody a, b;
    Fill(random, random.Between(1, 14), &a);
    Fill(random, random.Between(1, 14), &b);
    const Pose X_WA = At(0, 0, 0);
    Pose X_WB =
        At(random.Between(-14, 14) / (1 + round % 4), random.Between(-4, 4), random.Real(-1, 1));
    X_WB.q = {3, 1, 0, 0};
    double least = kInfinity;
    for (uint32_t i = 0; i < a.pieces.size(); ++i) {
      for (uint32_t j = 0; j < b.pieces.size(); ++j) {
        const PlacedPiece piece_a(a.Placed(X_WA), i);
        const PlacedPiece piece_b(b.Placed(X_WB), j);
        least = std::min(
            least, CheckCollision(piece_a.placed(), piece_b.placed(), wanted)->separation->value);
      }
    }
    for (const double clearance : {0.0, 0.5, 100.0}) {
      QueryOptions options = wanted;
      options.clearance = clearance;
      const auto answer = CheckBodies(a.Placed(X_WA), b.Placed(X_WB), options);
      ASSERT_TRUE(answer.ok());
      EXPECT_EQ(answer->answer.separation->value, least) << round;
      EXPECT_LE(answer->answer.separation->bound, 1e-10);
      ++relations[static_cast<size_t>(answer->answer.relation)];
      // No sum is near the queried clearances.
      if (std::abs(least - clearance) > 1e-9) {
        EXPECT_EQ(answer->answer.within_clearance, least <= clearance);
      }
      QueryOptions relation_only;
      relation_only.clearance = clearance;
      const auto quick = CheckBodies(a.Placed(X_WA), b.Placed(X_WB), relation_only);
      EXPECT_EQ(quick->answer.within_clearance, answer->answer.within_clearance);
      EXPECT_EQ(quick->answer.relation, answer->answer.relation);
    }
  }
  EXPECT_GT(relations[static_cast<size_t>(Relation::kSeparated)], 10);
  EXPECT_GT(relations[static_cast<size_t>(Relation::kOverlapping)], 10);
}

TEST(BodySearch, OnlyTheFewNearPairsOfManyPiecesAreQueried) {
  OwnBody grid;
  FillGrid(10, 2, &grid);
  // The corners of the grids overlap in one pair of cubes.
  BodyCounts counts;
  const auto overlap = CheckBodies(grid.Placed(At(0, 0, 0)), grid.Placed(At(18.5, 18.5, 18.5)),
                                   QueryOptions(), &counts);
  EXPECT_EQ(overlap->answer.relation, Relation::kOverlapping);
  EXPECT_EQ(*overlap->pieces, (PiecePair{999, 0}));
  EXPECT_EQ(counts.pairs, 1u);
  EXPECT_LT(counts.boxes, 400u);
  // 100 pairs of cubes share a face, of a million pairs.
  const auto touching =
      CheckBodies(grid.Placed(At(0, 0, 0)), grid.Placed(At(19, 0, 0)), QueryOptions(), &counts);
  EXPECT_EQ(touching->answer.relation, Relation::kTouching);
  EXPECT_EQ(counts.pairs, 100u);
  EXPECT_LT(counts.boxes, 30000u);
  // One test decides grids that are apart.
  const auto apart =
      CheckBodies(grid.Placed(At(0, 0, 0)), grid.Placed(At(40, 0, 0)), QueryOptions(), &counts);
  EXPECT_EQ(apart->answer.relation, Relation::kSeparated);
  EXPECT_EQ(counts.boxes, 1u);
  EXPECT_EQ(counts.pairs, 0u);
  // A rotated grid, and the nearest pair of a million.
  Pose between = At(45, 0, 0);
  between.q = {3, 0, 0, 1};
  QueryOptions options;
  options.want_separation = true;
  const auto nearest = CheckBodies(grid.Placed(Pose()), grid.Placed(between), options, &counts);
  EXPECT_EQ(nearest->answer.relation, Relation::kSeparated);
  EXPECT_LT(counts.pairs, 1000u);
  EXPECT_LT(counts.boxes, 10000u);
}

// Regression test: the search for the relation went on among all pairs within the clearance.
TEST(BodySearch, AClearanceSearchEndsAtTheFirstPairWithinIt) {
  OwnBody grid;
  FillGrid(10, 2, &grid);
  QueryOptions options;
  options.clearance = 100;
  BodyCounts counts;
  const auto answer = CheckBodies(grid.Placed(Pose()), grid.Placed(At(49, 0, 0)), options, &counts);
  EXPECT_EQ(answer->answer.relation, Relation::kSeparated);
  EXPECT_EQ(answer->answer.within_clearance, true);
  EXPECT_TRUE(answer->pieces.has_value());
  EXPECT_EQ(counts.pairs, 1u);
  EXPECT_LT(counts.boxes, 400u);
  // Only the pairs that share a face are left.
  const auto touching =
      CheckBodies(grid.Placed(Pose()), grid.Placed(At(19, 0, 0)), options, &counts);
  EXPECT_EQ(touching->answer.relation, Relation::kTouching);
  EXPECT_EQ(touching->answer.within_clearance, true);
  EXPECT_EQ(counts.pairs, 100u);
  // A negative clearance that no pair meets: once the relation is known, only pairs that may be as
  // deep are left.
  options.clearance = -0.75;
  const auto shallow =
      CheckBodies(grid.Placed(Pose()), grid.Placed(At(18.5, 0, 0)), options, &counts);
  EXPECT_EQ(shallow->answer.relation, Relation::kOverlapping);
  EXPECT_EQ(shallow->answer.within_clearance, false);
  EXPECT_EQ(counts.pairs, 1u);
}

TEST(BodySearch, AClearanceCostsNoMoreWorkThanTheSeparation) {
  Random random(TestSeed(9));
  QueryOptions separation;
  separation.want_separation = true;
  OwnBody grid;
  FillGrid(5, 1.5, &grid);
  for (int round = 0; round < 60; ++round) {
    OwnBody a, b;
    Fill(random, random.Between(1, 30), &a);
    Fill(random, random.Between(1, 30), &b);
    const bool of_grids = round % 3 == 0;
    Pose X_WB = At(random.Real(0, 14), random.Real(-2, 2), random.Real(-2, 2));
    if (round % 2 == 0) X_WB.q = {3, 1, 0, random.Real(-1, 1)};
    const PlacedBody placed_a = (of_grids ? grid : a).Placed(Pose());
    const PlacedBody placed_b = (of_grids ? grid : b).Placed(X_WB);
    BodyCounts most;
    const auto answer = CheckBodies(placed_a, placed_b, separation, &most);
    const double least = answer->answer.separation->value;
    for (const double clearance :
         {least - 1, least - 1e-6, least + 1e-6, least + 1, 100.0, kInfinity, -kInfinity}) {
      QueryOptions options;
      options.clearance = clearance;
      BodyCounts counts;
      const auto found = CheckBodies(placed_a, placed_b, options, &counts);
      EXPECT_EQ(found->answer.relation, answer->answer.relation) << round;
      EXPECT_EQ(found->answer.within_clearance, least <= clearance) << round;
      EXPECT_LE(counts.pairs, most.pairs) << "round " << round << ", clearance " << clearance;
      EXPECT_LE(counts.boxes, most.boxes) << "round " << round << ", clearance " << clearance;
    }
  }
}

TEST(BodySearch, AHullIsQueriedAgainstBodies) {
  OwnBody body;
  body.Add(LatticeCube(2, 1), At(0, 0, 0));
  body.Add(LatticeCube(2, 1), At(5, 0, 0));
  body.Finish();
  const Hull cube = BuildHull(LatticeCube(2, 1));
  const QueryHull query_cube(cube);
  const QueryBody hull(query_cube);
  const auto answer =
      CheckBodies(PlacedBody(hull, At(5.5, 0.5, 0.5)), body.Placed(Pose()), QueryOptions());
  EXPECT_EQ(answer->answer.relation, Relation::kOverlapping);
  EXPECT_EQ(*answer->pieces, (PiecePair{0, 1}));
  const auto touching = CheckBodies(PlacedBody(hull, At(1, 1, 1)), body.Placed(Pose()), Detailed());
  EXPECT_EQ(touching->answer.relation, Relation::kTouching);
  EXPECT_EQ(*touching->pieces, (PiecePair{0, 0}));
  EXPECT_EQ(touching->answer.separation->value, 0);
  EXPECT_EQ(touching->answer.separation->bound, 0);
}

TEST(BodySearch, ABodyWithoutPointsIsSeparatedFromEverything) {
  OwnBody none, empty, cube;
  none.Finish();
  empty.Add({}, Pose());
  empty.Finish();
  cube.Add(LatticeCube(2, 1), Pose());
  cube.Finish();
  for (const OwnBody* body : {&none, &empty}) {
    QueryOptions options = Detailed();
    options.clearance = kInfinity;
    const auto answer = CheckBodies(body->Placed(Pose()), cube.Placed(Pose()), options);
    ASSERT_TRUE(answer.ok());
    EXPECT_EQ(answer->answer.relation, Relation::kSeparated);
    EXPECT_EQ(answer->answer.separation->value, kInfinity);
    EXPECT_EQ(answer->answer.within_clearance, false);
    EXPECT_FALSE(answer->pieces.has_value());
  }
}

// The relation is that of the pieces, not of their union.
TEST(BodySearch, ASeamIsTreatedAsTheBoundaryOfThePieces) {
  OwnBody block, sheet;
  block.Add(LatticeCube(2, 1), At(0, 0, 0));
  block.Add(LatticeCube(2, 1), At(1, 0, 0));
  block.Finish();
  // In the plane where the cubes meet, inside their union.
  sheet.Add({{1, 0.25, 0.25}, {1, 0.75, 0.25}, {1, 0.25, 0.75}}, Pose());
  sheet.Finish();
  EXPECT_EQ(
      CheckBodies(block.Placed(Pose()), sheet.Placed(Pose()), QueryOptions())->answer.relation,
      Relation::kTouching);
}

TEST(BodySearch, WithinToleranceIsStrongerThanTouching) {
  OwnBody pair, cube;
  pair.Add(LatticeCube(2, 1), At(1, 0, 0));
  pair.Add(LatticeCube(2, 1), At(0, 0.999999, 0));
  pair.Finish();
  cube.Add(LatticeCube(2, 1), Pose());
  cube.Finish();
  QueryOptions options;
  options.tolerance = 0.01;
  const auto answer = CheckBodies(pair.Placed(Pose()), cube.Placed(Pose()), options);
  ASSERT_TRUE(answer.ok());
  EXPECT_THAT(answer->answer.relation,
              testing::AnyOf(Relation::kWithinTolerance, Relation::kOverlapping));
}

TEST(BodySearch, StepwiseSearchReturnsTheSameAnswer) {
  OwnBody grid;
  FillGrid(5, 1, &grid);
  const PlacedBody a = grid.Placed(Pose());
  const PlacedBody b = grid.Placed(At(4.5, 3.5, 0.25));
  const QueryOptions options = Detailed();
  BodySearch search(a, b, options);
  int slices = 0;
  while (!*search.Advance(7)) ++slices;
  EXPECT_GT(slices, 10);
  const auto sliced = search.Take();
  const auto whole = CheckBodies(a, b, options);
  EXPECT_EQ(sliced->answer.relation, whole->answer.relation);
  EXPECT_EQ(*sliced->pieces, *whole->pieces);
  EXPECT_EQ(sliced->answer.separation->value, whole->answer.separation->value);
}

TEST(BodySearch, StopsAtAPoll) {
  OwnBody grid;
  FillGrid(5, 1, &grid);
  QueryOptions options;
  options.want_separation = true;
  int polls = 0;
  options.should_stop = [&] { return ++polls > 3; };
  const auto answer = CheckBodies(grid.Placed(Pose()), grid.Placed(At(2, 2, 2)), options);
  EXPECT_TRUE(absl::IsCancelled(answer.status()));
  EXPECT_EQ(polls, 4);
}

TEST(BodySearch, RefusesOptionsForPairsOfHulls) {
  OwnBody cube;
  cube.Add(LatticeCube(2, 1), Pose());
  cube.Finish();
  QueryOptions options;
  options.method = Method::kTextbookSat;
  EXPECT_THAT(
      std::string(
          CheckBodies(cube.Placed(Pose()), cube.Placed(Pose()), options).status().message()),
      HasSubstr("not of bodies"));
}

TEST(BodySearch, CoordinatesBeyondTheRangeOfBoxesAreStillQueried) {
  OwnBody large, small;
  large.Add(Scaled(LatticeCube(2, 1), 1e307), At(0, 0, 0));
  large.Add(LatticeCube(2, 1), At(-1e307, 0, 0));
  large.Finish();
  small.Add(Scaled(LatticeCube(2, 1), 1e-320), At(0, 0, 0));
  small.Finish();
  EXPECT_EQ(CheckBodies(large.Placed(Pose()), small.Placed(At(-1e-320, 0, 0)), QueryOptions())
                ->answer.relation,
            Relation::kTouching);
  EXPECT_EQ(
      CheckBodies(large.Placed(Pose()), small.Placed(At(1, 1, 1)), QueryOptions())->answer.relation,
      Relation::kOverlapping);
}

}  // namespace body_search_test
}  // namespace hulld
