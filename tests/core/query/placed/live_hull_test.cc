#include "core/query/placed/live_hull.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/query/collision.h"
#include "tests/core/checks/extreme_clouds.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/test_size.h"

namespace hulld {
namespace live_hull_test {

constexpr int kPoints = TestSize(250, 60);

// A hull that grows together with its builder.
struct Growing {
  HullBuilder builder;
  LiveHull live;
  LiveHull::Mark mark;

  void Add(std::span<const Vector> points) {
    if (builder.Add(points).value().outside == 0) return;
    mark = live.Append(builder.NewVertices(), builder.dimension());
  }
};

Pose RandomPose(Random& random, const Vector& t) {
  Pose pose;
  for (double& q : pose.q) q = random.Real(-1, 1);
  pose.t = t;
  return pose;
}

// Returns the size of a cloud, to place a probe of that size where it matters.
double SizeOf(const std::vector<Vector>& points) {
  double size = 0;
  for (const Vector& p : points) size = std::max(size, p.cwiseAbs().maxCoeff());
  return size;
}

// Queries the version and a fresh canonical hull, and counts the relations.
class Comparison {
 public:
  explicit Comparison(const Hull& probe) : probe_(probe), query_probe_(probe) {}

  testing::AssertionResult Agree(const QueryHull& version, const Hull& fresh, const Pose& X_WA,
                                 const Pose& X_WB, double clearance) {
    const QueryHull query_fresh(fresh);
    const PlacedHull live(version, X_WA);
    const PlacedHull rested(query_fresh, X_WA);
    const PlacedHull probe(query_probe_, X_WB);
    QueryOptions near;
    near.clearance = clearance;
    for (const QueryOptions& options : {QueryOptions(), near}) {
      const Answer expected = CheckCollision(rested, probe, options).value();
      const Answer answer = CheckCollision(live, probe, options).value();
      const Answer swapped = CheckCollision(probe, live, options).value();
      if (answer.relation != expected.relation || swapped.relation != expected.relation ||
          answer.within_clearance != expected.within_clearance) {
        return testing::AssertionFailure()
               << Name(answer.relation) << ", swapped " << Name(swapped.relation) << ", not "
               << Name(expected.relation) << ": " << Describe(fresh, X_WA, probe_, X_WB);
      }
      ++counts_[static_cast<size_t>(expected.relation)];
    }
    return testing::AssertionSuccess();
  }
  int count(Relation relation) const { return counts_[static_cast<size_t>(relation)]; }

