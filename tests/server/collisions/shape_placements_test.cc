// Placements that carry points instead of naming a hull.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "client/calls/grpc_status.h"
#include "client/client.h"
#include "client/packed_placements.h"
#include "tests/server/collisions/watch_round.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace shape_placements_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

v1::Placement Shape(const Coordinates& xyz) {
  v1::Placement placement;
  placement.mutable_points()->mutable_xyz()->Assign(xyz.begin(), xyz.end());
  return placement;
}

v1::Placement At(v1::Placement placement, const v1::Pose& pose) {
  *placement.mutable_pose() = pose;
  return placement;
}

v1::Placement AtX(v1::Placement placement, double x) {
  placement.mutable_pose()->mutable_translation()->set_x(x);
  return placement;
}

v1::Wanted Everything() {
  v1::Wanted wanted;
  wanted.set_axis(true);
  wanted.set_certificate(true);
  wanted.set_separation(true);
  wanted.set_witness(true);
  wanted.set_clearance(0.25);
  return wanted;
}

// Points of hulls of each dimension; with duplicates, inside points, and both zeros.
std::vector<Coordinates> Shapes() {
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  Coordinates cloud = {-0.0, 0, 0, 0, -0.0, 0, 1, 1, 1, 1, 1, 1};
  for (int i = 0; i < 3 * 4000; ++i) cloud.push_back(coordinate(random));
  return {{0.5, 0, 0},
          {0, 0, 0, 1, 1, 0, 0.5, 0.5, 0},
          {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.25, 0.25, 0},
          Cube(),
          Sphere(200),
          cloud};
}

std::vector<v1::Pose> Poses(int count) {
  std::mt19937_64 random(32);
  std::uniform_real_distribution<double> number(-1.5, 1.5);
  std::vector<v1::Pose> poses(1);
  for (int i = 1; i < count; ++i) {
    v1::Pose& pose = poses.emplace_back();
    v1::Quaternion& q = *pose.mutable_rotation();
    q.set_w(number(random));
    q.set_x(number(random));
    q.set_y(number(random));
    q.set_z(number(random));
    pose.mutable_translation()->set_x(number(random));
    pose.mutable_translation()->set_z(number(random));
  }
  return poses;
}

class InlineShapes : public ServerTest {
 protected:
  // Reports a refusal without another attempt.
  Client client() const {
    ClientOptions options;
    options.retry.max_attempts = 1;
    return Client(options, channel_);
  }

  static v1::CheckCollisionRequest Pair(const v1::Placement& a, const v1::Placement& b,
                                        const v1::Wanted& wanted = {}) {
    v1::CheckCollisionRequest request;
    *request.mutable_a() = a;
    *request.mutable_b() = b;
    *request.mutable_wanted() = wanted;
    return request;
  }

  // Returns the answer without the versions of hulls.
  std::string AnswerText(const v1::CheckCollisionRequest& request) {
    v1::CheckCollisionResponse response = Check(request);
    response.clear_header();
    response.clear_hull_a();
    response.clear_hull_b();
    return response.DebugString();
  }

  void ExpectRefused(const v1::CheckCollisionRequest& request, const std::string& message) {
    const grpc::Status status = CheckError(request);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), HasSubstr(message));
  }

  v1::BatchCheckCollisionsResponse Batch(const v1::BatchCheckCollisionsRequest& request) const {
    v1::BatchCheckCollisionsResponse all;
    const absl::Status status =
        client().BatchCheckCollisions(request, [&](const v1::BatchCheckCollisionsResponse& part) {
          all.MergeFrom(part);
          return absl::OkStatus();
        });
    EXPECT_TRUE(status.ok()) << status;
    return all;
  }

  absl::StatusOr<v1::FindCollisionsResponse> Find(const v1::FindCollisionsRequest& request) const {
    v1::FindCollisionsResponse all;
    const absl::Status status =
        client().FindCollisions(request, [&](const v1::FindCollisionsResponse& part) {
          all.MergeFrom(part);
          return absl::OkStatus();
        });
    if (!status.ok()) return status;
    return all;
  }

  // Each shape twice: as registered hulls, and as inline shapes at the same poses.
  std::array<v1::FindCollisionsRequest, 2> Scenes() {
    const std::vector<v1::Pose> poses = Poses(12);
    std::array<v1::FindCollisionsRequest, 2> scenes;
    size_t i = 0;
    for (int copy = 0; copy < 2; ++copy) {
      for (const Coordinates& xyz : Shapes()) {
        const std::string id = absl::StrCat("hull", i % Shapes().size());
        if (copy == 0) Put(id, xyz);
        *scenes[0].add_placements() = At(PlacementOf(id), poses[i]);
        *scenes[1].add_placements() = At(Shape(xyz), poses[i]);
        ++i;
      }
    }
    return scenes;
  }
};

