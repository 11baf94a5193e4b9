#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "core/hull/audit.h"
#include "core/hull/growth/hull_builder.h"
#include "core/numeric/orientation.h"
#include "core/query/placed/live_hull.h"
#include "core/query/placed/query_hull.h"
#include "tests/core/checks/extreme_clouds.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/test_size.h"

namespace hulld {
namespace hull_cost_test {

// Cost of hulls in counted work and memory, never time.

struct NamedPoints {
  const char* name;
  std::vector<Vector> points;
};

HullBuilder BuiltAtOnce(const std::vector<Vector>& points) {
  HullBuilder builder;
  EXPECT_TRUE(builder.Add(points).ok());
  return builder;
}

std::vector<Vector> SortedVertices(const HullBuilder& builder) {
  const Hull hull = builder.Snapshot();
  return {hull.vertices().begin(), hull.vertices().end()};
}

// Shells that each hide the previous one.
std::vector<Vector> GrowingShells(Random& random, size_t n) {
  std::vector<Vector> points = RandomOnSphere(random, n, 1);
  for (size_t i = 0; i < n; ++i) points[i] *= 1 + std::floor(static_cast<double>(i) / 500) / 4;
  return points;
}

// When points are inserted one by one, no insertion does much more than its share of the
// housekeeping: apart from removing and creating triangles, its work is O(log^2 n).
TEST(HullCost, NoSinglePointStalls) {
  const uint64_t seed = TestSeed(501);
  Random random(seed);
  const std::vector<NamedPoints> streams = {{"ball", RandomInBall(random, 50000, 1)},
                                            {"sphere", RandomOnSphere(random, 20000, 1)},
                                            {"cube", RandomInCube(random, 50000, 1)},
                                            {"shells", GrowingShells(random, 5000)}};
  for (const NamedPoints& stream : streams) {
    HullBuilder builder;
    uint64_t before = 0;
    for (size_t i = 0; i < stream.points.size(); ++i) {
      ASSERT_TRUE(builder.Add(std::span(stream.points).subspan(i, 1)).ok());
      const uint64_t steps = builder.housekeeping_steps() - before;
      before = builder.housekeeping_steps();
      const double log = std::log2(static_cast<double>(i + 64));
      ASSERT_LE(static_cast<double>(steps), 4 * log * log)
          << stream.name << " point " << i << " seed " << seed;
    }
    // The counter works.
    EXPECT_GT(before, builder.vertex_count()) << stream.name;
  }
}

// Most points of a ball are inside, and the direction map rejects them in any order: few points are
// located by walking over the surface.
TEST(HullCost, InsidePointsAreRejectedWithoutAWalk) {
  const uint64_t seed = TestSeed(509);
  Random random(seed);
  const std::vector<Vector> ball = RandomInBall(random, 50000, 1);
  for (const size_t chunk : {size_t{1}, size_t{100}, size_t{1000}, size_t{10000}, ball.size()}) {
    HullBuilder builder;
    for (size_t i = 0; i < ball.size(); i += chunk) {
      ASSERT_TRUE(builder.Add(std::span(ball).subspan(i, chunk)).ok());
    }
    EXPECT_LT(builder.housekeeping_steps(), ball.size()) << chunk << " seed " << seed;
    EXPECT_GT(builder.housekeeping_steps(), builder.vertex_count());
  }
}

// Simulates a depth camera's rows, from the top, of a wall and a table in front of it: all points
// lie along two planes, with noise, and hardly any inside.
std::vector<Vector> DepthFrame(Random& random, int width, int height) {
  std::vector<Vector> points;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const double x = (2.0 * u - width) / width;
      const double y = (1.1 * v - 0.55 * height) / height;
      double noise = -6;
      for (int k = 0; k < 12; ++k) noise += random.Unit();
      const double depth = std::min(2.0, 0.5 / std::max(y, 1e-9)) * (1 + 1e-3 * noise);
      points.emplace_back(x * depth, y * depth, depth);
    }
  }
  return points;
}

