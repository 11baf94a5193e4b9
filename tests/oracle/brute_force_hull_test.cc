#include "tests/oracle/brute_force_hull.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tests/oracle/cgal_hull.h"
#include "tests/oracle/origin_position.h"

namespace hulld::oracle {
namespace brute_force_hull_test {

using testing::ElementsAre;

std::vector<Point> LatticeCube(int n) {
  std::vector<Point> points;
  for (int i = 0; i < n * n * n; ++i) {
    points.push_back({double(i % n), double(i / n % n), double(i / n / n)});
  }
  return points;
}

TEST(BruteForceHull, EmptyAndSmallDimensions) {
  EXPECT_EQ(BruteForceHull({}).dimension, -1);
  const std::vector<Point> same = {{1, 2, 3}, {1, 2, 3}};
  EXPECT_EQ(BruteForceHull(same).dimension, 0);
  EXPECT_EQ(BruteForceHull(same).vertices.size(), 1u);
  const std::vector<Point> line = {{2, 2, 2}, {0, 0, 0}, {1, 1, 1}, {3, 3, 3}};
  const ConvexHull segment = BruteForceHull(line);
  EXPECT_EQ(segment.dimension, 1);
  EXPECT_THAT(segment.vertices, ElementsAre(Point{0, 0, 0}, Point{3, 3, 3}));
  EXPECT_THAT(segment.edges, ElementsAre(std::pair(0u, 1u)));
  EXPECT_TRUE(segment.facets.empty());
}

TEST(BruteForceHull, SquareHasOneFacetFromItsLowestVertex) {
  const std::vector<Point> grid = {{0, 0, 1}, {1, 0, 1}, {2, 0, 1}, {0, 1, 1}, {1, 1, 1},
                                   {2, 1, 1}, {0, 2, 1}, {1, 2, 1}, {2, 2, 1}};
  const ConvexHull square = BruteForceHull(grid);
  EXPECT_EQ(square.dimension, 2);
  EXPECT_EQ(square.vertices.size(), 4u);
  EXPECT_THAT(square.facets, ElementsAre(ElementsAre(0, 1, 3, 2)));
  EXPECT_EQ(square.edges.size(), 4u);
}

TEST(BruteForceHull, CubeHasSixSquaresSeenFromOutside) {
  const ConvexHull cube = BruteForceHull(LatticeCube(3));
  EXPECT_EQ(cube.dimension, 3);
  EXPECT_EQ(cube.vertices.size(), 8u);
  EXPECT_EQ(cube.edges.size(), 12u);
  // Vertex 4x + 2y + z, with halved coordinates.
  EXPECT_THAT(cube.facets, ElementsAre(ElementsAre(0, 1, 3, 2), ElementsAre(0, 2, 6, 4),
                                       ElementsAre(0, 4, 5, 1), ElementsAre(1, 5, 7, 3),
                                       ElementsAre(2, 3, 7, 6), ElementsAre(4, 6, 7, 5)));
}

TEST(BruteForceHull, WorksFromSubnormalsToHugeCoordinates) {
  const std::vector<Point> points = {{0, 0, 0},         {1e300, 0, 0}, {0, 1e300, 0},
                                     {0, 0, 1e-310},    {0, 0, -0.0},  {1e-310, 0, 0},
                                     {1e300, 1e300, 0}, {0, 0, 5e-324}};
  const ConvexHull hull = BruteForceHull(points);
  EXPECT_EQ(hull.dimension, 3);
  EXPECT_EQ(hull.vertices.size(), 5u);
  EXPECT_EQ(hull.facets.size(), 5u);
}

// A point is extreme iff it is not a convex combination of the other points.
TEST(BruteForceHull, VerticesAgreeWithLinearPrograms) {
  std::mt19937_64 random(7);
  for (int round = 0; round < 200; ++round) {
    std::vector<Point> points;
    const int side = 2 + static_cast<int>(random() % 3);
    for (int i = 0; i < 12; ++i) {
      points.push_back({double(random() % side), double(random() % side), double(random() % side)});
    }
    const ConvexHull hull = BruteForceHull(points);
    const std::vector<IntegerVector> integers = ToIntegerVectors(points);
    for (size_t i = 0; i < points.size(); ++i) {
      std::vector<IntegerVector> others;
      for (const IntegerVector& p : integers) {
        if (p != integers[i]) others.push_back(p);
      }
      const std::vector<IntegerVector> self = {integers[i]};
      const bool extreme = LocateInDifference(self, others) == OriginPosition::kOutside;
      const bool listed =
          std::find(hull.vertices.begin(), hull.vertices.end(), points[i]) != hull.vertices.end();
      ASSERT_EQ(extreme, listed) << "round " << round << " point " << i;
    }
  }
}

TEST(CgalHull, AgreesWithBruteForceOnLattices) {
  if (!CgalIsAvailable()) GTEST_SKIP() << "skipped: built without CGAL";
  std::mt19937_64 random(11);
  int compared = 0;
  for (int round = 0; round < 300; ++round) {
    std::vector<Point> points;
    const int side = 2 + static_cast<int>(random() % 4);
    for (int i = 0; i < 24; ++i) {
      points.push_back({double(random() % side), double(random() % side), double(random() % side)});
    }
    const ConvexHull hull = BruteForceHull(points);
    if (hull.dimension != 3) continue;
    ++compared;
    ASSERT_EQ(CgalExtremePoints(points), hull.vertices) << "round " << round;
  }
  EXPECT_GT(compared, 250);
}

TEST(CgalHull, DropsCoplanarPointsOfALattice) {
  if (!CgalIsAvailable()) GTEST_SKIP() << "skipped: built without CGAL";
  EXPECT_EQ(CgalExtremePoints(LatticeCube(12)).size(), 8u);
}

}  // namespace brute_force_hull_test
}  // namespace hulld::oracle