TEST_F(InlineShapes, AreAnsweredLikeRegisteredHulls) {
  const std::vector<Coordinates> shapes = Shapes();
  for (size_t i = 0; i < shapes.size(); ++i) Put(absl::StrCat("hull", i), shapes[i]);
  for (size_t i = 0; i < shapes.size(); ++i) {
    for (size_t k = 0; k < shapes.size(); ++k) {
      for (const v1::Pose& pose : Poses(4)) {
        const v1::Placement a = PlacementOf(absl::StrCat("hull", i));
        const v1::Placement b = At(PlacementOf(absl::StrCat("hull", k)), pose);
        const v1::Placement shape_a = Shape(shapes[i]);
        const v1::Placement shape_b = At(Shape(shapes[k]), pose);
        const std::string expected = AnswerText(Pair(a, b, Everything()));
        EXPECT_EQ(AnswerText(Pair(shape_a, b, Everything())), expected);
        EXPECT_EQ(AnswerText(Pair(a, shape_b, Everything())), expected);
        EXPECT_EQ(AnswerText(Pair(shape_a, shape_b, Everything())), expected);
        EXPECT_EQ(Check(Pair(shape_a, shape_b)).relation(), Check(Pair(a, b)).relation());
      }
    }
  }
}

TEST_F(InlineShapes, TextbookAcceptsThem) {
  Put("cube", Cube());
  v1::CheckCollisionRequest registered = Pair(PlacementOf("cube"), PlacementOf("cube", 1));
  v1::CheckCollisionRequest request = Pair(Shape(Cube()), AtX(Shape(Cube()), 1));
  for (v1::CheckCollisionRequest* each : {&registered, &request}) {
    each->set_method(v1::METHOD_TEXTBOOK_SAT);
    each->mutable_wanted()->set_axis(true);
  }
  EXPECT_EQ(AnswerText(request), AnswerText(registered));
}

TEST_F(InlineShapes, MayHaveSinglePrecision) {
  v1::Placement a;
  for (const float x : {0.1f, 0.f, 0.f}) a.mutable_points()->add_xyz_float(x);
  const v1::Placement b = Shape({double{0.1f}, 0, 0});
  EXPECT_EQ(Check(Pair(a, b)).relation(), v1::RELATION_TOUCHING);
  EXPECT_EQ(Check(Pair(a, Shape({0.1, 0, 0}))).relation(), v1::RELATION_SEPARATED);
}

TEST_F(InlineShapes, AreNotStoredAndHaveNoVersion) {
  Put("cube", Cube());
  const v1::CheckCollisionResponse response = Check(Pair(PlacementOf("cube"), Shape({0, 0, 0})));
  EXPECT_EQ(response.relation(), v1::RELATION_TOUCHING);
  EXPECT_EQ(response.hull_a().hull_id(), "cube");
  EXPECT_EQ(response.hull_b().ByteSizeLong(), 0u);
  EXPECT_EQ(response.header().revision(), Get("cube").header().revision());
  const auto listed = client().ListAllHulls("");
  ASSERT_TRUE(listed.ok());
  EXPECT_EQ(listed->hulls_size(), 1);
}