// Each block of a frame is flat and adjacent to the previous ones. The direction map follows them
// in any orientation: few points are located by walking.
TEST(HullCost, DepthFramesAreRejectedWithoutAWalk) {
  const uint64_t seed = TestSeed(510);
  Random random(seed);
  std::vector<Vector> frame = DepthFrame(random, 424, 240);
  const Eigen::Quaterniond tilt(0.8, -0.3, 0.4, 0.2);
  for (const bool is_tilted : {false, true}) {
    if (is_tilted) {
      for (Vector& p : frame) p = tilt.normalized() * p;
    }
    const HullBuilder at_once = BuiltAtOnce(frame);
    for (const size_t blocks : {size_t{1}, size_t{4}}) {
      HullBuilder builder;
      const size_t size = frame.size() / blocks;
      for (size_t i = 0; i < frame.size(); i += size) {
        ASSERT_TRUE(builder.Add(std::span(frame).subspan(i, size)).ok());
      }
      EXPECT_LT(3 * builder.housekeeping_steps(), 2 * frame.size())
          << blocks << (is_tilted ? " tilted" : "") << " seed " << seed;
      EXPECT_EQ(SortedVertices(builder), SortedVertices(at_once));
    }
  }
}

// A block's undo record depends on its changes, not on the size of the hull.
TEST(HullCost, UndoCostIsProportionalToTheChange) {
  const uint64_t seed = TestSeed(507);
  Random random(seed);
  const std::vector<Vector> inside = RandomInBall(random, 2000, 0.9);
  std::vector<size_t> of_inside;
  std::vector<size_t> of_outside;
  for (const int vertices : {2000, 20000, 200000}) {
    const std::vector<Vector> sphere = RandomOnSphere(random, vertices, 1);
    HullBuilder builder;
    ASSERT_TRUE(builder.Add(sphere).ok());
    EXPECT_EQ(builder.undo_bytes(), 0u);
    AddLimits limits;
    limits.should_stop = [] { return false; };
    limits.max_vertices = static_cast<size_t>(vertices);
    ASSERT_TRUE(builder.Add(inside, limits).ok());
    of_inside.push_back(builder.undo_bytes());
    // Every point equals a vertex.
    ASSERT_TRUE(builder.Add(std::span(sphere).first(2000), limits).ok());
    EXPECT_LE(builder.undo_bytes(), 2000 * 48u) << "seed " << seed;
    // Refused at the end, after all were added.
    const std::vector<Vector> outside = RandomOnSphere(random, 2000, 1.0 + 0.1 / vertices);
    EXPECT_TRUE(absl::IsResourceExhausted(builder.Add(outside, limits).status()));
    of_outside.push_back(builder.undo_bytes());
    EXPECT_EQ(builder.vertex_count(), sphere.size());
  }
  for (const size_t bytes : of_inside) EXPECT_LE(bytes, 10000u) << "seed " << seed;
  // Six triangles around each, and as many beyond them.
  for (const size_t bytes : of_outside) {
    EXPECT_GT(bytes, 2000 * 100u) << "seed " << seed;
    EXPECT_LE(bytes, 2000 * 16 * 80u) << "seed " << seed;
  }
}

// Returns the exact signs of all stages decided by this thread.
uint64_t SignsSoFar() {
  const OrientationCounts counts = ThreadOrientationCounts();
  return counts.filter + counts.nearest_filter + counts.fixed_point + counts.expansion +
         counts.integer;
}

// Two polygons of n corners in parallel planes, tilted exactly: n from -n/2 to n/2 on a parabola.
std::vector<Vector> ParabolaPrism(int n) {
  std::vector<Vector> points;
  for (double i = -n / 2; i < n - n / 2; ++i) {  // NOLINT: exact
    for (const double side : {0., 1.}) {
      points.push_back(i * n * Vector(1, 2, -1) + i * i * Vector(2, -1, 3) +
                       side * n * n * Vector(1, 1, 5));
    }
  }
  return points;
}

