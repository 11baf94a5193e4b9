#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <random>
#include <thread>

#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace collision_stream_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

v1::StreamCollisionsRequest Open(const std::vector<v1::Placement>& placements,
                                 const std::vector<uint32_t>& pairs) {
  v1::StreamCollisionsRequest request;
  for (const v1::Placement& placement : placements) {
    *request.mutable_open()->add_placements() = placement;
  }
  request.mutable_open()->mutable_pairs()->Assign(pairs.begin(), pairs.end());
  return request;
}

using PoseNumbers = std::array<double, 7>;

v1::StreamCollisionsRequest Move(const std::vector<std::pair<uint32_t, PoseNumbers>>& moves) {
  v1::StreamCollisionsRequest request;
  request.mutable_update();
  for (const auto& [placement, pose] : moves) {
    request.mutable_update()->add_placements(placement);
    for (const double number : pose) request.mutable_update()->add_poses(number);
  }
  return request;
}

v1::StreamCollisionsRequest MoveX(uint32_t placement, double x) {
  return Move({{placement, {1, 0, 0, 0, x, 0, 0}}});
}

v1::StreamCollisionsRequest Refresh() {
  v1::StreamCollisionsRequest request;
  request.mutable_update()->set_refresh_hulls(true);
  return request;
}

// One stream; failures show in its final status.
class Stream {
 public:
  explicit Stream(v1::CollisionService::Stub& stub) : call_(stub.StreamCollisions(&context_)) {}

  bool Send(const v1::StreamCollisionsRequest& request) { return call_->Write(request); }

  // Returns the next answer, merged from its parts.
  v1::StreamCollisionsResponse Read() {
    v1::StreamCollisionsResponse answer;
    v1::StreamCollisionsResponse piece;
    pieces = 0;
    largest_piece = 0;
    while (call_->Read(&piece)) {
      EXPECT_EQ(piece.pairs_size(), piece.columns().relations_size());
      EXPECT_EQ(piece.has_header(), pieces == 0);
      ++pieces;
      largest_piece = std::max(largest_piece, piece.ByteSizeLong());
      answer.MergeFrom(piece);
      if (piece.last()) break;
    }
    return answer;
  }

  v1::StreamCollisionsResponse Exchange(const v1::StreamCollisionsRequest& request) {
    Send(request);
    return Read();
  }

  // Half-closes the stream, drains it, and returns its final status.
  grpc::Status Finish() {
    call_->WritesDone();
    v1::StreamCollisionsResponse rest;
    while (call_->Read(&rest)) {
    }
    return call_->Finish();
  }

  grpc::ClientContext& context() { return context_; }

  int pieces = 0;
  size_t largest_piece = 0;

 private:
  grpc::ClientContext context_;
  std::unique_ptr<
      grpc::ClientReaderWriter<v1::StreamCollisionsRequest, v1::StreamCollisionsResponse>>
      call_;
};

class StreamCollisionsCall : public ServerTest {
 protected:
  std::vector<int> BatchRelations(const v1::BatchCheckCollisionsRequest& request) {
    grpc::ClientContext context;
    const auto stream = collisions_->BatchCheckCollisions(&context, request);
    std::vector<int> relations;
    for (v1::BatchCheckCollisionsResponse part; stream->Read(&part);) {
      relations.insert(relations.end(), part.columns().relations().begin(),
                       part.columns().relations().end());
    }
    EXPECT_TRUE(stream->Finish().ok());
    return relations;
  }

  void ExpectRefused(const std::vector<v1::StreamCollisionsRequest>& messages,
                     grpc::StatusCode code, const std::string& what) {
    Stream stream(*collisions_);
    for (const auto& message : messages) stream.Send(message);
    const grpc::Status status = stream.Finish();
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(what));
  }
};

