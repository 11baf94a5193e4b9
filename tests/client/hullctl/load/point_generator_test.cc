#include "client/hullctl/load/point_generator.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <vector>

namespace hulld {
namespace point_generator_test {

using Point = std::array<double, 3>;

std::vector<Point> Generate(const CloudOptions& options) {
  std::vector<Point> points;
  GenerateCloud(options, [&points](const Point& p) { points.push_back(p); });
  return points;
}

// FNV-1a over the bits of all coordinates.
uint64_t HashOf(const std::vector<Point>& points) {
  uint64_t hash = 0xcbf29ce484222325;
  for (const Point& p : points) {
    for (const double coordinate : p) {
      const uint64_t bits = std::bit_cast<uint64_t>(coordinate);
      for (int shift = 0; shift < 64; shift += 8) {
        hash = (hash ^ ((bits >> shift) & 0xff)) * 0x100000001b3;
      }
    }
  }
  return hash;
}

double NormSquared(const Point& p) { return p[0] * p[0] + p[1] * p[1] + p[2] * p[2]; }

// Computed by an implementation in another language, as are the hashes below.
TEST(PointGenerator, DrawsTheNumbersOfXoshiro256PlusPlus) {
  Xoshiro256 random(42);
  EXPECT_EQ(random.Next(), 0xd0764d4f4476689fu);
  EXPECT_EQ(random.Next(), 0x519e4174576f3791u);
  EXPECT_EQ(random.Next(), 0xfbe07cfb0c24ed8cu);
}

TEST(PointGenerator, CloudsAreTheSameOnEveryPlatform) {
  struct Pinned {
    Shape shape;
    uint64_t hash;
  };
  const Pinned pinned[] = {{Shape::kBall, 0xceeb90b851ac06eeu},
                           {Shape::kSphere, 0xe6a515eec9726be8u},
                           {Shape::kCube, 0x29481180701361abu},
                           {Shape::kLattice, 0x8276a4da423fcbc5u}};
  for (const Pinned& entry : pinned) {
    CloudOptions options;
    options.shape = entry.shape;
    options.count = 1000;
    options.seed = 7;
    options.radius = 0.3;
    options.size = 0.7;
    options.center = {1, -2, 0.1};
    EXPECT_EQ(HashOf(Generate(options)), entry.hash) << static_cast<int>(entry.shape);
  }
}

TEST(PointGenerator, FillsTheBallEvenly) {
  CloudOptions options;
  options.count = 20000;
  options.radius = 2;
  int inner = 0;
  int right = 0;
  for (const Point& p : Generate(options)) {
    ASSERT_LE(NormSquared(p), 4);
    inner += NormSquared(p) < 1;
    right += p[0] > 0;
  }
  // An eighth lies within half the radius, a half on either side; the bounds are 6 standard
  // deviations away.
  EXPECT_NEAR(inner, 2500, 281);
  EXPECT_NEAR(right, 10000, 425);
}

TEST(PointGenerator, SpherePointsLieOnTheSphere) {
  CloudOptions options;
  options.shape = Shape::kSphere;
  options.count = 20000;
  int cap = 0;
  for (const Point& p : Generate(options)) {
    ASSERT_NEAR(NormSquared(p), 1, 1e-15);
    cap += p[2] > 0.5;
  }
  // Archimedes: equal heights, equal areas.
  EXPECT_NEAR(cap, 5000, 368);
}

TEST(PointGenerator, CubePointsStayInTheCube) {
  CloudOptions options;
  options.shape = Shape::kCube;
  options.count = 5000;
  options.size = 2;
  options.center = {10, 0, 0};
  for (const Point& p : Generate(options)) {
    ASSERT_GE(p[0], 9);
    ASSERT_LE(p[0], 11);
    ASSERT_LE(std::abs(p[1]), 1);
    ASSERT_LE(std::abs(p[2]), 1);
  }
}

TEST(PointGenerator, LatticesRunXFirst) {
  CloudOptions options;
  options.shape = Shape::kLattice;
  options.count = 8;
  options.size = 0.5;
  options.center = {1, 0, 0};
  const std::vector<Point> points = Generate(options);
  ASSERT_EQ(points.size(), 8u);
  EXPECT_EQ(points[0], (Point{1, 0, 0}));
  EXPECT_EQ(points[1], (Point{1.5, 0, 0}));
  EXPECT_EQ(points[2], (Point{1, 0.5, 0}));
  EXPECT_EQ(points[7], (Point{1.5, 0.5, 0.5}));
}

TEST(PointGenerator, TheLatticeIsTheSmallestThatFitsAllPoints) {
  EXPECT_EQ(LatticeSide(0), 0u);
  EXPECT_EQ(LatticeSide(1), 1u);
  EXPECT_EQ(LatticeSide(8), 2u);
  EXPECT_EQ(LatticeSide(9), 3u);
  for (uint64_t k = 2; k < 10000; k += 97) {
    EXPECT_EQ(LatticeSide(k * k * k), k);
    EXPECT_EQ(LatticeSide(k * k * k + 1), k + 1);
  }
}

TEST(PointGenerator, AnotherSeedYieldsDifferentPoints) {
  CloudOptions options;
  options.count = 10;
  const std::vector<Point> first = Generate(options);
  EXPECT_EQ(Generate(options), first);
  options.seed = 2;
  EXPECT_NE(Generate(options), first);
}

}  // namespace point_generator_test
}  // namespace hulld