TEST_F(InlineShapes, MeetBodies) {
  Put("cube", Cube());
  Put("other", Cube());
  v1::PutBodyRequest body;
  body.set_body_id("row");
  for (const double x : {0.0, 4.0}) *body.add_pieces() = PlacementOf("cube", x);
  ASSERT_TRUE(client().PutBody(body).ok());
  for (const double x : {2.5, 3.0, 3.5, 9.0}) {
    v1::CheckCollisionResponse expected =
        Check(Pair(PlacementOf("row"), PlacementOf("other", x), Everything()));
    v1::CheckCollisionResponse response =
        Check(Pair(PlacementOf("row"), AtX(Shape(Cube()), x), Everything()));
    EXPECT_EQ(response.hull_a().hull_id(), "row");
    EXPECT_EQ(expected.piece_hulls_size(), 2);
    ASSERT_EQ(response.piece_hulls_size(), 1);
    EXPECT_EQ(response.piece_hulls(0).hull_id(), "cube");
    for (v1::CheckCollisionResponse* each : {&expected, &response}) {
      each->clear_header();
      each->clear_hull_b();
      each->clear_piece_hulls();
    }
    EXPECT_EQ(response.DebugString(), expected.DebugString());
  }
  *body.add_pieces() = Shape(Cube());
  const absl::Status refused = client().PutBody(body).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("pieces[2].points is set"));
}

TEST_F(InlineShapes, BatchesAnswerThemLikeRegisteredHulls) {
  const auto scenes = Scenes();
  std::vector<v1::BatchCheckCollisionsRequest> requests(3);
  *requests[0].mutable_placements() = scenes[0].placements();
  *requests[1].mutable_placements() = scenes[1].placements();
  *requests[2].mutable_packed_placements() = PackPlacements(scenes[1].placements());
  EXPECT_EQ(requests[2].packed_placements().shape_sizes_size(), 6);
  std::vector<std::string> answers;
  for (v1::BatchCheckCollisionsRequest& request : requests) {
    *request.mutable_wanted() = Everything();
    for (uint32_t a = 0; a < 12; ++a) {
      for (uint32_t b = 0; b < 12; ++b) {
        request.add_pairs(a);
        request.add_pairs(b);
      }
    }
    const v1::BatchCheckCollisionsResponse response = Batch(request);
    EXPECT_EQ(response.columns().relations_size(), 144);
    EXPECT_THAT(response.placement_problems(), IsEmpty());
    answers.push_back(response.columns().DebugString());
  }
  EXPECT_EQ(answers[1], answers[0]);
  EXPECT_EQ(answers[2], answers[0]);
}

TEST_F(InlineShapes, ScenesAnswerThemLikeRegisteredHulls) {
  std::array<v1::FindCollisionsRequest, 2> scenes = Scenes();
  std::vector<std::string> answers;
  for (v1::FindCollisionsRequest& scene : scenes) {
    *scene.mutable_wanted() = Everything();
    auto response = Find(scene);
    ASSERT_TRUE(response.ok()) << response.status();
    EXPECT_GT(response->pairs_size(), 40);
    response->clear_header();
    response->clear_hulls();
    answers.push_back(response->DebugString());
  }
  EXPECT_EQ(answers[1], answers[0]);
}

TEST_F(InlineShapes, StreamsKeepThemUntilTheirEnd) {
  const auto scenes = Scenes();
  std::vector<std::string> answers;
  for (const v1::FindCollisionsRequest& scene : scenes) {
    v1::CollisionStreamOpen open;
    *open.mutable_placements() = scene.placements();
    *open.mutable_wanted() = Everything();
    for (uint32_t a = 0; a < 12; ++a) {
      open.add_pairs(a);
      open.add_pairs((a + 5) % 12);
    }
    const auto stream = client().OpenCollisionStream();
    const auto opened = stream->Open(open);
    ASSERT_TRUE(opened.ok()) << opened.status();
    std::string answer = opened->columns().DebugString();
    for (const bool refreshes : {false, true, false}) {
      v1::CollisionStreamUpdate update;
      update.add_placements(4);
      for (const double number : {1.0, 0.5, 0.0, 0.0, 0.25, 0.0, 0.125}) update.add_poses(number);
      update.set_refresh_hulls(refreshes);
      const auto updated = stream->Update(update);
      ASSERT_TRUE(updated.ok()) << updated.status();
      absl::StrAppend(&answer, updated->columns().DebugString());
    }
    answers.push_back(answer);
  }
  EXPECT_EQ(answers[1], answers[0]);
}

