#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "core/hull/audit.h"
#include "core/hull/growth/hull_builder.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/test_size.h"

namespace hulld {
namespace degenerate_hull_test {

constexpr int kLatticeSide = TestSize(50, 16);
constexpr int kLargeRounds = TestSize(60, 4);

// Expects a cube's 8 vertices, 12 edges, and 6 squares.
void ExpectBox(const Hull& hull) {
  EXPECT_EQ(hull.dimension(), 3);
  EXPECT_EQ(hull.vertices().size(), 8u);
  EXPECT_EQ(hull.edges().size(), 12u);
  ASSERT_EQ(hull.facet_count(), 6u);
  for (size_t i = 0; i < 6; ++i) EXPECT_EQ(hull.facet(i).size(), 4u);
  EXPECT_TRUE(AuditHull(hull).ok());
}

std::vector<Vector> Corners(double half) {
  return Shifted(LatticeCube(2, 2 * half), Vector::Constant(-half));
}

TEST(DegenerateHull, LatticeIsABox) {
  const std::vector<Vector> lattice = LatticeCube(kLatticeSide, 1);
  const Hull hull = BuildHull(lattice);
  ExpectBox(hull);
  EXPECT_TRUE(AuditContainment(hull, lattice).ok());
}

TEST(DegenerateHull, ShuffledLatticeIsTheSameBox) {
  Random random(201);
  std::vector<Vector> lattice = LatticeCube(kLatticeSide, 1);
  const Hull expected = BuildHull(lattice);
  Shuffle(random, lattice);
  EXPECT_TRUE(SameBits(BuildHull(lattice), expected));
}

// k * 0.1 rounds, but equally in all rows: still an exact grid.
TEST(DegenerateHull, LatticeTimesATenthIsABox) { ExpectBox(BuildHull(LatticeCube(30, 0.1))); }

TEST(DegenerateHull, CubeSurfaceGridIsABox) {
  Random random(202);
  std::vector<Vector> surface = LatticeCubeSurface(20);
  ExpectBox(BuildHull(surface));
  Shuffle(random, surface);
  ExpectBox(BuildHull(surface));
}

TEST(DegenerateHull, CornersAThousandTimesAreABox) {
  std::vector<Vector> corners;
  for (int i = 0; i < 1000; ++i) corners = Concatenated(std::move(corners), Corners(1));
  HullBuilder builder;
  const PointCounts counts = builder.Add(corners).value();
  EXPECT_EQ(counts, (PointCounts{8000, 8, 7992, 0}));
  ExpectBox(builder.Snapshot());
}

TEST(DegenerateHull, EqualPointsMakeOnePoint) {
  const std::vector<Vector> equal(5000, Vector(0.1, 0.2, 0.3));
  const Hull hull = BuildHull(equal);
  EXPECT_EQ(hull.dimension(), 0);
  EXPECT_EQ(hull.vertices().size(), 1u);
  EXPECT_EQ(hull.edges().size(), 0u);
  EXPECT_TRUE(AuditHull(hull).ok());
}

TEST(DegenerateHull, CollinearPointsAreASegment) {
  Random random(203);
  std::vector<Vector> line;
  for (int i = 0; i < 2000; ++i) line.push_back(Vector(3, -5, 7) * random.Between(-1000, 1000));
  line.push_back(Vector(3, -5, 7) * 1001);
  line.push_back(Vector(3, -5, 7) * -1001);
  const Hull hull = BuildHull(line);
  EXPECT_EQ(hull.dimension(), 1);
  ASSERT_EQ(hull.vertices().size(), 2u);
  EXPECT_EQ(hull.vertices()[0], Vector(3, -5, 7) * -1001);
  EXPECT_EQ(hull.edges().size(), 1u);
  EXPECT_TRUE(AuditHull(hull).ok());
}

// One unit in the last place off the line makes a triangle.
TEST(DegenerateHull, NearlyCollinearPointsAreATriangle) {
  std::vector<Vector> line;
  for (int i = 0; i <= 64; ++i) line.emplace_back(i, 3 * i, -i);
  line[20].y() = std::nextafter(line[20].y(), 1000);
  const Hull hull = BuildHull(line);
  EXPECT_EQ(hull.dimension(), 2);
  EXPECT_EQ(hull.vertices().size(), 3u);
}

std::vector<Vector> TiltedPlane(int n) {
  std::vector<Vector> plane;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) plane.push_back(i * Vector(3, 1, -2) + j * Vector(-1, 4, 5));
  }
  return plane;
}