// Facets with many corners grow at one side: the cost of a point is far below the number of corners
// of its facet.
TEST(HullCost, FacetsOfManyCornersTakeLessThanQuadraticTime) {
  const uint64_t seed = TestSeed(508);
  for (const bool one_by_one : {false, true}) {
    std::vector<double> signs;
    for (const int n : {500, 2000, 8000}) {
      Random random(seed);
      std::vector<Vector> points = ParabolaPrism(n);
      Shuffle(random, points);
      HullBuilder builder;
      const uint64_t before = SignsSoFar();
      for (size_t i = 0; i < points.size(); i += one_by_one ? 1 : points.size()) {
        ASSERT_TRUE(builder.Add(std::span(points).subspan(i, one_by_one ? 1 : points.size())).ok());
      }
      const Hull hull = builder.Snapshot();
      signs.push_back(static_cast<double>(SignsSoFar() - before));
      EXPECT_EQ(hull.vertices().size(), points.size());
      EXPECT_EQ(hull.facet_count(), static_cast<size_t>(n) + 2);
      EXPECT_TRUE(n > 500 || AuditHull(hull).ok());
    }
    // Four times as many corners; n log n is 5 times as much, n^2 16 times.
    EXPECT_LT(signs[1], 8 * signs[0]) << one_by_one << " seed " << seed;
    EXPECT_LT(signs[2], 8 * signs[1]) << one_by_one << " seed " << seed;
  }
}

// Cost of exact signs and steps of walks, in units of about 10 ns.
struct SignCost {
  double all;
  // By expansions and integers of any size: a count, not units.
  uint64_t wide;
};

template <typename Build>
SignCost CostOf(Build build) {
  const OrientationCounts before = ThreadOrientationCounts();
  const uint64_t steps = build().housekeeping_steps();
  const OrientationCounts after = ThreadOrientationCounts();
  const uint64_t expansion = after.expansion - before.expansion;
  const uint64_t integer = after.integer - before.integer;
  const uint64_t fast =
      after.filter - before.filter +
      3 * (after.nearest_filter + after.fixed_point - before.nearest_filter - before.fixed_point);
  return {static_cast<double>(fast + 100 * expansion + 1000 * integer + steps),
          expansion + integer};
}

HullBuilder BuiltOneByOne(std::span<const Vector> points) {
  HullBuilder builder;
  for (size_t i = 0; i < points.size(); ++i) EXPECT_TRUE(builder.Add(points.subspan(i, 1)).ok());
  return builder;
}

// For any cloud, a block costs little more than its points individually, and few signs take
// expansions or integers of any size.
TEST(HullCost, BlocksOfExtremeCloudsCostNoMoreThanTheirPoints) {
  for (const Extreme& extreme : Extremes()) {
    for (const int n : {TestSize(1000, 200), TestSize(5000, 1000)}) {
      if (extreme.needs == Arithmetic::kIntegers) continue;
      if (extreme.facets_one_by_one != nullptr && n > 2000) continue;
      const std::vector<Vector> points = extreme.make(n);
      const SignCost block = CostOf([&] { return BuiltAtOnce(points); });
      const SignCost one_by_one = CostOf([&] { return BuiltOneByOne(points); });
      const auto count = static_cast<double>(points.size());
      EXPECT_LE(block.all, 2 * one_by_one.all + 4 * count) << extreme.name << " " << n;
#ifdef NDEBUG
      // Otherwise the surface is checked after every change, which adds to the signs counted.
      EXPECT_LE(static_cast<double>(block.wide), 0.5 * count) << extreme.name << " " << n;
      EXPECT_LE(static_cast<double>(one_by_one.wide), count) << extreme.name << " " << n;
#endif
    }
  }
}

// Returns the server's memory for a hull at rest that grew and was queried, in bytes per vertex.
double RequestedBytes(const HullBuilder& builder) {
  LiveHull live(builder.Vertices(), builder.dimension());
  live.Prepare(live.Now());
  return static_cast<double>(live.MemoryBytes() + builder.MemoryBytes()) /
         static_cast<double>(builder.vertex_count());
}