TEST_F(InlineShapes, WatchesFollowTheOtherHulls) {
  Put("cube", Cube());
  v1::CollisionWatchOpen open;
  *open.add_placements() = AtX(Shape(Cube()), 5);
  *open.add_placements() = PlacementOf("cube");
  const auto watch = client().WatchCollisions(open);
  v1::WatchCollisionsResponse first = ReadRound(*watch);
  EXPECT_THAT(first.events(), IsEmpty());
  ASSERT_EQ(first.hulls_size(), 1);
  EXPECT_EQ(first.hulls(0).hull_id(), "cube");
  Appender appender(*hulls_, "cube", "grows");
  ASSERT_TRUE(appender.Append(1, {5.5, 0.5, 0.5}).has_value());
  v1::WatchCollisionsResponse second = ReadRound(*watch);
  ASSERT_EQ(second.events_size(), 1);
  EXPECT_EQ(second.events(0).kind(), v1::COLLISION_EVENT_KIND_ENTER);
  EXPECT_EQ(second.events(0).revision_a(), 0u);
  EXPECT_EQ(second.events(0).revision_b(), second.hulls(0).revision());
}

TEST_F(InlineShapes, MalformedOnesAreRefusedByName) {
  const v1::Placement good = Shape(Cube());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  ExpectRefused(Pair(Shape({0, 0, 0, 1, nan, 1}), good), "a.points[1].y is NaN");
  ExpectRefused(Pair(good, Shape({0, 0, infinity})), "b.points[0].z is infinite");
  ExpectRefused(Pair(good, Shape({})), "b.points is empty; give 1 to 4096");
  ExpectRefused(Pair(Shape({1, 2}), good), "a.points.xyz has 2 numbers; each point needs three");
  ExpectRefused(Pair(Shape(Coordinates(3 * 4097)), good), "a.points has 4097 points");
  EXPECT_EQ(Check(Pair(Shape(Coordinates(3 * 4096)), good)).relation(), v1::RELATION_TOUCHING);
  v1::Placement both = good;
  both.set_hull_id("cube");
  ExpectRefused(Pair(both, good), "a.hull_id and points are both set");
  both = good;
  both.mutable_points()->add_xyz_float(0);
  ExpectRefused(Pair(good, both), "b.points has both xyz and xyz_float");
  ExpectRefused(Pair(good, v1::Placement()), "b.hull_id is empty");
  v1::Placement still = good;
  still.mutable_pose()->mutable_rotation();
  ExpectRefused(Pair(still, good), "a.pose.rotation");
}