TEST(DegenerateHull, TiltedPlaneIsAParallelogram) {
  const std::vector<Vector> plane = TiltedPlane(60);
  const Hull hull = BuildHull(plane);
  EXPECT_EQ(hull.dimension(), 2);
  EXPECT_EQ(hull.vertices().size(), 4u);
  EXPECT_EQ(hull.facet_count(), 1u);
  EXPECT_TRUE(AuditHull(hull).ok());
  EXPECT_TRUE(AuditContainment(hull, plane).ok());
}

TEST(DegenerateHull, PlanePlusOnePointABillionthOffIsAPyramid) {
  for (double off : {1e-9, -1e-9, 1e-300, 5e-324}) {
    std::vector<Vector> plane;
    for (int i = 0; i <= 40; ++i) {
      for (int j = 0; j <= 40; ++j) plane.emplace_back(i * 0.25, j * 0.25, 0);
    }
    plane.insert(plane.begin() + 777, Vector(3.3, 4.4, off));
    const Hull hull = BuildHull(plane);
    EXPECT_EQ(hull.dimension(), 3) << off;
    EXPECT_EQ(hull.vertices().size(), 5u) << off;
    EXPECT_EQ(hull.facet_count(), 5u) << off;
    EXPECT_TRUE(AuditHull(hull).ok()) << off;
  }
}

TEST(DegenerateHull, NeedleKeepsItsFourLongEdges) {
  Random random(204);
  std::vector<Vector> needle;
  for (int i = 0; i < 2000; ++i) {
    needle.emplace_back(random.Real(-1, 1), random.Real(-1e-8, 1e-8), random.Real(-1e-8, 1e-8));
  }
  for (const Vector& p : Corners(1)) needle.emplace_back(p.x(), p.y() * 1e-8, p.z() * 1e-8);
  const Hull hull = BuildHull(needle);
  ExpectBox(hull);
  EXPECT_TRUE(AuditContainment(hull, needle).ok());
}

// Faces that are planar up to rounding: some points stand out, and each decision counts.
TEST(DegenerateHull, JitteredCubeFacesPassTheAudit) {
  Random random(205);
  std::vector<Vector> points;
  for (int i = 0; i < 1200; ++i) {
    Vector p(random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1));
    p[i % 3] = (i % 2 ? 1 : -1) + random.Between(-4, 4) * 0x1p-52;
    points.push_back(p);
  }
  const Hull hull = BuildHull(points);
  EXPECT_EQ(hull.dimension(), 3);
  EXPECT_GT(hull.vertices().size(), 20u);
  const absl::Status audit = AuditHull(hull);
  EXPECT_TRUE(audit.ok()) << audit;
  const absl::Status containment = AuditContainment(hull, points);
  EXPECT_TRUE(containment.ok()) << containment;
}

TEST(DegenerateHull, JitteredSquareFacesMatchBruteForce) {
  Random random(206);
  for (int round = 0; round < 60; ++round) {
    std::vector<Vector> points;
    for (int i = 0; i < 24; ++i) {
      Vector p(random.Between(-2, 2), random.Between(-2, 2), random.Between(-2, 2));
      p /= 2;
      p[i % 3] = (i % 2 ? 1 : -1) + random.Between(-1, 1) * 1e-15;
      points.push_back(p);
    }
    const oracle::ConvexHull expected = oracle::BruteForceHull(ToOracle(points));
    ASSERT_TRUE(SameHull(BuildHull(points), expected)) << "round " << round;
  }
}

TEST(DegenerateHull, SubnormalAndHugeCoordinatesLiveInOneHull) {
  Random random(207);
  const double magnitudes[] = {1e-310, 3e-310, 1e300, 0, -1e-310, -1e300, 1, 1.5e308, -1.5e308};
  for (int round = 0; round < 40; ++round) {
    std::vector<Vector> points;
    for (int i = 0; i < 10; ++i) {
      points.emplace_back(magnitudes[random.Below(9)], magnitudes[random.Below(9)],
                          magnitudes[random.Below(9)]);
    }
    const oracle::ConvexHull expected = oracle::BruteForceHull(ToOracle(points));
    const Hull hull = BuildHull(points);
    ASSERT_TRUE(SameHull(hull, expected)) << "round " << round;
    const absl::Status audit = AuditHull(hull);
    ASSERT_TRUE(audit.ok()) << audit << " round " << round;
  }
}