// Expects the bounds promised from 1000 vertices on.
void ExpectSmall(const HullBuilder& builder, const char* name) {
  const auto vertices = static_cast<double>(builder.vertex_count());
  ASSERT_GE(vertices, 1000) << name;
  const Hull hull = builder.Snapshot();
  const double snapshot = static_cast<double>(hull.MemoryBytes()) / vertices;
  const double queried = snapshot + static_cast<double>(QueryHull(hull).MemoryBytes()) / vertices;
  const double built = static_cast<double>(builder.MemoryBytes()) / vertices;
  const double requested = RequestedBytes(builder);
  EXPECT_LE(snapshot, 100) << name;
  EXPECT_LE(queried, 150) << name;
  EXPECT_LE(built, 230) << name;
  EXPECT_LE(requested, 300) << name;
  std::printf(
      "%s: %.0f vertices, bytes for each: snapshot %.0f, with queries %.0f, builder %.0f, with "
      "queries %.0f\n",
      name, vertices, snapshot, queried, built, requested);
  // At least the vertices and the triangles are counted.
  EXPECT_GE(snapshot, 24 + 24 + 24) << name;
  EXPECT_GE(built, 24 + 2 * 64 - 1) << name;
}

// Inside points are not kept, and the rest is small.
TEST(HullCost, MemoryIsBoundedByTheVertices) {
  const uint64_t seed = TestSeed(503);
  Random random(seed);
  const std::vector<NamedPoints> clouds = {{"sphere of 1000", RandomOnSphere(random, 1000, 1)},
                                           {"sphere of 1100", RandomOnSphere(random, 1100, 1)},
                                           {"sphere", RandomOnSphere(random, 30000, 1)},
                                           {"ball of 1e5", RandomInBall(random, 100000, 1)},
                                           {"ball of 1e6", RandomInBall(random, 1000000, 1)}};
  for (const NamedPoints& cloud : clouds) {
    ExpectSmall(BuiltAtOnce(cloud.points), cloud.name);
    const std::span<const Vector> points = cloud.points;
    ExpectSmall(BuiltOneByOne(points.first(std::min<size_t>(points.size(), 100000))), cloud.name);
  }
}

// Vertices of meshes are unevenly distributed, so that many belong to few directions.
TEST(HullCost, MemoryOfMeshesIsBoundedByTheVertices) {
  size_t seen = 0;
  for (const char* name : {"stanford-bunny.obj", "rocker-arm.obj"}) {
    const std::optional<std::vector<Vector>> points = MeshVertices(name);
    if (!points) continue;
    const HullBuilder builder = BuiltAtOnce(*points);
    // Another mesh may replace a missing one.
    if (builder.vertex_count() < 1000) continue;
    ++seen;
    ExpectSmall(builder, name);
    ExpectSmall(BuiltOneByOne(*points), name);
  }
  if (seen == 0) GTEST_SKIP() << "no mesh of 1000 vertices in HULLD_DATA";
}

// Scenes contain many small hulls. Their constant overhead weighs more per vertex.
TEST(HullCost, MemoryOfSmallHullsIsSmall) {
  Random random(TestSeed(504));
  // A LiveHull has two: a mutex takes 40 bytes on x86-64, and 48 on 64-bit ARM.
  const double mutexes = 2 * (static_cast<double>(sizeof(std::mutex)) - 40);
  EXPECT_LE(RequestedBytes(BuiltAtOnce(RandomOnSphere(random, 8, 1))), 700 + mutexes / 8);
  EXPECT_LE(RequestedBytes(BuiltAtOnce(RandomOnSphere(random, 24, 1))), 650);
  EXPECT_LE(RequestedBytes(BuiltAtOnce(RandomOnSphere(random, 64, 1))), 400);
}

TEST(HullCost, MemoryOfFlatHullsIsCounted) {
  HullBuilder builder;
  const size_t empty = builder.MemoryBytes();
  EXPECT_GT(empty, 0u);
  std::vector<Vector> circle;
  for (int i = -500; i <= 500; ++i) circle.emplace_back(i, i * i, 0);
  ASSERT_TRUE(builder.Add(circle).ok());
  EXPECT_GE(builder.MemoryBytes(), empty + circle.size() * (24 + 48));
}

}  // namespace hull_cost_test
}  // namespace hulld
