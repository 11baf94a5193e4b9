#include "core/query/placed/center_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

#include "core/numeric/orientation.h"
#include "core/query/collision.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/test_size.h"

namespace hulld {
namespace center_bounds_test {

struct NamedHull {
  std::string name;
  Hull hull;
};

// Round hulls and boxes, needles and plates, far from the origin and at the ends of the range, with
// few vertices and many.
std::vector<NamedHull> Solids(Random& random) {
  std::vector<NamedHull> solids;
  const auto add = [&](const std::string& name, std::vector<Vector> points) {
    for (const double scale : {1.0, 0x1p-200, 0x1p200}) {
      solids.push_back(
          {name + " times " + std::to_string(scale), BuildHull(Scaled(points, scale))});
    }
    solids.push_back({name + " far off", BuildHull(Shifted(points, Vector(3e3, -1e4, 5e3)))});
    for (Vector& p : points) p = p.cwiseProduct(Vector(1, 0.02, 7));
    solids.push_back({name + " oblong", BuildHull(points)});
    for (Vector& p : points) p.x() *= 1e-5;
    solids.push_back({name + " thin", BuildHull(points)});
  };
  add("cube", LatticeCube(2, 1));
  add("tetrahedron", {Vector(0, 0, 0), Vector(1, 0, 0), Vector(0, 1, 0), Vector(0, 0, 1)});
  add("8 points", RandomInBall(random, 8, 1));
  add("sphere of 50", RandomOnSphere(random, 50, 1));
  add("sphere of 700", RandomOnSphere(random, 700, 1));
  add("paraboloid", IntegerParaboloid(3));
  return solids;
}

// Includes corners of the cube map's cells, where bounds are nearly tight.
std::vector<Vector> Directions(Random& random) {
  std::vector<Vector> directions = LatticeCubeSurface(5);
  for (Vector& n : directions) n -= Vector(2, 2, 2);
  for (const Vector& n : RandomOnSphere(random, 200, 1)) directions.push_back(n);
  return directions;
}

double SupportOf(const Hull& hull, const Vector& n) {
  double farthest = -INFINITY;
  for (const Vector& v : hull.vertices()) farthest = std::max(farthest, n.dot(v - hull.center()));
  return farthest;
}

bool Contains(const Hull& hull, const Vector& p) {
  const auto v = hull.vertices();
  for (size_t f = 0; f < hull.facet_count(); ++f) {
    const auto facet = hull.facet(f);
    if (Orient3d(v[facet[0]], v[facet[1]], v[facet[2]], p) > 0) return false;
  }
  return true;
}

TEST(CenterBounds, SupportIsNeverFarther) {
  const uint64_t seed = TestSeed(901);
  Random random(seed);
  for (const auto& [name, hull] : Solids(random)) {
    const SupportMap support(hull);
    const CenterBounds bounds(hull, support);
    for (const Vector& n : Directions(random)) {
      ASSERT_GE(bounds.Along(n).support, SupportOf(hull, n)) << name << " seed " << seed;
    }
  }
}

TEST(CenterBounds, PointsWithinTheGaugeAreInside) {
  const uint64_t seed = TestSeed(902);
  Random random(seed);
  int without = 0;
  for (const auto& [name, hull] : Solids(random)) {
    const SupportMap support(hull);
    const CenterBounds bounds(hull, support);
    for (const Vector& d : Directions(random)) {
      const double gauge = bounds.Along(d).gauge;
      if (std::isnan(gauge)) {
        ++without;
        continue;
      }
      ASSERT_GT(gauge, 0) << name;
      ASSERT_LE(gauge, (1 + 1e-6) * bounds.largest_gauge() * d.cwiseAbs().maxCoeff()) << name;
      ASSERT_TRUE(Contains(hull, hull.center() + d / gauge)) << name << " seed " << seed;
    }
  }
  EXPECT_GT(without, 0);
}

TEST(CenterBounds, RoundHullsAreBoundedClosely) {
  Random random(TestSeed(903));
  const Hull hull = BuildHull(RandomOnSphere(random, 2000, 1));
  const SupportMap support(hull);
  const CenterBounds bounds(hull, support);
  for (Vector n : Directions(random)) {
    n.normalize();
    EXPECT_LT(bounds.Along(n).support, 1.05);
    EXPECT_LT(bounds.Along(n).gauge, 1.2);
  }
}

// Cells are created lazily by any thread: their contents depend on neither thread nor order.
TEST(CenterBounds, CellsDoNotDependOnTheOrderOfTheirCreation) {
  const uint64_t seed = TestSeed(907);
  Random random(seed);
  for (const auto& [name, hull] : Solids(random)) {
    const SupportMap support(hull);
    std::vector<Vector> directions = Directions(random);
    const CenterBounds forwards(hull, support);
    std::vector<CenterBounds::Bounds> expected;
    for (const Vector& n : directions) expected.push_back(forwards.Along(n));
    const size_t bytes = forwards.MemoryBytes();
    const CenterBounds shared(hull, support);
    EXPECT_EQ(shared.MemoryBytes(), bytes) << name;
    std::vector<std::vector<CenterBounds::Bounds>> found(4);
    std::vector<std::thread> threads;
    for (size_t t = 0; t < found.size(); ++t) {
      threads.emplace_back([&, t] {
        found[t].resize(directions.size());
        for (size_t k = 0; k < directions.size(); ++k) {
          const size_t i =
              (t % 2 == 0 ? directions.size() - 1 - k : k + t * 40) % directions.size();
          found[t][i] = shared.Along(directions[i]);
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    const auto bits = [](double x) { return std::bit_cast<uint64_t>(x); };
    for (const auto& of_thread : found) {
      for (size_t i = 0; i < directions.size(); ++i) {
        ASSERT_EQ(bits(of_thread[i].support), bits(expected[i].support))
            << name << " seed " << seed;
        ASSERT_EQ(bits(of_thread[i].gauge), bits(expected[i].gauge)) << name << " seed " << seed;
      }
    }
    EXPECT_EQ(shared.largest_gauge(), forwards.largest_gauge()) << name;
  }
}

TEST(CenterBounds, CellsComputedAtTheSecondUseAreTheSame) {
  Random random(TestSeed(908));
  for (const auto& [name, hull] : Solids(random)) {
    const SupportMap support(hull);
    const CenterBounds at_first(hull, support);
    const CenterBounds at_second(hull.vertices(), hull.dimension(), hull.center(),
                                 hull.max_abs_coordinate(), support,
                                 CenterBounds::Making::kAtSecondUse);
    int unknown = 0;
    for (const Vector& n : Directions(random)) {
      const CenterBounds::Bounds expected = at_first.Along(n);
      if (!at_second.PlaceOf(n).known()) ++unknown;
      const CenterBounds::Bounds found = at_second.Along(n);
      const auto bits = [](double x) { return std::bit_cast<uint64_t>(x); };
      ASSERT_EQ(bits(found.support), bits(expected.support)) << name;
      ASSERT_EQ(bits(found.gauge), bits(expected.gauge)) << name;
    }
    // The least number of cells.
    EXPECT_GE(unknown, 24) << name;
    EXPECT_EQ(at_second.largest_gauge(), at_first.largest_gauge()) << name;
  }
}

TEST(CenterBounds, FlatHullsHaveNone) {
  for (const std::vector<Vector>& points : {std::vector<Vector>{Vector(1, 2, 3)},
                                            {Vector(0, 0, 0), Vector(1, 1, 0)},
                                            {Vector(0, 0, 0), Vector(1, 0, 0), Vector(0, 1, 0)}}) {
    const Hull hull = BuildHull(points);
    const SupportMap support(hull);
    const CenterBounds bounds(hull, support);
    EXPECT_TRUE(std::isnan(bounds.Along(Vector(1, 0, 0)).support));
    EXPECT_TRUE(std::isnan(bounds.Along(Vector(1, 0, 0)).gauge));
  }
}

// Its six extreme vertices are corners of a single facet.
TEST(CenterBounds, CentersOnTheBoundaryHaveNoGauge) {
  const Hull hull = BuildHull(std::vector<Vector>{Vector(12, -6, -6), Vector(-6, 12, -6),
                                                  Vector(-6, -6, 12), Vector(1, 1, 1)});
  ASSERT_EQ(hull.center(), Vector(-3, 0, 3));
  const SupportMap support(hull);
  const CenterBounds bounds(hull, support);
  EXPECT_LT(bounds.Along(Vector(1, 1, 1)).support, INFINITY);
  for (const Vector& d : {Vector(1, 1, 1), Vector(-1, -1, -1), Vector(1, -1, 0)}) {
    EXPECT_TRUE(std::isnan(bounds.Along(d).gauge));
  }
}

// The relation alone, which the bounds may decide, against the search's result with evidence.
TEST(CenterBounds, RelationsAgreeWithTheSearch) {
  const uint64_t seed = TestSeed(904);
  Random random(seed);
  const std::vector<NamedHull> solids = Solids(random);
  int settled[2] = {0, 0};
  for (int round = 0; round < TestSize(5000, 800); ++round) {
    const NamedHull& one = solids[random.Below(static_cast<int>(solids.size()))];
    const NamedHull& other = solids[random.Below(static_cast<int>(solids.size()))];
    if (one.hull.max_abs_coordinate() > 0x1p60 * other.hull.max_abs_coordinate()) continue;
    if (other.hull.max_abs_coordinate() > 0x1p60 * one.hull.max_abs_coordinate()) continue;
    const QueryHull a(one.hull);
    const QueryHull b(other.hull);
    Pose X_WA;
    Pose X_WB;
    for (double& q : X_WA.q) q = random.Real(-1, 1);
    for (double& q : X_WB.q) q = random.Real(-1, 1);
    const PlacedHull placed_a = PlacedHull::Make(a, X_WA).value();
    const Vector start =
        placed_a.rotated_center() - PlacedHull::Make(b, X_WB).value().rotated_center();
    const double reach = a.radius() + b.radius();
    X_WB.t = start + RandomOnSphere(random, 1, reach * random.Real(0, 1))[0];
    const PlacedHull placed_b = PlacedHull::Make(b, X_WB).value();
    QueryOptions options;
    options.want_axis = true;
    const Answer plain = CheckCollision(placed_a, placed_b).value();
    ASSERT_EQ(plain.relation, CheckCollision(placed_a, placed_b, options)->relation)
        << one.name << ", " << other.name << " seed " << seed << " round " << round;
    if (plain.rung == Rung::kBounds) ++settled[plain.relation == Relation::kOverlapping];
  }
  EXPECT_GT(settled[0], TestSize(300, 40));
  EXPECT_GT(settled[1], TestSize(300, 40));
}

// Coincident centers, and hulls that touch along the line of their centers.
TEST(CenterBounds, LimitsOfTheLineOfCenters) {
  const Hull cube = BuildHull(LatticeCube(2, 1));
  const QueryHull query_hull(cube);
  const auto ask = [&](const Vector& t) {
    Pose X_WB;
    X_WB.t = t;
    return CheckCollision(PlacedHull::Make(query_hull, Pose()).value(),
                          PlacedHull::Make(query_hull, X_WB).value())
        ->relation;
  };
  EXPECT_EQ(ask(Vector(0, 0, 0)), Relation::kOverlapping);
  EXPECT_EQ(ask(Vector(0x1p-1000, 0, 0)), Relation::kOverlapping);
  for (const Vector& d : {Vector(1, 0, 0), Vector(0, -1, 0), Vector(1, 1, 0), Vector(-1, 1, 1)}) {
    EXPECT_EQ(ask((1 - 0x1p-50) * d), Relation::kOverlapping);
    EXPECT_EQ(ask(0.5 * d), Relation::kOverlapping);
    EXPECT_EQ(ask(d), Relation::kTouching);
    EXPECT_EQ(ask((1 + 0x1p-50) * d), Relation::kSeparated);
    EXPECT_EQ(ask(1.5 * d), Relation::kSeparated);
  }
}

}  // namespace center_bounds_test
}  // namespace hulld