TEST(DegenerateHull, IntegerCosphericalPointsAreAllExtreme) {
  const std::vector<Vector> points = IntegerSphere(2021);
  ASSERT_EQ(points.size(), 816u);
  const Hull hull = BuildHull(points);
  EXPECT_EQ(hull.vertices().size(), points.size());
  const absl::Status audit = AuditHull(hull);
  EXPECT_TRUE(audit.ok()) << audit;
}

TEST(DegenerateHull, ParaboloidLatticeIsAllExtremeWithSquareFacets) {
  const int n = 8;
  const std::vector<Vector> points = IntegerParaboloid(n);
  const Hull hull = BuildHull(points);
  EXPECT_EQ(hull.vertices().size(), points.size());
  // The lower side: one square for each cell of the grid.
  size_t squares = 0;
  for (size_t i = 0; i < hull.facet_count(); ++i) squares += hull.facet(i).size() == 4;
  EXPECT_GE(squares, static_cast<size_t>(4 * n * n));
  const absl::Status audit = AuditHull(hull);
  EXPECT_TRUE(audit.ok()) << audit;
}

TEST(DegenerateHull, FibonacciSphereIsAllExtreme) {
  const std::vector<Vector> points = FibonacciSphere(1500);
  const Hull hull = BuildHull(points);
  EXPECT_EQ(hull.vertices().size(), 1500u);
  const absl::Status audit = AuditHull(hull);
  EXPECT_TRUE(audit.ok()) << audit;
}

// 2^k scales every coordinate exactly: the same facets from 2^-1000 to 2^1000.
TEST(DegenerateHull, PowersOfTwoKeepTheFacetsOfABall) {
  Random random(208);
  // Multiples of 2^-40, so that 2^-1000 times them are exact.
  std::vector<Vector> ball = RandomInBall(random, 400, 1);
  for (Vector& p : ball) p = (p * 0x1p40).array().round() * 0x1p-40;
  const oracle::ConvexHull base = ToOracle(BuildHull(ball));
  for (int exponent : {-1000, -700, -500, -340, -100, 100, 340, 500, 700, 1000}) {
    const double scale = std::ldexp(1.0, exponent);
    oracle::ConvexHull expected = base;
    for (oracle::Point& p : expected.vertices) {
      for (double& x : p) x *= scale;
    }
    EXPECT_TRUE(ToOracle(BuildHull(Scaled(ball, scale))) == expected) << "2^" << exponent;
  }
}

// Scaling by a separate power of two on each axis, from needles to pancakes far beyond the range
// of any rounding, for sets large enough for every stage of the builder.
TEST(DegenerateHull, PowersOfTwoOnEachAxisKeepTheFacetsOfLargeSets) {
  const uint64_t seed = TestSeed(210);
  Random random(seed);
  for (int round = 0; round < kLargeRounds; ++round) {
    std::vector<Vector> points;
    if (round % 3 == 0) points = RandomLatticePoints(random, 6000, 12);
    if (round % 3 == 1) points = RandomInBall(random, 6000, 1);
    if (round % 3 == 2) points = RandomOnSphere(random, 2500, 1);
    for (Vector& p : points) p = (p * 0x1p30).array().round() * 0x1p-30;
    oracle::ConvexHull expected = ToOracle(BuildHull(points));
    // Each axis has its own power within one range, or all have similar ones: cubes of about 2^-350
    // underflow partially, so that filters see some of the values.
    const int spans[][2] = {{-60, 60}, {-1000, 1000}, {-370, -330}, {-352, -350}};
    const auto [low, high] = spans[round % 4];
    Vector scale;
    for (double& s : scale) s = std::ldexp(1.0, random.Between(low, high));
    for (Vector& p : points) p = p.cwiseProduct(scale);
    for (oracle::Point& p : expected.vertices) {
      for (int k = 0; k < 3; ++k) p[k] *= scale[k];
    }
    ASSERT_TRUE(SameHull(BuildHull(points), expected))
        << "seed " << seed << " round " << round << " scale " << scale.transpose();
  }
}

