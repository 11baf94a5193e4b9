#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "core/hull/audit.h"
#include "core/hull/growth/hull_builder.h"
#include "core/numeric/orientation.h"
#include "tests/core/checks/extreme_clouds.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/oracle/brute_force_hull.h"
#include "tests/oracle/cgal_hull.h"
#include "tests/test_size.h"

namespace hulld {
namespace extreme_hull_test {

constexpr int kPoints = TestSize(1500, 300);
constexpr int kDuplicates = TestSize(1000000, 50000);
constexpr int kSmallRounds = TestSize(6, 2);

constexpr double kLargest = std::numeric_limits<double>::max();
constexpr double kLeast = std::numeric_limits<double>::denorm_min();

// Maximum number of exact point-facet tests in a test.
constexpr size_t kContainmentTests = 400000;

Hull BuildOneByOne(const std::vector<Vector>& points) {
  HullBuilder builder;
  for (const Vector& p : points) EXPECT_TRUE(builder.Add(std::span(&p, 1)).ok());
  return builder.Snapshot();
}

Hull BuildInRandomBlocks(Random& random, std::span<const Vector> rest) {
  HullBuilder builder;
  while (!rest.empty()) {
    const int longest = random.Below(2) ? 8 : static_cast<int>(rest.size());
    const size_t n = std::min(rest.size(), static_cast<size_t>(random.Between(1, longest)));
    EXPECT_TRUE(builder.Add(rest.subspan(0, n)).ok());
    rest = rest.subspan(n);
  }
  return builder.Snapshot();
}

// Returns true if CGAL's floating-point filters are valid for the points: see CgalExtremePoints.
bool InRangeOfCgal(const std::vector<Vector>& points) {
  return std::all_of(points.begin(), points.end(), [](const Vector& p) {
    return std::all_of(p.begin(), p.end(), [](double x) {
      return x == 0 || (std::abs(x) > 1e-70 && std::abs(x) < 1e70);
    });
  });
}

// Builds the hull in one block, audits it, and checks that it contains the points (a sample if
// many) and equals CGAL's hull if available and valid.
Hull BuildChecked(const std::vector<Vector>& points) {
  const Hull hull = BuildHull(points);
  const absl::Status audit = AuditHull(hull);
  EXPECT_TRUE(audit.ok()) << audit;
  const size_t facets = std::max<size_t>(hull.facet_count(), 1);
  const size_t stride = points.size() / std::max<size_t>(kContainmentTests / facets, 1) + 1;
  std::vector<Vector> sample;
  for (size_t i = 0; i < points.size(); i += stride) sample.push_back(points[i]);
  const absl::Status containment = AuditContainment(hull, sample);
  EXPECT_TRUE(containment.ok()) << containment;
  if (hull.dimension() == 3 && oracle::CgalIsAvailable() && InRangeOfCgal(points)) {
    EXPECT_TRUE(ToOracle(hull.vertices()) == oracle::CgalExtremePoints(ToOracle(points)));
  }
  return hull;
}

std::string NameOf(const testing::TestParamInfo<Extreme>& extreme) { return extreme.param.name; }

class ExtremeHull : public testing::TestWithParam<Extreme> {};

TEST_P(ExtremeHull, EveryOrderGivesOneAuditedSnapshot) {
  const uint64_t seed = TestSeed(611);
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::vector<Vector> points = GetParam().make(kPoints);
  const Hull hull = BuildChecked(points);
  EXPECT_TRUE(SameBits(BuildOneByOne(points), hull));
  Random random(seed);
  EXPECT_TRUE(SameBits(BuildInRandomBlocks(random, points), hull));
  std::reverse(points.begin(), points.end());
  EXPECT_TRUE(SameBits(BuildOneByOne(points), hull));
  Shuffle(random, points);
  EXPECT_TRUE(SameBits(BuildOneByOne(points), hull));
  EXPECT_TRUE(SameBits(BuildInRandomBlocks(random, points), hull));
}

TEST_P(ExtremeHull, FewPointsMatchBruteForce) {
  const uint64_t seed = TestSeed(612);
  Random random(seed);
  std::vector<Vector> points = GetParam().make(kPoints);
  for (int round = 0; round < kSmallRounds; ++round) {
    Shuffle(random, points);
    const std::vector<Vector> few(points.begin(), points.begin() + 16);
    const oracle::ConvexHull expected = oracle::BruteForceHull(ToOracle(few));
    ASSERT_TRUE(SameHull(BuildHull(few), expected)) << "seed " << seed << " round " << round;
    ASSERT_TRUE(SameHull(BuildOneByOne(few), expected)) << "seed " << seed << " round " << round;
  }
}

INSTANTIATE_TEST_SUITE_P(Extremes, ExtremeHull,
                         testing::ValuesIn(Extremes().begin(), Extremes().end()), NameOf);

// Clouds designed for exact arithmetic reach it.
class ExactlyDecidedHull : public testing::TestWithParam<Extreme> {};

TEST_P(ExactlyDecidedHull, CountsTheSignsBeyondDoubles) {
  const std::vector<Vector> points = GetParam().make(kPoints);
  const OrientationCounts before = ThreadOrientationCounts();
  BuildOneByOne(points);
  const OrientationCounts after = ThreadOrientationCounts();
  const uint64_t expansion = after.expansion - before.expansion;
  const uint64_t integer = after.integer - before.integer;
  const uint64_t fixed_point = after.fixed_point - before.fixed_point;
  RecordProperty("expansion", std::to_string(expansion));
  RecordProperty("integer", std::to_string(integer));
  EXPECT_GT(fixed_point + expansion + integer, 100u);
  if (GetParam().needs == Arithmetic::kIntegers) {
    EXPECT_GT(integer, 100u);
  }
}

std::vector<Extreme> ExactlyDecided() {
  std::vector<Extreme> result;
  for (const Extreme& extreme : Extremes()) {
    if (extreme.needs != Arithmetic::kAny) result.push_back(extreme);
  }
  return result;
}

INSTANTIATE_TEST_SUITE_P(Extremes, ExactlyDecidedHull, testing::ValuesIn(ExactlyDecided()), NameOf);

// A million points, few of them distinct.
class ManyDuplicates : public testing::TestWithParam<Extreme> {};

TEST_P(ManyDuplicates, CountAsDuplicatesInAnyBlocks) {
  const std::vector<Vector> points = GetParam().make(kDuplicates);
  const auto less = [](const Vector& p, const Vector& q) {
    return std::lexicographical_compare(p.begin(), p.end(), q.begin(), q.end());
  };
  const std::set<Vector, decltype(less)> distinct(points.begin(), points.end(), less);
  // All distinct points of these clouds are vertices.
  const PointCounts expected = {points.size(), distinct.size(), points.size() - distinct.size(), 0};
  HullBuilder builder;
  EXPECT_EQ(*builder.Add(points), expected);
  const Hull hull = builder.Snapshot();
  EXPECT_EQ(hull.vertices().size(), distinct.size());
  const absl::Status audit = AuditHull(hull);
  EXPECT_TRUE(audit.ok()) << audit;
  EXPECT_TRUE(SameBits(BuildOneByOne(points), hull));
  EXPECT_EQ(builder.Add(points)->duplicate, points.size());
  EXPECT_TRUE(SameBits(builder.Snapshot(), hull));
}

std::vector<Extreme> Duplicates() {
  std::vector<Extreme> result;
  for (const Extreme& extreme : Extremes()) {
    if (extreme.name.starts_with("duplicates")) result.push_back(extreme);
  }
  return result;
}

INSTANTIATE_TEST_SUITE_P(Extremes, ManyDuplicates, testing::ValuesIn(Duplicates()), NameOf);

TEST(ExtremeCoordinates, LeastDoubleAboveTheLargestSquareMakesAPyramid) {
  std::vector<Vector> points = {{kLargest, kLargest, 0},  {kLargest, -kLargest, 0},
                                {-kLargest, kLargest, 0}, {-kLargest, -kLargest, 0},
                                {0, 0, kLeast},           {kLeast, 0, 0}};
  std::sort(points.begin(), points.end(), [](const Vector& p, const Vector& q) {
    return std::lexicographical_compare(p.begin(), p.end(), q.begin(), q.end());
  });
  const oracle::ConvexHull expected = oracle::BruteForceHull(ToOracle(points));
  EXPECT_EQ(expected.vertices.size(), 5u);
  do {
    ASSERT_TRUE(SameHull(BuildOneByOne(points), expected));
  } while (
      std::next_permutation(points.begin(), points.end(), [](const Vector& p, const Vector& q) {
        return std::lexicographical_compare(p.begin(), p.end(), q.begin(), q.end());
      }));
}

TEST(ExtremeCoordinates, CubesOfTheLeastAndTheLargestDoubleHaveSixSquares) {
  for (const double half : {kLeast, 0x1p-1022, 1.0, kLargest}) {
    const std::vector<Vector> corners =
        Scaled(Shifted(LatticeCube(3, 1), Vector::Constant(-1)), half);
    const Hull hull = BuildChecked(corners);
    EXPECT_EQ(hull.vertices().size(), 8u) << half;
    EXPECT_EQ(hull.facet_count(), 6u) << half;
  }
}

// Each apex sees every side of the cone below it: the most expensive order.
TEST(ExtremeOrders, OnlyTheLastOfTheRisingApexesRemains) {
  for (const Extreme& extreme : Extremes()) {
    if (extreme.facets_one_by_one == nullptr) continue;
    const Hull hull = BuildOneByOne(extreme.make(kPoints));
    EXPECT_EQ(hull.vertices().size(), static_cast<size_t>(kPoints / 2 + 1));
    EXPECT_EQ(hull.facet_count(), static_cast<size_t>(kPoints / 2 + 1));
  }
}

}  // namespace extreme_hull_test
}  // namespace hulld
