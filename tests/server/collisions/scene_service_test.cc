#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <initializer_list>
#include <limits>
#include <map>
#include <random>
#include <utility>

#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace scene_service_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

using IndexPair = std::pair<uint32_t, uint32_t>;

void Fill(google::protobuf::RepeatedField<uint32_t>* field, std::initializer_list<uint32_t> list) {
  field->Assign(list.begin(), list.end());
}

class FindCollisionsCall : public ServerTest {
 protected:
  struct Scene {
    grpc::Status status;
    // The first message.
    v1::FindCollisionsResponse head;
    std::map<IndexPair, v1::Relation> found;
    std::vector<double> separations;
    v1::SceneTotals totals;
    int messages = 0;
    size_t largest_message = 0;
  };

  Scene Find(const v1::FindCollisionsRequest& request) {
    grpc::ClientContext context;
    auto stream = collisions_->FindCollisions(&context, request);
    Scene scene;
    v1::FindCollisionsResponse part;
    bool ended = false;
    while (stream->Read(&part)) {
      if (scene.messages++ == 0) scene.head = part;
      EXPECT_FALSE(ended) << "the totals come last";
      ended = part.has_totals();
      scene.largest_message = std::max(scene.largest_message, part.ByteSizeLong());
      EXPECT_EQ(part.pairs_size(), 2 * part.columns().relations_size());
      for (int i = 0; 2 * i < part.pairs_size(); ++i) {
        const IndexPair pair = {part.pairs(2 * i), part.pairs(2 * i + 1)};
        EXPECT_LT(pair.first, pair.second);
        EXPECT_TRUE(scene.found.emplace(pair, part.columns().relations(i)).second);
      }
      const auto& separations = part.columns().separations();
      scene.separations.insert(scene.separations.end(), separations.begin(), separations.end());
      if (part.has_totals()) scene.totals = part.totals();
    }
    scene.status = stream->Finish();
    EXPECT_EQ(ended, scene.status.ok());
    return scene;
  }

  // Cubes of size 1 at these places on the x axis.
  v1::FindCollisionsRequest Row(const std::vector<double>& places) {
    v1::FindCollisionsRequest request;
    for (const double x : places) *request.add_placements() = PlacementOf("cube", x);
    return request;
  }

  void ExpectRefused(const v1::FindCollisionsRequest& request, const std::string& what) {
    const grpc::Status status = Find(request).status;
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(what));
  }
};

