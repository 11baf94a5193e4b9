#include "core/query/scene/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/query/box_tree.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {
namespace scene_test {

struct Scene {
  std::deque<Hull> hulls;
  std::deque<QueryHull> query_hulls;
  std::vector<PlacedHull> placements;
};

// Hulls of all dimensions, including an empty one, on a lattice where many touch; each third one
// with this radius.
Scene MakeScene(uint64_t seed, int placements, int side, double radius = 0) {
  Random random(TestSeed(seed));
  Scene scene;
  scene.hulls.emplace_back();
  for (int i = 0; i < 10; ++i) {
    scene.hulls.push_back(BuildHull(RandomLatticePoints(random, random.Between(1, 12), 3)));
    scene.hulls.push_back(BuildHull(RandomOnSphere(random, 60, 1.5)));
  }
  for (const Hull& hull : scene.hulls) scene.query_hulls.emplace_back(hull);
  for (int i = 0; i < placements; ++i) {
    Pose pose;
    if (i % 3 == 0) pose.q = {2, 1, 0, 0};
    pose.t = Vector(random.Below(side), random.Below(side), random.Below(side));
    const auto hull = static_cast<size_t>(random.Below(static_cast<int>(scene.hulls.size())));
    scene.placements.emplace_back(scene.query_hulls[hull], pose, i % 3 == 1 ? radius : 0);
  }
  return scene;
}

using Found = std::vector<std::pair<PlacedPair, Relation>>;

Found Search(const Scene& scene, const SceneOptions& options, SceneTotals* totals) {
  Found found;
  const absl::StatusOr<SceneTotals> result =
      FindCollisions(scene.placements, options, [&](std::span<const SceneAnswer> answers) {
        for (const SceneAnswer& answer : answers) {
          found.emplace_back(answer.pair, answer.answer->relation);
        }
      });
  EXPECT_TRUE(result.ok()) << result.status();
  *totals = *result;
  return found;
}

template <typename IsSelected>
Found BruteForce(const Scene& scene, IsSelected is_selected, uint64_t* selected) {
  Found found;
  *selected = 0;
  for (uint32_t a = 0; a < scene.placements.size(); ++a) {
    for (uint32_t b = a + 1; b < scene.placements.size(); ++b) {
      if (!is_selected(a, b)) continue;
      ++*selected;
      const Relation relation = CheckCollision(scene.placements[a], scene.placements[b])->relation;
      if (relation != Relation::kSeparated) found.emplace_back(PlacedPair{a, b}, relation);
    }
  }
  return found;
}

TEST(Scene, AgreesWithAllPairsInOrderOnAnyNumberOfThreads) {
  const Scene scene = MakeScene(821, 700, 20);
  uint64_t selected = 0;
  const Found expected = BruteForce(
      scene, [](uint32_t, uint32_t) { return true; }, &selected);
  size_t touching = 0;
  for (const auto& [pair, relation] : expected) touching += relation == Relation::kTouching;
  EXPECT_GT(touching, 50u);
  EXPECT_GT(expected.size() - touching, 50u);
  for (const int threads : {1, 2, 8}) {
    SceneOptions options;
    options.threads = threads;
    SceneTotals totals;
    EXPECT_TRUE(Search(scene, options, &totals) == expected) << threads << " threads";
    EXPECT_EQ(totals.pairs, selected);
    EXPECT_EQ(totals.found, expected.size());
    // The boxes leave few pairs.
    EXPECT_LT(totals.candidates, selected / 20);
    EXPECT_GE(totals.candidates, totals.found);
  }
}

TEST(Scene, RadiiGrowTheBoxes) {
  const Scene scene = MakeScene(825, 400, 16, 1.5);
  uint64_t selected = 0;
  const Found expected = BruteForce(
      scene, [](uint32_t, uint32_t) { return true; }, &selected);
  SceneTotals totals;
  EXPECT_TRUE(Search(scene, SceneOptions(), &totals) == expected);
  SceneTotals without_radii;
  Search(MakeScene(825, 400, 16), SceneOptions(), &without_radii);
  EXPECT_GT(totals.found, without_radii.found);
}

TEST(Scene, GroupsAndMoversExcludeTheirPairs) {
  const Scene scene = MakeScene(822, 300, 9);
  std::vector<uint32_t> groups;
  for (uint32_t i = 0; i < 300; ++i) groups.push_back(i * i % 7);
  // A pair named twice, or in both orders, counts as one.
  const std::vector<GroupPair> ignored = {{0, 0}, {1, 2}, {2, 1}, {4, 4}, {9, 1}};
  const auto is_ignored = [&](uint32_t a, uint32_t b) {
    for (const auto& [first, second] : ignored) {
      if (groups[a] == first && groups[b] == second) return true;
      if (groups[a] == second && groups[b] == first) return true;
    }
    return false;
  };
  for (const uint32_t movers : {0u, 1u, 37u, 300u, 1000u}) {
    SceneOptions options;
    options.groups = groups;
    options.ignored_groups = ignored;
    options.movers = movers;
    uint64_t selected = 0;
    const Found expected = BruteForce(
        scene, [&](uint32_t a, uint32_t b) { return a < movers && !is_ignored(a, b); }, &selected);
    SceneTotals totals;
    EXPECT_TRUE(Search(scene, options, &totals) == expected) << movers << " movers";
    EXPECT_EQ(totals.pairs, selected);
    EXPECT_EQ(expected.empty(), movers == 0);
  }
}

TEST(Scene, RequiresAGroupForEachPlacement) {
  const Scene scene = MakeScene(823, 3, 3);
  const std::vector<uint32_t> groups = {0, 1};
  SceneOptions options;
  options.groups = groups;
  const auto result = FindCollisions(scene.placements, options, [](auto) { FAIL(); });
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(Scene, CancellationEndsTheSearch) {
  const Scene scene = MakeScene(824, 700, 6);
  std::atomic<int> polls = 0;
  int limit = std::numeric_limits<int>::max();
  SceneOptions options;
  options.query.should_stop = [&] { return ++polls > limit; };
  size_t emitted = 0;
  const auto emit = [&](std::span<const SceneAnswer> answers) { emitted += answers.size(); };
  ASSERT_TRUE(FindCollisions(scene.placements, options, emit).ok());
  const size_t all = emitted;
  limit = polls * 3 / 4;
  polls = 0;
  emitted = 0;
  const auto result = FindCollisions(scene.placements, options, emit);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kCancelled);
  EXPECT_GT(emitted, 0u);
  EXPECT_LT(emitted, all);
}

TEST(BoxTree, IsTheSameOnAnyNumberOfThreads) {
  Random random(TestSeed(825));
  for (const int count : {1, 8, 9, 17, 4097, 20000}) {
    std::vector<Box> boxes;
    for (int i = 0; i < count; ++i) {
      // Many centers are equal, and some boxes have none.
      const Vector low(random.Below(5), random.Below(50), random.Below(5));
      boxes.push_back(i % 100 == 99   ? Box::All()
                      : i % 100 == 98 ? Box::Empty()
                                      : Box{low, low + Vector::Constant(random.Below(3))});
    }
    const BoxTree one(boxes);
    const BoxTree two(boxes, {}, 2);
    std::vector<bool> placed(boxes.size(), false);
    std::vector<uint32_t> waiting = {0};
    while (!waiting.empty()) {
      const uint32_t node = waiting.back();
      waiting.pop_back();
      ASSERT_EQ(one.is_leaf(node), two.is_leaf(node));
      EXPECT_EQ(one.box(node).low, two.box(node).low);
      EXPECT_EQ(one.box(node).high, two.box(node).high);
      if (one.is_leaf(node)) {
        EXPECT_TRUE(std::ranges::equal(one.indices(node), two.indices(node)));
        for (size_t i = 0; i < one.indices(node).size(); ++i) {
          const uint32_t index = one.indices(node)[i];
          EXPECT_FALSE(placed[index]);
          placed[index] = true;
          EXPECT_EQ(one.boxes(node)[i].low, boxes[index].low);
        }
        continue;
      }
      EXPECT_EQ(one.children(node), two.children(node));
      for (const uint32_t child : one.children(node)) waiting.push_back(child);
    }
    EXPECT_TRUE(std::ranges::all_of(placed, [](bool is_placed) { return is_placed; }));
    // All of space intersects every box except empty ones.
    std::vector<uint32_t> found;
    two.AppendMeeting(Box::All(), 0, found);
    EXPECT_EQ(found.size(),
              boxes.size() - static_cast<size_t>(count) / 100 - (count % 100 == 99 ? 1 : 0));
  }
}

// Every pair collides: the backlog between two calls of emit must not grow with the scene.
TEST(Scene, AnswersAreEmittedInBoundedParts) {
  constexpr uint32_t kPlacements = 1000;
  Random random(TestSeed(826));
  const Hull ball = BuildHull(RandomOnSphere(random, 8, 1));
  const QueryHull query(ball);
  Scene scene;
  for (uint32_t i = 0; i < kPlacements; ++i) {
    scene.placements.push_back(*PlacedHull::Make(query, Pose()));
  }
  for (const int threads : {1, 2}) {
    SceneOptions options;
    options.threads = threads;
    size_t largest = 0;
    size_t found = 0;
    const auto totals =
        FindCollisions(scene.placements, options, [&](std::span<const SceneAnswer> answers) {
          largest = std::max(largest, answers.size());
          found += answers.size();
        });
    ASSERT_TRUE(totals.ok());
    EXPECT_EQ(found, size_t{kPlacements} * (kPlacements - 1) / 2);
    EXPECT_LE(largest, 4096u) << threads << " threads";
  }
}

TEST(Scene, CandidatesAreGatheredInStepsAndUseAtMostOneBitEach) {
  constexpr uint32_t kPlacements = 5000;
  Random random(TestSeed(827));
  const Hull ball = BuildHull(RandomOnSphere(random, 8, 1));
  const QueryHull query(ball);
  // All but every third meet.
  std::vector<PlacedHull> placements;
  for (uint32_t i = 0; i < kPlacements; ++i) {
    Pose pose;
    if (i % 3 == 0) pose.t = Vector(100.0 * i, 0, 0);
    placements.push_back(*PlacedHull::Make(query, pose));
  }
  const SceneOptions options;
  const absl::StatusOr<SceneSearch> scene = SceneSearch::Make(placements, options);
  ASSERT_TRUE(scene.ok());
  SceneCandidates candidates;
  for (const uint32_t a : {1u, 2u, 3u, 4000u, 4999u}) {
    candidates.Start(*scene, a);
    int steps = 1;
    while (!candidates.Gather(16)) ++steps;
    EXPECT_GT(steps, a < 3 ? 50 : 0);
    std::vector<uint32_t> expected;
    for (uint32_t b = a + 1; b < kPlacements && a % 3 != 0; ++b) {
      if (b % 3 != 0) expected.push_back(b);
    }
    std::vector<uint32_t> found;
    while (const std::optional<uint32_t> b = candidates.Next()) found.push_back(*b);
    EXPECT_EQ(found, expected) << a;
    EXPECT_EQ(candidates.Next(), std::nullopt);
  }
  // A list of the few candidates, and one bit for each placement.
  EXPECT_LT(candidates.MemoryBytes(), 2 * 1200 * sizeof(uint32_t) + kPlacements / 8 + 64);
}

// Rays against one hull: the boxes of all rays intersect.
TEST(Scene, MembersOfAGroupThatIgnoresItselfAreNotVisited) {
  constexpr uint32_t kRays = 4000;
  Random random(TestSeed(829));
  const Hull ball = BuildHull(RandomOnSphere(random, 8, 1));
  const QueryHull query(ball);
  const std::vector<PlacedHull> placements(kRays + 1, PlacedHull(query, Pose{}));
  std::vector<uint32_t> groups(kRays, 0);
  groups.push_back(1);
  const std::vector<GroupPair> ignored = {{0, 0}};
  SceneOptions options;
  options.groups = groups;
  options.ignored_groups = ignored;
  const absl::StatusOr<SceneSearch> scene = SceneSearch::Make(placements, options);
  ASSERT_TRUE(scene.ok());
  SceneCandidates candidates;
  for (const uint32_t a : {0U, kRays / 2, kRays - 1}) {
    candidates.Start(*scene, a);
    int nodes = 1;
    while (!candidates.Gather(1)) ++nodes;
    EXPECT_LT(nodes, 50) << a;
    EXPECT_EQ(candidates.Next(), kRays);
    EXPECT_EQ(candidates.Next(), std::nullopt);
  }
}

TEST(Scene, BoxesContainTheirHullsAtEveryScale) {
  Random random(TestSeed(825));
  for (const double scale : {1e-305, 1e-100, 1e-3, 1.0, 1e80, 1e300}) {
    for (const double offset : {0.0, 1.0, 1e15}) {
      if (!std::isfinite(offset * scale)) continue;
      const Hull ball = BuildHull(Scaled(RandomOnSphere(random, 100, 1), scale));
      const QueryHull query(ball);
      Pose pose;
      pose.q = {random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1), 0.5};
      pose.t = Vector(offset * scale, -offset * scale, 0);
      const PlacedHull placed = *PlacedHull::Make(query, pose);
      const Box box = BoundingBox(placed);
      // A plate beyond each side of the box is not entered.
      for (int axis = 0; axis < 3; ++axis) {
        for (const double side : {-1.0, 1.0}) {
          const double bound = side < 0 ? box.low[axis] : box.high[axis];
          if (std::abs(bound) == std::numeric_limits<double>::max()) continue;  // All of space.
          std::vector<Vector> plate;
          const double reach = 4 * scale * (1 + offset);
          for (int corner = 0; corner < 8; ++corner) {
            Vector v;
            v[axis] = corner & 1 ? bound : bound + side * reach;
            v[(axis + 1) % 3] = corner & 2 ? reach : -reach;
            v[(axis + 2) % 3] = corner & 4 ? reach : -reach;
            plate.push_back(v);
          }
          const Hull beyond = BuildHull(plate);
          EXPECT_NE(CheckCollision(ball, pose, beyond, Pose())->relation, Relation::kOverlapping);
        }
      }
    }
  }
}

}  // namespace scene_test
}  // namespace hulld
