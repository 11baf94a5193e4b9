// Placements with an end pose.

#include "tests/server/collisions/moving_placements.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "client/packed_placements.h"

namespace hulld::server {
namespace moving_placements {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST_F(MovingPlacements, TranslationsMeetAtExactTimes) {
  Put("cube", Cube());
  const v1::Placement cube = PlacementOf("cube");
  ExpectMeets(cube, MovingTo(PlacementOf("cube", 3), -1), kOverlapping, 0.5);
  ExpectMeets(cube, MovingTo(PlacementOf("cube", 3), 1), kTouching, 1);
  ExpectMeets(cube, MovingTo(PlacementOf("cube", -3, 1), 1, 1), kTouching, 0.5);
  ExpectMeets(cube, MovingTo(PlacementOf("cube", 0.5), 9), kOverlapping, 0);
  ExpectMeets(MovingTo(PlacementOf("cube"), 2), MovingTo(PlacementOf("cube", 4), 0), kOverlapping,
              0.5);
  // A third of the time is not a double.
  ExpectMeets(cube, MovingTo(PlacementOf("cube", 2), -1), kOverlapping, std::nextafter(1.0 / 3, 1));
}

TEST_F(MovingPlacements, SeparatedMeansAtAllTimes) {
  Put("cube", Cube());
  const v1::Placement cube = PlacementOf("cube");
  const double beyond = std::nextafter(1.0, 2);
  for (const v1::Placement& b : {MovingTo(PlacementOf("cube", 3), beyond),
                                 MovingTo(PlacementOf("cube", -3, beyond), 3, beyond)}) {
    const v1::CheckCollisionResponse response = Proven(Pair(cube, b));
    EXPECT_EQ(response.relation(), kSeparated);
    EXPECT_EQ(response.first_contact().separated_until(), 1);
    EXPECT_FALSE(response.first_contact().has_contact_time());
    EXPECT_FALSE(response.first_contact().intervals().empty());
  }
}

TEST_F(MovingPlacements, RotationsMeetWithinTheRequestedBracket) {
  for (const double width : {0x1p-10, 0x1p-20, 0x1p-30}) {
    v1::CheckCollisionRequest request = Pair(Ceiling(), TurningRod());
    request.mutable_wanted()->set_max_time_error(width);
    // Its tip is at y = 4 at half time. Deeper, so that a contact can be proven.
    *request.mutable_a() = Shape({0, 3.5, -1, 6, 3.5, -1, 0, 3.5, 1, 6, 3.5, 1, 3, 5, 0});
    const v1::CheckCollisionResponse response = Proven(request);
    EXPECT_EQ(response.relation(), kOverlapping);
    const v1::FirstContact& contact = response.first_contact();
    EXPECT_LE(contact.contact_time() - contact.separated_until(), width);
    // 10 t / (1 + t^2) = 3.5
    const double exact = (10 - std::sqrt(51)) / 7;
    EXPECT_LE(contact.separated_until(), exact + 1e-15);
    EXPECT_GE(contact.contact_time(), exact - 1e-15);
  }
  v1::CheckCollisionRequest apart = Pair(Shape({0, 5.5, 0, 6, 5.5, 0}), TurningRod());
  EXPECT_EQ(Proven(apart).relation(), kSeparated);
}

TEST_F(MovingPlacements, RandomMotionsAreProven) {
  Put("cube", Cube());
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-2, 2);
  int counts[v1::Relation_ARRAYSIZE] = {};
  for (int i = 0; i < 40; ++i) {
    v1::Placement b = MovingTo(PlacementOf("cube", number(random), number(random), number(random)),
                               number(random), number(random), number(random));
    Turn(2, number(random), number(random), number(random), b.mutable_pose());
    Turn(2, number(random), number(random), number(random), b.mutable_end_pose());
    v1::Placement a = PlacementOf("cube", 2);
    if (i % 2 == 0) Turn(2, number(random), 0, number(random), a.mutable_end_pose());
    ++counts[Proven(Pair(a, b)).relation()];
  }
  EXPECT_GT(counts[kSeparated], 3);
  EXPECT_GT(counts[kOverlapping], 3);
}

TEST_F(MovingPlacements, ABatchAnswersLikeSingleCalls) {
  Put("cube", Cube());
  std::vector<v1::Placement> placements = {PlacementOf("cube"), PlacementOf("nothing"),
                                           TurningRod(), Ceiling()};
  for (int i = 0; i < 20; ++i) {
    placements.push_back(MovingTo(PlacementOf("cube", 3, i / 8.0), i % 5 - 1.5, i % 3));
  }
  std::vector<uint32_t> pairs = {0, 1, 2, 3};
  for (uint32_t i = 4; i < placements.size(); ++i) pairs.insert(pairs.end(), {0, i});
  v1::BatchCheckCollisionsRequest request = Batch(placements, pairs);
  request.mutable_wanted()->set_certificate(true);
  const auto batch = CheckBatch(request);
  ASSERT_TRUE(batch.ok()) << batch.status();
  const v1::AnswerColumns& columns = batch->columns();
  const int rows = static_cast<int>(pairs.size()) / 2;
  ASSERT_EQ(columns.relations_size(), rows);
  ASSERT_EQ(columns.separated_until_size(), rows);
  ASSERT_EQ(columns.contact_times_size(), rows);
  ASSERT_EQ(columns.certificates_size(), rows);
  EXPECT_EQ(columns.relations(0), v1::RELATION_UNSPECIFIED);
  EXPECT_TRUE(std::isnan(columns.separated_until(0)));
  EXPECT_TRUE(std::isnan(columns.contact_times(0)));
  int proof = 0;
  for (int i = 1; i < rows; ++i) {
    const v1::CheckCollisionResponse single =
        Proven(Pair(placements[pairs[2 * i]], placements[pairs[2 * i + 1]]));
    const v1::FirstContact& contact = single.first_contact();
    EXPECT_EQ(columns.relations(i), single.relation());
    EXPECT_EQ(columns.separated_until(i), contact.separated_until());
    EXPECT_EQ(std::isnan(columns.contact_times(i)), !contact.has_contact_time());
    if (contact.has_contact_time()) {
      EXPECT_EQ(columns.contact_times(i), contact.contact_time());
    }
    EXPECT_EQ(columns.certificates(i).ShortDebugString(), single.certificate().ShortDebugString());
    if (contact.intervals().empty()) continue;
    ASSERT_LT(proof, columns.motion_proofs_size());
    EXPECT_EQ(columns.motion_proofs(proof).row(), static_cast<uint64_t>(i));
    EXPECT_EQ(columns.motion_proofs(proof).intervals_size(), contact.intervals_size());
    ++proof;
  }
  EXPECT_EQ(proof, columns.motion_proofs_size());
}

TEST_F(MovingPlacements, PackedMotionsAreAnsweredLikeListedOnes) {
  Put("cube", Cube());
  const std::vector<v1::Placement> placements = {PlacementOf("cube"),
                                                 MovingTo(PlacementOf("cube", 3), -1)};
  v1::BatchCheckCollisionsRequest packed = Batch({}, {0, 1});
  v1::PackedPlacements& list = *packed.mutable_packed_placements();
  list = PackPlacements(Batch(placements, {}).placements());
  const auto listed = CheckBatch(Batch(placements, {0, 1}));
  const auto answer = CheckBatch(packed);
  ASSERT_TRUE(listed.ok() && answer.ok()) << listed.status() << answer.status();
  EXPECT_THAT(answer->columns().contact_times(), ElementsAre(0.5));
  EXPECT_EQ(answer->columns().ShortDebugString(), listed->columns().ShortDebugString());

  list.mutable_end_poses()->RemoveLast();
  EXPECT_THAT(CheckBatch(packed).status().message(),
              HasSubstr("packed_placements.end_poses has 13 numbers for 2 placements"));
}

TEST_F(MovingPlacements, AnswersAtRestHaveNoTimes) {
  Put("cube", Cube());
  EXPECT_FALSE(Check(Pair(PlacementOf("cube"), PlacementOf("cube"))).has_first_contact());
  const auto batch = CheckBatch(Batch({PlacementOf("cube"), PlacementOf("cube")}, {0, 1}));
  ASSERT_TRUE(batch.ok()) << batch.status();
  EXPECT_TRUE(batch->columns().separated_until().empty());
  EXPECT_TRUE(batch->columns().contact_times().empty());
}

TEST_F(MovingPlacements, TheColumnsOfASceneAreThoseOfABatch) {
  Put("cube", Cube());
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-6, 6);
  v1::FindCollisionsRequest request;
  for (int i = 0; i < 60; ++i) {
    v1::Placement one = PlacementOf("cube", number(random), number(random), number(random));
    if (i % 3 != 0) one = MovingTo(one, number(random), number(random), number(random));
    if (i % 3 == 2) Turn(1, number(random), 0, number(random), one.mutable_end_pose());
    *request.add_placements() = one;
  }
  v1::BatchCheckCollisionsRequest pairs;
  *pairs.mutable_placements() = request.placements();
  for (uint32_t a = 0; a < 60; ++a) {
    for (uint32_t b = a + 1; b < 60; ++b) {
      pairs.add_pairs(a);
      pairs.add_pairs(b);
    }
  }
  const auto batch = CheckBatch(pairs);
  ASSERT_TRUE(batch.ok()) << batch.status();
  const auto found = Find(request);
  ASSERT_TRUE(found.ok()) << found.status();
  const v1::FindCollisionsResponse& scene = *found;
  int row = 0;
  for (int i = 0; i < batch->columns().relations_size(); ++i) {
    if (batch->columns().relations(i) == kSeparated) continue;
    ASSERT_LT(row, scene.columns().relations_size());
    EXPECT_EQ(scene.pairs(2 * row), pairs.pairs(2 * i));
    EXPECT_EQ(scene.pairs(2 * row + 1), pairs.pairs(2 * i + 1));
    EXPECT_EQ(scene.columns().relations(row), batch->columns().relations(i));
    EXPECT_EQ(scene.columns().contact_times(row), batch->columns().contact_times(i));
    EXPECT_EQ(scene.columns().separated_until(row), batch->columns().separated_until(i));
    ++row;
  }
  EXPECT_EQ(row, scene.columns().relations_size());
  EXPECT_EQ(scene.totals().overlapping() + scene.totals().touching(), static_cast<uint64_t>(row));
  EXPECT_GT(row, 20);
  EXPECT_LT(scene.totals().candidates(), scene.totals().pairs());
}

