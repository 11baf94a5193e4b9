#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <vector>

#include "core/query/collision.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/checks/relation_check.h"
#include "tests/test_size.h"

namespace hulld {
namespace large_contact_test {

constexpr int kSphereVertices = TestSize(1500, 400);
constexpr int kParaboloidRadius = TestSize(19, 7);

std::vector<Vector> Reflected(std::span<const Vector> points) {
  std::vector<Vector> result;
  for (const Vector& p : points) result.push_back(-p);
  return result;
}

Pose At(const Vector& t) {
  Pose pose;
  pose.t = t;
  return pose;
}

// Queries by the search and prints the time of an answer; only the benchmark asserts speed.
void ExpectRelation(const char* name, const Hull& a, const Pose& X_WA, const Hull& b,
                    const Pose& X_WB, Relation expected) {
  const auto start = std::chrono::steady_clock::now();
  const absl::StatusOr<Answer> answer = CheckCollision(a, X_WA, b, X_WB);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_STREQ(Name(answer->relation), Name(expected)) << name;
  std::printf("%-34s %5zu x %5zu vertices  %-11s %9.6f s\n", name, a.vertices().size(),
              b.vertices().size(), Name(answer->relation), seconds.count());
  RelationCheck check;
  EXPECT_TRUE(check.Verify(a, X_WA, b, X_WB, expected, RelationCheck::kSearchOnly)) << name;
}

// A - v and its reflection share the origin, and v is extreme: they touch there, vertex to vertex.
TEST(LargeContact, SpheresTouchAtAVertex) {
  for (double scale : {1.0, 1e-30, 1e30}) {
    const Hull a = BuildHull(Scaled(FibonacciSphere(kSphereVertices), scale));
    ASSERT_EQ(a.vertices().size(), static_cast<size_t>(kSphereVertices));
    const Hull b = BuildHull(Reflected(a.vertices()));
    for (size_t i : {size_t{0}, a.vertices().size() / 2, a.vertices().size() - 1}) {
      const Vector v = a.vertices()[i];
      ExpectRelation("sphere vertex to vertex", a, At(-v), b, At(v), Relation::kTouching);
      ExpectRelation("a hair apart", a, At(-v), b, At(v * (1 + 0x1p-50)), Relation::kSeparated);
      ExpectRelation("a hair deep", a, At(-v), b, At(v * (1 - 0x1p-50)), Relation::kOverlapping);
    }
  }
}

// The lattice paraboloid and its reflection about the center of a square: face to face.
TEST(LargeContact, IntegerHullsTouchFaceToFace) {
  const std::vector<Vector> bowl = IntegerParaboloid(kParaboloidRadius);
  const Hull a = BuildHull(bowl);
  ASSERT_EQ(a.vertices().size(), bowl.size());
  // Twice the center of the square on (i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1).
  const auto twice_center = [](int i, int j) {
    return Vector(2 * i + 1, 2 * j + 1, i * i + j * j + (i + 1) * (i + 1) + (j + 1) * (j + 1));
  };
  Pose pose;
  pose.q = {0.9, -0.2, 0.31, 0.7};
  pose.t = Vector(0.1, 1e6, 3);
  for (const auto& [i, j] : {std::pair(0, 0), std::pair(-5, 3), std::pair(4, 6)}) {
    const Hull b = BuildHull(Shifted(Reflected(bowl), twice_center(i, j)));
    ExpectRelation("square to square", a, Pose(), b, Pose(), Relation::kTouching);
    ExpectRelation("square to square, any pose", a, pose, b, pose, Relation::kTouching);
    Pose turned;
    turned.q = {2, 1, 0, 0};
    ExpectRelation("square to square, integer pose", a, turned, b, turned, Relation::kTouching);
    // One step down in the common frame, along the square's normal (a, b, -1) on the outside.
    const Hull apart =
        BuildHull(Shifted(Reflected(bowl), twice_center(i, j) - Vector(0, 0, 0x1p-40)));
    ExpectRelation("a hair apart", a, pose, apart, pose, Relation::kSeparated);
    const Hull deep =
        BuildHull(Shifted(Reflected(bowl), twice_center(i, j) + Vector(0, 0, 0x1p-40)));
    ExpectRelation("a hair deep", a, pose, deep, pose, Relation::kOverlapping);
  }
}

// Two many-sided coplanar discs as faces of prisms: thousands of coplanar differences.
TEST(LargeContact, PrismsOverManySidedPolygonsTouchFaceToFace) {
  std::vector<Vector> prism;
  for (const Vector& p : IntegerSphere(1105)) {
    if (p.z() != 0) continue;
    prism.emplace_back(0, p.x(), p.y());
  }
  for (int k = -kParaboloidRadius * 10; k <= kParaboloidRadius * 10; ++k) {
    prism.emplace_back(0, k, k * k);
  }
  prism = Concatenated(prism, Shifted(prism, Vector(-7, 0, 0)));
  const Hull a = BuildHull(prism);
  const Hull b = BuildHull(Reflected(prism));
  Pose pose;
  pose.q = {0.3, 0.4, -0.7, 0.2};
  ExpectRelation("polygon to polygon", a, Pose(), b, Pose(), Relation::kTouching);
  ExpectRelation("polygon to polygon, any pose", a, pose, b, pose, Relation::kTouching);
  ExpectRelation("the same prism twice", a, pose, a, pose, Relation::kOverlapping);
}

// Polygons with many corners in one plane, all farthest along its normal. For any query, the scans
// of these poll should_stop and end when it returns true.
TEST(LargeContact, FlatQueriesStopAtEveryPoll) {
  std::vector<Vector> corners;
  for (int i = -10000; i <= 10000; ++i) corners.emplace_back(i, int64_t{i} * i, 0);
  const Hull hull = BuildHull(corners);
  const QueryHull query_hull(hull);
  const PlacedHull a(query_hull, At({0, 0, 0}));
  const PlacedHull b(query_hull, At({100, 20000, 0}));
  for (int kind = 0; kind < 3; ++kind) {
    QueryOptions options;
    options.want_axis = kind == 0;
    options.want_certificate = kind == 1;
    options.want_witness = kind == 2;
    int polls = 0;
    options.should_stop = [&polls] { return ++polls < 0; };
    const absl::StatusOr<Answer> answer = CheckCollision(a, b, options);
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_EQ(answer->relation, Relation::kTouching);
    if (kind == 0) {
      EXPECT_GE(polls, 2 * 20000 / 1024);
    }
    const int all = polls;
    for (int last = 1; last <= all; last += 1 + all / 16) {
      polls = 0;
      options.should_stop = [&polls, last] { return ++polls >= last; };
      const absl::Status status = CheckCollision(a, b, options).status();
      EXPECT_EQ(status.code(), absl::StatusCode::kCancelled)
          << kind << " " << last << " " << status;
    }
  }
}

// The axis limit is checked before any vertex is multiplied out.
TEST(LargeContact, TooManyFlatAxesAreRefusedBeforeAnyWork) {
  std::vector<Vector> corners;
  for (int i = -10000; i <= 10000; ++i) corners.emplace_back(i, int64_t{i} * i, 0);
  const Hull polygon = BuildHull(corners);
  const Hull point = BuildHull(std::vector<Vector>{Vector(0, 1, 0)});
  QueryOptions options;
  options.method = Method::kTextbookSat;
  options.max_textbook_axes = 100;
  int polls = 0;
  options.should_stop = [&polls] { return ++polls < 0; };
  const absl::Status status = CheckCollision(polygon, Pose(), point, Pose(), options).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  EXPECT_EQ(polls, 0);
}

}  // namespace large_contact_test
}  // namespace hulld
