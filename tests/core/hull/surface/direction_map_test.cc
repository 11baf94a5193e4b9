#include "core/hull/surface/direction_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "core/numeric/simd_path.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {
namespace direction_map_test {

using Gauge = std::function<double(const Vector&)>;

double OctahedronGauge(const Vector& d) { return d.cwiseAbs().sum(); }
double BallGauge(const Vector& d) { return d.norm(); }

// A thin, sheared plate: the octahedron times this.
const Eigen::Matrix3d kPlate{{2, 0, 0}, {0.3, 1.5, 0}, {-0.7, 1.1, 1e-3}};
double PlateGauge(const Vector& d) { return OctahedronGauge(kPlate.inverse() * d); }
MapFrame FrameOfPlate(const Vector& center, double size = 2) {
  return MapFrame(center, size, kPlate * kPlate.transpose());
}

// Returns a map in `frame` of the set with the given gauge about its center.
DirectionMap MapOf(const Gauge& gauge, const MapFrame& frame, int resolution) {
  DirectionMap map(frame, resolution);
  double least = INFINITY;
  double largest = 0;
  double extent = 0;
  for (int face = 0; face < 6; ++face) {
    for (int i = 0; i <= resolution; ++i) {
      for (int j = 0; j <= resolution; ++j) {
        const Vector direction = map.CornerDirection(face, i, j);
        const double reach = (1 - 1e-9) / gauge(direction);
        extent = std::max(extent, reach * LargestComponent(direction));
        map.AppendCorner(reach);
        least = std::min(least, reach);
        largest = std::max(largest, reach);
        if (i > 0 && j > 0) map.AppendCell(0);
      }
    }
  }
  map.Finish(least, largest, extent);
  return map;
}

DirectionMap MapOf(const Gauge& gauge, const Vector& center, int resolution) {
  return MapOf(gauge, MapFrame(center, 1), resolution);
}

size_t SurvivorCount(const DirectionMap& map, const std::vector<Vector>& points) {
  std::vector<uint32_t> survivors;
  StopPoll never;
  map.AppendSurvivors(points, survivors, never);
  EXPECT_TRUE(std::is_sorted(survivors.begin(), survivors.end()));
  return survivors.size();
}

// Returns points in random directions at a gauge about the center.
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

// Rejected points are inside, and kept ones are near the surface: by less than the square of a
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

// The plate is an octahedron in its frame. Without a frame, most of its cells straddle an edge.
TEST(DirectionMap, FramesMakeFlatSetsRound) {
  const Vector center(0.25, -3, 10);
  const auto points_at = [&](double value) {
    std::vector<Vector> points = PointsAt(OctahedronGauge, Vector(0, 0, 0), value, 5001);
    for (Vector& p : points) p = center + kPlate * p;
    return points;
  };
  const std::vector<Vector> inside = points_at(1 - 1e-4);
  for (const int resolution : {2, 6, 32}) {
    const DirectionMap map = MapOf(PlateGauge, FrameOfPlate(center), resolution);
    EXPECT_FALSE(map.frame().is_plain());
    EXPECT_EQ(SurvivorCount(map, inside), 0u);
    EXPECT_EQ(SurvivorCount(map, points_at(1)), 5001u);
    EXPECT_GT(SurvivorCount(MapOf(PlateGauge, center, resolution), inside), 1000u);
  }
}

TEST(DirectionMap, RoundSetsNeedNoFrame) {
  const Eigen::Matrix3d ball = Eigen::Matrix3d::Identity();
  EXPECT_TRUE(MapFrame(Vector::Zero(), 1, 7 * ball).is_plain());
  EXPECT_TRUE(MapFrame(Vector::Zero(), 1, 0 * ball).is_plain());
  for (const double unusable : {HUGE_VAL, std::nan("")}) {
    EXPECT_TRUE(MapFrame(Vector::Zero(), 1, unusable * Eigen::Matrix3d::Ones()).is_plain());
  }
}

// At any scale. A set without any thickness has no frame.
TEST(DirectionMap, FramesAreInvertible) {
  const Vector direction(0.25, -1, 0.5);
  for (const double moment : {1e-300, 1.0, 1e300}) {
    for (const double size : {0x1p-300, 1.0, 0x1p300}) {
      const Vector center = size * Vector(1, 1, 1);
      const MapFrame frame(center, size, moment * kPlate * kPlate.transpose());
      EXPECT_FALSE(frame.is_plain());
      EXPECT_EQ(frame.matrix().cwiseAbs().maxCoeff() * size, 1);
      EXPECT_GE(frame.matrix().diagonal().minCoeff() * size, 0x1p-20);
      const Eigen::Vector3f back = frame.ToMap(center + frame.FromMap(direction));
      EXPECT_LT((back.cast<double>() - direction).norm(), 1e-6) << moment << " " << size;
      const Vector along(1, 2, -3);
      EXPECT_TRUE(MapFrame(center, size, moment * along * along.transpose()).is_plain());
    }
  }
}

// The scale is limited, so that it and its multiples are normal.
TEST(DirectionMap, FramesScaleSetsToOne) {
  for (const double size : {0.0, 0x1p-1074, 0x1p-1000, 0.75, 1.0, 0x1p1000, 0x1p1023, HUGE_VAL}) {
    const MapFrame frame(Vector::Zero(), size);
    const double scale = frame.matrix()(0, 0);
    EXPECT_TRUE(std::isnormal(scale)) << size;
    if (size < 0x1p-1000 || size > 0x1p1000) continue;
    EXPECT_GE(size * scale, 1);
    EXPECT_LT(size * scale, 2);
  }
}

TEST(DirectionMap, CoarsenedMapsRemainValid) {
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

TEST(DirectionMap, KeepsUnmeasurableDirections) {
  const DirectionMap map = MapOf(BallGauge, Vector(0, 0, 0), 8);
  const std::vector<Vector> far = {Vector::Constant(1e308), Vector(-1.7e308, 0, 1),
                                   Vector(0, 0, 1e302), Vector(1, 1, 1)};
  EXPECT_EQ(SurvivorCount(map, far), far.size());
  // In a frame, an infinite difference times zero, or minus another, is NaN.
  constexpr double kMax = std::numeric_limits<double>::max();
  std::vector<Vector> overflowing;
  for (const double x : {-kMax, 0.0, kMax}) {
    for (const double y : {-kMax, 0.0, kMax}) {
      for (const double z : {-kMax, kMax}) overflowing.emplace_back(x, y, z);
    }
  }
  for (const Vector& center : {Vector(0, 0, 0), Vector(1e305, -1e305, 1e305)}) {
    // So large that its map is useful around either center.
    const Gauge large = [](const Vector& d) { return PlateGauge(d) / 1e302; };
    const DirectionMap plate = MapOf(large, FrameOfPlate(center, 2e302), 8);
    EXPECT_EQ(SurvivorCount(plate, PointsAt(large, center, 0.1, 100)), 0u);
    EXPECT_EQ(SurvivorCount(plate, overflowing), overflowing.size());
  }
  // Rounding matters if the ratio of reaches is 1e12, but not if it is 100.
  const Gauge needle = [](const Vector& d) { return Vector(d.x(), 1e12 * d.y(), d.z()).norm(); };
  const DirectionMap slender = MapOf(needle, Vector(0, 0, 0), 8);
  EXPECT_EQ(SurvivorCount(slender, PointsAt(needle, Vector::Zero(), 0.01, 100)), 100u);
  const Gauge blade = [](const Vector& d) { return OctahedronGauge({d.x(), 100 * d.y(), d.z()}); };
  const DirectionMap sharp = MapOf(blade, Vector(0, 0, 0), 8);
  EXPECT_EQ(SurvivorCount(sharp, PointsAt(blade, Vector::Zero(), 0.999, 5001)), 0u);
  EXPECT_EQ(SurvivorCount(sharp, PointsAt(blade, Vector::Zero(), 1, 5001)), 5001u);
}

// Expects that both paths keep the same points.
void ExpectSamePoints(const DirectionMap& map, const std::vector<Vector>& points) {
  const SimdPath before = CurrentSimdPath();
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

TEST(DirectionMap, SimdPathsKeepTheSamePoints) {
  Random random(TestSeed(522));
  const Vector center(0.1, 0.2, 0.3);
  std::vector<Vector> points = RandomInBall(random, 3003, 1.2);
  // On the borders of cells and faces, and beyond all distances.
  for (int i = -20; i <= 20; ++i) points.emplace_back(0.1 + 0.9, 0.2 + 0.09 * i / 2, 0.3 - 0.9);
  points.push_back(Vector::Constant(1e305));
  ExpectSamePoints(MapOf(BallGauge, center, 20), points);
  for (Vector& p : points) p = center + kPlate * (p - center);
  ExpectSamePoints(MapOf(PlateGauge, FrameOfPlate(center), 20), points);
}

}  // namespace direction_map_test
}  // namespace hulld
