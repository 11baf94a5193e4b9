// Placements with an end pose.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "client/client.h"
#include "client/packed_placements.h"
#include "client/verify/answer_check.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace moving_placements_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr v1::Relation kSeparated = v1::RELATION_SEPARATED;
constexpr v1::Relation kTouching = v1::RELATION_TOUCHING;
constexpr v1::Relation kOverlapping = v1::RELATION_OVERLAPPING;

void Turn(double w, double x, double y, double z, v1::Pose* pose) {
  pose->mutable_rotation()->set_w(w);
  pose->mutable_rotation()->set_x(x);
  pose->mutable_rotation()->set_y(y);
  pose->mutable_rotation()->set_z(z);
}

v1::Placement MovingTo(v1::Placement placement, double x, double y = 0, double z = 0) {
  v1::Vector3* const translation = placement.mutable_end_pose()->mutable_translation();
  translation->set_x(x);
  translation->set_y(y);
  translation->set_z(z);
  return placement;
}

v1::Placement Shape(const std::vector<double>& xyz) {
  v1::Placement placement;
  placement.mutable_points()->mutable_xyz()->Assign(xyz.begin(), xyz.end());
  return placement;
}

v1::CheckCollisionRequest Pair(const v1::Placement& a, const v1::Placement& b) {
  v1::CheckCollisionRequest request;
  *request.mutable_a() = a;
  *request.mutable_b() = b;
  return request;
}

v1::BatchCheckCollisionsRequest Batch(const std::vector<v1::Placement>& placements,
                                      const std::vector<uint32_t>& pairs) {
  v1::BatchCheckCollisionsRequest request;
  for (const v1::Placement& placement : placements) *request.add_placements() = placement;
  request.mutable_pairs()->Assign(pairs.begin(), pairs.end());
  return request;
}

// A rod that turns by 90 degrees about z, and a box that it meets at half time, in (3, 4, 0).
v1::Placement TurningRod() {
  v1::Placement rod = Shape({0, 0, 0, 5, 0, 0});
  Turn(1, 0, 0, 1, rod.mutable_end_pose());
  return rod;
}
v1::Placement Ceiling() { return Shape({0, 4, -1, 6, 4, -1, 0, 4, 1, 6, 4, 1, 3, 5, 0}); }

std::string MessageOf(const absl::Status& status) { return std::string(status.message()); }

class MovingPlacements : public ServerTest {
 protected:
  Client client() const {
    ClientOptions options;
    options.retry.max_attempts = 1;
    return Client(options, channel_);
  }

  // Expects an answer whose certificate the client verifies; returns it.
  v1::CheckCollisionResponse Proven(v1::CheckCollisionRequest request) {
    request.mutable_wanted()->set_certificate(true);
    const auto verified = CheckCollisionVerified(client(), request);
    if (!verified.ok()) {
      ADD_FAILURE() << verified.status();
      return {};
    }
    EXPECT_EQ(verified->verification.verdict, Verdict::kValid)
        << verified->verification.reason << "\n"
        << verified->response.ShortDebugString();
    return verified->response;
  }

  // Expects that the pair meets at this time, and that this is proven.
  void ExpectMeets(const v1::Placement& a, const v1::Placement& b, v1::Relation relation,
                   double time) {
    const v1::CheckCollisionResponse response = Check(Pair(a, b));
    EXPECT_EQ(response.relation(), relation);
    EXPECT_EQ(response.first_contact().contact_time(), time);
    EXPECT_FALSE(response.has_certificate());
    EXPECT_TRUE(response.first_contact().intervals().empty());
    EXPECT_EQ(Proven(Pair(a, b)).first_contact().contact_time(), time);
  }

  void ExpectRefused(const v1::CheckCollisionRequest& request, const std::string& message) {
    const grpc::Status status = CheckError(request);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), StartsWith(message));
  }

  absl::StatusOr<v1::FindCollisionsResponse> Find(const v1::FindCollisionsRequest& request) {
    v1::FindCollisionsResponse scene;
    const absl::Status status =
        client().FindCollisions(request, [&](const v1::FindCollisionsResponse& part) {
          scene.MergeFrom(part);
          return absl::OkStatus();
        });
    if (!status.ok()) return status;
    return scene;
  }

  absl::StatusOr<v1::BatchCheckCollisionsResponse> Ask(
      const v1::BatchCheckCollisionsRequest& request) {
    v1::BatchCheckCollisionsResponse whole;
    const absl::Status status =
        client().BatchCheckCollisions(request, [&](const v1::BatchCheckCollisionsResponse& part) {
          // Each message numbers its own rows.
          v1::BatchCheckCollisionsResponse next = part;
          for (v1::MotionProof& proof : *next.mutable_columns()->mutable_motion_proofs()) {
            proof.set_row(proof.row() + part.first_pair());
          }
          whole.MergeFrom(next);
          return absl::OkStatus();
        });
    if (!status.ok()) return status;
    return whole;
  }
};