TEST_F(FindCollisionsCall, FindsAndCountsCollisions) {
  Put("cube", Cube());
  auto request = Row({0, 0.5, 1.5, 5});
  *request.add_placements() = PlacementOf("none");
  const Scene scene = Find(request);
  ASSERT_TRUE(scene.status.ok()) << scene.status.error_message();
  EXPECT_THAT(scene.found, ElementsAre(Pair(IndexPair(0, 1), v1::RELATION_OVERLAPPING),
                                       Pair(IndexPair(1, 2), v1::RELATION_TOUCHING)));
  EXPECT_EQ(scene.totals.pairs(), 10);
  EXPECT_GE(scene.totals.candidates(), 2);
  EXPECT_LT(scene.totals.candidates(), 6);
  EXPECT_EQ(scene.totals.overlapping(), 1);
  EXPECT_EQ(scene.totals.touching(), 1);
  EXPECT_EQ(scene.totals.separated() + scene.totals.failed(), 0);
  EXPECT_EQ(scene.head.header().revision(), Get("cube").header().revision());
  ASSERT_EQ(scene.head.hulls_size(), 5);
  EXPECT_EQ(scene.head.hulls(3).revision(), Get("cube").hull().revision());
  ASSERT_EQ(scene.head.placement_problems_size(), 1);
  EXPECT_EQ(scene.head.placement_problems(0).placement(), 4);
  EXPECT_EQ(scene.head.placement_problems(0).code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(FindCollisionsCall, AnEmptySceneHasItsTotals) {
  const Scene scene = Find({});
  EXPECT_TRUE(scene.status.ok());
  EXPECT_EQ(scene.messages, 2);
  EXPECT_EQ(scene.totals.pairs(), 0);
}

TEST_F(FindCollisionsCall, GroupsAndMoversLeavePairsOut) {
  Put("cube", Cube());
  const auto found = [&](const std::function<void(v1::FindCollisionsRequest*)>& change) {
    auto request = Row({0, 0, 0, 0});
    Fill(request.mutable_groups(), {5, 5, 6, 7});
    change(&request);
    const Scene scene = Find(request);
    EXPECT_TRUE(scene.status.ok()) << scene.status.error_message();
    std::vector<IndexPair> pairs;
    for (const auto& [pair, relation] : scene.found) pairs.push_back(pair);
    return pairs;
  };
  EXPECT_EQ(found([](auto*) {}).size(), 6u);
  EXPECT_THAT(found([](auto* r) { r->set_ignore_same_group(true); }),
              ElementsAre(Pair(0, 2), Pair(0, 3), Pair(1, 2), Pair(1, 3), Pair(2, 3)));
  EXPECT_THAT(found([](auto* r) {
                Fill(r->mutable_ignored_group_pairs(), {7, 5, 6, 6});
              }),
              ElementsAre(Pair(0, 1), Pair(0, 2), Pair(1, 2), Pair(2, 3)));
  EXPECT_THAT(found([](auto* r) {
                Fill(r->mutable_ignored_group_pairs(), {5, 5, 5, 6, 5, 7});
              }),
              ElementsAre(Pair(2, 3)));
  EXPECT_THAT(found([](auto* r) { r->set_movers(1); }),
              ElementsAre(Pair(0, 1), Pair(0, 2), Pair(0, 3)));
  EXPECT_THAT(found([](auto* r) {
                r->set_movers(2);
                Fill(r->mutable_ignored_group_pairs(), {5, 6});
              }),
              ElementsAre(Pair(0, 1), Pair(0, 3), Pair(1, 3)));
  EXPECT_THAT(found([](auto* r) { r->set_movers(0); }), IsEmpty());
}

TEST_F(FindCollisionsCall, AToleranceAllowsAnAnswerWithinTolerance) {
  Put("cube", Cube());
  auto request = Row({0, 1, 3});
  request.set_tolerance(0.25);
  const Scene scene = Find(request);
  EXPECT_THAT(scene.found, ElementsAre(Pair(IndexPair(0, 1), v1::RELATION_WITHIN_TOLERANCE)));
  EXPECT_EQ(scene.totals.within_tolerance(), 1);
}

TEST_F(FindCollisionsCall, EqualsABatchOfAllPairs) {
  Put("cube", Cube(-0.5, 1));
  Put("ball", Sphere(50));
  Put("needle", {-1, -1, -1, 1, 1, 1});
  std::mt19937 random(3);
  std::uniform_int_distribution<int> steps(-10, 10);
  v1::FindCollisionsRequest request;
  v1::BatchCheckCollisionsRequest batch;
  for (int i = 0; i < 120; ++i) {
    constexpr const char* kIds[] = {"cube", "ball", "needle"};
    *request.add_placements() =
        PlacementOf(kIds[i % 3], steps(random) * 0.5, steps(random) * 0.5, steps(random) * 0.5);
  }
  *batch.mutable_placements() = request.placements();
  for (uint32_t a = 0; a < 120; ++a) {
    for (uint32_t b = a + 1; b < 120; ++b) {
      batch.add_pairs(a);
      batch.add_pairs(b);
    }
  }
  std::map<IndexPair, v1::Relation> expected;
  int counts[4] = {};
  grpc::ClientContext context;
  auto stream = collisions_->BatchCheckCollisions(&context, batch);
  v1::BatchCheckCollisionsResponse part;
  while (stream->Read(&part)) {
    for (int i = 0; i < part.columns().relations_size(); ++i) {
      const int at = 2 * (static_cast<int>(part.first_pair()) + i);
      ++counts[part.columns().relations(i)];
      if (part.columns().relations(i) == v1::RELATION_SEPARATED) continue;
      expected[{batch.pairs(at), batch.pairs(at + 1)}] = part.columns().relations(i);
    }
  }
  ASSERT_TRUE(stream->Finish().ok());
  EXPECT_GT(counts[v1::RELATION_TOUCHING], 3);
  EXPECT_GT(counts[v1::RELATION_OVERLAPPING], 20);
  EXPECT_GT(counts[v1::RELATION_SEPARATED], 1000);
  const Scene scene = Find(request);
  EXPECT_EQ(scene.found, expected);
  EXPECT_EQ(scene.totals.touching(), static_cast<uint64_t>(counts[v1::RELATION_TOUCHING]));
  EXPECT_EQ(scene.totals.overlapping(), static_cast<uint64_t>(counts[v1::RELATION_OVERLAPPING]));
}

TEST_F(FindCollisionsCall, ErrorsNameTheField) {
  Put("cube", Cube());
  auto request = Row({0, 1});
  request.add_groups(1);
  ExpectRefused(request, "groups has 1 groups for 2 placements");
  request.add_groups(2);
  request.add_ignored_group_pairs(1);
  ExpectRefused(request, "ignored_group_pairs has an odd number of groups, 1; each pair needs two");
  request.clear_groups();
  request.add_ignored_group_pairs(1);
  ExpectRefused(request, "ignored_group_pairs requires groups");
  request = Row({0, 1});
  request.set_ignore_same_group(true);
  ExpectRefused(request, "ignore_same_group requires groups");
  request = Row({0, 1});
  request.set_movers(3);
  ExpectRefused(request, "movers is 3, but there are 2 placements");
  request = Row({0, 1});
  request.set_tolerance(-1);
  ExpectRefused(request, "tolerance is -1");
}

TEST_F(FindCollisionsCall, LongAnswersStreamInMessagesOfAMebibyte) {
  Put("cube", Cube());
  auto request = Row(std::vector<double>(300, 0.0));
  request.mutable_wanted()->set_analysis(true);
  const Scene scene = Find(request);
  ASSERT_TRUE(scene.status.ok()) << scene.status.error_message();
  EXPECT_EQ(scene.found.size(), 300u * 299 / 2);
  EXPECT_EQ(scene.totals.overlapping(), 300u * 299 / 2);
  EXPECT_GT(scene.messages, 1);
  EXPECT_LT(scene.largest_message, (1 << 20) + 4096);
}

// Parallel needles along the space diagonal: all boxes meet, but no needles do, so the scene has
// 2e9 pairs to test and nothing to send.
v1::FindCollisionsRequest EndlessScene() {
  v1::FindCollisionsRequest request;
  for (int i = 0; i < 65'536; ++i) *request.add_placements() = PlacementOf("needle", 1e-6 * i);
  return request;
}

TEST_F(FindCollisionsCall, CancellingEndsALongScene) {
  Put("needle", {0, 0, 0, 1, 1, 1});
  const auto request = EndlessScene();
  grpc::ClientContext context;
  auto stream = collisions_->FindCollisions(&context, request);
  v1::FindCollisionsResponse part;
  ASSERT_TRUE(stream->Read(&part));
  context.TryCancel();
  while (stream->Read(&part)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  server_->BeginDrain();
  EXPECT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
}

TEST_F(FindCollisionsCall, ADeadlineEndsALongScene) {
  Put("needle", {0, 0, 0, 1, 1, 1});
  const auto request = EndlessScene();
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(800));
  auto stream = collisions_->FindCollisions(&context, request);
  v1::FindCollisionsResponse part;
  while (stream->Read(&part)) EXPECT_FALSE(part.has_totals());
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  server_->BeginDrain();
  EXPECT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
}

}  // namespace scene_service_test
}  // namespace hulld::server