TEST_F(InlineShapes, MalformedOnesAreProblemsOfTheirPlacements) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Put("cube", Cube());
  v1::BatchCheckCollisionsRequest request;
  *request.add_placements() = Shape(Cube());
  *request.add_placements() = Shape({0, 0, nan});
  *request.add_placements() = PlacementOf("cube");
  *request.add_placements() = Shape({});
  *request.add_placements() = Shape({0.5, 0.5, 0.5});
  for (const uint32_t i : {0, 1, 0, 2, 3, 2, 2, 4}) request.add_pairs(i);
  v1::BatchCheckCollisionsRequest packed = request;
  *packed.mutable_packed_placements() = PackPlacements(request.placements());
  packed.clear_placements();
  const v1::BatchCheckCollisionsResponse response = Batch(request);
  ASSERT_EQ(response.hulls_size(), 5);
  EXPECT_EQ(response.hulls(2).hull_id(), "cube");
  EXPECT_EQ(response.hulls(0).ByteSizeLong() + response.hulls(4).ByteSizeLong(), 0u);
  for (const auto& [answer, of_1, of_3] :
       {std::tuple(response, "placements[1].points[0].z is NaN", "placements[3].points is empty"),
        std::tuple(Batch(packed), "packed_placements: shape 1: points[0].z is NaN",
                   "packed_placements: shape 2: points is empty")}) {
    EXPECT_THAT(answer.columns().relations(),
                ElementsAre(v1::RELATION_UNSPECIFIED, v1::RELATION_OVERLAPPING,
                            v1::RELATION_UNSPECIFIED, v1::RELATION_OVERLAPPING));
    ASSERT_EQ(answer.placement_problems_size(), 2);
    const v1::PlacementProblem& first = answer.placement_problems(0);
    EXPECT_EQ(first.placement(), 1u);
    EXPECT_EQ(first.code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(first.message(), HasSubstr(of_1));
    EXPECT_EQ(answer.placement_problems(1).placement(), 3u);
    EXPECT_THAT(answer.placement_problems(1).message(), HasSubstr(of_3));
  }
}

TEST_F(InlineShapes, PackedListsMustMatch) {
  v1::FindCollisionsRequest request;
  v1::PackedPlacements& packed = *request.mutable_packed_placements();
  for (const double number : {1, 0, 0, 0, 0, 0, 0}) packed.add_poses(number);
  packed.add_hulls(0);
  packed.add_shape_sizes(2);
  for (const double number : {1, 0, 0}) packed.mutable_shape_points()->add_xyz(number);
  const auto refusal = [&] {
    const absl::Status status = Find(request).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
    return std::string(status.message());
  };
  EXPECT_THAT(refusal(), HasSubstr("packed_placements.shape_sizes add up to 2 points, but "
                                   "shape_points has 1"));
  packed.set_shape_sizes(0, 1);
  EXPECT_TRUE(Find(request).ok());
  packed.set_hulls(0, 1);
  EXPECT_THAT(refusal(),
              HasSubstr("packed_placements.hulls[0] is 1, but packed_placements.hull_ids "
                        "has 0 and shape_sizes 1"));
  packed.set_hulls(0, 0);
  packed.mutable_shape_points()->add_xyz(0);
  EXPECT_THAT(refusal(), HasSubstr("packed_placements.shape_points.xyz has 4 numbers"));
}

TEST_F(InlineShapes, CountAsRequestMemory) {
  Config config = TestConfig();
  config.limits.request_memory = 1 << 20;
  Restart(config);
  EXPECT_EQ(Check(Pair(Shape(Sphere(4000)), Shape(Sphere(4000)))).relation(),
            v1::RELATION_OVERLAPPING);
  v1::FindCollisionsRequest scene;
  for (int i = 0; i < 12; ++i) *scene.add_placements() = Shape(Sphere(4000));
  const absl::Status refused = Find(scene).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("--request-memory"));
}

// A hull of 4000 vertices takes about a MiB.
TEST_F(InlineShapes, TheirHullsCountAgainstTheMemoryLimit) {
  Config config = TestConfig();
  config.limits.memory_limit = 16 << 20;
  Restart(config);
  v1::FindCollisionsRequest scene;
  for (int i = 0; i < 40; ++i) *scene.add_placements() = AtX(Shape(Sphere(4000)), 3 * i);
  // 4 MiB of points.
  const absl::Status refused = Find(scene).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("--memory-limit"));
  // Placements of one packed shape share its hull.
  v1::FindCollisionsRequest shared;
  *shared.mutable_packed_placements() = PackPlacements(scene.placements());
  EXPECT_EQ(shared.packed_placements().shape_sizes_size(), 1);
  EXPECT_EQ(shared.packed_placements().hulls_size(), 40);
  const auto found = Find(shared);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ(found->totals().pairs(), 40u * 39 / 2);
}

}  // namespace shape_placements_test
}  // namespace hulld::server