TEST_F(MovingPlacements, TranslationsMeetAtExactTimes) {
  Put("cube", Cube());
  const v1::Placement cube = PlacementOf("cube");
  ExpectMeets(cube, MovingTo(PlacementOf("cube", 3), -1), kOverlapping, 0.5);
  ExpectMeets(cube, MovingTo(PlacementOf("cube", 3), 1), kTouching, 1);
  ExpectMeets(cube, MovingTo(PlacementOf("cube", -3, 1), 1, 1), kTouching, 0.5);
  ExpectMeets(cube, MovingTo(PlacementOf("cube", 0.5), 9), kOverlapping, 0);
  ExpectMeets(MovingTo(PlacementOf("cube"), 2), MovingTo(PlacementOf("cube", 4), 0), kOverlapping,
              0.5);
  // A third of the time is no double.
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

TEST_F(MovingPlacements, ABatchAnswersAsSingleCalls) {
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
  const auto batch = Ask(request);
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

TEST_F(MovingPlacements, PackedMotionsAnswerAsListed) {
  Put("cube", Cube());
  const std::vector<v1::Placement> placements = {PlacementOf("cube"),
                                                 MovingTo(PlacementOf("cube", 3), -1)};
  v1::BatchCheckCollisionsRequest packed = Batch({}, {0, 1});
  v1::PackedPlacements& list = *packed.mutable_packed_placements();
  list = PackPlacements(Batch(placements, {}).placements());
  const auto listed = Ask(Batch(placements, {0, 1}));
  const auto answer = Ask(packed);
  ASSERT_TRUE(listed.ok() && answer.ok()) << listed.status() << answer.status();
  EXPECT_THAT(answer->columns().contact_times(), ElementsAre(0.5));
  EXPECT_EQ(answer->columns().ShortDebugString(), listed->columns().ShortDebugString());

  list.mutable_end_poses()->RemoveLast();
  EXPECT_THAT(Ask(packed).status().message(),
              HasSubstr("packed_placements.end_poses holds 13 numbers for 2 placements"));
}

TEST_F(MovingPlacements, AnswersAtRestHaveNoTimes) {
  Put("cube", Cube());
  EXPECT_FALSE(Check(Pair(PlacementOf("cube"), PlacementOf("cube"))).has_first_contact());
  const auto batch = Ask(Batch({PlacementOf("cube"), PlacementOf("cube")}, {0, 1}));
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
  const auto batch = Ask(pairs);
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
    const auto batch = Ask(Batch({cube, bad}, {0, 1}));
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
    ExpectRefused(request, absl::StrCat(name, " excludes end_pose"));
    v1::BatchCheckCollisionsRequest batch = Batch({request.a(), request.b()}, {0, 1});
    batch.set_method(request.method());
    batch.set_tolerance(request.tolerance());
    *batch.mutable_wanted() = request.wanted();
    EXPECT_THAT(MessageOf(Ask(batch).status()), StartsWith(absl::StrCat(name, " excludes")));
    if (request.method() != v1::METHOD_UNSPECIFIED) continue;
    v1::FindCollisionsRequest scene;
    *scene.mutable_placements() = batch.placements();
    scene.set_tolerance(request.tolerance());
    *scene.mutable_wanted() = request.wanted();
    const absl::Status found = Find(scene).status();
    EXPECT_EQ(found.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(MessageOf(found), StartsWith(absl::StrCat(name, " excludes")));
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

TEST_F(MovingPlacements, FirstOnlyFindsWhatMayTouchFirst) {
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
    const auto batch = Ask(pairs);
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
    contacts += static_cast<int>(found.size());
  }
  EXPECT_GT(contacts, 12);
}

TEST_F(MovingPlacements, FirstOnlyFindsNothingIfNothingTouches) {
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

TEST_F(MovingPlacements, FirstOnlyNamesTheFieldsThatItExcludes) {
  Put("cube", Cube());
  v1::FindCollisionsRequest request;
  *request.add_placements() = PlacementOf("cube");
  *request.add_placements() = PlacementOf("cube", 3);
  request.set_first_only(true);
  EXPECT_THAT(MessageOf(Find(request).status()), HasSubstr("no placement has an end_pose"));
  *request.mutable_placements(1) = MovingTo(request.placements(1), 1);
  request.set_limit(1);
  EXPECT_THAT(MessageOf(Find(request).status()), StartsWith("first_only excludes a limit"));
  request.clear_limit();
  request.set_first_only(false);
  request.set_every_piece(true);
  EXPECT_THAT(MessageOf(Find(request).status()), StartsWith("every_piece excludes end_pose"));
}

// A cube of size 1 that begins at x.
std::vector<double> CubeFrom(double x) {
  std::vector<double> corners;
  for (int i = 0; i < 8; ++i) {
    corners.insert(corners.end(), {x + (i & 1), 1.0 * (i >> 1 & 1), 1.0 * (i >> 2)});
  }
  return corners;
}

// A body of these hulls, all in its own frame.
v1::PutBodyRequest BodyOf(const std::string& id, const std::vector<std::string>& hulls) {
  v1::PutBodyRequest body;
  body.set_body_id(id);
  for (const std::string& hull : hulls) *body.add_pieces() = PlacementOf(hull);
  return body;
}

TEST_F(MovingPlacements, BodiesMeetWithTheirEarliestPieces) {
  Put("cube", Cube());
  Put("far", CubeFrom(5));
  ASSERT_TRUE(client().PutBody(BodyOf("body", {"far", "cube"})).ok());
  const v1::CheckCollisionResponse left =
      Proven(Pair(PlacementOf("body"), MovingTo(PlacementOf("cube", -3), 3)));
  EXPECT_EQ(left.relation(), kOverlapping);
  EXPECT_EQ(left.first_contact().contact_time(), std::nextafter(1.0 / 3, 1));
  EXPECT_EQ(left.piece_a().index(), 1u);
  EXPECT_FALSE(left.has_piece_b());
  EXPECT_EQ(left.piece_certificates_size(), 2);
  const v1::CheckCollisionResponse right =
      Proven(Pair(MovingTo(PlacementOf("cube", 8), 4), PlacementOf("body")));
  EXPECT_EQ(right.first_contact().contact_time(), 0.5);
  EXPECT_EQ(right.piece_b().index(), 0u);
  const v1::CheckCollisionResponse between =
      Proven(Pair(MovingTo(PlacementOf("body"), 0, 9), PlacementOf("cube", 3)));
  EXPECT_EQ(between.relation(), kSeparated);
  EXPECT_EQ(between.first_contact().separated_until(), 1);
  EXPECT_EQ(between.piece_certificates_size(), 2);
  // Touches one piece first, and overlaps the other later.
  const v1::CheckCollisionResponse both =
      Proven(Pair(MovingTo(PlacementOf("body"), 1.5, 1), PlacementOf("cube", 6, 1)));
  EXPECT_EQ(both.first_contact().contact_time(), 0);
}

TEST_F(MovingPlacements, BodiesAnswerAsTheirPieces) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-4, 4);
  for (int i = 0; i < 6; ++i) {
    std::vector<double> points;
    for (int k = 0; k < 18; ++k)
      points.push_back(number(random) / 4 + (k % 3 == i % 3 ? i / 2 : 0));
    Put(absl::StrCat("piece", i), points);
  }
  v1::PutBodyRequest rounded = BodyOf("b", {"piece3", "piece4", "piece5"});
  rounded.mutable_pieces(1)->set_radius(0.125);
  ASSERT_TRUE(client().PutBody(BodyOf("a", {"piece0", "piece1", "piece2"})).ok());
  ASSERT_TRUE(client().PutBody(rounded).ok());
  int counts[v1::Relation_ARRAYSIZE] = {};
  for (int round = 0; round < 24; ++round) {
    const v1::Placement a =
        MovingTo(PlacementOf("a", number(random), number(random)), number(random), number(random));
    v1::Placement b = MovingTo(PlacementOf("b", 2 * number(random), number(random)), number(random),
                               number(random), number(random));
    if (round % 3 != 0) Turn(2, number(random), 0, number(random), b.mutable_end_pose());
    const v1::CheckCollisionResponse whole = Proven(Pair(a, b));
    double until = 1;
    double contact = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        v1::Placement piece_a = a;
        v1::Placement piece_b = b;
        piece_a.set_hull_id(absl::StrCat("piece", i));
        piece_b.set_hull_id(absl::StrCat("piece", 3 + j));
        if (j == 1) piece_b.set_radius(0.125);
        const v1::CheckCollisionResponse one = Check(Pair(piece_a, piece_b));
        if (one.relation() == kSeparated) continue;
        until = std::min(until, one.first_contact().separated_until());
        if (!one.first_contact().has_contact_time()) continue;
        contact = std::min(contact, one.first_contact().contact_time());
      }
    }
    // Brackets of one contact may differ, because rounding depends on the order of the vertices.
    const auto is_near = [](double x, double y) { return std::abs(x - y) <= 0x1p-29; };
    EXPECT_PRED2(is_near, whole.first_contact().separated_until(), until);
    EXPECT_EQ(whole.first_contact().has_contact_time(), std::isfinite(contact));
    if (std::isfinite(contact)) {
      EXPECT_PRED2(is_near, whole.first_contact().contact_time(), contact);
      EXPECT_LE(whole.first_contact().separated_until(), contact);
      EXPECT_LE(until, whole.first_contact().contact_time());
    }
    ++counts[whole.relation()];
    const auto batch = Ask(Batch({a, b}, {0, 1}));
    ASSERT_TRUE(batch.ok()) << batch.status();
    EXPECT_EQ(batch->columns().relations(0), whole.relation());
    EXPECT_PRED2(is_near, batch->columns().separated_until(0), until);
    if (std::isfinite(contact)) {
      EXPECT_EQ(batch->columns().pieces(0), static_cast<int32_t>(whole.piece_a().index()));
      EXPECT_EQ(batch->columns().pieces(1), static_cast<int32_t>(whole.piece_b().index()));
    }
  }
  EXPECT_GT(counts[kSeparated], 3);
  EXPECT_GT(counts[kOverlapping], 3);
}