 private:
  const Hull& probe_;
  const QueryHull query_probe_;
  int counts_[4] = {};
};

// All extreme clouds, point by point, prepared occasionally.
TEST(LiveHull, EveryStepAnswersLikeAFreshHull) {
  const uint64_t seed = TestSeed(941);
  Random random(seed);
  int counts[3] = {};
  for (const Extreme& extreme : Extremes()) {
    const std::vector<Vector> cloud = extreme.make(kPoints);
    const double size = SizeOf(cloud);
    if (!(size < 0x1p1000)) continue;
    const Hull probe = BuildHull(std::vector<Vector>{
        Vector(0, 0, 0), Vector(size / 8, 0, 0), Vector(0, size / 8, 0), Vector(0, 0, size / 8)});
    Comparison comparison(probe);
    Growing growing;
    const size_t step = std::max<size_t>(1, cloud.size() / 40);
    for (size_t i = 0; i < cloud.size(); i += step) {
      growing.Add(std::span(cloud).subspan(i, std::min(step, cloud.size() - i)));
      if (random.Below(7) == 0) growing.live.Prepare(growing.mark);
      const auto version = growing.live.VersionAt(growing.mark);
      const Hull fresh = growing.builder.Snapshot();
      ASSERT_EQ(version->dimension(), fresh.dimension()) << extreme.name;
      // At a vertex, so that contact is near and exact.
      const Vector corner =
          fresh.vertices()[random.Below(static_cast<int>(fresh.vertices().size()))];
      ASSERT_TRUE(comparison.Agree(*version, fresh, Pose(), {{1, 0, 0, 0}, corner}, size / 50))
          << extreme.name << " at " << i << " seed " << seed;
      const Pose X_WB = RandomPose(random, random.Real(0, 1.2) * corner);
      ASSERT_TRUE(comparison.Agree(*version, fresh, RandomPose(random, Vector(0, 0, 0)), X_WB, 0))
          << extreme.name << " at " << i << " seed " << seed;
    }
    for (int relation = 0; relation < 3; ++relation) {
      counts[relation] += comparison.count(static_cast<Relation>(relation));
    }
  }
  EXPECT_GT(counts[static_cast<int>(Relation::kSeparated)], 100);
  EXPECT_GT(counts[static_cast<int>(Relation::kTouching)], 100);
  EXPECT_GT(counts[static_cast<int>(Relation::kOverlapping)], 100);
}

// Old versions stay unchanged while the hull grows and is prepared.
TEST(LiveHull, MarksPreserveTheirState) {
  Random random(TestSeed(942));
  Growing growing;
  std::vector<LiveHull::Mark> marks;
  std::vector<Hull> hulls;
  std::vector<std::shared_ptr<const QueryHull>> versions;
  for (int i = 0; i < 60; ++i) {
    std::vector<Vector> points = RandomOnSphere(random, 1 + random.Below(9), 1 + 0.05 * i);
    if (i < 3) {
      for (Vector& p : points) p.z() = 0;
    }
    growing.Add(points);
    marks.push_back(growing.mark);
    hulls.push_back(growing.builder.Snapshot());
    versions.push_back(growing.live.VersionAt(growing.mark));
    if (random.Below(4) == 0) growing.live.Prepare(marks[random.Below(i + 1)]);
  }
  for (size_t i = 0; i < marks.size(); ++i) {
    EXPECT_TRUE(SameBits(BuildHull(growing.live.PointsAt(marks[i])), hulls[i])) << i;
    const auto later = growing.live.VersionAt(marks[i]);
    for (const auto& version : {versions[i], later}) {
      std::vector<Vector> points;
      for (uint32_t k = 0; k < version->point_count(); ++k) points.push_back(version->point(k));
      EXPECT_TRUE(SameBits(BuildHull(points), hulls[i])) << i;
      EXPECT_EQ(version->dimension(), hulls[i].dimension());
      EXPECT_EQ(version->max_abs_coordinate(), hulls[i].max_abs_coordinate());
    }
    EXPECT_EQ(marks[i].low().x(), hulls[i].vertices().front().x());
    EXPECT_EQ(marks[i].high().x(), hulls[i].vertices().back().x());
  }
}

// As after a change that could not be stored.
TEST(LiveHull, CopiesContinueFromAMark) {
  Random random(TestSeed(943));
  Growing growing;
  growing.Add(RandomOnSphere(random, 30, 1));
  const LiveHull::Mark mark = growing.mark;
  HullBuilder before = growing.builder;
  growing.Add(RandomOnSphere(random, 100, 2));
  LiveHull copy(growing.live, mark);
  EXPECT_TRUE(SameBits(BuildHull(copy.PointsAt(mark)), before.Snapshot()));
  EXPECT_TRUE(SameBits(BuildHull(copy.PointsAt(copy.Now())), before.Snapshot()));
  ASSERT_TRUE(before.Add(RandomOnSphere(random, 20, 1.5)).ok());
  const LiveHull::Mark after = copy.Append(before.NewVertices(), before.dimension());
  copy.Prepare(after);
  EXPECT_TRUE(SameBits(BuildHull(copy.PointsAt(after)), before.Snapshot()));
  EXPECT_TRUE(LiveHull(growing.live, LiveHull::Mark()).VersionAt({})->empty());
}

TEST(LiveHull, EmptyHullsAreSeparatedFromAll) {
  const LiveHull live;
  const auto version = live.VersionAt(live.Now());
  EXPECT_TRUE(version->empty());
  EXPECT_EQ(version->dimension(), -1);
  const Hull cube = BuildHull(LatticeCube(2, 1));
  const QueryHull query_cube(cube);
  EXPECT_EQ(CheckCollision(PlacedHull(*version, Pose()), PlacedHull(query_cube, Pose()))->relation,
            Relation::kSeparated);
  EXPECT_FALSE(live.WantsPreparing(live.Now(), 1000000));
}

// A hull without queries is never prepared; a queried hull is prepared after the queries have
// scanned as much as preparation costs.
TEST(LiveHull, QueriesPayForPreparation) {
  Random random(TestSeed(944));
  Growing growing;
  growing.Add(RandomOnSphere(random, 500, 1));
  EXPECT_FALSE(growing.live.WantsPreparing(growing.mark));
  EXPECT_FALSE(growing.live.WantsPreparing(growing.mark, 1));
  EXPECT_TRUE(growing.live.WantsPreparing(growing.mark, 100000));
  const Hull probe = BuildHull(RandomOnSphere(random, 20, 1));
  const QueryHull query_probe(probe);
  const auto ask = [&] {
    const auto version = growing.live.VersionAt(growing.mark);
    Pose pose;
    pose.t = Vector(random.Real(1.5, 1.9), 0, 0);
    ASSERT_TRUE(CheckCollision(PlacedHull(*version, Pose()), PlacedHull(query_probe, pose)).ok());
  };
  int queries = 0;
  for (; !growing.live.WantsPreparing(growing.mark) && queries < 100000; ++queries) ask();
  EXPECT_GT(queries, 20);
  EXPECT_LT(queries, 5000);
  EXPECT_EQ(growing.live.points_moved(), 0u);
  growing.live.Prepare(growing.mark);
  EXPECT_EQ(growing.live.points_moved(), 500u);
  EXPECT_FALSE(growing.live.WantsPreparing(growing.mark, 1000000));
}

// One point per step and a query after each, counted in operations: points that queries scan and
// that merges move.
TEST(LiveHull, WorkPerStepIsPolylogarithmic) {
  Random random(TestSeed(945));
  const Hull probe = BuildHull(RandomOnSphere(random, 20, 1));
  const QueryHull query_probe(probe);
  for (const int n : {500, 4000}) {
    Growing growing;
    growing.Add(RandomOnSphere(random, n, 1));
    growing.live.Prepare(growing.mark);
    const uint64_t before = growing.live.points_moved();
    const int steps = 4000;
    uint64_t longest_tail = 0;
    uint64_t since = 0;
    for (int i = 0; i < steps; ++i) {
      growing.Add(RandomOnSphere(random, 1, 1 + 1e-3 * i));
      ++since;
      const auto version = growing.live.VersionAt(growing.mark);
      Pose pose;
      // Just out of contact.
      pose.t = (1.99 + 1e-3 * i) * RandomOnSphere(random, 1, 1)[0];
      ASSERT_TRUE(CheckCollision(PlacedHull(*version, Pose()), PlacedHull(query_probe, pose)).ok());
      if (growing.live.WantsPreparing(growing.mark)) {
        longest_tail = std::max(longest_tail, since);
        since = 0;
        growing.live.Prepare(growing.mark);
      }
    }
    const double moved = static_cast<double>(growing.live.points_moved() - before) / steps;
    EXPECT_LT(moved, 2 * std::log2(n)) << n;
    EXPECT_GT(longest_tail, 0u) << n;
    EXPECT_LT(longest_tail, 4000u) << n;
  }
}

// One thread grows the hull, one prepares it, two query it.
TEST(LiveHull, ThreadsDoNotWaitForEachOther) {
  Growing growing;
  {
    Random random(TestSeed(946));
    growing.Add(RandomOnSphere(random, 50, 1));
  }
  std::mutex mutex;  // guards the mark, as the server's mutex does
  std::atomic<bool> ending = false;
  const auto mark = [&] {
    const std::lock_guard lock(mutex);
    return growing.mark;
  };
  std::thread writer([&] {
    Random random(TestSeed(947));
    for (int i = 0; i < 300; ++i) {
      const std::vector<Vector> points = RandomOnSphere(random, 5, 1 + 0.01 * i);
      if (growing.builder.Add(points).value().outside == 0) continue;
      const LiveHull::Mark now =
          growing.live.Append(growing.builder.NewVertices(), growing.builder.dimension());
      const std::lock_guard lock(mutex);
      growing.mark = now;
    }
    ending = true;
  });
  std::thread preparer([&] {
    while (!ending) growing.live.Prepare(mark());
  });
  std::vector<std::thread> readers;
  for (int t = 0; t < 2; ++t) {
    readers.emplace_back([&] {
      const Hull probe = BuildHull(LatticeCube(2, 1));
      const QueryHull query_probe(probe);
      Pose pose;
      pose.t = Vector(-0.5, -0.5, -0.5);
      while (!ending) {
        const auto version = growing.live.VersionAt(mark());
        EXPECT_EQ(
            CheckCollision(PlacedHull(*version, Pose()), PlacedHull(query_probe, pose))->relation,
            Relation::kOverlapping);
        growing.live.WantsPreparing(mark());
        growing.live.MemoryBytes();
      }
    });
  }
  writer.join();
  preparer.join();
  for (std::thread& reader : readers) reader.join();
  EXPECT_TRUE(SameBits(BuildHull(growing.live.PointsAt(growing.mark)), growing.builder.Snapshot()));
}

}  // namespace live_hull_test
}  // namespace hulld