TEST_F(StreamCollisionsCall, OpenIsAnsweredByEveryPair) {
  Put("cube", Cube());
  Stream stream(*collisions_);
  const auto answer = stream.Exchange(Open(
      {PlacementOf("cube"), PlacementOf("cube", 1), PlacementOf("cube", 3), PlacementOf("none")},
      {0, 1, 0, 2, 0, 0, 3, 1}));
  EXPECT_EQ(answer.update(), 0);
  EXPECT_TRUE(answer.last());
  EXPECT_THAT(answer.pairs(), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(answer.columns().relations(),
              ElementsAre(v1::RELATION_TOUCHING, v1::RELATION_SEPARATED, v1::RELATION_OVERLAPPING,
                          v1::RELATION_UNSPECIFIED));
  EXPECT_EQ(answer.header().revision(), Get("cube").header().revision());
  ASSERT_EQ(answer.hulls_size(), 4);
  EXPECT_EQ(answer.hulls(1).revision(), Get("cube").hull().revision());
  ASSERT_EQ(answer.placement_problems_size(), 1);
  EXPECT_EQ(answer.placement_problems(0).placement(), 3);
  EXPECT_EQ(answer.placement_problems(0).code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_F(StreamCollisionsCall, UpdatesAreAnsweredByThePairsThatMoved) {
  Put("cube", Cube());
  Stream stream(*collisions_);
  stream.Exchange(Open({PlacementOf("cube"), PlacementOf("cube", 1), PlacementOf("cube", 3)},
                       {0, 1, 1, 2, 0, 2, 2, 2}));
  auto answer = stream.Exchange(MoveX(1, 2));
  EXPECT_EQ(answer.update(), 1);
  EXPECT_THAT(answer.pairs(), ElementsAre(0, 1));
  EXPECT_THAT(answer.columns().relations(),
              ElementsAre(v1::RELATION_SEPARATED, v1::RELATION_TOUCHING));
  EXPECT_EQ(answer.hulls_size(), 0);
  EXPECT_GT(answer.header().revision(), 0);
  answer = stream.Exchange(Move({}));
  EXPECT_EQ(answer.update(), 2);
  EXPECT_THAT(answer.pairs(), IsEmpty());
  answer = stream.Exchange(Move({{2, {1, 0, 0, 0, 0.5, 0, 0}}, {0, {1, 0, 0, 0, 9, 0, 0}}}));
  EXPECT_THAT(answer.pairs(), ElementsAre(0, 1, 2, 3));
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_F(StreamCollisionsCall, OnlyChangesOmitsUnchangedPairs) {
  Put("cube", Cube());
  Stream stream(*collisions_);
  auto open =
      Open({PlacementOf("cube"), PlacementOf("cube", 5), PlacementOf("cube", 1)}, {0, 1, 1, 2});
  open.mutable_open()->set_only_changes(true);
  EXPECT_THAT(stream.Exchange(open).pairs(), ElementsAre(0, 1));
  EXPECT_THAT(stream.Exchange(MoveX(1, 4)).pairs(), IsEmpty());
  const auto answer = stream.Exchange(MoveX(1, 2));
  EXPECT_THAT(answer.pairs(), ElementsAre(1));
  EXPECT_THAT(answer.columns().relations(), ElementsAre(v1::RELATION_TOUCHING));
  EXPECT_THAT(stream.Exchange(MoveX(1, 2)).pairs(), IsEmpty());
  EXPECT_THAT(stream.Exchange(MoveX(1, 0.5)).pairs(), ElementsAre(0, 1));
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_F(StreamCollisionsCall, EveryStepEqualsASingleCheck) {
  Put("cube", Cube(-1, 2));
  Put("ball", Sphere(60));
  Put("square", {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
  const std::vector<std::string> ids = {"cube", "ball", "square", "ball"};
  std::vector<v1::Placement> placements;
  placements.reserve(ids.size());
  for (const std::string& id : ids) placements.push_back(PlacementOf(id, 1.5 * placements.size()));
  Stream stream(*collisions_);
  auto answer = stream.Exchange(Open(placements, {0, 1, 1, 2, 2, 3, 3, 0, 0, 2}));
  const uint32_t pairs[][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 2}};
  std::mt19937 random(9);
  std::uniform_real_distribution<double> step(-0.1, 0.1);
  int cached = 0;
  int relations[4] = {};
  for (int i = 0; i < 300; ++i) {
    const uint32_t moved = i % 4;
    v1::Pose* const pose = placements[moved].mutable_pose();
    pose->mutable_rotation()->set_w(1);
    pose->mutable_rotation()->set_x(pose->rotation().x() + step(random));
    pose->mutable_translation()->set_x(pose->translation().x() * 0.95 + step(random));
    answer = stream.Exchange(Move({{moved,
                                    {1, pose->rotation().x(), 0, 0, pose->translation().x(),
                                     pose->translation().y(), pose->translation().z()}}}));
    ASSERT_GE(answer.pairs_size(), 2) << i;
    for (int k = 0; k < answer.pairs_size(); ++k) {
      v1::CheckCollisionRequest single;
      *single.mutable_a() = placements[pairs[answer.pairs(k)][0]];
      *single.mutable_b() = placements[pairs[answer.pairs(k)][1]];
      ASSERT_EQ(answer.columns().relations(k), Check(single).relation()) << "step " << i;
      cached += answer.columns().rungs(k) == v1::RUNG_CACHED ? 1 : 0;
      ++relations[answer.columns().relations(k)];
    }
  }
  EXPECT_GT(cached, 50);
  EXPECT_GT(relations[v1::RELATION_SEPARATED], 50);
  EXPECT_GT(relations[v1::RELATION_OVERLAPPING], 50);
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_F(StreamCollisionsCall, AnEmptyHullIsDecidedByTheSameRungAsInASingleCheck) {
  Put("cube", Cube());
  Create("empty");
  Stream stream(*collisions_);
  const auto answer = stream.Exchange(Open({PlacementOf("cube"), PlacementOf("empty")}, {0, 1}));
  v1::CheckCollisionRequest single;
  *single.mutable_a() = PlacementOf("cube");
  *single.mutable_b() = PlacementOf("empty");
  EXPECT_THAT(answer.columns().rungs(), ElementsAre(Check(single).rung()));
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_F(StreamCollisionsCall, HullsChangeOnlyWhenRefreshed) {
  Put("grows", {0, 0, 0});
  Put("target", Cube(5, 1));
  Stream stream(*collisions_);
  const auto target = PlacementOf("target");
  auto answer = stream.Exchange(
      Open({PlacementOf("grows"), target, target, PlacementOf("later")}, {0, 1, 1, 2, 3, 1}));
  EXPECT_THAT(
      answer.columns().relations(),
      ElementsAre(v1::RELATION_SEPARATED, v1::RELATION_OVERLAPPING, v1::RELATION_UNSPECIFIED));
  ASSERT_TRUE(Appender(*hulls_, "grows", "w").Append(1, Cube(0, 10)).has_value());
  Put("later", Cube(5.5, 9));
  answer = stream.Exchange(Move({{0, {1, 0, 0, 0, 0, 0, 0}}}));
  EXPECT_THAT(answer.columns().relations(), ElementsAre(v1::RELATION_SEPARATED));
  answer = stream.Exchange(Refresh());
  EXPECT_THAT(answer.pairs(), ElementsAre(0, 2));
  EXPECT_THAT(answer.columns().relations(),
              ElementsAre(v1::RELATION_OVERLAPPING, v1::RELATION_OVERLAPPING));
  ASSERT_EQ(answer.hulls_size(), 4);
  EXPECT_EQ(answer.hulls(0).revision(), Get("grows").hull().revision());
  EXPECT_EQ(answer.placement_problems_size(), 0);
  EXPECT_THAT(stream.Exchange(Refresh()).pairs(), IsEmpty());
  // Smaller hulls under the same names: cached pair state names vertices that no longer exist.
  ASSERT_TRUE(Delete("grows").ok() && Delete("later").ok());
  Put("grows", {5, 5, 5});
  answer = stream.Exchange(Refresh());
  EXPECT_THAT(answer.pairs(), ElementsAre(0, 2));
  EXPECT_THAT(answer.columns().relations(),
              ElementsAre(v1::RELATION_TOUCHING, v1::RELATION_UNSPECIFIED));
  ASSERT_EQ(answer.placement_problems_size(), 1);
  EXPECT_EQ(answer.placement_problems(0).placement(), 3);
  EXPECT_TRUE(stream.Finish().ok());
}

// Refreshed after each of many chunks: every answer equals that of a single call.
TEST_F(StreamCollisionsCall, AGrowingHullIsQueriedAtEveryStep) {
  Create("grows");
  Put("ball", Sphere(300));
  Appender appender(*hulls_, "grows", "w");
  Stream stream(*collisions_);
  const auto opened =
      stream.Exchange(Open({PlacementOf("grows", -2), PlacementOf("ball")}, {0, 1, 1, 0}));
  EXPECT_THAT(opened.columns().relations(),
              ElementsAre(v1::RELATION_SEPARATED, v1::RELATION_SEPARATED));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  int overlapping = 0;
  int separated = 0;
  for (uint64_t i = 1; i <= 200; ++i) {
    Coordinates xyz(30);
    for (double& x : xyz) x = coordinate(random) * (0.5 + 0.01 * static_cast<double>(i));
    ASSERT_TRUE(appender.Append(i, xyz).has_value());
    // Both together, then separately.
    const double x = -2 - coordinate(random);
    v1::StreamCollisionsRequest move = MoveX(0, x);
    if (i % 2 == 0) stream.Exchange(Refresh());
    if (i % 2 == 1) move.mutable_update()->set_refresh_hulls(true);
    const v1::StreamCollisionsResponse answer = stream.Exchange(move);
    v1::CheckCollisionRequest single;
    *single.mutable_a() = PlacementOf("grows", x);
    *single.mutable_b() = PlacementOf("ball");
    const v1::Relation expected = Check(single).relation();
    EXPECT_THAT(answer.columns().relations(), ElementsAre(expected, expected)) << i;
    ++(expected == v1::RELATION_SEPARATED ? separated : overlapping);
  }
  EXPECT_GT(overlapping, 5);
  EXPECT_GT(separated, 5);
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_F(StreamCollisionsCall, AMoveReplacesAMalformedPose) {
  Put("cube", Cube());
  Stream stream(*collisions_);
  const auto bad = PlacementOf("cube", std::numeric_limits<double>::quiet_NaN());
  auto answer = stream.Exchange(Open({PlacementOf("cube"), bad}, {0, 1}));
  EXPECT_THAT(answer.columns().relations(), ElementsAre(v1::RELATION_UNSPECIFIED));
  EXPECT_THAT(answer.placement_problems(0).message(),
              HasSubstr("placements[1].pose.translation.x is NaN"));
  answer = stream.Exchange(MoveX(1, 1));
  EXPECT_THAT(answer.columns().relations(), ElementsAre(v1::RELATION_TOUCHING));
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_F(StreamCollisionsCall, ErrorsNameTheMessageAndTheField) {
  Put("cube", Cube());
  const auto open = Open({PlacementOf("cube"), PlacementOf("cube")}, {0, 1});
  constexpr grpc::StatusCode kInvalid = grpc::StatusCode::INVALID_ARGUMENT;
  ExpectRefused({v1::StreamCollisionsRequest()}, kInvalid, "set open or update");
  ExpectRefused({MoveX(0, 1)}, kInvalid, "the first message must be open");
  ExpectRefused({open, open}, kInvalid, "open was sent twice");
  ExpectRefused({Open({PlacementOf("cube")}, {0})}, kInvalid,
                "open: pairs has an odd number of indices, 1;");
  ExpectRefused({Open({PlacementOf("cube")}, {0, 1})}, kInvalid,
                "open: pairs[1] is 1, but there is 1 placement");
  auto negative = open;
  negative.mutable_open()->set_tolerance(-1);
  ExpectRefused({negative}, kInvalid, "open: tolerance is -1");
  ExpectRefused({open, MoveX(1, 1), MoveX(2, 1)}, kInvalid, "update 2: placements[0] is 2");
  ExpectRefused({open, Move({{1, {1, 0, 0, 0, 0, 0, 0}}, {1, {1, 0, 0, 0, 0, 0, 0}}})}, kInvalid,
                "update 1: placements[1] is 1, which is listed twice; list each placement once");
  ExpectRefused({open, Move({{0, {1, 0, 0, 0, 0, 0, 0}}, {1, {0, 0, 0, 0, 0, 0, 0}}})}, kInvalid,
                "update 1: poses[1].rotation is zero");
  auto few = MoveX(0, 1);
  few.mutable_update()->mutable_poses()->RemoveLast();
  ExpectRefused({open, few}, kInvalid, "update 1: poses has 6 numbers for 1 placements");
  Config config = TestConfig();
  config.limits.max_pairs_per_batch = 1;
  Restart(config);
  ExpectRefused({Open({PlacementOf("cube")}, {0, 0, 0, 0})}, grpc::StatusCode::RESOURCE_EXHAUSTED,
                "the stream has 2 pairs; the limit is 1 (--max-pairs-per-batch)");
}

TEST_F(StreamCollisionsCall, LongAnswersComeInPiecesOfAMebibyte) {
  Put("cube", Cube());
  std::vector<uint32_t> pairs;
  for (uint32_t i = 0; i < 20'000; ++i) pairs.insert(pairs.end(), {i % 2, 1});
  auto open = Open({PlacementOf("cube"), PlacementOf("cube", 3)}, pairs);
  open.mutable_open()->mutable_wanted()->set_axis(true);
  Stream stream(*collisions_);
  for (const auto& message : {open, MoveX(1, 2)}) {
    const auto answer = stream.Exchange(message);
    ASSERT_EQ(answer.pairs_size(), 20'000);
    EXPECT_GT(stream.pieces, 2);
    EXPECT_LT(stream.largest_piece, (1 << 20) + 4096);
    for (int i = 0; i < answer.pairs_size(); ++i) {
      ASSERT_EQ(answer.pairs(i), i);
      const bool found = answer.columns().axes(i).kind() != v1::AXIS_KIND_UNSPECIFIED;
      ASSERT_EQ(found, i % 2 == 0);
    }
  }
  EXPECT_TRUE(stream.Finish().ok());
}

// Includes pairs with a missing hull.
TEST_F(StreamCollisionsCall, ManyPairsAreAnsweredAsInABatch) {
  Put("cube", Cube());
  Put("ball", Sphere(60));
  const std::vector<std::string> ids = {"cube", "ball", "missing", "ball", "cube"};
  v1::BatchCheckCollisionsRequest batch;
  std::vector<v1::Placement> placements;
  std::vector<uint32_t> pairs;
  // Enough that threads share the placing of movers, and then their pairs.
  constexpr uint32_t kPlacements = 250;
  constexpr uint32_t kPairsEach = 40;
  for (uint32_t i = 0; i < kPlacements; ++i) {
    placements.push_back(PlacementOf(ids[i % ids.size()], 0.1 * i));
    for (uint32_t j = i - std::min(i, kPairsEach); j < i; ++j) pairs.insert(pairs.end(), {j, i});
  }
  batch.mutable_pairs()->Assign(pairs.begin(), pairs.end());
  Stream stream(*collisions_);
  auto answer = stream.Exchange(Open(placements, pairs));
  for (int step = 0; step < 3; ++step) {
    std::vector<std::pair<uint32_t, PoseNumbers>> moves;
    for (uint32_t i = 0; i < kPlacements; ++i) {
      const double x = 0.1 * i + 0.01 * step * (i % 7);
      placements[i].mutable_pose()->mutable_translation()->set_x(x);
      moves.push_back({i, {1, 0, 0, 0, x, 0, 0}});
    }
    if (step > 0) answer = stream.Exchange(Move(moves));
    batch.mutable_placements()->Assign(placements.begin(), placements.end());
    const std::vector<int> expected = BatchRelations(batch);
    ASSERT_EQ(expected.size(), pairs.size() / 2);
    ASSERT_EQ(answer.pairs_size(), pairs.size() / 2);
    int relations[5] = {};
    for (int i = 0; i < answer.pairs_size(); ++i) {
      ASSERT_EQ(answer.pairs(i), i);
      ASSERT_EQ(answer.columns().relations(i), expected[i]) << i;
      ++relations[answer.columns().relations(i)];
    }
    EXPECT_GT(relations[v1::RELATION_UNSPECIFIED], 1000);
    EXPECT_GT(relations[v1::RELATION_SEPARATED], 1000);
    EXPECT_GT(relations[v1::RELATION_OVERLAPPING], 300);
  }
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_F(StreamCollisionsCall, ManyPlacementsThatMoveMayHaveFewPairsOrNone) {
  Put("cube", Cube());
  constexpr uint32_t kPlacements = 250;
  std::vector<v1::Placement> placements;
  for (uint32_t i = 0; i < kPlacements; ++i) placements.push_back(PlacementOf("cube", 10.0 * i));
  Stream stream(*collisions_);
  EXPECT_EQ(stream.Exchange(Open(placements, {0, kPlacements - 1})).pairs_size(), 1);
  const auto move_from = [&](uint32_t first, double x) {
    std::vector<std::pair<uint32_t, PoseNumbers>> moves;
    for (uint32_t i = first; i < kPlacements; ++i) moves.push_back({i, {1, 0, 0, 0, x, 0, 0}});
    return stream.Exchange(Move(moves));
  };
  const auto together = move_from(0, 1);
  ASSERT_EQ(together.pairs_size(), 1);
  EXPECT_EQ(together.columns().relations(0), v1::RELATION_OVERLAPPING);
  std::vector<std::pair<uint32_t, PoseNumbers>> others;
  for (uint32_t i = 1; i + 1 < kPlacements; ++i) others.push_back({i, {1, 0, 0, 0, -30, 0, 0}});
  EXPECT_EQ(stream.Exchange(Move(others)).pairs_size(), 0);
  const auto apart = move_from(1, 20);
  ASSERT_EQ(apart.pairs_size(), 1);
  EXPECT_EQ(apart.columns().relations(0), v1::RELATION_SEPARATED);
  EXPECT_TRUE(stream.Finish().ok());
}

// Steps of any size, some with a refresh: several threads place and decide many placements.
TEST_F(StreamCollisionsCall, RandomStepsAreAnsweredAsInABatch) {
  Put("cube", Cube());
  Put("ball", Sphere(60));
  const char* const seed = std::getenv("HULLD_TEST_SEED");
  std::mt19937 random(seed == nullptr ? 0 : std::atoi(seed));
  const auto below = [&](uint32_t count) {
    return std::uniform_int_distribution<uint32_t>(0, count - 1)(random);
  };
  constexpr uint32_t kPlacements = 400;
  constexpr int kSteps = 60;
  const char* const ids[] = {"cube", "ball", "late"};
  std::vector<v1::Placement> placements;
  for (uint32_t i = 0; i < kPlacements; ++i) {
    placements.push_back(PlacementOf(ids[below(3)], 0.02 * below(1000)));
    if (below(20) == 0) placements[i].mutable_pose()->mutable_translation()->set_x(NAN);
  }
  std::vector<uint32_t> pairs;
  for (int i = 0; i < 3000; ++i)
    pairs.insert(pairs.end(), {below(kPlacements), below(kPlacements)});
  Stream stream(*collisions_);
  auto answer = stream.Exchange(Open(placements, pairs));
  std::vector<char> is_due(pairs.size() / 2, true);
  for (int step = 0; step <= kSteps; ++step) {
    v1::BatchCheckCollisionsRequest batch;
    batch.mutable_placements()->Assign(placements.begin(), placements.end());
    std::vector<uint32_t> due;
    for (uint32_t i = 0; i < is_due.size(); ++i) {
      if (!is_due[i]) continue;
      due.push_back(i);
      batch.add_pairs(pairs[2 * i]);
      batch.add_pairs(pairs[2 * i + 1]);
    }
    ASSERT_THAT(answer.pairs(), ::testing::ElementsAreArray(due)) << "step " << step;
    ASSERT_THAT(answer.columns().relations(), ::testing::ElementsAreArray(BatchRelations(batch)))
        << "step " << step;
    is_due.assign(is_due.size(), false);
    const auto ask_about = [&](auto holds) {
      for (uint32_t i = 0; i < is_due.size(); ++i) {
        if (holds(pairs[2 * i]) || holds(pairs[2 * i + 1])) is_due[i] = true;
      }
    };
    std::vector<uint32_t> order(kPlacements);
    std::iota(order.begin(), order.end(), 0);
    std::shuffle(order.begin(), order.end(), random);
    order.resize(below(3) == 0 ? kPlacements : below(1 << below(9)) % kPlacements);
    std::vector<std::pair<uint32_t, PoseNumbers>> moves;
    for (const uint32_t i : order) {
      const double x = 0.02 * below(1000);
      *placements[i].mutable_pose() = PlacementOf("", x).pose();
      moves.push_back({i, {1, 0, 0, 0, x, 0, 0}});
    }
    std::vector<char> moved(kPlacements, false);
    for (const uint32_t i : order) moved[i] = true;
    ask_about([&](uint32_t i) { return moved[i] != 0; });
    v1::StreamCollisionsRequest request = Move(moves);
    if (step == kSteps / 2) {
      Put("late", Cube());
      request.mutable_update()->set_refresh_hulls(true);
      ask_about([&](uint32_t i) { return placements[i].hull_id() == "late"; });
    } else if (below(8) == 0) {
      request.mutable_update()->set_refresh_hulls(true);
    }
    answer = stream.Exchange(request);
  }
  EXPECT_TRUE(stream.Finish().ok());
}

// Enough that threads share them.
TEST_F(StreamCollisionsCall, OnlyChangesAgreesWithABatch) {
  Put("cube", Cube());
  Put("ball", Sphere(60));
  v1::BatchCheckCollisionsRequest batch;
  std::vector<v1::Placement> placements;
  std::vector<uint32_t> pairs;
  constexpr uint32_t kPlacements = 60;
  for (uint32_t i = 0; i < kPlacements; ++i) {
    placements.push_back(PlacementOf(i % 2 == 0 ? "cube" : "ball", 0.1 * i));
    for (uint32_t j = 0; j < i; ++j) pairs.insert(pairs.end(), {j, i});
  }
  batch.mutable_pairs()->Assign(pairs.begin(), pairs.end());
  batch.mutable_placements()->Assign(placements.begin(), placements.end());
  std::vector<int> before = BatchRelations(batch);
  v1::StreamCollisionsRequest open = Open(placements, pairs);
  open.mutable_open()->set_only_changes(true);
  Stream stream(*collisions_);
  EXPECT_EQ(stream.Exchange(open).pairs_size(), pairs.size() / 2);
  for (int step = 1; step <= 5; ++step) {
    std::vector<std::pair<uint32_t, PoseNumbers>> moves;
    for (uint32_t i = 0; i < kPlacements; ++i) {
      const double x = 0.1 * i + 0.05 * step * (i % 5);
      placements[i].mutable_pose()->mutable_translation()->set_x(x);
      moves.push_back({i, {1, 0, 0, 0, x, 0, 0}});
    }
    batch.mutable_placements()->Assign(placements.begin(), placements.end());
    const std::vector<int> now = BatchRelations(batch);
    std::vector<uint32_t> changed;
    for (uint32_t i = 0; i < now.size(); ++i) {
      if (now[i] != before[i]) changed.push_back(i);
    }
    const auto answer = stream.Exchange(Move(moves));
    EXPECT_THAT(answer.pairs(), ::testing::ElementsAreArray(changed));
    EXPECT_GT(changed.size(), 20U);
    EXPECT_LT(changed.size(), 1000U);
    for (int i = 0; i < answer.pairs_size(); ++i) {
      EXPECT_EQ(answer.columns().relations(i), now[answer.pairs(i)]);
    }
    before = now;
  }
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_F(StreamCollisionsCall, ClientsThatWriteAheadAreAnsweredInOrder) {
  Put("cube", Cube());
  Stream stream(*collisions_);
  stream.Send(Open({PlacementOf("cube"), PlacementOf("cube", 2)}, {0, 1}));
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(stream.Send(MoveX(1, i % 3)));
  EXPECT_EQ(stream.Read().update(), 0);
  const v1::Relation expected[] = {v1::RELATION_OVERLAPPING, v1::RELATION_TOUCHING,
                                   v1::RELATION_SEPARATED};
  for (int i = 0; i < 200; ++i) {
    const auto answer = stream.Read();
    ASSERT_EQ(answer.update(), i + 1);
    ASSERT_EQ(answer.columns().relations(0), expected[i % 3]);
  }
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_F(StreamCollisionsCall, DrainingRefusesNewStreamsAndLetsRunningOnesEnd) {
  Put("cube", Cube());
  Stream stream(*collisions_);
  stream.Exchange(Open({PlacementOf("cube"), PlacementOf("cube", 2)}, {0, 1}));
  server_->BeginDrain();
  ExpectRefused({}, grpc::StatusCode::UNAVAILABLE, "shutting down");
  EXPECT_THAT(stream.Exchange(MoveX(1, 1)).columns().relations(),
              ElementsAre(v1::RELATION_TOUCHING));
  EXPECT_FALSE(server_->WaitIdle(std::chrono::milliseconds(0)));
  EXPECT_TRUE(stream.Finish().ok());
  EXPECT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
}

// Its answers take minutes: every pair needs exact arithmetic on large features.
v1::StreamCollisionsRequest EndlessOpen() {
  std::vector<uint32_t> pairs;
  for (uint32_t i = 0; i < 900'000; ++i) pairs.insert(pairs.end(), {0, 1});
  auto open = Open({PlacementOf("ball"), PlacementOf("ball", 2)}, pairs);
  open.mutable_open()->mutable_wanted()->set_axis(true);
  return open;
}

TEST_F(StreamCollisionsCall, CancellingEndsALongAnswer) {
  Put("ball", Sphere(3000));
  Stream stream(*collisions_);
  stream.Send(EndlessOpen());
  stream.context().TryCancel();
  EXPECT_EQ(stream.Finish().error_code(), grpc::StatusCode::CANCELLED);
  server_->BeginDrain();
  EXPECT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
}

TEST_F(StreamCollisionsCall, ADeadlineEndsALongAnswer) {
  Put("ball", Sphere(3000));
  v1::StreamCollisionsRequest open = EndlessOpen();
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(500));
  const auto stream = collisions_->StreamCollisions(&context);
  stream->Write(open);
  v1::StreamCollisionsResponse piece;
  while (stream->Read(&piece)) EXPECT_FALSE(piece.last());
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  server_->BeginDrain();
  EXPECT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
}

}  // namespace collision_stream_test
}  // namespace hulld::server
