// Queries about bodies: single calls, batches, streams, and scenes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/server/hulls/body_fixture.h"

namespace hulld::server {
namespace body_queries_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Optional;

class BodyQueries : public BodyTest {
 protected:
  // Returns the merged answer of a batch.
  absl::StatusOr<v1::BatchCheckCollisionsResponse> Batch(
      const v1::BatchCheckCollisionsRequest& request) {
    v1::BatchCheckCollisionsResponse all;
    const absl::Status status = MakeClient().BatchCheckCollisions(
        request, [&](const v1::BatchCheckCollisionsResponse& part) {
          all.MergeFrom(part);
          return absl::OkStatus();
        });
    if (!status.ok()) return status;
    return all;
  }
};

TEST_F(BodyQueries, TheAnswerNamesThePieceThatDecided) {
  PutPair("pair");
  const auto overlap = CheckPair(PlacementOf("cube", 5.5, 0.5, 0.5), PlacementOf("pair"));
  ASSERT_TRUE(overlap.ok()) << overlap.status();
  EXPECT_EQ(overlap->relation(), v1::RELATION_OVERLAPPING);
  EXPECT_FALSE(overlap->has_piece_a());
  EXPECT_EQ(overlap->piece_b().index(), 1u);
  EXPECT_EQ(overlap->piece_b().hull().hull_id(), "cube");
  EXPECT_EQ(overlap->piece_b().hull().revision(), overlap->hull_a().revision());
  EXPECT_EQ(overlap->hull_b().hull_id(), "pair");
  EXPECT_EQ(overlap->hull_b().revision(), MakeClient().GetBody("pair")->body().revision());

  const auto apart = CheckPair(PlacementOf("pair"), PlacementOf("cube", 2, 0, 0));
  EXPECT_EQ(apart->relation(), v1::RELATION_SEPARATED);
  EXPECT_FALSE(apart->has_piece_a());
}

TEST_F(BodyQueries, DetailsBelongToTheNearestOrDeepestPair) {
  PutPair("pair");
  v1::Wanted wanted;
  wanted.set_separation(true);
  wanted.set_witness(true);
  wanted.set_axis(true);
  wanted.set_analysis(true);
  wanted.set_clearance(1.5);
  const auto apart = CheckPair(PlacementOf("pair"), PlacementOf("pair", 2.5, 0, 0), wanted);
  ASSERT_TRUE(apart.ok()) << apart.status();
  EXPECT_EQ(apart->relation(), v1::RELATION_SEPARATED);
  EXPECT_NEAR(apart->separation().value(), 1.5, apart->separation().bound());
  EXPECT_TRUE(apart->has_witness());
  EXPECT_TRUE(apart->within_clearance());
  EXPECT_EQ(apart->piece_a().hull().hull_id(), "cube");
  EXPECT_EQ(apart->piece_b().hull().hull_id(), "cube");
  EXPECT_EQ(apart->axis().feature_a().vertex_indices_size(), 4);
  EXPECT_EQ(apart->analysis().size_a().vertices(), 8u);

  const auto deep = CheckPair(PlacementOf("pair"), PlacementOf("cube", 4.75, 0, 0), wanted);
  EXPECT_EQ(deep->relation(), v1::RELATION_OVERLAPPING);
  EXPECT_EQ(deep->piece_a().index(), 1u);
  EXPECT_NEAR(deep->separation().value(), -0.75, deep->separation().bound() + 1e-12);
}

// Two cubes of one rotated body share a face: only the exact product of the poses shows it.
TEST_F(BodyQueries, PosesComposeExactly) {
  Put("cube", Cube());
  ASSERT_TRUE(PutBody("left", {PlacementOf("cube", 0.25, 0.2, 0.3)}).ok());
  ASSERT_TRUE(PutBody("right", {PlacementOf("cube", 1.25, 0.2, 0.3)}).ok());
  v1::Placement left = PlacementOf("left", 17.3, -4.1, 1e6);
  v1::Quaternion* const q = left.mutable_pose()->mutable_rotation();
  q->set_w(0.3);
  q->set_x(-0.7);
  q->set_y(0.2);
  q->set_z(0.9);
  v1::Placement right = left;
  right.set_hull_id("right");
  EXPECT_EQ(CheckPair(left, right)->relation(), v1::RELATION_TOUCHING);
}

TEST_F(BodyQueries, TheTextbookMethodIsOnlyForHulls) {
  PutPair("pair");
  v1::CheckCollisionRequest request;
  *request.mutable_a() = PlacementOf("pair");
  *request.mutable_b() = PlacementOf("cube");
  request.set_method(v1::METHOD_TEXTBOOK_SAT);
  EXPECT_TRUE(absl::IsInvalidArgument(MakeClient().CheckCollision(request).status()));
}

TEST_F(BodyQueries, AMissingPieceIsNamedUntilItExists) {
  Put("cube", Cube());
  ASSERT_TRUE(PutBody("b", {PlacementOf("cube"), PlacementOf("late", 5, 0, 0)}).ok());
  const auto missing = CheckPair(PlacementOf("b"), PlacementOf("cube", 9, 0, 0));
  EXPECT_TRUE(absl::IsNotFound(missing.status()));
  EXPECT_EQ(ReasonOf(missing.status()), v1::ERROR_REASON_PIECE_NOT_FOUND);
  EXPECT_THAT(std::string(missing.status().message()),
              HasSubstr("body \"b\": piece 1: hull \"late\" not found"));
  EXPECT_THAT(MetadataOf(missing.status(), "body_id"), Optional(std::string("b")));
  EXPECT_THAT(MetadataOf(missing.status(), "piece"), Optional(std::string("1")));
  EXPECT_THAT(MetadataOf(missing.status(), "hull_id"), Optional(std::string("late")));
  Put("late", Cube());
  EXPECT_EQ(CheckPair(PlacementOf("b"), PlacementOf("cube", 5.5, 0, 0))->relation(),
            v1::RELATION_OVERLAPPING);
  ASSERT_TRUE(Delete("late").ok());
  EXPECT_EQ(ReasonOf(CheckPair(PlacementOf("b"), PlacementOf("cube")).status()),
            v1::ERROR_REASON_PIECE_NOT_FOUND);
  // A body cannot be a piece.
  ASSERT_TRUE(PutBody("late", {PlacementOf("cube")}).ok());
  EXPECT_THAT(std::string(CheckPair(PlacementOf("b"), PlacementOf("cube")).status().message()),
              HasSubstr("is a body; this call requires a hull"));
}

TEST_F(BodyQueries, APieceUsesTheCurrentVersionOfItsHull) {
  PutPair("pair");
  EXPECT_EQ(CheckPair(PlacementOf("pair"), PlacementOf("cube", 2.5, 0, 0))->relation(),
            v1::RELATION_SEPARATED);
  Put("other", Cube());
  ::hulld::server::Appender appender(*hulls_, "cube", "grow");
  ASSERT_TRUE(appender.Append(1, {3, 0.5, 0.5}).has_value());
  ASSERT_TRUE(appender.Finish().ok());
  const auto grown = CheckPair(PlacementOf("pair"), PlacementOf("other", 2.5, 0, 0));
  EXPECT_EQ(grown->relation(), v1::RELATION_OVERLAPPING);
  EXPECT_EQ(grown->piece_a().index(), 0u);
}

TEST_F(BodyQueries, BatchesAcceptHullsAndBodies) {
  PutPair("pair");
  ASSERT_TRUE(PutBody("broken", {PlacementOf("nothing")}).ok());
  v1::BatchCheckCollisionsRequest request;
  *request.add_placements() = PlacementOf("pair");
  *request.add_placements() = PlacementOf("cube", 5.5, 0, 0);
  *request.add_placements() = PlacementOf("pair", 0, 0, 1);
  *request.add_placements() = PlacementOf("broken");
  *request.add_placements() = PlacementOf("cube", 40, 0, 0);
  for (const uint32_t i : {0, 1, 1, 0, 0, 2, 0, 3, 0, 4, 1, 4}) request.add_pairs(i);
  const auto answer = Batch(request);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_THAT(
      answer->columns().relations(),
      ElementsAre(v1::RELATION_OVERLAPPING, v1::RELATION_OVERLAPPING, v1::RELATION_TOUCHING,
                  v1::RELATION_UNSPECIFIED, v1::RELATION_SEPARATED, v1::RELATION_SEPARATED));
  ASSERT_EQ(answer->columns().pieces_size(), 12);
  const auto& pieces = answer->columns().pieces();
  EXPECT_EQ(pieces[0], 1);
  EXPECT_EQ(pieces[1], -1);
  EXPECT_EQ(pieces[2], -1);
  EXPECT_EQ(pieces[3], 1);
  EXPECT_EQ(pieces[4], pieces[5]);
  for (int i = 6; i < 12; ++i) EXPECT_EQ(pieces[i], -1);
  ASSERT_EQ(answer->placement_problems_size(), 1);
  EXPECT_EQ(answer->placement_problems(0).placement(), 3u);
  EXPECT_EQ(answer->placement_problems(0).reason(), v1::ERROR_REASON_PIECE_NOT_FOUND);
  EXPECT_EQ(answer->hulls(0).hull_id(), "pair");
  // Packed, with the separation.
  v1::BatchCheckCollisionsRequest packed;
  packed.mutable_packed_placements()->add_hull_ids("pair");
  for (const double x : {0.0, 2.5}) {
    packed.mutable_packed_placements()->add_hulls(0);
    for (const double number : {1.0, 0.0, 0.0, 0.0, x, 0.0, 0.0}) {
      packed.mutable_packed_placements()->add_poses(number);
    }
  }
  packed.add_pairs(0);
  packed.add_pairs(1);
  packed.mutable_wanted()->set_separation(true);
  const auto apart = Batch(packed);
  ASSERT_TRUE(apart.ok()) << apart.status();
  EXPECT_NEAR(apart->columns().separations(0), 1.5, 1e-10);
  EXPECT_GE(apart->columns().pieces(0), 0);
  // Options for hulls alone are a problem of the pair.
  packed.clear_wanted();
  packed.set_method(v1::METHOD_TEXTBOOK_SAT);
  EXPECT_THAT(Batch(packed)->columns().pair_problems(0).message(),
              HasSubstr("METHOD_TEXTBOOK_SAT applies to pairs of hulls, not of bodies"));
}

TEST_F(BodyQueries, WithoutBodiesThePiecesColumnIsAbsent) {
  Put("cube", Cube());
  v1::BatchCheckCollisionsRequest request;
  *request.add_placements() = PlacementOf("cube");
  request.add_pairs(0);
  request.add_pairs(0);
  EXPECT_EQ(Batch(request)->columns().pieces_size(), 0);
}

TEST_F(BodyQueries, ScenesAcceptHullsAndBodies) {
  PutPair("pair");
  v1::FindCollisionsRequest request;
  *request.add_placements() = PlacementOf("pair");
  *request.add_placements() = PlacementOf("cube", 5.5, 0, 0);
  *request.add_placements() = PlacementOf("cube", 2.5, 0, 0);
  v1::Placement turned = PlacementOf("pair", 0.5, 5.5, 0);
  turned.mutable_pose()->mutable_rotation()->set_w(1);
  turned.mutable_pose()->mutable_rotation()->set_z(-1);
  *request.add_placements() = turned;
  v1::FindCollisionsResponse all;
  const absl::Status status =
      MakeClient().FindCollisions(request, [&](const v1::FindCollisionsResponse& part) {
        all.MergeFrom(part);
        return absl::OkStatus();
      });
  ASSERT_TRUE(status.ok()) << status;
  // The rotated body's second piece reaches down into the first cube.
  EXPECT_THAT(all.pairs(), ElementsAre(0, 1, 0, 3));
  EXPECT_THAT(all.columns().pieces(), ElementsAre(1, -1, 0, 1));
  EXPECT_EQ(all.totals().overlapping(), 2u);
  EXPECT_EQ(all.totals().pairs(), 6u);
}

TEST_F(BodyQueries, StreamsMoveAndRefreshBodies) {
  PutPair("pair");
  Put("probe", Cube());
  v1::CollisionStreamOpen open;
  *open.add_placements() = PlacementOf("pair");
  *open.add_placements() = PlacementOf("probe", 2.5, 0, 0);
  open.add_pairs(0);
  open.add_pairs(1);
  const auto stream = MakeClient().OpenCollisionStream();
  std::vector<v1::Relation> relations;
  std::vector<int32_t> pieces;
  const auto take = [&](const absl::StatusOr<v1::StreamCollisionsResponse>& answer) {
    ASSERT_TRUE(answer.ok()) << answer.status();
    for (const int relation : answer->columns().relations()) {
      relations.push_back(static_cast<v1::Relation>(relation));
    }
    pieces.insert(pieces.end(), answer->columns().pieces().begin(),
                  answer->columns().pieces().end());
  };
  take(stream->Open(open));
  v1::CollisionStreamUpdate update;
  update.add_placements(0);
  for (const double number : {1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0}) update.add_poses(number);
  take(stream->Update(update));
  EXPECT_THAT(relations, ElementsAre(v1::RELATION_SEPARATED, v1::RELATION_OVERLAPPING));
  EXPECT_THAT(pieces, ElementsAre(-1, -1, 0, -1));
  // Puts the body again, then deletes one of its hulls; a refresh shows each change.
  ASSERT_TRUE(PutBody("pair", {PlacementOf("cube", 30, 0, 0)}).ok());
  v1::CollisionStreamUpdate refresh;
  refresh.set_refresh_hulls(true);
  take(stream->Update(refresh));
  EXPECT_EQ(relations.back(), v1::RELATION_SEPARATED);
  ASSERT_EQ(relations.size(), 3u);
  ASSERT_TRUE(Delete("cube").ok());
  take(stream->Update(refresh));
  ASSERT_EQ(relations.size(), 4u);
  EXPECT_EQ(relations.back(), v1::RELATION_UNSPECIFIED);
  EXPECT_TRUE(stream->Close().ok());
}

TEST_F(BodyQueries, ALongQueryEndsAtItsDeadline) {
  Put("sphere", Sphere(2000));
  std::vector<v1::Placement> pieces;
  for (int i = 0; i < 3000; ++i) {
    pieces.push_back(PlacementOf("sphere", 1e-4 * i, 1e-4 * (i % 7), 0));
  }
  ASSERT_TRUE(PutBody("heap", pieces).ok());
  v1::CheckCollisionRequest request;
  *request.mutable_a() = PlacementOf("heap");
  *request.mutable_b() = PlacementOf("heap", 0.1, 0.1, 0.1);
  request.mutable_wanted()->set_separation(true);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(500));
  v1::CheckCollisionResponse response;
  EXPECT_EQ(collisions_->CheckCollision(&context, request, &response).error_code(),
            grpc::StatusCode::DEADLINE_EXCEEDED);
  // Its work ends, too: otherwise this would wait for it.
  TearDown();
}

}  // namespace body_queries_test
}  // namespace hulld::server
