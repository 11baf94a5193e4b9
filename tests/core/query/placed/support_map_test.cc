#include "core/query/placed/support_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/numeric/error_bounds.h"
#include "core/numeric/simd_path.h"
#include "tests/core/checks/extreme_clouds.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/test_size.h"

namespace hulld {
namespace support_map_test {

constexpr int kDirections = TestSize(3000, 100);
constexpr int kCorners = TestSize(20000, 4000);

struct NamedSet {
  std::string name;
  std::vector<Vector> points;
};

// Corners of a regular polygon, of a prism over it, or of a cone.
std::vector<Vector> OnCircles(int corners, std::span<const double> heights,
                              std::span<const Vector> others = {}) {
  std::vector<Vector> points(others.begin(), others.end());
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * M_PI * i / corners;
    for (const double height : heights) {
      points.emplace_back(std::cos(angle), std::sin(angle), height);
    }
  }
  return points;
}

// Sets along curves: cells of directions list many of their points at any cell size.
std::vector<NamedSet> CurvedSets(int corners) {
  const Vector apex(0, 0, 2);
  return {{"polygon", OnCircles(corners, std::array{0.0})},
          {"prism", OnCircles(corners / 2, std::array{-1.0, 1.0})},
          {"slab", OnCircles(corners / 2, std::array{-1e-9, 1e-9})},
          {"cone", OnCircles(corners, std::array{0.0}, std::span(&apex, 1))}};
}

// Sets of every shape, with more points than are scanned: round, flat, oblong, far from the origin,
// with points inside, and nearly flat caps.
std::vector<NamedSet> Sets(Random& random) {
  std::vector<NamedSet> sets;
  sets.push_back({"few", RandomOnSphere(random, 12, 1)});
  sets.push_back({"sphere", RandomOnSphere(random, 1000, 1)});
  std::vector<Vector> ball = RandomOnSphere(random, 2000, 1);
  for (size_t i = 0; i < ball.size(); ++i) ball[i] *= random.Real(0, 1);
  sets.push_back({"ball", ball});
  std::vector<Vector> needle = RandomOnSphere(random, 500, 1);
  for (Vector& p : needle) p = p.cwiseProduct(Vector(1e5, 1, 1e-5));
  sets.push_back({"needle", needle});
  sets.push_back({"far", Shifted(RandomOnSphere(random, 500, 1), Vector(1e9, -3e8, 7))});
  std::vector<Vector> polygon = RandomOnSphere(random, 300, 1);
  for (Vector& p : polygon) p.z() = 0;
  sets.push_back({"polygon", polygon});
  for (NamedSet& curved : CurvedSets(kCorners)) {
    curved.name = "large " + curved.name;
    sets.push_back(std::move(curved));
  }
  std::vector<Vector> tilted;
  for (const Vector& p : polygon) tilted.emplace_back(p.x(), p.y(), p.x() + 2 * p.y());
  sets.push_back({"tilted polygon", tilted});
  std::vector<Vector> segment;
  for (int i = 0; i < 60; ++i) segment.push_back(random.Below(100) * Vector(1, 2, -3));
  sets.push_back({"segment", segment});
  std::vector<Vector> lens;
  for (int i = 0; i < 600; ++i) {
    const double x = random.Real(-1, 1);
    const double y = random.Real(-1, 1);
    lens.emplace_back(x, y, (i % 2 == 0 ? 1e-9 : -1e-9) * (2 - x * x - y * y));
  }
  sets.push_back({"lens", lens});
  sets.push_back({"lattice", LatticeCube(7, 1)});
  std::vector<Vector> same(50, Vector(1, 2, 3));
  sets.push_back({"same", same});
  return sets;
}

// Directions of all kinds: random, along axes and diagonals, across edges, and near to these.
std::vector<Vector> Directions(Random& random, const std::vector<Vector>& points) {
  std::vector<Vector> directions = RandomOnSphere(random, kDirections, 1);
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x != 0 || y != 0 || z != 0) directions.emplace_back(x, y, z);
      }
    }
  }
  const auto any = [&] { return points[random.Below(static_cast<int>(points.size()))]; };
  for (int i = 0; i < kDirections; ++i) {
    const Vector p = any();
    directions.push_back((any() - p).cross(any() - p));
  }
  for (int i = 0; i < kDirections; ++i) {
    Vector n = directions[random.Below(static_cast<int>(directions.size()))];
    n += 1e-12 * n.cwiseAbs().maxCoeff() * RandomOnSphere(random, 1, 1)[0];
    directions.push_back(n);
  }
  std::erase_if(directions, [](const Vector& n) {
    return !n.allFinite() || !(n.cwiseAbs().maxCoeff() > 1e-100);
  });
  return directions;
}

