#include "core/hull/simplification/inside_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/hull/growth/hull_builder.h"
#include "core/hull/simplification/inside_order.h"
#include "core/hull/simplification/unit_scale.h"
#include "core/hull/simplification/vertex_subset.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/oracle/brute_force_hausdorff.h"
#include "tests/test_size.h"

namespace hulld {
namespace inside_search_test {

std::vector<Vector> OnEllipsoid(int n, const Vector& radii) {
  std::mt19937_64 random(31);
  std::normal_distribution<double> normal;
  std::vector<Vector> points;
  for (int i = 0; i < n; ++i) {
    const Vector v(normal(random), normal(random), normal(random));
    points.push_back(v.normalized().cwiseProduct(radii));
  }
  return points;
}

// A cube with balls as corners.
std::vector<Vector> OnRoundedCube(int n) {
  std::vector<Vector> points = OnEllipsoid(n, Vector(0.1, 0.1, 0.1));
  for (Vector& p : points) {
    for (int k = 0; k < 3; ++k) p[k] += std::copysign(0.9, p[k]);
  }
  return points;
}

std::vector<Vector> OnPrism(int n) {
  std::vector<Vector> points;
  for (int i = 0; i < n; ++i) {
    const double angle = 6.28318 * i / n;
    for (const double z : {-1.0, 1.0}) points.emplace_back(std::cos(angle), std::sin(angle), z);
  }
  return points;
}

// Each vertex of such a hull may see all lower ones.
std::vector<Vector> OnMomentCurve(int n) {
  std::vector<Vector> points;
  for (int i = 0; i < n; ++i) {
    const double t = 2.0 * i / n - 1;
    points.emplace_back(t, t * t, t * t * t);
  }
  return points;
}

struct Shape {
  std::string name;
  std::vector<Vector> points;
};

std::vector<Shape> Shapes() {
  return {{"sphere", OnEllipsoid(1000, Vector(1, 1, 1))},
          {"ellipsoid", OnEllipsoid(1000, Vector(5, 1, 0.2))},
          {"needle", OnEllipsoid(1000, Vector(1e-3, 1, 1e3))},
          {"rounded cube", OnRoundedCube(1000)},
          {"prism", OnPrism(200)},
          {"moment curve", OnMomentCurve(300)},
          {"cube", OnRoundedCube(8)}};
}

TEST(InsideSearch, IsNeverWorseThanFarthestFirst) {
  int better = 0;
  for (const Shape& shape : Shapes()) {
    const Hull full = BuildHull(shape.points);
    const size_t all = full.vertices().size();
    StopPoll poll;
    const UnitScale scale(full.max_abs_coordinate());
    InsideOrder order(full, scale, poll);
    for (const double relative_error : {0.3, 0.1, 0.03, 0.01, 0.003, 1e-4}) {
      const double max_error = relative_error * full.max_abs_coordinate();
      const VertexChoice choice = ChooseInside(full, max_error, all, poll);
      const size_t count = order.CountFor(max_error, all);
      EXPECT_LE(choice.vertices.size(), count) << shape.name << " " << relative_error;
      EXPECT_LE(choice.error, max_error) << shape.name << " " << relative_error;
      better += choice.vertices.size() < count ? 1 : 0;
    }
    for (const size_t most : {4, 5, 8, 20, 60, 200}) {
      if (most >= all) continue;
      const VertexChoice choice = ChooseInside(full, 0, most, poll);
      EXPECT_EQ(choice.vertices.size(), most) << shape.name;
      EXPECT_LE(choice.error, order.ErrorAt(most)) << shape.name << " " << most;
      better += choice.error < order.ErrorAt(most) ? 1 : 0;
    }
  }
  // **Observed**: 34.
  EXPECT_GT(better, 20);
}

// In the oracle's exact arithmetic, the bound of any start is true, and so is the bound of the
// subset chosen from it.
TEST(VertexSubset, StartsWithAnyVertices) {
  Random random(TestSeed(41));
  const Hull full = BuildHull(RandomOnSphere(random, 18, 3.0));
  const size_t all = full.vertices().size();
  const UnitScale scale(full.max_abs_coordinate());
  const std::vector<Vector> unit_points = scale.ToUnit(full.vertices());
  std::mt19937 shuffler(5);
  std::vector<uint32_t> start(all);
  std::iota(start.begin(), start.end(), 0u);
  StopPoll poll;
  for (size_t count = 4; count <= all; count += TestSize(1, 4)) {
    std::shuffle(start.begin(), start.end(), shuffler);
    auto subset = VertexSubset::StartingWith(std::span(start).first(count), full.vertices(),
                                             unit_points, poll);
    ASSERT_TRUE(subset.has_value()) << count;
    EXPECT_TRUE(std::is_permutation(subset->chosen().begin(), subset->chosen().end(), start.begin(),
                                    start.begin() + static_cast<ptrdiff_t>(count)));
    for (;;) {
      std::vector<Vector> chosen;
      for (const uint32_t i : subset->chosen()) chosen.push_back(full.vertices()[i]);
      EXPECT_TRUE(oracle::IsNestedWithin(ToOracle(chosen), ToOracle(full.vertices()),
                                         scale.LengthFromUnit(subset->DistanceBound())));
      if (subset->is_complete()) break;
      subset->ChooseNext(poll);
    }
  }
}

TEST(VertexSubset, DoesNotStartInAPlane) {
  const Hull full = BuildHull(OnPrism(20));
  const UnitScale scale(full.max_abs_coordinate());
  const std::vector<Vector> unit_points = scale.ToUnit(full.vertices());
  std::vector<uint32_t> top;
  for (uint32_t i = 0; i < full.vertices().size(); ++i) {
    if (full.vertices()[i].z() > 0) top.push_back(i);
  }
  ASSERT_EQ(top.size(), 20u);
  StopPoll poll;
  const auto start = [&](std::span<const uint32_t> vertices) {
    return VertexSubset::StartingWith(vertices, full.vertices(), unit_points, poll);
  };
  EXPECT_FALSE(start(top).has_value());
  EXPECT_FALSE(start(std::span(top).first(3)).has_value());
  EXPECT_FALSE(start({}).has_value());
}

}  // namespace inside_search_test
}  // namespace hulld
