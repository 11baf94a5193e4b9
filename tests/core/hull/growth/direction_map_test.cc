#include "core/hull/growth/direction_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "core/numeric/simd_path.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {
namespace {

using Gauge = std::function<double(const Vector&)>;

double OctahedronGauge(const Vector& d) { return d.cwiseAbs().sum(); }
double BallGauge(const Vector& d) { return d.norm(); }

// A map round `center` of the set with the given gauge about it.
DirectionMap MapOf(const Gauge& gauge, const Vector& center, int resolution) {
  DirectionMap map(center, resolution);
  double least = INFINITY;
  double largest = 0;
  for (int face = 0; face < 6; ++face) {
    for (int i = 0; i <= resolution; ++i) {
      for (int j = 0; j <= resolution; ++j) {
        const double reach = (1 - 1e-9) / gauge(map.CornerDirection(face, i, j));
        map.AppendCorner(reach);
        least = std::min(least, reach);
        largest = std::max(largest, reach);
        if (i > 0 && j > 0) map.AppendCell(0);
      }
    }
  }
  map.Finish(least, largest);
  return map;
}

size_t SurvivorCount(const DirectionMap& map, const std::vector<Vector>& points) {
  std::vector<uint32_t> survivors;
  StopPoll never;
  map.AppendSurvivors(points, survivors, never);
  EXPECT_TRUE(std::is_sorted(survivors.begin(), survivors.end()));
  return survivors.size();
}

// Points in random directions at a gauge about the center.
std::vector<Vector> PointsAt(const Gauge& gauge, const Vector& center, double value, int n) {
  Random random(TestSeed(521));
  std::vector<Vector> points;
  for (const Vector& d : RandomOnSphere(random, n, 1)) {
    points.push_back(center + d * (value / gauge(d)));
  }
  return points;
}

// Cells of an even resolution do not straddle the octahedron's edges.
TEST(DirectionMap, FollowsPlanesExactly) {
  const Vector center(0.25, -3, 10);
  for (const int resolution : {2, 6, 32}) {
    const DirectionMap map = MapOf(OctahedronGauge, center, resolution);
    EXPECT_EQ(SurvivorCount(map, PointsAt(OctahedronGauge, center, 1 - 1e-5, 5001)), 0u);
    EXPECT_EQ(SurvivorCount(map, PointsAt(OctahedronGauge, center, 1, 5001)), 5001u);
  }
}

// What is rejected is inside, and what is kept is near the surface: by less than the square of a
// cell's diagonal, 2 sqrt(2) / n, times half the largest curvature, 1, of the gauge.
TEST(DirectionMap, FollowsCurvesToTheSecondOrder) {
  const Vector center(-1, 2, 0.5);
  for (const int resolution : {5, 16, 64}) {
    const DirectionMap map = MapOf(BallGauge, center, resolution);
    const double gap = 4.0 / (resolution * resolution) + 1e-5;
    EXPECT_EQ(SurvivorCount(map, PointsAt(BallGauge, center, 1 - gap, 5001)), 0u);
    EXPECT_EQ(SurvivorCount(map, PointsAt(BallGauge, center, 1, 5001)), 5001u);
  }
}

TEST(DirectionMap, CoarsenedMapsStillBound) {
  const Vector center(0, 0, 0);
  DirectionMap map = MapOf(BallGauge, center, 12);
  EXPECT_TRUE(map.Coarsen());
  EXPECT_EQ(map.resolution(), 6);
  EXPECT_EQ(SurvivorCount(map, PointsAt(BallGauge, center, 1, 5001)), 5001u);
  EXPECT_EQ(SurvivorCount(map, PointsAt(BallGauge, center, 1 - 4.0 / 36 - 1e-5, 5001)), 0u);
  EXPECT_TRUE(map.Coarsen());
  EXPECT_FALSE(map.Coarsen());
  EXPECT_EQ(map.resolution(), 3);
  EXPECT_EQ(SurvivorCount(map, PointsAt(BallGauge, center, 1, 5001)), 5001u);
}

TEST(DirectionMap, KeepsWhatItCannotMeasure) {
  const DirectionMap map = MapOf(BallGauge, Vector::Zero(), 8);
  const std::vector<Vector> far = {Vector::Constant(1e308), Vector(-1.7e308, 0, 1),
                                   Vector(0, 0, 1e302), Vector(1, 1, 1)};
  EXPECT_EQ(SurvivorCount(map, far), far.size());
  // A ratio of reaches at which rounding is no longer negligible.
  const Gauge needle = [](const Vector& d) { return Vector(d.x(), 1e12 * d.y(), d.z()).norm(); };
  const DirectionMap slender = MapOf(needle, Vector::Zero(), 8);
  EXPECT_EQ(SurvivorCount(slender, PointsAt(needle, Vector::Zero(), 0.01, 100)), 100u);
}

TEST(DirectionMap, SimdPathsKeepTheSamePoints) {
  const SimdPath before = CurrentSimdPath();
  Random random(TestSeed(522));
  const DirectionMap map = MapOf(BallGauge, Vector(0.1, 0.2, 0.3), 20);
  std::vector<Vector> points = RandomInBall(random, 3003, 1.2);
  // On the borders of cells and faces, and beyond all distances.
  for (int i = -20; i <= 20; ++i) points.emplace_back(0.1 + 0.9, 0.2 + 0.09 * i / 2, 0.3 - 0.9);
  points.push_back(Vector::Constant(1e305));
  std::vector<uint32_t> fast;
  StopPoll never;
  map.AppendSurvivors(points, fast, never);
  EXPECT_GT(fast.size(), 500u);
  EXPECT_LT(fast.size(), 2500u);
  ASSERT_TRUE(UseSimdPath(SimdPath::kPortable));
  std::vector<uint32_t> portable;
  map.AppendSurvivors(points, portable, never);
  UseSimdPath(before);
  EXPECT_EQ(fast, portable);
}

}  // namespace
}  // namespace hulld