double LargestOf(const std::vector<Vector>& points) {
  double largest = 0;
  for (const Vector& p : points) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  return largest;
}

TEST(SupportMap, FindsTheFarthestPointOfAnySet) {
  Random random(TestSeed(931));
  for (const NamedSet& set : Sets(random)) {
    const SupportMap map(set.points);
    const SupportMap scanning = SupportMap::ForScanning(set.points);
    const double size = LargestOf(set.points);
    for (const Vector& n : Directions(random, set.points)) {
      const SupportPoint found = map.Farthest(n);
      const SupportPoint scanned = scanning.Farthest(n);
      ASSERT_EQ(found.value,
                SupportValue(n, set.points[found.vertex].x(), set.points[found.vertex].y(),
                             set.points[found.vertex].z()));
      const double blur = kSupportBlurFactor * n.cwiseAbs().maxCoeff() * size;
      ASSERT_GE(found.value, scanned.value - blur) << set.name << " along " << n.transpose();
      ASSERT_LE(found.value, scanned.value) << set.name;
    }
  }
}

// Ties are exact if coordinates and directions are small integers: all points of a face.
TEST(SupportMap, CandidatesIncludeAllExactlyFarthestPoints) {
  Random random(TestSeed(932));
  std::vector<Vector> lattice = LatticeCube(9, 1);
  const SupportMap map(lattice);
  ASSERT_FALSE(map.scans());
  for (int x = -3; x <= 3; ++x) {
    for (int y = -3; y <= 3; ++y) {
      for (int z = -3; z <= 3; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        const Vector n(x, y, z);
        double largest = -INFINITY;
        for (const Vector& p : lattice) largest = std::max(largest, n.dot(p));
        std::vector<uint32_t> expected;
        for (uint32_t i = 0; i < lattice.size(); ++i) {
          if (n.dot(lattice[i]) == largest) expected.push_back(i + 5);
        }
        for (const double error : {0.0, 1e-12, 1e-3}) {
          std::vector<uint32_t> candidates;
          map.AppendCandidates(n, error, largest, 5, candidates);
          EXPECT_EQ(candidates, expected) << n.transpose() << " error " << error;
        }
      }
    }
  }
}

// A direction that differs by up to the error: the farthest point along it is a candidate.
TEST(SupportMap, CandidatesIncludeTheFarthestPointsOfNearbyDirections) {
  Random random(TestSeed(933));
  for (const NamedSet& set : Sets(random)) {
    const SupportMap map(set.points);
    const double size = LargestOf(set.points);
    for (const Vector& n : Directions(random, set.points)) {
      const double largest = n.cwiseAbs().maxCoeff();
      for (const double error : {1e-15 * largest, 1e-6 * largest}) {
        const Vector off =
            error * Vector(random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1));
        const uint32_t farthest = map.Farthest(Vector(n + off)).vertex;
        std::vector<uint32_t> candidates;
        const double slack = 8 * error * size + 4 * kSupportBlurFactor * largest * size;
        map.AppendCandidates(n, error, map.Farthest(n).value - slack, 0, candidates);
        ASSERT_TRUE(std::binary_search(candidates.begin(), candidates.end(), farthest))
            << set.name << " along " << n.transpose();
      }
    }
  }
}

