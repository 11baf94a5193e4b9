// Scenes in motion with first_only.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "tests/server/collisions/moving_placements.h"

namespace hulld::server {
namespace moving_placements {

using ::testing::HasSubstr;
using ::testing::StartsWith;

using FirstPairsTest = MovingPlacements;

TEST_F(FirstPairsTest, FirstOnlyFindsThePairsThatMayTouchFirst) {
  Put("cube", Cube());
  std::mt19937 random(11);
  std::uniform_real_distribution<double> number(-8, 8);
  int contacts = 0;
  for (int round = 0; round < 12; ++round) {
    v1::FindCollisionsRequest request;
    for (int i = 0; i < 14; ++i) {
      // Lattice points give several pairs the same time.
      const auto coordinate = [&] {
        return round % 2 == 0 ? std::round(number(random) / 2) : number(random);
      };
      v1::Placement one = PlacementOf("cube", coordinate(), coordinate(), coordinate());
      if (i % 3 != 0) one = MovingTo(one, coordinate(), coordinate(), coordinate());
      if (i % 3 == 2 && round % 2 == 1) Turn(1, number(random), 0, 1, one.mutable_end_pose());
      *request.add_placements() = one;
    }
    v1::BatchCheckCollisionsRequest pairs;
    *pairs.mutable_placements() = request.placements();
    for (uint32_t a = 0; a < 14; ++a) {
      for (uint32_t b = a + 1; b < 14; ++b) {
        pairs.add_pairs(a);
        pairs.add_pairs(b);
      }
    }
    const auto batch = CheckBatch(pairs);
    ASSERT_TRUE(batch.ok()) << batch.status();
    const v1::AnswerColumns& all = batch->columns();
    double earliest = std::numeric_limits<double>::infinity();
    for (const double time : all.contact_times()) earliest = std::fmin(earliest, time);
    std::vector<std::tuple<double, uint32_t, uint32_t, v1::Relation>> expected;
    for (int i = 0; i < all.relations_size(); ++i) {
      if (all.relations(i) == kSeparated || !(all.separated_until(i) <= earliest)) continue;
      if (std::isinf(earliest)) continue;
      expected.emplace_back(all.separated_until(i), pairs.pairs(2 * i), pairs.pairs(2 * i + 1),
                            all.relations(i));
    }
    std::sort(expected.begin(), expected.end());
    request.set_first_only(true);
    request.mutable_wanted()->set_certificate(true);
    const auto scene = Find(request);
    ASSERT_TRUE(scene.ok()) << scene.status();
    std::vector<std::tuple<double, uint32_t, uint32_t, v1::Relation>> found;
    for (int i = 0; i < scene->columns().relations_size(); ++i) {
      found.emplace_back(scene->columns().separated_until(i), scene->pairs(2 * i),
                         scene->pairs(2 * i + 1), scene->columns().relations(i));
      EXPECT_GT(scene->columns().certificates(i).pairs_size(), 0);
    }
    EXPECT_EQ(found, expected);
    const v1::SceneTotals& totals = scene->totals();
    EXPECT_EQ(totals.touching() + totals.overlapping() + totals.within_tolerance(), found.size());
    EXPECT_GT(totals.candidates(), found.size());
    contacts += static_cast<int>(found.size());
  }
  EXPECT_GT(contacts, 12);
}

TEST_F(FirstPairsTest, FirstOnlyFindsNothingIfNothingTouches) {
  Put("cube", Cube());
  v1::FindCollisionsRequest request;
  *request.add_placements() = PlacementOf("cube");
  *request.add_placements() = MovingTo(PlacementOf("cube", 3), 2);
  request.set_first_only(true);
  const auto scene = Find(request);
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ(scene->pairs_size(), 0);
  EXPECT_EQ(scene->totals().pairs(), 1u);
}

TEST_F(FirstPairsTest, FirstOnlyNamesTheFieldsThatItExcludes) {
  Put("cube", Cube());
  v1::FindCollisionsRequest request;
  *request.add_placements() = PlacementOf("cube");
  *request.add_placements() = PlacementOf("cube", 3);
  request.set_first_only(true);
  EXPECT_THAT(MessageOf(Find(request).status()), HasSubstr("no placement has an end_pose"));
  *request.mutable_placements(1) = MovingTo(request.placements(1), 1);
  request.set_limit(1);
  EXPECT_THAT(MessageOf(Find(request).status()),
              StartsWith("first_only and limit cannot be combined"));
  request.clear_limit();
  request.set_first_only(false);
  request.set_every_piece(true);
  EXPECT_THAT(MessageOf(Find(request).status()),
              StartsWith("every_piece and end_pose cannot be combined"));
}

}  // namespace moving_placements
}  // namespace hulld::server
