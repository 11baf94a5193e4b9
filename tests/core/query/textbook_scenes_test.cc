#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "core/hull/audit.h"
#include "core/query/collision.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/checks/relation_check.h"

namespace hulld {
namespace textbook_scenes_test {

// The scenes of the coursework that this project grew from, with poses that make the answer known:
// each hull is shifted so that one of its vertices is exactly the origin. The textbook runs on the
// hulls of at most this many vertices.
constexpr size_t kTextbookVertices = 70;

Pose At(const Vector& t) {
  Pose pose;
  pose.t = t;
  return pose;
}

// Return the vertex of largest or least x. Vertices are sorted by x first.
const Vector& Rightmost(const Hull& hull) { return hull.vertices().back(); }
const Vector& Leftmost(const Hull& hull) { return hull.vertices().front(); }

void Expect(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB, Relation expected,
            const char* scene) {
  const bool small = std::max(a.vertices().size(), b.vertices().size()) <= kTextbookVertices;
  RelationCheck check;
  EXPECT_TRUE(check.Verify(a, X_WA, b, X_WB, expected,
                           small ? RelationCheck::kAllWays : RelationCheck::kSearchOnly))
      << scene;
#ifndef HULLD_SANITIZED
  EXPECT_STREQ(Name(OracleRelation(a, X_WA, b, X_WB)), Name(expected)) << scene;
#endif
}

// Expects the relations of two hulls far apart, overlapping deeply and slightly, and exactly at the
// boundary: A's rightmost vertex and B's leftmost both at the origin, with A in x <= 0 and B in x
// >= 0.
void ExpectScenes(const Hull& a, const Hull& b) {
  const Vector at_a = -Rightmost(a);
  const Vector at_b = -Leftmost(b);
  const double width = Rightmost(a).x() - Leftmost(a).x() + Rightmost(b).x() - Leftmost(b).x();
  Expect(a, At(at_a), b, At(at_b), Relation::kTouching, "exactly at the boundary");
  Expect(a, At(at_a), b, At(at_b + Vector(width, 0, 0)), Relation::kSeparated, "far apart");
  Pose apart = At(at_b);
  apart.t.x() = std::nextafter(apart.t.x(), 2 * std::abs(apart.t.x()) + 1);
  Expect(a, At(at_a), b, apart, Relation::kSeparated, "one unit in the last place apart");

  // Toward the other's center, by about a tenth and by about 2^-40 of the size.
  const auto center = [](const Hull& hull) {
    Vector sum = Vector::Zero();
    for (const Vector& p : hull.vertices()) sum += p;
    return Vector(sum / static_cast<double>(hull.vertices().size()));
  };
  // From B's center to A's, each relative to the common origin: an inner direction of A - B.
  const Vector inward = (center(a) + at_a) - (center(b) + at_b);
  Expect(a, At(at_a), b, At(at_b + 0.9 * inward), Relation::kOverlapping, "overlapping plainly");
  Expect(a, At(at_a), b, At(at_b + 0x1p-40 * inward), Relation::kOverlapping, "overlapping barely");
  // A common quarter turn changes nothing.
  Pose turned_a = At(Vector(at_a.x(), -at_a.z(), at_a.y()));
  Pose turned_b = At(Vector(at_b.x(), -at_b.z(), at_b.y()));
  turned_a.q = turned_b.q = {1, 1, 0, 0};
  Expect(a, turned_a, b, turned_b, Relation::kTouching, "at the boundary, turned");
}

TEST(TextbookScenes, OneMesh) {
  const std::optional<std::vector<Vector>> mesh = MeshVertices("spot.obj");
  if (!mesh) GTEST_SKIP() << "skipped: no data";
  const Hull hull = BuildHull(*mesh);
  EXPECT_EQ(hull.dimension(), 3);
  EXPECT_TRUE(AuditHull(hull).ok());
  Expect(hull, Pose(), hull, Pose(), Relation::kOverlapping, "a mesh and itself");
}

TEST(TextbookScenes, TwoCopiesOfAMesh) {
  const std::optional<std::vector<Vector>> mesh = MeshVertices("spot.obj");
  if (!mesh) GTEST_SKIP() << "skipped: no data";
  const Hull hull = BuildHull(*mesh);
  ExpectScenes(hull, hull);
}

TEST(TextbookScenes, ThreeThousandRandomPointsInABall) {
  Random random(801);
  const Hull hull = BuildHull(RandomInBall(random, 3000, 1));
  ExpectScenes(hull, hull);
}

TEST(TextbookScenes, AHundredRandomPointsInABall) {
  Random random(802);
  const Hull hull = BuildHull(RandomInBall(random, 100, 1));
  ASSERT_LE(hull.vertices().size(), kTextbookVertices);
  ExpectScenes(hull, hull);
}

TEST(TextbookScenes, TwoRandomBalls) {
  Random random(803);
  const Hull large = BuildHull(RandomInBall(random, 3000, 2));
  const Hull small = BuildHull(RandomInBall(random, 100, 1));
  ExpectScenes(large, small);
  const Hull other = BuildHull(RandomInBall(random, 60, 1.5));
  ExpectScenes(small, other);
}

// With no time budget, each part tests one block of axes.
TEST(TextbookCheck, WorkInPartsReturnsTheSameAnswerAndStopsBetweenThem) {
  Random random(TestSeed(941));
  const Hull a = BuildHull(RandomOnSphere(random, 60, 1));
  const Hull b = BuildHull(RandomOnSphere(random, 60, 1));
  const QueryHull query_a(a);
  const QueryHull query_b(b);
  for (const double x : {0.5, 1.9, 5.0}) {
    for (const int threads : {1, 2}) {
      const PlacedHull placed_a(query_a, Pose());
      const PlacedHull placed_b(query_b, At({x, 0, 0}));
      bool stop = false;
      QueryOptions options;
      options.method = Method::kTextbookSat;
      options.threads = threads;
      options.want_axis = true;
      options.want_analysis = true;
      options.should_stop = [&stop] { return stop; };
      const absl::StatusOr<Answer> whole = CheckCollision(placed_a, placed_b, options);
      ASSERT_TRUE(whole.ok());
      absl::StatusOr<TextbookCheck> check = TextbookCheck::Begin(placed_a, placed_b, options);
      ASSERT_TRUE(check.ok());
      uint64_t pieces = 1;
      while (!*check->Advance(TextbookSearch::Clock::time_point::min())) ++pieces;
      constexpr uint64_t kAxesPerPoll = 64;
      EXPECT_GE(pieces * threads, whole->analysis->axes_tested / kAxesPerPoll);
      const absl::StatusOr<Answer> answer = check->Finish();
      ASSERT_TRUE(answer.ok());
      EXPECT_EQ(answer->relation, whole->relation);
      EXPECT_EQ(answer->axis.has_value(), whole->axis.has_value());
      EXPECT_EQ(answer->analysis->axes_total, whole->analysis->axes_total);
      EXPECT_EQ(answer->analysis->axes_tested, whole->analysis->axes_tested);
      EXPECT_EQ(answer->analysis->axis_index, whole->analysis->axis_index);
      // Abandoned after the first part.
      absl::StatusOr<TextbookCheck> stopped = TextbookCheck::Begin(placed_a, placed_b, options);
      ASSERT_TRUE(stopped.ok());
      if (*stopped->Advance(TextbookSearch::Clock::time_point::min())) continue;
      stop = true;
      EXPECT_TRUE(
          absl::IsCancelled(stopped->Advance(TextbookSearch::Clock::time_point::max()).status()));
    }
  }
}

}  // namespace textbook_scenes_test
}  // namespace hulld
