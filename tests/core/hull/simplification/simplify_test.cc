#include "core/hull/simplification/simplify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/hull/audit.h"
#include "core/hull/growth/hull_builder.h"

namespace hulld {
namespace {

// Exact audits take the square of this.
#ifdef HULLD_SANITIZED
constexpr int kLargeSphere = 1000;
#else
constexpr int kLargeSphere = 5000;
#endif

Hull HullOf(const std::vector<Vector>& points) {
  HullBuilder builder;
  EXPECT_TRUE(builder.Add(points).ok());
  return builder.Snapshot();
}

std::vector<Vector> Sphere(int n, unsigned seed, const Vector& radii = Vector(1, 1, 1)) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Vector> points;
  for (int i = 0; i < n; ++i) {
    const Vector v(normal(random), normal(random), normal(random));
    points.push_back(v.normalized().cwiseProduct(radii));
  }
  return points;
}

double Support(const Hull& hull, const Vector& n) {
  double most = -INFINITY;
  for (const Vector& v : hull.vertices()) most = std::max(most, n.dot(v));
  return most;
}

// The Hausdorff distance of nested convex sets is the largest difference of their support
// functions; over some directions that is a lower bound.
double LeastHausdorffDistance(const Hull& inner, const Hull& outer) {
  double most = 0;
  for (const Vector& n : Sphere(3000, 99)) {
    most = std::max(most, Support(outer, n) - Support(inner, n));
  }
  return most;
}

bool IsSubset(const Hull& part, const Hull& whole) {
  return std::all_of(part.vertices().begin(), part.vertices().end(), [&](const Vector& v) {
    return std::find(whole.vertices().begin(), whole.vertices().end(), v) != whole.vertices().end();
  });
}

class Simplify : public testing::TestWithParam<size_t> {};

TEST_P(Simplify, InsideIsASubsetWithinItsProvenError) {
  for (const Vector& radii : {Vector(1, 1, 1), Vector(5, 1, 0.2), Vector(1e-3, 1, 1e3)}) {
    const Hull full = HullOf(Sphere(2000, 1, radii));
    const auto inside = SimplifyInside(full, {GetParam(), 0, {}});
    ASSERT_TRUE(inside.ok()) << inside.status();
    EXPECT_EQ(inside->hull.vertices().size(), GetParam());
    EXPECT_TRUE(AuditHull(inside->hull).ok());
    EXPECT_TRUE(IsSubset(inside->hull, full));
    const double least = LeastHausdorffDistance(inside->hull, full);
    EXPECT_GE(inside->error, least * (1 - 1e-12));
    // Some directions tell little of a slender shape.
    if (radii.minCoeff() > 0.1) {
      EXPECT_LE(inside->error, 2 * least);
    }
  }
}

TEST_P(Simplify, OutsideEnclosesExactlyWithinItsProvenError) {
  for (const Vector& radii : {Vector(1, 1, 1), Vector(5, 1, 0.2), Vector(1e-3, 1, 1e3)}) {
    const Hull full = HullOf(Sphere(2000, 2, radii));
    const auto outside = SimplifyOutside(full, {GetParam(), 0, {}});
    ASSERT_TRUE(outside.ok()) << outside.status();
    EXPECT_LE(outside->hull.vertices().size(), GetParam());
    EXPECT_TRUE(AuditHull(outside->hull).ok());
    EXPECT_TRUE(AuditContainment(outside->hull, full.vertices()).ok());
    const double least = LeastHausdorffDistance(full, outside->hull);
    EXPECT_GE(outside->error, least * (1 - 1e-12));
    if (radii.minCoeff() > 0.1) {
      EXPECT_LE(outside->error, 3 * least);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Vertices, Simplify, testing::Values(8, 12, 32, 100, 400));

TEST(SimplifyTarget, ErrorIsReachedWithFewVertices) {
  const Hull full = HullOf(Sphere(kLargeSphere, 3));
  for (const double max_error : {0.3, 0.03, 15. / kLargeSphere}) {
    const auto inside = SimplifyInside(full, {0, max_error, {}});
    ASSERT_TRUE(inside.ok());
    EXPECT_LE(inside->error, max_error);
    EXPECT_LT(inside->hull.vertices().size(), full.vertices().size() / 2);
    const auto outside = SimplifyOutside(full, {0, max_error, {}});
    ASSERT_TRUE(outside.ok());
    EXPECT_LE(outside->error, max_error);
    EXPECT_TRUE(AuditContainment(outside->hull, full.vertices()).ok());
  }
}

TEST(SimplifyTarget, UnreachableErrorGivesTheHullItself) {
  const Hull full = HullOf(Sphere(100, 4));
  const auto inside = SimplifyInside(full, {0, 1e-300, {}});
  ASSERT_TRUE(inside.ok());
  EXPECT_EQ(inside->hull.vertices().size(), full.vertices().size());
  EXPECT_EQ(inside->error, 0);
  const auto outside = SimplifyOutside(full, {0, 1e-300, {}});
  ASSERT_TRUE(outside.ok());
  EXPECT_EQ(outside->error, 0);
}

TEST(SimplifyTarget, NonsenseIsRefused) {
  const Hull full = HullOf(Sphere(100, 5));
  using testing::HasSubstr;
  EXPECT_THAT(std::string(SimplifyInside(full, {}).status().message()),
              HasSubstr("give max_vertices, max_error or both"));
  EXPECT_THAT(std::string(SimplifyInside(full, {3, 0, {}}).status().message()),
              HasSubstr("needs at least 4"));
  EXPECT_THAT(std::string(SimplifyOutside(full, {7, 0, {}}).status().message()),
              HasSubstr("needs at least 8"));
  EXPECT_FALSE(SimplifyInside(full, {0, -1, {}}).ok());
  EXPECT_FALSE(SimplifyInside(full, {0, std::nan(""), {}}).ok());
}

TEST(SimplifyTarget, StopsWhenAsked) {
  const Hull full = HullOf(Sphere(1000, 7));
  int polls = 0;
  const SimplifyTarget target = {500, 0, [&] { return ++polls > 10; }};
  EXPECT_TRUE(absl::IsCancelled(SimplifyInside(full, target).status()));
  polls = 0;
  EXPECT_TRUE(absl::IsCancelled(SimplifyOutside(full, target).status()));
}

TEST(SimplifyFlat, HullsOfEveryDimensionAreHandled) {
  std::vector<Vector> circle;
  for (int i = 0; i < 100; ++i)
    circle.emplace_back(std::cos(i * 0.0628), std::sin(i * 0.0628), 0.0);
  const Hull polygon = HullOf(circle);
  ASSERT_EQ(polygon.dimension(), 2);
  const auto inside = SimplifyInside(polygon, {10, 0, {}});
  ASSERT_TRUE(inside.ok());
  EXPECT_EQ(inside->hull.vertices().size(), 10u);
  EXPECT_GE(inside->error, LeastHausdorffDistance(inside->hull, polygon) * (1 - 1e-12));
  EXPECT_LT(inside->error, 0.2);
  const auto outside = SimplifyOutside(polygon, {10, 0, {}});
  ASSERT_TRUE(outside.ok());
  EXPECT_TRUE(AuditContainment(outside->hull, polygon.vertices()).ok());
  EXPECT_GE(outside->error, LeastHausdorffDistance(polygon, outside->hull) * (1 - 1e-12));
  for (const std::vector<Vector>& few :
       {std::vector<Vector>{}, {Vector(1, 2, 3)}, {Vector(1, 2, 3), Vector(4, 5, 6)}}) {
    const Hull hull = HullOf(few);
    EXPECT_EQ(SimplifyInside(hull, {8, 0, {}})->error, 0);
    EXPECT_EQ(SimplifyOutside(hull, {8, 0, {}})->error, 0);
  }
}

TEST(SimplifyExtremes, EveryScaleIsEnclosed) {
  for (const double scale : {1e-300, 1e-150, 1e-12, 1e12, 1e150, 1e300}) {
    std::vector<Vector> points = Sphere(300, 6);
    for (Vector& p : points) p *= scale;
    const Hull full = HullOf(points);
    const auto inside = SimplifyInside(full, {30, 0, {}});
    ASSERT_TRUE(inside.ok());
    EXPECT_LT(inside->error, scale);
    EXPECT_GT(inside->error, 0);
    const auto outside = SimplifyOutside(full, {30, 0, {}});
    ASSERT_TRUE(outside.ok());
    EXPECT_TRUE(AuditContainment(outside->hull, full.vertices()).ok()) << scale;
  }
}

}  // namespace
}  // namespace hulld
