#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "server/collisions/ranked_pairs.h"
#include "tests/server/hulls/body_fixture.h"

namespace hulld::server {
namespace nearest_pairs_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Separation, then placements.
using Ranked = std::tuple<double, uint32_t, uint32_t>;

TEST(RankedPairs, OrderOfAdditionsDoesNotMatter) {
  std::vector<RankedPair> pairs;
  for (uint32_t a = 0; a < 20; ++a) {
    for (uint32_t b = a + 1; b < 20; ++b) {
      pairs.push_back({static_cast<double>((a * b) % 7) - 3, a, b, v1::RELATION_SEPARATED});
    }
  }
  std::vector<RankedPair> sorted = pairs;
  std::sort(sorted.begin(), sorted.end());
  sorted.resize(25);
  std::mt19937 random(31);
  for (int round = 0; round < 10; ++round) {
    std::shuffle(pairs.begin(), pairs.end(), random);
    RankedPairs nearest(25, {}, 0);
    for (const RankedPair& pair : pairs) {
      const bool may_be_skipped = pair.rank > nearest.bound();
      if (!may_be_skipped) nearest.Add(pair);
    }
    nearest.AddUnanswered(3, 9);
    nearest.AddUnanswered(1, 2);
    std::vector<RankedPair> taken = nearest.Take();
    ASSERT_THAT(taken, SizeIs(27));
    EXPECT_EQ(taken[25].a, 1u);
    EXPECT_EQ(taken[26].a, 3u);
    taken.resize(25);
    EXPECT_EQ(taken, sorted);
  }
}

TEST(RankedPairs, BoundCoversTheErrorOfSeparations) {
  const Box box = {Vector(0, 0, 0), Vector(3, 4, 0)};
  RankedPairs nearest(1, {box}, 0.25);
  EXPECT_EQ(nearest.bound(), kInfinity);
  nearest.AddUnanswered(0, 1);
  EXPECT_EQ(nearest.bound(), kInfinity);
  nearest.Add({2, 0, 1, v1::RELATION_SEPARATED});
  EXPECT_GT(nearest.bound(), 2.25 + 1e-10);
  EXPECT_LT(nearest.bound(), 2.25 + 1e-9);
  const Box far = {Vector(3, 4, 3), Vector(4, 5, 3)};
  RankedPairs apart(1, {box, far, box}, 0);
  EXPECT_TRUE(apart.MayBeNear(0, 1));
  apart.Add({3, 0, 1, v1::RELATION_SEPARATED});
  EXPECT_TRUE(apart.MayBeNear(0, 1));
  apart.Add({2.9, 0, 1, v1::RELATION_SEPARATED});
  EXPECT_FALSE(apart.MayBeNear(1, 0));
  EXPECT_TRUE(apart.MayBeNear(0, 2));
  RankedPairs points(1, {}, 0);
  points.Add({0, 0, 1, v1::RELATION_TOUCHING});
  EXPECT_GT(points.bound(), 0);
}

class LimitedScene : public BodyTest {
 protected:
  struct Found {
    std::vector<Ranked> pairs;
    std::vector<v1::Relation> relations;
    v1::SceneTotals totals;
    std::vector<std::string> problems;
  };

  Found Find(const v1::FindCollisionsRequest& request) const {
    Found found;
    const absl::Status status =
        MakeClient().FindCollisions(request, [&](const v1::FindCollisionsResponse& part) {
          const v1::AnswerColumns& columns = part.columns();
          for (int i = 0; 2 * i < part.pairs_size(); ++i) {
            found.pairs.emplace_back(columns.separations(i), part.pairs(2 * i),
                                     part.pairs(2 * i + 1));
            found.relations.push_back(columns.relations(i));
          }
          for (const v1::PairProblem& problem : columns.pair_problems()) {
            EXPECT_EQ(columns.relations(static_cast<int>(problem.row())), v1::RELATION_UNSPECIFIED);
            found.problems.push_back(problem.message());
          }
          if (part.has_totals()) found.totals = part.totals();
          return absl::OkStatus();
        });
    EXPECT_TRUE(status.ok()) << status;
    return found;
  }

  // The separations of all pairs, ascending.
  std::vector<Ranked> BruteForce(const v1::FindCollisionsRequest& scene) const {
    v1::BatchCheckCollisionsRequest batch;
    *batch.mutable_placements() = scene.placements();
    *batch.mutable_wanted() = scene.wanted();
    const auto count = static_cast<uint32_t>(scene.placements_size());
    for (uint32_t a = 0; a < count; ++a) {
      for (uint32_t b = a + 1; b < count; ++b) {
        batch.add_pairs(a);
        batch.add_pairs(b);
      }
    }
    std::vector<Ranked> pairs;
    const absl::Status status =
        MakeClient().BatchCheckCollisions(batch, [&](const v1::BatchCheckCollisionsResponse& part) {
          for (const double separation : part.columns().separations()) {
            const int at = 2 * static_cast<int>(pairs.size());
            pairs.emplace_back(separation, batch.pairs(at), batch.pairs(at + 1));
          }
          return absl::OkStatus();
        });
    EXPECT_TRUE(status.ok()) << status;
    // A missing hull has no separation, and an empty one is infinitely far away.
    std::erase_if(pairs, [&](const Ranked& pair) {
      return !(std::get<0>(pair) <= scene.wanted().clearance()) || std::isinf(std::get<0>(pair));
    });
    std::sort(pairs.begin(), pairs.end());
    return pairs;
  }

