// Packed placements are equivalent to a list of placements, in every call that accepts them.

#include "client/packed_placements.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace packed_placements_test {

using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using Placements = google::protobuf::RepeatedPtrField<v1::Placement>;

class Packed : public ServerTest {
 protected:
  // Existing hulls, a missing one, and an invalid ID.
  Placements SomePlacements() {
    Put("cube", Cube());
    Put("ball", Sphere(40));
    std::mt19937 random(17);
    std::uniform_real_distribution<double> number(-2, 2);
    Placements placements;
    for (int i = 0; i < 40; ++i) {
      v1::Placement* const placement = placements.Add();
      const char* const ids[] = {"cube", "ball", "cube", "lost", "ball", "a//b"};
      placement->set_hull_id(ids[i % 6]);
      v1::Quaternion* const q = placement->mutable_pose()->mutable_rotation();
      q->set_w(number(random));
      q->set_x(number(random));
      q->set_y(number(random));
      q->set_z(number(random));
      v1::Vector3* const t = placement->mutable_pose()->mutable_translation();
      t->set_x(number(random));
      t->set_y(number(random));
      t->set_z(number(random));
      placement->set_radius(i % 3 == 0 ? 0.25 : 0);
    }
    placements.Mutable(0)->mutable_pose()->clear_rotation();
    placements.Mutable(4)->clear_pose();
    // A zero quaternion.
    placements.Mutable(1)->mutable_pose()->mutable_rotation()->Clear();
    placements.Mutable(7)->set_radius(-1);
    return placements;
  }

  std::vector<v1::BatchCheckCollisionsResponse> Batch(
      const v1::BatchCheckCollisionsRequest& request, grpc::Status* status) {
    grpc::ClientContext context;
    const auto stream = collisions_->BatchCheckCollisions(&context, request);
    std::vector<v1::BatchCheckCollisionsResponse> parts;
    for (v1::BatchCheckCollisionsResponse part; stream->Read(&part);) parts.push_back(part);
    *status = stream->Finish();
    return parts;
  }
  std::string BatchError(const v1::BatchCheckCollisionsRequest& request) {
    grpc::Status status;
    EXPECT_TRUE(Batch(request, &status).empty());
    return status.error_message();
  }

  static std::vector<int> Relations(const std::vector<v1::BatchCheckCollisionsResponse>& parts) {
    std::vector<int> relations;
    for (const v1::BatchCheckCollisionsResponse& part : parts) {
      relations.insert(relations.end(), part.columns().relations().begin(),
                       part.columns().relations().end());
    }
    return relations;
  }

  // Returns the problems without their wording.
  template <typename Problems>
  static std::vector<std::pair<uint32_t, int>> Causes(const Problems& problems) {
    std::vector<std::pair<uint32_t, int>> causes;
    for (const v1::PlacementProblem& problem : problems) {
      causes.emplace_back(problem.placement(), problem.code());
    }
    return causes;
  }
};

TEST_F(Packed, BatchesReturnTheSameAnswers) {
  v1::BatchCheckCollisionsRequest request;
  *request.mutable_placements() = SomePlacements();
  for (uint32_t a = 0; a < 40; ++a) {
    for (uint32_t b = 0; b < a; ++b) {
      request.add_pairs(a);
      request.add_pairs(b);
    }
  }
  v1::BatchCheckCollisionsRequest packed = request;
  *packed.mutable_packed_placements() = PackPlacements(request.placements());
  packed.clear_placements();
  grpc::Status status;
  std::vector<v1::BatchCheckCollisionsResponse> expected = Batch(request, &status);
  ASSERT_TRUE(status.ok()) << status.error_message();
  std::vector<v1::BatchCheckCollisionsResponse> answer = Batch(packed, &status);
  ASSERT_TRUE(status.ok()) << status.error_message();

  ASSERT_EQ(answer.front().hulls_size(), 4);
  EXPECT_EQ(answer.front().hulls(0).SerializeAsString(),
            expected.front().hulls(0).SerializeAsString());
  EXPECT_EQ(answer.front().hulls(1).hull_id(), "ball");
  for (const int none : {2, 3}) EXPECT_EQ(answer.front().hulls(none).hull_id(), "");
  EXPECT_EQ(Causes(answer.front().placement_problems()),
            Causes(expected.front().placement_problems()));
  const v1::PlacementProblem& zeros = answer.front().placement_problems(0);
  EXPECT_EQ(zeros.placement(), 1);
  EXPECT_THAT(zeros.message(), HasSubstr("packed_placements.poses[1].rotation"));
  EXPECT_THAT(answer.front().placement_problems(2).message(),
              HasSubstr("packed_placements.hull_ids[3]"));
  EXPECT_EQ(answer.front().placement_problems(3).message(),
            "packed_placements.radii[7] is -1; it must be a finite length of at least 0");
  EXPECT_EQ(Relations(answer), Relations(expected));
  EXPECT_THAT(Relations(answer), IsSupersetOf({v1::RELATION_UNSPECIFIED, v1::RELATION_SEPARATED,
                                               v1::RELATION_OVERLAPPING}));
}