TEST(SupportMap, ListedPointsHaveTheSameHull) {
  Random random(TestSeed(934));
  std::vector<NamedSet> sets = Sets(random);
  for (const Extreme& extreme : Extremes()) sets.push_back({extreme.name, extreme.make(300)});
  size_t hidden = 0;
  for (const NamedSet& set : sets) {
    const SupportMap map(set.points);
    std::vector<Vector> listed;
    for (const uint32_t i : map.Listed()) listed.push_back(set.points[i]);
    EXPECT_TRUE(SameBits(BuildHull(listed), BuildHull(set.points))) << set.name;
    hidden += set.points.size() - listed.size();
  }
  EXPECT_GT(hidden, 1000u);
}

TEST(SupportMap, EveryInstructionSetReturnsTheSameBits) {
  const SimdPath best = BestSimdPath();
  if (best == SimdPath::kPortable) GTEST_SKIP() << "this machine has only one SIMD path";
  Random random(TestSeed(935));
  for (const NamedSet& set : Sets(random)) {
    UseSimdPath(best);
    const SupportMap wide(set.points);
    UseSimdPath(SimdPath::kPortable);
    const SupportMap narrow(set.points);
    EXPECT_EQ(wide.Listed(), narrow.Listed());
    EXPECT_EQ(wide.MemoryBytes(), narrow.MemoryBytes());
    for (const Vector& n : Directions(random, set.points)) {
      UseSimdPath(best);
      const SupportPoint one = wide.Farthest(n);
      UseSimdPath(SimdPath::kPortable);
      const SupportPoint other = narrow.Farthest(n);
      ASSERT_EQ(one.vertex, other.vertex) << set.name;
      ASSERT_EQ(one.value, other.value) << set.name;
    }
  }
  UseSimdPath(best);
}

// At coordinates where products would overflow or vanish, all points are scanned.
TEST(SupportMap, ExtremeCoordinatesAreScanned) {
  Random random(TestSeed(936));
  for (const double scale : {0x1p1000, 0x1p-1000}) {
    std::vector<Vector> points = RandomOnSphere(random, 100, scale);
    const SupportMap map(points);
    EXPECT_TRUE(map.scans());
    EXPECT_EQ(map.Farthest(Vector(1, 0, 0)).value,
              std::max_element(points.begin(), points.end(), [](const Vector& p, const Vector& q) {
                return p.x() < q.x();
              })->x());
  }
}

// A map of V points takes O(V) memory for every set: sixteen times as many points take at most
// about sixteen times as much.
TEST(SupportMap, MemoryIsLinearForPointsAlongCurves) {
  constexpr int kFew = TestSize(4000, 2000);
  constexpr int kMany = 16 * kFew;
  const std::vector<NamedSet> small = CurvedSets(kFew);
  const std::vector<NamedSet> large = CurvedSets(kMany);
  for (size_t i = 0; i < small.size(); ++i) {
    const double few = static_cast<double>(SupportMap(small[i].points).MemoryBytes());
    const double many = static_cast<double>(SupportMap(large[i].points).MemoryBytes());
    EXPECT_LT(many, 24 * few) << large[i].name;
    EXPECT_LT(many, 600.0 * kMany) << large[i].name;
  }
}

// A flat hull prepares slowest: all of its points are farthest along the normal of its plane.
TEST(SupportMap, PreparationPollsOftenAndStopsAtOnce) {
  std::vector<Vector> polygon;
  for (int i = 0; i < 1 << 16; ++i) {
    const double x = i * 0x1p-16;
    polygon.emplace_back(x, x * x, 0);
  }
  uint64_t polls = 0;
  uint64_t most = UINT64_MAX;
  const std::function<bool()> should_stop = [&] { return ++polls >= most; };
  EXPECT_FALSE(SupportMap(polygon, should_stop).stopped());
  // Each face filters all points about 30 times, in steps of 4096 points, with a poll in 1024
  // steps.
  EXPECT_GT(polls, 10);
  for (most = 1; most <= 8; most *= 2) {
    polls = 0;
    EXPECT_TRUE(SupportMap(polygon, should_stop).stopped());
    EXPECT_EQ(polls, most);
  }
}

}  // namespace support_map_test
}  // namespace hulld