TEST_F(MovingPlacements, FlawedCertificatesOfMovingBodiesAreRejected) {
  Put("cube", Cube());
  Put("far", CubeFrom(5));
  ASSERT_TRUE(client().PutBody(BodyOf("body", {"far", "cube"})).ok());
  v1::CheckCollisionRequest request =
      Pair(PlacementOf("body"), MovingTo(PlacementOf("cube", -3), 3));
  request.mutable_wanted()->set_certificate(true);
  const v1::CheckCollisionResponse response = Check(request);
  const Client connected = client();
  const auto verdict_without = [&](const std::function<void(v1::CheckCollisionResponse*)>& spoil) {
    v1::CheckCollisionResponse flawed = response;
    spoil(&flawed);
    const auto checked = AnswerChecker(connected).Check(request, flawed);
    return checked.ok() ? checked->verdict : Verdict::kCannotCheck;
  };
  EXPECT_EQ(verdict_without([](auto*) {}), Verdict::kValid);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(
        verdict_without([i](auto* r) { r->mutable_piece_certificates()->DeleteSubrange(i, 1); }),
        Verdict::kInvalid);
    EXPECT_EQ(
        verdict_without([i](auto* r) { r->mutable_piece_certificates(i)->clear_intervals(); }),
        Verdict::kInvalid);
  }
  EXPECT_EQ(verdict_without([](auto* r) { r->set_relation(v1::RELATION_TOUCHING); }),
            Verdict::kInvalid);
  EXPECT_EQ(verdict_without([](auto* r) { r->mutable_first_contact()->set_separated_until(0.4); }),
            Verdict::kInvalid);
  EXPECT_EQ(verdict_without([](auto* r) { r->mutable_piece_a()->set_index(0); }),
            Verdict::kInvalid);
}