TEST_F(Packed, ScenesReturnTheSameAnswers) {
  v1::FindCollisionsRequest request;
  *request.mutable_placements() = SomePlacements();
  v1::FindCollisionsRequest packed;
  *packed.mutable_packed_placements() = PackPlacements(request.placements());
  for (uint32_t i = 0; i < 40; ++i) {
    request.add_groups(i % 3);
    packed.add_groups(i % 3);
  }
  request.set_ignore_same_group(true);
  packed.set_ignore_same_group(true);
  const auto pairs_of = [&](const v1::FindCollisionsRequest& scene) {
    grpc::ClientContext context;
    const auto stream = collisions_->FindCollisions(&context, scene);
    std::vector<uint32_t> pairs;
    for (v1::FindCollisionsResponse part; stream->Read(&part);) {
      pairs.insert(pairs.end(), part.pairs().begin(), part.pairs().end());
    }
    EXPECT_TRUE(stream->Finish().ok());
    return pairs;
  };
  const std::vector<uint32_t> expected = pairs_of(request);
  EXPECT_GT(expected.size(), 20);
  EXPECT_EQ(pairs_of(packed), expected);
}

TEST_F(Packed, StreamsReturnTheSameAnswers) {
  v1::StreamCollisionsRequest request;
  v1::CollisionStreamOpen* const open = request.mutable_open();
  *open->mutable_placements() = SomePlacements();
  for (uint32_t i = 0; i + 1 < 40; ++i) {
    open->add_pairs(i);
    open->add_pairs(i + 1);
  }
  v1::StreamCollisionsRequest packed = request;
  *packed.mutable_open()->mutable_packed_placements() = PackPlacements(open->placements());
  packed.mutable_open()->clear_placements();
  // The placement with the zero quaternion gets a pose.
  v1::StreamCollisionsRequest update;
  update.mutable_update()->add_placements(1);
  for (const double number : {1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}) {
    update.mutable_update()->add_poses(number);
  }
  const auto answers_of = [&](const v1::StreamCollisionsRequest& first) {
    grpc::ClientContext context;
    const auto stream = collisions_->StreamCollisions(&context);
    EXPECT_TRUE(stream->Write(first));
    EXPECT_TRUE(stream->Write(update));
    stream->WritesDone();
    std::string answers;
    for (v1::StreamCollisionsResponse part; stream->Read(&part);) {
      answers += part.columns().SerializeAsString();
    }
    EXPECT_TRUE(stream->Finish().ok());
    return answers;
  };
  EXPECT_EQ(answers_of(packed), answers_of(request));
}

TEST_F(Packed, ErrorsNameTheList) {
  Put("cube", Cube());
  v1::BatchCheckCollisionsRequest request;
  v1::PackedPlacements* const packed = request.mutable_packed_placements();
  packed->add_hull_ids("cube");
  packed->add_hulls(0);
  EXPECT_THAT(BatchError(request),
              HasSubstr("packed_placements.poses has 0 numbers for 1 placements"));
  for (int i = 0; i < 8; ++i) packed->add_poses(1);
  EXPECT_THAT(BatchError(request), HasSubstr("poses has 8 numbers for 1 placements"));
  packed->mutable_poses()->RemoveLast();
  packed->set_hulls(0, 1);
  EXPECT_THAT(BatchError(request),
              HasSubstr("packed_placements.hulls[0] is 1, but packed_placements.hull_ids has 1"));
  packed->set_hulls(0, 0);
  packed->add_radii(1);
  packed->add_radii(1);
  EXPECT_THAT(BatchError(request),
              HasSubstr("packed_placements.radii has 2 numbers for 1 placements"));
  packed->clear_radii();
  *request.add_placements() = PlacementOf("cube");
  EXPECT_THAT(BatchError(request), HasSubstr("both set"));
  request.clear_placements();
  request.add_pairs(0);
  request.add_pairs(1);
  EXPECT_THAT(BatchError(request), HasSubstr("pairs[1] is 1, but there is 1 placement"));
}

TEST_F(Packed, HullsAndPlacementsAreLimited) {
  Config config = TestConfig();
  config.limits.max_placements = 3;
  Restart(config);
  Put("cube", Cube());
  v1::BatchCheckCollisionsRequest request;
  v1::PackedPlacements* const packed = request.mutable_packed_placements();
  packed->add_hull_ids("cube");
  for (int i = 0; i < 4; ++i) {
    packed->add_hulls(0);
    for (int k = 0; k < 7; ++k) packed->add_poses(1);
  }
  EXPECT_THAT(BatchError(request), HasSubstr("4 placements; the limit is 3 (--max-placements)"));
  packed->clear_hulls();
  packed->clear_poses();
  for (int i = 0; i < 3; ++i) packed->add_hull_ids("cube");
  EXPECT_THAT(BatchError(request), HasSubstr("4 hull_ids; the limit is 3 (--max-placements)"));
}

}  // namespace packed_placements_test
}  // namespace hulld::server
