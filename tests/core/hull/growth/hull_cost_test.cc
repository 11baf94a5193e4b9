#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/query/placed/live_hull.h"
#include "core/query/placed/query_hull.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {
namespace {

// What a hull costs, counted: work and memory, never time.

struct NamedPoints {
  const char* name;
  std::vector<Vector> points;
};

// Shells that each hide the one before.
std::vector<Vector> GrowingShells(Random& random, size_t n) {
  std::vector<Vector> points = RandomOnSphere(random, n, 1);
  for (size_t i = 0; i < n; ++i) points[i] *= 1 + std::floor(static_cast<double>(i) / 500) / 4;
  return points;
}

// Of one point after another, none does much more than its share of the housekeeping: beyond the
// triangles that it removes and creates, its work grows like the square of a logarithm.
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
    // The counter counts.
    EXPECT_GT(before, builder.vertex_count()) << stream.name;
  }
}

// Inside points are not kept, and what is kept is small.
TEST(HullCost, MemoryIsBoundedByTheVertices) {
  const uint64_t seed = TestSeed(503);
  Random random(seed);
  const std::vector<NamedPoints> clouds = {{"sphere of 1000", RandomOnSphere(random, 1000, 1)},
                                           {"sphere of 1100", RandomOnSphere(random, 1100, 1)},
                                           {"sphere", RandomOnSphere(random, 30000, 1)},
                                           {"ball of 1e5", RandomInBall(random, 100000, 1)},
                                           {"ball of 1e6", RandomInBall(random, 1000000, 1)}};
  for (const NamedPoints& cloud : clouds) {
    HullBuilder builder;
    ASSERT_TRUE(builder.Add(cloud.points).ok());
    HullBuilder streamed;
    for (size_t i = 0; i < cloud.points.size() && i < 100000; ++i) {
      ASSERT_TRUE(streamed.Add(std::span(cloud.points).subspan(i, 1)).ok());
    }
    for (const HullBuilder* b : {&builder, &streamed}) {
      const auto vertices = static_cast<double>(b->vertex_count());
      ASSERT_GE(vertices, 1000) << cloud.name;
      const Hull hull = b->Snapshot();
      EXPECT_LE(static_cast<double>(hull.MemoryBytes()) / vertices, 100) << cloud.name;
      EXPECT_LE(static_cast<double>(b->MemoryBytes()) / vertices, 230) << cloud.name;
      const auto queried = static_cast<double>(hull.MemoryBytes() + QueryHull(hull).MemoryBytes());
      EXPECT_LE(queried / vertices, 150) << cloud.name;
      // What the server holds of a hull that grew and is asked about, at rest.
      LiveHull live(b->Vertices(), b->dimension());
      live.Prepare(live.Now());
      const auto asked = static_cast<double>(live.MemoryBytes() + b->MemoryBytes());
      EXPECT_LE(asked / vertices, 300) << cloud.name;
      std::printf(
          "%s, %s: %.0f vertices, bytes for each: snapshot %.0f, with queries %.0f, builder %.0f, "
          "with queries %.0f\n",
          cloud.name, b == &builder ? "at once" : "one by one", vertices,
          static_cast<double>(hull.MemoryBytes()) / vertices, queried / vertices,
          static_cast<double>(b->MemoryBytes()) / vertices, asked / vertices);
      // At least the vertices and the triangles are counted.
      EXPECT_GE(static_cast<double>(hull.MemoryBytes()) / vertices, 24 + 24 + 24) << cloud.name;
      EXPECT_GE(static_cast<double>(b->MemoryBytes()) / vertices, 24 + 2 * 64 - 1) << cloud.name;
    }
  }
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

}  // namespace
}  // namespace hulld