TEST_F(MovingPlacements, PiecesWithAPoseOfTheirOwnDoNotMoveYet) {
  Put("cube", Cube());
  v1::PutBodyRequest body = BodyOf("body", {"cube", "cube"});
  body.mutable_pieces(1)->mutable_pose()->mutable_translation()->set_x(2);
  ASSERT_TRUE(client().PutBody(body).ok());
  ExpectRefused(Pair(MovingTo(PlacementOf("body"), 1), PlacementOf("cube")),
                "piece 1 of the body has a pose of its own");
  const auto batch =
      Ask(Batch({PlacementOf("body"), MovingTo(PlacementOf("cube", 3), -1), PlacementOf("cube")},
                {0, 1, 1, 2}));
  ASSERT_TRUE(batch.ok()) << batch.status();
  EXPECT_THAT(batch->columns().relations(), ElementsAre(v1::RELATION_UNSPECIFIED, kOverlapping));
  EXPECT_THAT(batch->columns().pieces(), ElementsAre(-1, -1, -1, -1));
  ASSERT_EQ(batch->columns().pair_problems_size(), 1);
  EXPECT_THAT(batch->columns().pair_problems(0).message(), StartsWith("piece 1 of the body"));

  *body.add_pieces() = MovingTo(PlacementOf("cube"), 1);
  EXPECT_THAT(MessageOf(client().PutBody(body).status()),
              StartsWith("pieces[2].end_pose is set; a piece is at rest"));
}

