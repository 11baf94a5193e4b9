#include "core/query/exact/lattice_contact.h"

#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <vector>

#include "core/query/floating/float_search.h"
#include "core/query/placed/placed_hull.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/checks/relation_check.h"
#include "tests/test_size.h"

namespace hulld {
namespace lattice_contact_test {

constexpr int kRounds = TestSize(20000, 10000);

std::optional<LatticeContact> Find(const Hull& a, const Pose& X_WA, const Hull& b,
                                   const Pose& X_WB) {
  const QueryHull query_a(a);
  const QueryHull query_b(b);
  const PlacedHull placed_a(query_a, X_WA);
  const PlacedHull placed_b(query_b, X_WB);
  const FloatPair pair(placed_a, placed_b);
  const FloatSearchResult end = SearchInFloatingPoint(pair, 0, -pair.CenterDifference());
  if (end.verdict != FloatVerdict::kUndecided) return std::nullopt;
  return FindLatticeContact(pair, end);
}

// Moves B so that a vertex of A and one of B meet, up to the rounding of rotations that leave the
// lattice.
Pose WithMeetingVertices(Random& random, const Hull& a, const Pose& X_WA, const Hull& b,
                         Pose X_WB) {
  const QueryHull query_a(a);
  const QueryHull query_b(b);
  const PlacedHull placed_a(query_a, X_WA);
  const PlacedHull placed_b(query_b, X_WB);
  const auto pick = [&](const Hull& hull) {
    return static_cast<uint32_t>(random.Below(hull.vertices().size()));
  };
  X_WB.t += Vector(FloatPair(placed_a, placed_b).Difference({pick(a), pick(b)}));
  return X_WB;
}

// A box or a random hull of few lattice points.
Hull SmallHull(Random& random) {
  std::vector<Vector> points = RandomLatticePoints(random, 8, 5);
  if (random.Below(2) == 0) {
    const Vector size(random.Between(1, 4), random.Between(1, 4), random.Between(1, 4));
    for (int i = 0; i < 8; ++i) points[i] = size.cwiseProduct(Vector(i & 1, i >> 1 & 1, i >> 2));
  }
  return BuildHull(points);
}

// The identity, a quarter or third turn, or a rotation that leaves the lattice, at any scale.
Pose SmallPose(Random& random) {
  Pose pose;
  const double c = random.Between(1, 3);
  const std::array<double, 4> turns[] = {{c, 0, 0, 0},  {0, 0, -c, 0}, {c, 0, c, 0},
                                         {c, -c, c, c}, {c, c, -c, 0}, {c, 2 * c, 0, 0}};
  pose.q = turns[random.Below(6)];
  for (int k = 0; k < 3; ++k) pose.t[k] = random.Between(-4, 4) * 0.5;
  return pose;
}

TEST(LatticeContact, FoundContactsTouch) {
  const uint64_t seed = TestSeed(20261127);
  SCOPED_TRACE(seed);
  Random random(seed);
  RelationCheck check;
  int at_vertices = 0;
  int across_axes = 0;
  for (int round = 0; round < kRounds; ++round) {
    const Hull a = SmallHull(random);
    const Hull b = SmallHull(random);
    const Pose X_WA = SmallPose(random);
    Pose X_WB = SmallPose(random);
    if (round % 2 == 0) X_WB = WithMeetingVertices(random, a, X_WA, b, X_WB);
    const std::optional<LatticeContact> contact = Find(a, X_WA, b, X_WB);
    if (!contact) continue;
    ASSERT_EQ(OracleRelation(a, X_WA, b, X_WB), Relation::kTouching) << Describe(a, X_WA, b, X_WB);
    // The certificate consists of the axis and the pairs.
    ASSERT_TRUE(check.Verify(a, X_WA, b, X_WB, Relation::kTouching, RelationCheck::kSearchOnly));
    const bool is_across = (contact->axis.array() == 0).count() == 2;
    across_axes += is_across ? 1 : 0;
    at_vertices += is_across ? 0 : 1;
  }
  EXPECT_GT(at_vertices, kRounds / 200);
  EXPECT_GT(across_axes, kRounds / 200);
}

TEST(LatticeContact, OneUnitMakesADifference) {
  const Hull box = BuildHull(LatticeCube(2, 1));
  Pose X_WB;
  X_WB.t = {1, 0.25, -0.5};
  ASSERT_TRUE(Find(box, {}, box, X_WB));
  for (const double change : {0x1p-52, -0x1p-52, 0x1p-48, -0x1p-48}) {
    X_WB.t.x() = 1 + change;
    EXPECT_FALSE(Find(box, {}, box, X_WB)) << change;
  }
}

TEST(LatticeContact, CoordinatesWithManyBitsAreLeftToIntegers) {
  const Hull box = BuildHull(LatticeCube(2, 1));
  const Hull fine = BuildHull(Concatenated(LatticeCube(2, 1), {{0.5, 0.5, -0x1p-60}}));
  Pose X_WB;
  X_WB.t = {1, 0.25, 0.5};
  EXPECT_TRUE(Find(box, {}, box, X_WB));
  EXPECT_FALSE(Find(box, {}, fine, X_WB));
  Pose X_WA;
  X_WA.t = {0, 0, 0x1p-60};
  EXPECT_FALSE(Find(box, X_WA, box, X_WB));
  // A common offset takes no additional bits.
  X_WA.t = {0x1p30, 0, 0};
  X_WB.t += X_WA.t;
  EXPECT_TRUE(Find(box, X_WA, box, X_WB));
}

}  // namespace lattice_contact_test
}  // namespace hulld