TEST_F(MovingPlacements, MalformedEndPosesAreRefusedByName) {
  Put("cube", Cube());
  const v1::Placement cube = PlacementOf("cube");
  const auto expect = [&](const v1::Placement& bad, const std::string& message) {
    ExpectRefused(Pair(bad, cube), absl::StrCat("a.end_pose.", message));
    ExpectRefused(Pair(cube, bad), absl::StrCat("b.end_pose.", message));
    const auto batch = CheckBatch(Batch({cube, bad}, {0, 1}));
    ASSERT_TRUE(batch.ok()) << batch.status();
    ASSERT_EQ(batch->placement_problems_size(), 1);
    EXPECT_EQ(batch->placement_problems(0).placement(), 1u);
    EXPECT_EQ(batch->placement_problems(0).code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(batch->placement_problems(0).message(),
                StartsWith(absl::StrCat("placements[1].end_pose.", message)));
  };
  expect(MovingTo(cube, kNaN), "translation.x is NaN");
  expect(MovingTo(cube, 0, HUGE_VAL), "translation.y is infinite");
  v1::Placement bad = MovingTo(cube, 1);
  Turn(0, 0, 0, 0, bad.mutable_end_pose());
  expect(bad, "rotation is zero");
  Turn(1, kNaN, 0, 0, bad.mutable_end_pose());
  expect(bad, "rotation.x is NaN");
  // The rotation vanishes at a third of the time.
  Turn(-2, 0, 0, 0, bad.mutable_end_pose());
  expect(bad, "rotation is opposite");
  Turn(-2, 0, 0, 2, bad.mutable_end_pose());
  EXPECT_TRUE(Check(Pair(bad, PlacementOf("cube", 9))).has_first_contact());
}

TEST_F(MovingPlacements, OptionsThatMotionsExcludeAreRefusedByName) {
  Put("cube", Cube());
  const v1::CheckCollisionRequest moving =
      Pair(PlacementOf("cube"), MovingTo(PlacementOf("cube", 3), 1));
  const std::vector<std::pair<std::string, std::function<void(v1::CheckCollisionRequest*)>>>
      excluded = {
          {"METHOD_TEXTBOOK_SAT", [](auto* r) { r->set_method(v1::METHOD_TEXTBOOK_SAT); }},
          {"tolerance", [](auto* r) { r->set_tolerance(0.5); }},
          {"wanted.axis", [](auto* r) { r->mutable_wanted()->set_axis(true); }},
          {"wanted.analysis", [](auto* r) { r->mutable_wanted()->set_analysis(true); }},
          {"wanted.separation", [](auto* r) { r->mutable_wanted()->set_separation(true); }},
          {"wanted.witness", [](auto* r) { r->mutable_wanted()->set_witness(true); }},
          {"wanted.normal", [](auto* r) { r->mutable_wanted()->set_normal(true); }},
          {"wanted.clearance", [](auto* r) { r->mutable_wanted()->set_clearance(0); }},
      };
  for (const auto& [name, set] : excluded) {
    v1::CheckCollisionRequest request = moving;
    set(&request);
    ExpectRefused(request, absl::StrCat(name, " cannot be combined with end_pose"));
    v1::BatchCheckCollisionsRequest batch = Batch({request.a(), request.b()}, {0, 1});
    batch.set_method(request.method());
    batch.set_tolerance(request.tolerance());
    *batch.mutable_wanted() = request.wanted();
    EXPECT_THAT(MessageOf(CheckBatch(batch).status()),
                StartsWith(absl::StrCat(name, " cannot be combined")));
    if (request.method() != v1::METHOD_UNSPECIFIED) continue;
    v1::FindCollisionsRequest scene;
    *scene.mutable_placements() = batch.placements();
    scene.set_tolerance(request.tolerance());
    *scene.mutable_wanted() = request.wanted();
    const absl::Status found = Find(scene).status();
    EXPECT_EQ(found.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(MessageOf(found), StartsWith(absl::StrCat(name, " cannot be combined")));
  }
  for (const double bad : {0.0, -1.0, 1.5, kNaN}) {
    v1::CheckCollisionRequest request = moving;
    request.mutable_wanted()->set_max_time_error(bad);
    ExpectRefused(request, "wanted.max_time_error is ");
  }
  for (const double bad : {-1.0, kNaN}) {
    v1::CheckCollisionRequest request = moving;
    request.mutable_wanted()->set_resolution(bad);
    ExpectRefused(request, "wanted.resolution is ");
  }
}

TEST_F(MovingPlacements, RadiiCountAtAllTimes) {
  v1::Placement a = Shape({0, 0, 0});
  a.set_radius(1);
  v1::Placement b = Shape({0, 0, 0});
  b.set_radius(2);
  b.mutable_pose()->mutable_translation()->set_x(6);
  b.mutable_pose()->mutable_translation()->set_y(8);
  // The distance of the centers is 10 at the start, and falls to 3 at a time of 0.35.
  const v1::FirstContact contact = Proven(Pair(a, MovingTo(b, -6, -8))).first_contact();
  EXPECT_NEAR(contact.contact_time(), 0.35, 0x1p-29);
  EXPECT_LE(contact.contact_time() - contact.separated_until(), 0x1p-30);
  EXPECT_EQ(Proven(Pair(a, MovingTo(b, -6, 10))).relation(), kSeparated);
}

TEST_F(MovingPlacements, StreamsAndWatchesRefuseThem) {
  Put("cube", Cube());
  v1::CollisionStreamOpen listed;
  *listed.add_placements() = PlacementOf("cube");
  *listed.add_placements() = MovingTo(PlacementOf("cube"), 1);
  v1::CollisionStreamOpen packed;
  v1::PackedPlacements& list = *packed.mutable_packed_placements();
  list.add_hull_ids("cube");
  list.add_hulls(0);
  for (const double number : {1, 0, 0, 0, 5, 0, 0}) {
    list.add_poses(number);
    list.add_end_poses(number);
  }
  for (const auto& [open, field] :
       {std::pair(listed, "placements[1].end_pose"), {packed, "packed_placements.end_poses"}}) {
    const std::string expected = absl::StrCat(field, " is set, but ");
    const auto stream = client().OpenCollisionStream()->Open(open);
    EXPECT_EQ(stream.status().message(),
              absl::StrCat("open: ", expected,
                           "a stream does not support motions; use CheckCollision, "
                           "BatchCheckCollisions, or FindCollisions"));
    grpc::ClientContext context;
    const auto watch = collisions_->WatchCollisions(&context);
    v1::WatchCollisionsRequest first;
    *first.mutable_open()->mutable_placements() = open.placements();
    *first.mutable_open()->mutable_packed_placements() = open.packed_placements();
    watch->Write(first);
    const grpc::Status watched = watch->Finish();
    EXPECT_EQ(watched.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(watched.error_message(), HasSubstr(expected + "a watch does not support motions"));
  }
}

TEST_F(MovingPlacements, EmptyHullsNeverMeet) {
  Create("empty");
  const v1::CheckCollisionResponse response =
      Proven(Pair(PlacementOf("empty"), MovingTo(PlacementOf("empty"), 1)));
  EXPECT_EQ(response.relation(), kSeparated);
  EXPECT_EQ(response.first_contact().separated_until(), 1);
}

}  // namespace moving_placements
}  // namespace hulld::server
