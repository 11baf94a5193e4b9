#include "core/hull/growth/hull_builder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "core/hull/audit.h"
#include "tests/core/checks/extreme_clouds.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/test_size.h"

namespace hulld {
namespace hull_builder_test {

using testing::HasSubstr;

constexpr int kRounds = TestSize(3000, 600);

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Highly degenerate sets of every dimension.
std::vector<Vector> DegeneratePoints(Random& random) {
  const int n = random.Below(24);
  if (random.Below(3) == 0) return RandomFlatPoints(random, n, random.Below(4));
  return RandomLatticePoints(random, n, random.Between(1, 4));
}

void AddInRandomBlocks(Random& random, const std::vector<Vector>& points, HullBuilder& builder) {
  std::span<const Vector> rest = points;
  while (!rest.empty()) {
    const size_t n = 1 + static_cast<size_t>(random.Below(static_cast<int>(rest.size())));
    ASSERT_TRUE(builder.Add(rest.subspan(0, n)).ok());
    rest = rest.subspan(n);
  }
}

TEST(HullBuilder, StartsEmpty) {
  const HullBuilder builder;
  EXPECT_EQ(builder.dimension(), -1);
  EXPECT_EQ(builder.vertex_count(), 0u);
  const Hull hull = builder.Snapshot();
  EXPECT_TRUE(hull.empty());
  EXPECT_EQ(hull.facet_count(), 0u);
  EXPECT_TRUE(AuditHull(hull).ok());
}

TEST(HullBuilder, EmptyBlockChangesNothing) {
  HullBuilder builder;
  EXPECT_EQ(*builder.Add({}), PointCounts{});
  EXPECT_EQ(builder.dimension(), -1);
}

TEST(HullBuilder, MatchesBruteForceOnDegenerateSets) {
  const uint64_t seed = TestSeed(101);
  Random random(seed);
  std::array<int, 5> dimensions = {};
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<Vector> points = DegeneratePoints(random);
    const oracle::ConvexHull expected = oracle::BruteForceHull(ToOracle(points));
    HullBuilder builder;
    AddInRandomBlocks(random, points, builder);
    const Hull hull = builder.Snapshot();
    ASSERT_TRUE(SameHull(hull, expected)) << "seed " << seed << " round " << round << " points "
                                          << testing::PrintToString(ToOracle(points));
    ASSERT_EQ(builder.dimension(), expected.dimension);
    ASSERT_EQ(builder.vertex_count(), expected.vertices.size());
    const absl::Status audit = AuditHull(hull);
    ASSERT_TRUE(audit.ok()) << audit << " seed " << seed << " round " << round;
    ASSERT_TRUE(AuditContainment(hull, points).ok()) << "seed " << seed << " round " << round;
    ++dimensions[static_cast<size_t>(expected.dimension + 1)];
  }
  for (int count : dimensions) EXPECT_GT(count, kRounds / 50);
}

// Rounded lattices are nearly degenerate: filters cannot decide their signs.
TEST(HullBuilder, MatchesBruteForceOnNearlyDegenerateSets) {
  const uint64_t seed = TestSeed(102);
  Random random(seed);
  for (int round = 0; round < kRounds / 6; ++round) {
    std::vector<Vector> points = DegeneratePoints(random);
    const double scale = std::array{0.1, 1.0 / 3, 1e-160, 3e150, 0.7e-318, 1e-92, 1e99}[round % 7];
    const double offset = round % 7 < 2 ? random.Below(3) * 0.3 : 0;
    for (Vector& p : points) {
      p = p * scale + Vector::Constant(offset);
      if (random.Below(4) == 0) {
        double& x = p[random.Below(3)];
        x = std::nextafter(x, random.Below(2) ? kInfinity : -kInfinity);
      }
    }
    const Hull hull = BuildHull(points);
    ASSERT_TRUE(SameHull(hull, oracle::BruteForceHull(ToOracle(points))))
        << "seed " << seed << " round " << round << " points "
        << testing::PrintToString(ToOracle(points));
    ASSERT_TRUE(AuditHull(hull).ok()) << "seed " << seed << " round " << round;
  }
}

// Nearly degenerate sets in planes that doubles represent exactly: x = c, y = c, z = c, x = y or z
// = x.
TEST(HullBuilder, MatchesBruteForceOnNearlyDegeneratePolygons) {
  const uint64_t seed = TestSeed(112);
  Random random(seed);
  for (int round = 0; round < kRounds / 3; ++round) {
    std::vector<Vector> points = RandomLatticePoints(random, random.Between(3, 14), 5);
    const double scale = std::array{0.1, 1e-160, 1e153, 1e-318}[round % 4];
    const int plane = random.Below(5);
    for (Vector& p : points) {
      p *= scale;
      if (round % 4 == 0) p += Vector(0.3, 0.7, 0.1);
      for (int k = 0; k < 3; ++k) {
        if (random.Below(3) == 0) p[k] = std::nextafter(p[k], random.Below(2) ? 1e300 : -1e300);
      }
      if (plane < 3) p[plane] = scale;
      if (plane == 3) p.y() = p.x();
      if (plane == 4) p.z() = p.x();
    }
    const Hull hull = BuildHull(points);
    ASSERT_LE(hull.dimension(), 2);
    ASSERT_TRUE(SameHull(hull, oracle::BruteForceHull(ToOracle(points))))
        << "seed " << seed << " round " << round << " points "
        << testing::PrintToString(ToOracle(points));
  }
}

// Rounded multiples of a vector, in an exactly represented plane: slivers with corners decided by
// rounding alone.
TEST(HullBuilder, MatchesBruteForceOnRoundedLinesInAPlane) {
  const uint64_t seed = TestSeed(114);
  Random random(seed);
  int spread = 0;
  for (int round = 0; round < kRounds / 3; ++round) {
    const Vector step(random.Unit(), random.Unit(), 0);
    const Vector origin(random.Unit(), random.Unit(), 0);
    const int plane = random.Below(4);
    std::vector<Vector> points;
    for (int i = random.Between(4, 16); i > 0; --i) {
      Vector p = origin + random.Between(-20, 20) * step;
      if (plane < 3) std::swap(p.z(), p[plane]);
      if (plane == 3) p.z() = p.x();
      points.push_back(p);
    }
    const oracle::ConvexHull expected = oracle::BruteForceHull(ToOracle(points));
    spread += expected.vertices.size() > 3;
    ASSERT_TRUE(SameHull(BuildHull(points), expected))
        << "seed " << seed << " round " << round << " points "
        << testing::PrintToString(ToOracle(points));
  }
  EXPECT_GT(spread, kRounds / 10);
}

// Convexity is invariant under translation: a lattice of units in the last place about 2^e is
// equivalent to one of units, at every exponent, up to the boundary between exact stages.
TEST(HullBuilder, LatticesOfLastPlacesKeepTheFacets) {
  const uint64_t seed = TestSeed(113);
  Random random(seed);
  std::vector<int> exponents = {-1022, -1021, -970, -500, -360, 0, 300, 500, 1000, 1022, 1023};
  for (int e = -312; e <= -300; ++e) exponents.push_back(e);
  for (int e = 326; e <= 334; ++e) exponents.push_back(e);
  for (int round = 0; round < kRounds / 3; ++round) {
    const std::vector<Vector> points = DegeneratePoints(random);
    oracle::ConvexHull expected = ToOracle(BuildHull(points));
    const int e = exponents[static_cast<size_t>(round) % exponents.size()];
    // 2^e (1 + k 2^-52) for each coordinate k, which may be negative: 1.5 leaves room below.
    const auto moved = [e](double k) { return std::ldexp(1.5 + k * 0x1p-52, e); };
    std::vector<Vector> cluster;
    for (const Vector& p : points) cluster.emplace_back(moved(p.x()), moved(p.y()), moved(p.z()));
    for (oracle::Point& p : expected.vertices) {
      for (double& x : p) x = moved(x);
    }
    ASSERT_TRUE(SameHull(BuildHull(cluster), expected))
        << "seed " << seed << " round " << round << " exponent " << e << " points "
        << testing::PrintToString(ToOracle(points));
  }
}

// Convexity is affine: a power of two on each axis changes no facet, for any exponents.
TEST(HullBuilder, PowersOfTwoOnEachAxisKeepTheFacets) {
  const uint64_t seed = TestSeed(103);
  Random random(seed);
  for (int round = 0; round < kRounds / 3; ++round) {
    const std::vector<Vector> points = DegeneratePoints(random);
    oracle::ConvexHull expected = ToOracle(BuildHull(points));
    // From 2^-1074 (a coordinate 1 is the least subnormal) to 2^1020.
    std::array<double, 3> scale;
    for (double& s : scale) s = std::ldexp(1.0, random.Between(-1074, 1020));
    if (round % 4 == 0) scale.fill(std::ldexp(1.0, random.Between(-1000, 1000)));
    std::vector<Vector> scaled = points;
    for (Vector& p : scaled) p = p.cwiseProduct(Vector(scale[0], scale[1], scale[2]));
    for (oracle::Point& p : expected.vertices) {
      for (int k = 0; k < 3; ++k) p[k] *= scale[k];
    }
    const Hull hull = BuildHull(scaled);
    ASSERT_TRUE(SameHull(hull, expected))
        << "seed " << seed << " round " << round << " points "
        << testing::PrintToString(ToOracle(points)) << " scale " << testing::PrintToString(scale);
    if (round % 10 == 0) {
      ASSERT_TRUE(AuditHull(hull).ok()) << "seed " << seed << " round " << round;
    }
  }
}

TEST(HullBuilder, OrderAndBlocksDoNotMatter) {
  const uint64_t seed = TestSeed(104);
  Random random(seed);
  for (int round = 0; round < 40; ++round) {
    std::vector<Vector> points =
        round % 2 ? RandomLatticePoints(random, 200, 6) : RandomInBall(random, 300, 1);
    if (round % 4 == 3) points = Concatenated(points, points);
    const Hull expected = BuildHull(points);
    for (int shuffle = 0; shuffle < 4; ++shuffle) {
      Shuffle(random, points);
      HullBuilder builder;
      AddInRandomBlocks(random, points, builder);
      ASSERT_TRUE(SameBits(builder.Snapshot(), expected)) << "seed " << seed << " round " << round;
    }
    HullBuilder one_by_one;
    for (const Vector& p : points) ASSERT_TRUE(one_by_one.Add(std::span(&p, 1)).ok());
    ASSERT_TRUE(SameBits(one_by_one.Snapshot(), expected)) << "seed " << seed << " round " << round;
  }
}

TEST(HullBuilder, SnapshotsBetweenBlocksHaveNoEffect) {
  Random random(105);
  const std::vector<Vector> points = RandomLatticePoints(random, 120, 5);
  HullBuilder builder;
  std::vector<Vector> so_far;
  for (size_t i = 0; i < points.size(); ++i) {
    ASSERT_TRUE(builder.Add(std::span(&points[i], 1)).ok());
    so_far.push_back(points[i]);
    ASSERT_TRUE(SameBits(builder.Snapshot(), BuildHull(so_far))) << i;
  }
}

TEST(HullBuilder, VerticesOfAHullReproduceTheHull) {
  Random random(106);
  for (int round = 0; round < 30; ++round) {
    const Hull hull = BuildHull(RandomInBall(random, 200, 1));
    EXPECT_TRUE(SameBits(BuildHull(hull.vertices()), hull));
  }
}

TEST(HullBuilder, DimensionsGrowOneByOne) {
  HullBuilder builder;
  const auto add = [&](double x, double y, double z) {
    const Vector p(x, y, z);
    return builder.Add(std::span(&p, 1)).value();
  };
  EXPECT_EQ(add(1, 1, 1), (PointCounts{1, 1, 0, 0}));
  EXPECT_EQ(builder.dimension(), 0);
  EXPECT_EQ(add(1, 1, 1), (PointCounts{1, 0, 1, 0}));
  EXPECT_EQ(add(3, 3, 3), (PointCounts{1, 1, 0, 0}));
  EXPECT_EQ(builder.dimension(), 1);
  EXPECT_EQ(add(2, 2, 2), (PointCounts{1, 0, 0, 1}));
  EXPECT_EQ(add(5, 5, 5), (PointCounts{1, 1, 0, 0}));
  EXPECT_EQ(builder.vertex_count(), 2u);
  EXPECT_EQ(add(0, 0, 5), (PointCounts{1, 1, 0, 0}));
  EXPECT_EQ(builder.dimension(), 2);
  EXPECT_EQ(add(2, 2, 4), (PointCounts{1, 0, 0, 1}));
  EXPECT_EQ(add(1, 0, 0), (PointCounts{1, 1, 0, 0}));
  EXPECT_EQ(builder.dimension(), 3);
}

// Returns the counts of a block as defined by hull_builder.h, from snapshots before and after it.
PointCounts ExpectedCounts(const Hull& before, const Hull& after, std::span<const Vector> block) {
  using Key = std::tuple<double, double, double>;
  const auto key = [](const Vector& p) { return Key(p.x(), p.y(), p.z()); };
  std::set<Key> old_vertices, vertices;
  for (const Vector& p : before.vertices()) old_vertices.insert(key(p));
  for (const Vector& p : after.vertices()) vertices.insert(key(p));
  PointCounts counts;
  for (const Vector& p : block) {
    ++counts.received;
    if (!vertices.contains(key(p))) {
      ++counts.inside;
    } else if (old_vertices.insert(key(p)).second) {
      ++counts.outside;
    } else {
      ++counts.duplicate;
    }
  }
  return counts;
}

TEST(HullBuilder, CountsCoverEveryPoint) {
  const uint64_t seed = TestSeed(107);
  Random random(seed);
  PointCounts total;
  for (int round = 0; round < kRounds / 6; ++round) {
    HullBuilder builder;
    for (int block = 0; block < 6; ++block) {
      std::vector<Vector> points = DegeneratePoints(random);
      if (random.Below(3) == 0) points = Concatenated(points, points);
      const Hull before = builder.Snapshot();
      const PointCounts counts = builder.Add(points).value();
      ASSERT_EQ(counts.received, points.size());
      ASSERT_EQ(counts.received, counts.outside + counts.duplicate + counts.inside);
      const PointCounts expected = ExpectedCounts(before, builder.Snapshot(), points);
      ASSERT_EQ(counts.outside, expected.outside) << "seed " << seed << " round " << round;
      ASSERT_EQ(counts.duplicate, expected.duplicate) << "seed " << seed << " round " << round;
      total.outside += counts.outside;
      total.duplicate += counts.duplicate;
      total.inside += counts.inside;
    }
  }
  EXPECT_GT(total.outside, 500u);
  EXPECT_GT(total.duplicate, 500u);
  EXPECT_GT(total.inside, 500u);
}

// Large blocks. Most points occur several times and lie in facets that are perpendicular to an axis
// or cut off corners, at any scale.
TEST(HullBuilder, CountsCoverEveryPointInPlanesPerpendicularToAnAxis) {
  const uint64_t seed = TestSeed(108);
  Random random(seed);
  uint64_t duplicate = 0;
  for (int round = 0; round < kRounds / 50; ++round) {
    const int side = random.Between(2, 9);
    const int cut = random.Between(2 * side, 3 * side);
    std::vector<Vector> points = RandomLatticePoints(random, random.Between(150, 900), side);
    std::erase_if(points, [cut](const Vector& p) { return p.sum() > cut; });
    const double scale = std::array{1.0, 0.1, 0x1p-1074, 1e300}[static_cast<size_t>(round) % 4];
    points = Scaled(std::move(points), scale);
    HullBuilder builder;
    for (int block = 0; block < 2; ++block) {
      const Hull before = builder.Snapshot();
      const PointCounts counts = builder.Add(points).value();
      const PointCounts expected = ExpectedCounts(before, builder.Snapshot(), points);
      ASSERT_EQ(counts.outside, expected.outside) << "seed " << seed << " round " << round;
      ASSERT_EQ(counts.duplicate, expected.duplicate) << "seed " << seed << " round " << round;
      duplicate += counts.duplicate;
      if (block == 0) Shuffle(random, points);
    }
    ASSERT_TRUE(AuditHull(builder.Snapshot()).ok()) << "seed " << seed << " round " << round;
  }
  EXPECT_GT(duplicate, 500u);
}

TEST(HullBuilder, NegativeZeroIsStoredAsZero) {
  const std::vector<Vector> signs = {{-0.0, 0.0, -0.0}, {0.0, -0.0, 0.0}, {1, -0.0, -0.0}};
  HullBuilder builder;
  EXPECT_EQ(builder.Add(signs).value(), (PointCounts{3, 2, 1, 0}));
  const Hull hull = builder.Snapshot();
  ASSERT_EQ(hull.vertices().size(), 2u);
  for (const Vector& p : hull.vertices()) {
    for (int k = 0; k < 3; ++k) EXPECT_FALSE(std::signbit(p[k]));
  }
}

// A non-finite value is refused by its index and coordinate, anywhere in a block.
TEST(HullBuilder, RefusesNonFinitePointsAndChangesNothing) {
  Random random(108);
  HullBuilder builder;
  ASSERT_TRUE(builder.Add(RandomInBall(random, 50, 1)).ok());
  const Hull before = builder.Snapshot();
  for (size_t index : {size_t{0}, size_t{17}, size_t{2999}}) {
    for (int k = 0; k < 3; ++k) {
      for (double bad : {kNan, kInfinity, -kInfinity}) {
        std::vector<Vector> points = RandomInBall(random, 3000, 2);
        points[index][k] = bad;
        const absl::Status status = builder.Add(points).status();
        EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
        const std::string expected = "points[" + std::to_string(index) + "]." + "xyz"[k] +
                                     (std::isnan(bad) ? " is NaN" : " is infinite");
        EXPECT_THAT(std::string(status.message()), HasSubstr(expected));
        ASSERT_TRUE(SameBits(builder.Snapshot(), before));
      }
    }
  }
  // The builder still works.
  const std::vector<Vector> far = {{10, 0, 0}};
  EXPECT_EQ(builder.Add(far).value(), (PointCounts{1, 1, 0, 0}));
}

TEST(HullBuilder, RefusalInAnEmptyBuilderLeavesItEmpty) {
  HullBuilder builder;
  const std::vector<Vector> points = {{0, 0, 0}, {1, kNan, 0}};
  EXPECT_FALSE(builder.Add(points).ok());
  EXPECT_EQ(builder.dimension(), -1);
  EXPECT_EQ(builder.vertex_count(), 0u);
}

TEST(HullBuilder, VertexLimitRefusesTheBlockAndChangesNothing) {
  Random random(109);
  const std::vector<Vector> sphere = FibonacciSphere(100);
  HullBuilder builder;
  ASSERT_TRUE(builder.Add(std::span(sphere).subspan(0, 60)).ok());
  const Hull before = builder.Snapshot();
  AddLimits limits;
  limits.max_vertices = 99;
  const absl::Status status = builder.Add(std::span(sphere).subspan(60), limits).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  EXPECT_TRUE(SameBits(builder.Snapshot(), before));
  limits.max_vertices = 100;
  EXPECT_TRUE(builder.Add(std::span(sphere).subspan(60), limits).ok());
  EXPECT_TRUE(SameBits(builder.Snapshot(), BuildHull(sphere)));
  // Only the hull after the block counts: a cube around it has eight vertices.
  limits.max_vertices = 8;
  EXPECT_TRUE(builder.Add(Shifted(LatticeCube(2, 4), Vector(-2, -2, -2)), limits).ok());
  EXPECT_EQ(builder.vertex_count(), 8u);
}

// The limit holds in each dimension.
TEST(HullBuilder, VertexLimitHoldsForFlatHulls) {
  for (int dimension = 0; dimension <= 3; ++dimension) {
    std::vector<Vector> simplex = {Vector::Zero()};
    for (int k = 0; k < dimension; ++k) simplex.push_back(Vector::Unit(k));
    HullBuilder builder;
    AddLimits limits;
    limits.max_vertices = simplex.size() - 1;
    EXPECT_EQ(builder.Add(simplex, limits).status().code(), absl::StatusCode::kResourceExhausted)
        << dimension;
    EXPECT_EQ(builder.dimension(), -1);
    limits.max_vertices = simplex.size();
    EXPECT_TRUE(builder.Add(simplex, limits).ok());
    EXPECT_EQ(builder.dimension(), dimension);
  }
}

TEST(HullBuilder, CancellationAtAnyTimeChangesNothing) {
  Random random(110);
  const std::vector<Vector> first = RandomInBall(random, 500, 1);
  const std::vector<Vector> block = RandomOnSphere(random, 20000, 2);
  HullBuilder builder;
  ASSERT_TRUE(builder.Add(first).ok());
  const Hull before = builder.Snapshot();
  int cancelled = 0;
  for (int allowed : {0, 1, 2, 5, 20, 60}) {
    int polls = 0;
    AddLimits limits;
    limits.should_stop = [&] { return ++polls > allowed; };
    const absl::StatusOr<PointCounts> counts = builder.Add(block, limits);
    if (counts.ok()) break;  // fewer polls than allowed
    ++cancelled;
    EXPECT_EQ(counts.status().code(), absl::StatusCode::kCancelled) << counts.status();
    ASSERT_TRUE(SameBits(builder.Snapshot(), before)) << "after " << allowed << " polls";
  }
  EXPECT_EQ(cancelled, 6);
  int polls = 0;
  AddLimits limits;
  limits.should_stop = [&] { return ++polls < 0; };
  ASSERT_TRUE(builder.Add(block, limits).ok());
  EXPECT_GT(polls, 2);
  EXPECT_TRUE(SameBits(builder.Snapshot(), BuildHull(Concatenated(first, block))));
}

// A refused block is undone, in any combination of stages.
TEST(HullBuilder, RefusedBlocksAreUndoneInEveryStage) {
  const uint64_t seed = TestSeed(113);
  Random random(seed);
  int reached[4][4] = {};
  for (int k = 0; k < 600; ++k) {
    const int dimension = random.Below(4);
    std::vector<Vector> first = RandomFlatPoints(random, 1 + random.Below(40), dimension);
    if (k % 7 == 0) first.clear();
    std::vector<Vector> second = first;
    if (k % 3 != 0) {
      for (int more = random.Below(30); more >= 0; --more) {
        second.push_back(RandomLatticePoints(random, 1, 40)[0]);
      }
    } else {
      for (const Vector& p : RandomFlatPoints(random, 30, 3)) second.push_back(p * 3);
    }
    HullBuilder builder;
    ASSERT_TRUE(builder.Add(first).ok());
    const Hull before = builder.Snapshot();
    const size_t new_before = builder.NewVertices().size();
    AddLimits none;
    none.max_vertices = 0;
    for (int again = 0; again < 2; ++again) {
      EXPECT_TRUE(absl::IsResourceExhausted(builder.Add(second, none).status()));
      EXPECT_GT(builder.undo_bytes() + second.size(), 0u);
      ASSERT_TRUE(SameBits(builder.Snapshot(), before)) << "case " << k << " seed " << seed;
      EXPECT_EQ(builder.NewVertices().size(), new_before);
      EXPECT_EQ(builder.vertex_count(), before.vertices().size());
    }
    const auto counts = builder.Add(second);
    HullBuilder untouched;
    ASSERT_TRUE(untouched.Add(first).ok());
    EXPECT_EQ(*counts, *untouched.Add(second)) << "case " << k << " seed " << seed;
    ASSERT_TRUE(SameBits(builder.Snapshot(), untouched.Snapshot())) << "case " << k;
    if (before.dimension() >= 0) ++reached[before.dimension()][builder.dimension()];
  }
  for (int from = 0; from < 4; ++from) EXPECT_GT(reached[from][3], 0) << from;
}

// A direction map measured within an undone block would reject too much.
TEST(HullBuilder, RefusedBlocksLeaveNoMap) {
  Random random(114);
  HullBuilder builder;
  ASSERT_TRUE(builder.Add(RandomOnSphere(random, 3000, 1)).ok());
  const Hull before = builder.Snapshot();
  const std::vector<Vector> large = RandomInBall(random, 200000, 50);
  for (const size_t limit : {size_t{10}, size_t{100}}) {
    AddLimits limits;
    limits.max_vertices = limit;
    EXPECT_TRUE(absl::IsResourceExhausted(builder.Add(large, limits).status()));
    ASSERT_TRUE(SameBits(builder.Snapshot(), before));
  }
  for (int allowed = 1; allowed < 100000; allowed = 2 * allowed + 1) {
    int polls = 0;
    AddLimits limits;
    limits.should_stop = [&] { return ++polls > allowed; };
    if (builder.Add(large, limits).ok()) {
      EXPECT_GT(allowed, 20);
      break;
    }
    ASSERT_TRUE(SameBits(builder.Snapshot(), before)) << allowed;
    HullBuilder copy = builder;
    const std::vector<Vector> slightly_larger = RandomOnSphere(random, 500, 1.5);
    ASSERT_TRUE(copy.Add(slightly_larger).ok());
    ASSERT_TRUE(SameBits(copy.Snapshot(), BuildHull(Concatenated(
                                              {before.vertices().begin(), before.vertices().end()},
                                              slightly_larger))));
  }
}

// A stop noticed during the choice of the insertion order omits no points.
TEST(HullBuilder, NoBlockSucceedsAfterAStop) {
  for (const Extreme& extreme : Extremes()) {
    const std::vector<Vector> points = extreme.make(600);
    const std::span<const Vector> first = std::span(points).first(100);
    const std::span<const Vector> rest = std::span(points).subspan(100);
    HullBuilder builder;
    ASSERT_TRUE(builder.Add(first).ok());
    const Hull before = builder.Snapshot();
    const Hull whole = BuildHull(points);
    for (int last = 1; last <= 4; ++last) {
      int polls = 0;
      AddLimits limits;
      limits.should_stop = [&] { return ++polls == last; };
      HullBuilder copy = builder;
      const auto counts = copy.Add(rest, limits);
      EXPECT_EQ(absl::IsCancelled(counts.status()), polls >= last) << extreme.name;
      ASSERT_TRUE(SameBits(copy.Snapshot(), counts.ok() ? whole : before)) << extreme.name;
    }
  }
}

// A snapshot polls every 1024 steps of each pass, so that no pass runs long without polling, and
// stops at any poll.
void ExpectToStopAnywhere(std::span<const Vector> points, int steps) {
  HullBuilder builder;
  ASSERT_TRUE(builder.Add(points).ok());
  ASSERT_EQ(builder.vertex_count(), points.size());
  const Hull hull = builder.Snapshot();
  int polls = 0;
  const absl::StatusOr<Hull> whole = builder.Snapshot([&] { return ++polls < 0; });
  ASSERT_TRUE(whole.ok()) << whole.status();
  EXPECT_TRUE(SameBits(*whole, hull));
  EXPECT_EQ(polls, (steps + 1023) / 1024);
  for (int last = 1; last <= polls; ++last) {
    int polls_to_stop = 0;
    const absl::StatusOr<Hull> stopped = builder.Snapshot([&] { return ++polls_to_stop == last; });
    EXPECT_EQ(stopped.status().code(), absl::StatusCode::kCancelled) << stopped.status();
    // After a stop, it does not poll again.
    EXPECT_EQ(polls_to_stop, last);
  }
  EXPECT_TRUE(SameBits(builder.Snapshot(), hull));
}

TEST(HullBuilder, ASnapshotStopsAtEveryPoll) {
  Random random(112);
  constexpr int kVertices = TestSize(20000, 4000);
  // Two passes over 2 V - 4 triangles, and seven over V vertices.
  ExpectToStopAnywhere(RandomOnSphere(random, kVertices, 2),
                       2 * (2 * kVertices - 4) + 7 * kVertices);
  std::vector<Vector> polygon;
  for (int i = 0; i < kVertices; ++i) polygon.push_back({1.0 * i, 1.0 * i * i, 3.0});
  ExpectToStopAnywhere(polygon, 9 * kVertices);
}

std::set<std::tuple<double, double, double>> SetOf(std::span<const Vector> points) {
  std::set<std::tuple<double, double, double>> set;
  for (const Vector& p : points) set.emplace(p.x() + 0.0, p.y() + 0.0, p.z() + 0.0);
  return set;
}

TEST(HullBuilder, NewVerticesComeFromTheLastBlock) {
  const uint64_t seed = TestSeed(113);
  Random random(seed);
  size_t brought = 0;
  size_t replaced = 0;
  size_t nothing_new = 0;
  for (int round = 0; round < kRounds / 6; ++round) {
    HullBuilder builder;
    EXPECT_TRUE(builder.NewVertices().empty());
    for (int block = 0; block < 6; ++block) {
      const std::vector<Vector> points = DegeneratePoints(random);
      HullBuilder former = builder;
      const auto before = SetOf(builder.Vertices());
      const PointCounts counts = builder.Add(points).value();
      const std::vector<Vector> fresh = builder.NewVertices();
      ASSERT_EQ(fresh.size(), counts.outside) << "seed " << seed << " round " << round;
      // Each vertex occurs exactly once; none is missing or out of date.
      const auto after = SetOf(builder.Vertices());
      std::set<std::tuple<double, double, double>> expected;
      std::set_difference(after.begin(), after.end(), before.begin(), before.end(),
                          std::inserter(expected, expected.end()));
      ASSERT_EQ(SetOf(fresh), expected) << "seed " << seed << " round " << round;
      ASSERT_TRUE(former.Add(fresh).ok());
      ASSERT_TRUE(SameBits(former.Snapshot(), builder.Snapshot()))
          << "seed " << seed << " round " << round;
      brought += fresh.size();
      replaced += !fresh.empty() && after.size() < before.size() + fresh.size();
      nothing_new += !before.empty() && !points.empty() && fresh.empty();
    }
  }
  EXPECT_GT(brought, 500u);
  EXPECT_GT(replaced, 100u);
  EXPECT_GT(nothing_new, 50u);
}

TEST(HullBuilder, NewVerticesSurviveARefusedBlock) {
  Random random(114);
  HullBuilder builder;
  ASSERT_TRUE(builder.Add(RandomInBall(random, 100, 1)).ok());
  const auto first = SetOf(builder.NewVertices());
  const std::vector<Vector> more = RandomOnSphere(random, 5000, 2);
  AddLimits limits;
  limits.max_vertices = 500;
  EXPECT_TRUE(absl::IsResourceExhausted(builder.Add(more, limits).status()));
  EXPECT_EQ(SetOf(builder.NewVertices()), first);
  limits = {};
  limits.should_stop = [] { return true; };
  EXPECT_TRUE(absl::IsCancelled(builder.Add(more, limits).status()));
  EXPECT_EQ(SetOf(builder.NewVertices()), first);
  EXPECT_FALSE(builder.Add(std::vector{Vector(kNan, 0, 0)}).ok());
  EXPECT_EQ(SetOf(builder.NewVertices()), first);
  ASSERT_TRUE(builder.Add({}).ok());
  EXPECT_TRUE(builder.NewVertices().empty());
}

TEST(HullBuilder, CopiesAreIndependent) {
  Random random(111);
  const std::vector<Vector> first = RandomInBall(random, 100, 1);
  const std::vector<Vector> more = RandomInBall(random, 100, 2);
  HullBuilder builder;
  ASSERT_TRUE(builder.Add(first).ok());
  HullBuilder copy = builder;
  ASSERT_TRUE(copy.Add(more).ok());
  EXPECT_TRUE(SameBits(builder.Snapshot(), BuildHull(first)));
  EXPECT_TRUE(SameBits(copy.Snapshot(), BuildHull(Concatenated(first, more))));
  builder = copy;
  EXPECT_TRUE(SameBits(builder.Snapshot(), copy.Snapshot()));
  HullBuilder moved = std::move(copy);
  EXPECT_TRUE(SameBits(moved.Snapshot(), builder.Snapshot()));
}

TEST(Hull, ReportsItsLargestCoordinate) {
  EXPECT_EQ(Hull().max_abs_coordinate(), 0);
  const std::vector<Vector> points = {{1, -7, 2}, {3, 0, 0}};
  EXPECT_EQ(BuildHull(points).max_abs_coordinate(), 7);
}

}  // namespace hull_builder_test
}  // namespace hulld