// Snapshots have canonical order for any distribution of the vertices' x: on a sphere, in two
// planes, near one end, on either side of zero, and so far apart that their distance is not a
// double.
TEST(DegenerateHull, SnapshotsAreCanonicalForAnyDistributionOfX) {
  Random random(209);
  const std::vector<Vector> sphere = RandomOnSphere(random, 300, 1);
  std::vector<Vector> prism;
  for (const Vector& p : RandomOnSphere(random, 200, 1)) {
    prism.emplace_back(p.x() < 0 ? -1 : 1, p.y() / std::hypot(p.y(), p.z()),
                       p.z() / std::hypot(p.y(), p.z()));
  }
  std::vector<Vector> subnormal = sphere;
  std::vector<Vector> widest = sphere;
  for (size_t i = 0; i < sphere.size(); ++i) {
    subnormal[i].x() *= 0x1p-1070;
    widest[i].x() *= i % 2 == 0 ? 0x1.fp1023 : 1;
  }
  const std::vector<Vector> outlier = Concatenated(sphere, {Vector(1e300, 0, 0)});
  for (const std::vector<Vector>& points : {sphere, prism, subnormal, widest, outlier}) {
    const Hull hull = BuildHull(points);
    EXPECT_EQ(hull.dimension(), 3);
    EXPECT_GT(hull.vertices().size(), 100u);
    EXPECT_TRUE(AuditHull(hull).ok());
    EXPECT_TRUE(AuditContainment(hull, points).ok());
  }
}

// Streams with first blocks unlike the last: clusters far apart, growing shells, flat starts. Any
// split into blocks yields the hull of a single block.
TEST(DegenerateHull, StreamsOfDissimilarBlocksEqualOneBlock) {
  const uint64_t seed = TestSeed(211);
  Random random(seed);
  for (int round = 0; round < kLargeRounds; ++round) {
    std::vector<Vector> points = RandomInBall(random, 1500, 1e-6);
    const Vector far(1e3, -2e3, 5e2);
    points = Concatenated(points, Shifted(RandomOnSphere(random, 1500, 1e-3), far));
    if (round % 2) points = Shifted(RandomFlatPoints(random, 1500, 2), far);
    for (double radius : {1e-3, 1.0, 1e3}) {
      points = Concatenated(points, RandomOnSphere(random, 700, radius));
      points = Concatenated(points, Scaled(RandomLatticePoints(random, 700, 5), radius / 4));
    }
    points = Concatenated(points, Scaled(LatticeCubeSurface(12), 100));
    const Hull expected = BuildHull(points);
    HullBuilder builder;
    std::span<const Vector> rest = points;
    while (!rest.empty()) {
      const size_t n = std::min(rest.size(), static_cast<size_t>(random.Between(1, 2500)));
      ASSERT_TRUE(builder.Add(rest.subspan(0, n)).ok());
      rest = rest.subspan(n);
    }
    ASSERT_TRUE(SameBits(builder.Snapshot(), expected)) << "seed " << seed << " round " << round;
    Shuffle(random, points);
    ASSERT_TRUE(SameBits(BuildHull(points), expected)) << "seed " << seed << " round " << round;
    HullBuilder one_by_one;
    for (const Vector& p : points) ASSERT_TRUE(one_by_one.Add(std::span(&p, 1)).ok());
    ASSERT_TRUE(SameBits(one_by_one.Snapshot(), expected)) << "seed " << seed << " round " << round;
  }
}

// A mesh far from the origin, tiny and huge.
TEST(DegenerateHull, MeshAtOtherScalesPassesTheAudit) {
  const std::optional<std::vector<Vector>> mesh = MeshVertices("spot.obj");
  if (!mesh) GTEST_SKIP() << "skipped: no data";
  std::vector<Vector> points = *mesh;
  for (const std::vector<Vector>& variant :
       {points, Shifted(points, Vector::Constant(1e6)), Scaled(points, 1e-12), Scaled(points, 1e12),
        Scaled(points, 1e-300), Scaled(points, 1e300)}) {
    const Hull hull = BuildHull(variant);
    EXPECT_EQ(hull.dimension(), 3);
    const absl::Status audit = AuditHull(hull);
    EXPECT_TRUE(audit.ok()) << audit;
    Random random(209);
    std::vector<Vector> sample;
    for (int i = 0; i < 100; ++i) {
      sample.push_back(
          variant[static_cast<size_t>(random.Below(static_cast<int>(variant.size())))]);
    }
    const absl::Status containment = AuditContainment(hull, sample);
    EXPECT_TRUE(containment.ok()) << containment;
  }
}

}  // namespace degenerate_hull_test
}  // namespace hulld
