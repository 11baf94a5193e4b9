#include "core/query/floating/simplex.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/query/floating/nearest_part.h"

namespace hulld::simplex_test {
namespace {

constexpr double kRounding = 1e-12;

// Returns the distance from the origin to the nearest vertex, edge, or triangle of these corners
// that contains the last.
double DistanceByParts(const std::vector<PlainVector>& corners) {
  const PlainVector& p = corners.back();
  double squared = SquaredNorm(p);
  for (size_t i = 0; i + 1 < corners.size(); ++i) {
    squared = std::min(squared, SquaredNorm(NearestOnEdge(p, corners[i], 0, 1).point));
    for (size_t j = 0; j < i; ++j) {
      const NearestPart nearest = NearestOnTriangle(p, corners[i], corners[j]);
      squared = std::min(squared, SquaredNorm(nearest.point));
    }
  }
  return std::sqrt(squared);
}

// Returns true if the origin is on the same side of every face as the corner opposite to it.
bool Surround(const std::vector<PlainVector>& corners) {
  for (size_t i = 0; i < 4; ++i) {
    const PlainVector& p = corners[(i + 1) % 4];
    const PlainVector normal = Cross(corners[(i + 2) % 4] - p, corners[(i + 3) % 4] - p);
    if (Dot(normal, corners[i] - p) * Dot(normal, -p) < -kRounding) return false;
  }
  return true;
}

// Walks of GJK toward the origin over random point clouds.
TEST(Simplex, KeepsThePartNearestToTheOrigin) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  int reduced[4] = {};
  int surrounded = 0;
  for (int walk = 0; walk < 2000; ++walk) {
    std::vector<PlainVector> cloud;
    const double offset = 1.5 * std::abs(coordinate(random));
    for (int i = 0; i < 12; ++i) {
      const double x = coordinate(random);
      const double y = coordinate(random);
      cloud.emplace_back(x + offset, y, coordinate(random));
    }
    Simplex simplex;
    simplex.Set(LaneVector(cloud[0]), {0, 0});
    LaneVector n(-cloud[0]);
    for (int step = 0; step < 20; ++step) {
      const auto farthest = std::ranges::max_element(
          cloud, {}, [&](const PlainVector& v) { return Dot(n.plain(), v); });
      const auto index = static_cast<uint32_t>(farthest - cloud.begin());
      if (simplex.Contains({index, index})) break;
      std::vector<PlainVector> corners;
      for (uint32_t i = 0; i < simplex.count(); ++i) corners.push_back(simplex.corner(i));
      corners.push_back(*farthest);
      if (!simplex.Add(LaneVector(*farthest), {index, index}, n)) {
        ++surrounded;
        ASSERT_EQ(simplex.count(), 4);
        ASSERT_TRUE(Surround(corners)) << "walk " << walk;
        break;
      }
      ++reduced[simplex.count()];
      ASSERT_EQ(simplex.pair(simplex.count() - 1), (VertexPair{index, index}));
      const PlainVector near = simplex.NearPoint();
      const double distance = Norm(near);
      ASSERT_NEAR(distance, DistanceByParts(corners), kRounding) << "walk " << walk;
      // n leads from the nearest point to the origin.
      ASSERT_NEAR(Dot(n.plain(), near), -Norm(n.plain()) * distance, kRounding) << "walk " << walk;
    }
  }
  for (const int count : {1, 2, 3}) EXPECT_GT(reduced[count], 50) << count << " corners";
  EXPECT_GT(surrounded, 50);
}

}  // namespace
}  // namespace hulld::simplex_test