  v1::FindCollisionsRequest MixedScene() {
    Put("cube", Cube(-0.5, 1));
    Put("ball", Sphere(50));
    Put("needle", {-1, -1, -1, 1, 1, 1});
    Create("empty");
    EXPECT_TRUE(PutBody("gate", {PlacementOf("cube"), PlacementOf("cube", 3, 0, 0)}).ok());
    std::mt19937 random(7);
    std::uniform_int_distribution<int> steps(-10, 10);
    v1::FindCollisionsRequest request;
    for (const char* id : {"cube", "ball", "needle", "gate", "cube", "empty", "missing"}) {
      for (int i = 0; i < 15; ++i) {
        *request.add_placements() =
            PlacementOf(id, steps(random) * 0.5, steps(random) * 0.5, steps(random) * 0.5);
      }
    }
    request.mutable_wanted()->set_separation(true);
    request.mutable_wanted()->set_clearance(kInfinity);
    return request;
  }

  void ExpectRefused(const v1::FindCollisionsRequest& request, const std::string& what) const {
    const absl::Status status = MakeClient().FindCollisions(
        request, [](const v1::FindCollisionsResponse&) { return absl::OkStatus(); });
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(what));
  }
};

TEST_F(LimitedScene, FindsTheNearestPairsOfABatch) {
  v1::FindCollisionsRequest request = MixedScene();
  for (const double clearance : {kInfinity, 2.0, 0.0}) {
    request.mutable_wanted()->set_clearance(clearance);
    request.clear_limit();
    const Found all = Find(request);
    std::vector<Ranked> expected = BruteForce(request);
    ASSERT_GT(expected.size(), 20u);
    for (const size_t limit : {size_t{1}, size_t{17}, expected.size(), size_t{1} << 31}) {
      request.set_limit(static_cast<uint32_t>(limit));
      const Found nearest = Find(request);
      const std::vector<Ranked> first(
          expected.begin(),
          expected.begin() + static_cast<ptrdiff_t>(std::min(limit, expected.size())));
      EXPECT_EQ(nearest.pairs, first) << limit << " within " << clearance;
      EXPECT_EQ(nearest.totals.SerializeAsString(), all.totals.SerializeAsString());
    }
  }
}

TEST_F(LimitedScene, ALooseMaxErrorStillOrdersTheReportedSeparations) {
  v1::FindCollisionsRequest request = MixedScene();
  request.mutable_wanted()->set_max_error(0.5);
  const std::vector<Ranked> expected = BruteForce(request);
  request.set_limit(40);
  EXPECT_EQ(Find(request).pairs, std::vector<Ranked>(expected.begin(), expected.begin() + 40));
}

TEST_F(LimitedScene, GroupsMoversAndDetailsApply) {
  Put("cube", Cube());
  v1::FindCollisionsRequest request;
  for (const double x : {0.0, 1.5, 4.0, 4.25}) *request.add_placements() = PlacementOf("cube", x);
  request.mutable_wanted()->set_separation(true);
  request.mutable_wanted()->set_max_error(0);
  request.mutable_wanted()->set_witness(true);
  request.mutable_wanted()->set_clearance(2);
  request.set_limit(3);
  EXPECT_THAT(Find(request).pairs,
              ElementsAre(Ranked(-0.75, 2, 3), Ranked(0.5, 0, 1), Ranked(1.5, 1, 2)));
  request.set_movers(1);
  EXPECT_THAT(Find(request).pairs, ElementsAre(Ranked(0.5, 0, 1)));
  request.clear_movers();
  for (const uint32_t group : {0, 1, 2, 2}) request.add_groups(group);
  request.set_ignore_same_group(true);
  const Found found = Find(request);
  EXPECT_THAT(found.pairs, ElementsAre(Ranked(0.5, 0, 1), Ranked(1.5, 1, 2), Ranked(1.75, 1, 3)));
  EXPECT_THAT(found.relations, testing::Each(v1::RELATION_SEPARATED));
  EXPECT_EQ(found.totals.separated(), 3);
}

TEST_F(LimitedScene, OnlyTheRowWithoutItsCertificateFails) {
  Put("cube", Cube());
  ASSERT_TRUE(PutBody("heap", std::vector<v1::Placement>(100, PlacementOf("cube"))).ok());
  v1::FindCollisionsRequest request;
  // The heaps touch at 10000 pairs of pieces, too many for a proof.
  *request.add_placements() = PlacementOf("heap");
  *request.add_placements() = PlacementOf("heap", 1, 0, 0);
  *request.add_placements() = PlacementOf("cube", 0, 0, 3);
  request.mutable_wanted()->set_certificate(true);
  request.mutable_wanted()->set_separation(true);
  request.mutable_wanted()->set_clearance(2);
  request.set_limit(2);
  const Found found = Find(request);
  ASSERT_THAT(found.problems, SizeIs(1));
  EXPECT_THAT(found.problems[0], HasSubstr("fewer pieces"));
  EXPECT_THAT(found.relations, ElementsAre(v1::RELATION_UNSPECIFIED, v1::RELATION_SEPARATED));
  EXPECT_EQ(found.totals.failed(), 1);
  EXPECT_EQ(found.totals.touching(), 0);
  EXPECT_EQ(found.totals.separated(), 2);
}

TEST_F(LimitedScene, ErrorsNameTheField) {
  v1::FindCollisionsRequest request;
  request.set_limit(0);
  ExpectRefused(request, "limit is 0; set it to at least 1");
  request.set_limit(1);
  ExpectRefused(request, "set wanted.separation and wanted.clearance");
  request.mutable_wanted()->set_separation(true);
  ExpectRefused(request, "set wanted.separation and wanted.clearance");
  request.mutable_wanted()->set_clearance(0);
  EXPECT_EQ(Find(request).totals.pairs(), 0);
}

}  // namespace nearest_pairs_test
}  // namespace hulld::server