TEST_F(MovingPlacements, EveryPieceGivesARowToEachPairOfPieces) {
  Put("cube", Cube());
  v1::PutBodyRequest row;
  row.set_body_id("row");
  for (int i = 0; i < 5; ++i) *row.add_pieces() = PlacementOf("cube", 2 * i);
  ASSERT_TRUE(client().PutBody(row).ok());
  const std::vector<v1::Placement> placements = {PlacementOf("row"), PlacementOf("row", 0.5, 0.25),
                                                 PlacementOf("cube", 4, -1),
                                                 PlacementOf("cube", 4, -1.5)};
  for (const double clearance : {-1.0, 0.0, 0.5}) {
    SCOPED_TRACE(clearance);
    v1::FindCollisionsRequest request;
    for (const v1::Placement& one : placements) *request.add_placements() = one;
    request.set_every_piece(true);
    request.mutable_wanted()->set_separation(true);
    request.mutable_wanted()->set_certificate(true);
    if (clearance >= 0) request.mutable_wanted()->set_clearance(clearance);
    const auto scene = Find(request);
    ASSERT_TRUE(scene.ok()) << scene.status();
    // Brute force: each piece as a hull at its place.
    const auto pieces_of = [&](uint32_t i) {
      std::vector<v1::Placement> pieces;
      for (int k = 0; k < (i < 2 ? 5 : 1); ++k) {
        const v1::Vector3& t = placements[i].pose().translation();
        pieces.push_back(PlacementOf("cube", t.x() + 2 * k, t.y()));
      }
      return pieces;
    };
    std::vector<std::tuple<uint32_t, uint32_t, int, int, v1::Relation>> expected;
    for (uint32_t a = 0; a < 4; ++a) {
      for (uint32_t b = a + 1; b < 4; ++b) {
        const auto pieces_a = pieces_of(a);
        const auto pieces_b = pieces_of(b);
        for (size_t i = 0; i < pieces_a.size(); ++i) {
          for (size_t j = 0; j < pieces_b.size(); ++j) {
            v1::CheckCollisionRequest one = Pair(pieces_a[i], pieces_b[j]);
            if (clearance >= 0) one.mutable_wanted()->set_clearance(clearance);
            const v1::CheckCollisionResponse answer = Check(one);
            const bool is_found =
                clearance >= 0 ? answer.within_clearance() : answer.relation() != kSeparated;
            if (!is_found) continue;
            expected.emplace_back(a, b, a < 2 ? static_cast<int>(i) : -1,
                                  b < 2 ? static_cast<int>(j) : -1, answer.relation());
          }
        }
      }
    }
    std::vector<std::tuple<uint32_t, uint32_t, int, int, v1::Relation>> found;
    const v1::AnswerColumns& columns = scene->columns();
    for (int i = 0; i < columns.relations_size(); ++i) {
      found.emplace_back(scene->pairs(2 * i), scene->pairs(2 * i + 1), columns.pieces(2 * i),
                         columns.pieces(2 * i + 1), columns.relations(i));
    }
    EXPECT_EQ(found, expected);
    EXPECT_GT(found.size(), 6u);
    const v1::SceneTotals& totals = scene->totals();
    EXPECT_EQ(totals.separated() + totals.touching() + totals.overlapping(), found.size());
    EXPECT_EQ(columns.separations_size(), static_cast<int>(found.size()));
  }
  v1::FindCollisionsRequest limited;
  *limited.add_placements() = PlacementOf("row");
  limited.set_every_piece(true);
  limited.set_limit(1);
  EXPECT_THAT(MessageOf(Find(limited).status()), StartsWith("every_piece excludes a limit"));
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
                           "a stream takes no motions; use CheckCollision, "
                           "BatchCheckCollisions, or FindCollisions"));
    grpc::ClientContext context;
    const auto watch = collisions_->WatchCollisions(&context);
    v1::WatchCollisionsRequest first;
    *first.mutable_open()->mutable_placements() = open.placements();
    *first.mutable_open()->mutable_packed_placements() = open.packed_placements();
    watch->Write(first);
    const grpc::Status watched = watch->Finish();
    EXPECT_EQ(watched.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(watched.error_message(), HasSubstr(expected + "a watch takes no motions"));
  }
}

TEST_F(MovingPlacements, EmptyHullsNeverMeet) {
  Create("empty");
  const v1::CheckCollisionResponse response =
      Proven(Pair(PlacementOf("empty"), MovingTo(PlacementOf("empty"), 1)));
  EXPECT_EQ(response.relation(), kSeparated);
  EXPECT_EQ(response.first_contact().separated_until(), 1);
}

}  // namespace moving_placements_test
}  // namespace hulld::server
