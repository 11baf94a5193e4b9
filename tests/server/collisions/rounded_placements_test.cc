// Placements and pieces of bodies with a radius.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "client/calls/grpc_status.h"
#include "client/client.h"
#include "client/packed_placements.h"
#include "client/verify/answer_check.h"
#include "server/store/records.h"
#include "server/store/store_keys.h"
#include "tests/server/collisions/watch_round.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace rounded_placements_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::Placement Rounded(v1::Placement placement, double radius) {
  placement.set_radius(radius);
  return placement;
}

v1::Placement Ball(double radius, double x = 0, double y = 0, double z = 0) {
  v1::Placement placement = PlacementOf("", x, y, z);
  for (int i = 0; i < 3; ++i) placement.mutable_points()->add_xyz(0);
  return Rounded(placement, radius);
}

v1::CheckCollisionRequest Pair(const v1::Placement& a, const v1::Placement& b) {
  v1::CheckCollisionRequest request;
  *request.mutable_a() = a;
  *request.mutable_b() = b;
  return request;
}

class RoundedPlacements : public ServerTest {
 protected:
  Client client() const {
    ClientOptions options;
    options.retry.max_attempts = 1;
    return Client(options, channel_);
  }

  v1::Relation RelationOf(const v1::Placement& a, const v1::Placement& b) {
    return Check(Pair(a, b)).relation();
  }

  // Expects this relation, alone and with a certificate that the client verifies.
  void ExpectProven(const v1::Placement& a, const v1::Placement& b, v1::Relation relation) {
    EXPECT_EQ(RelationOf(a, b), relation);
    v1::CheckCollisionRequest request = Pair(a, b);
    request.mutable_wanted()->set_certificate(true);
    request.mutable_wanted()->set_separation(true);
    const auto verified = CheckCollisionVerified(client(), request);
    ASSERT_TRUE(verified.ok()) << verified.status();
    EXPECT_EQ(verified->response.relation(), relation);
    EXPECT_EQ(verified->verification.verdict, Verdict::kValid) << verified->verification.reason;
  }

  // Cubes at x = 0 and 4, the second with a radius of 0.25.
  void PutRow() {
    Put("cube", Cube());
    v1::PutBodyRequest body;
    body.set_body_id("row");
    *body.add_pieces() = PlacementOf("cube");
    *body.add_pieces() = Rounded(PlacementOf("cube", 4), 0.25);
    ASSERT_TRUE(client().PutBody(body).ok());
  }
};

constexpr v1::Relation kSeparated = v1::RELATION_SEPARATED;
constexpr v1::Relation kTouching = v1::RELATION_TOUCHING;
constexpr v1::Relation kOverlapping = v1::RELATION_OVERLAPPING;

TEST_F(RoundedPlacements, AreDecidedToTheLastBit) {
  Put("cube", Cube());
  const v1::Placement cube = Rounded(PlacementOf("cube"), 2);
  ExpectProven(cube, Ball(std::nextafter(3.0, 0), 4, 5, 1), kSeparated);
  ExpectProven(cube, Ball(3, 4, 5, 1), kTouching);
  ExpectProven(cube, Ball(std::nextafter(3.0, 4), 4, 5, 1), kOverlapping);
  ExpectProven(Ball(1), Ball(1e-30, 1), kOverlapping);
}

TEST_F(RoundedPlacements, AnswersDescribeTheRoundedShapes) {
  v1::CheckCollisionRequest request = Pair(Ball(1), Ball(2, 6, 8));
  v1::Wanted& wanted = *request.mutable_wanted();
  wanted.set_axis(true);
  wanted.set_separation(true);
  wanted.set_witness(true);
  wanted.set_normal(true);
  wanted.set_clearance(7);
  const v1::CheckCollisionResponse response = Check(request);
  EXPECT_NEAR(response.separation().value(), 7, response.separation().bound());
  EXPECT_LE(response.separation().bound(), 1e-10);
  EXPECT_TRUE(response.within_clearance());
  EXPECT_NEAR(response.witness().point_a().x(), 0.6, 1e-14);
  EXPECT_NEAR(response.witness().point_b().y(), 6.4, 1e-14);
  EXPECT_NEAR(response.normal().direction().y(), 0.8, 1e-9);
  EXPECT_NEAR(response.axis().direction().x(), 0.6, 1e-9);
  request.mutable_wanted()->set_clearance(std::nextafter(7.0, 0));
  EXPECT_FALSE(Check(request).within_clearance());
}

TEST_F(RoundedPlacements, MalformedRadiiAreRefusedByName) {
  Put("cube", Cube());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::string rule = "; it must be a finite length of at least 0";
  for (const auto& [radius, text] : std::vector<std::pair<double, std::string>>{
           {-1, "-1"}, {nan, "NaN"}, {INFINITY, "infinite"}}) {
    const v1::Placement bad = Rounded(PlacementOf("cube"), radius);
    const grpc::Status status = CheckError(Pair(PlacementOf("cube"), bad));
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(status.error_message(), absl::StrCat("b.radius is ", text, rule));
    v1::PutBodyRequest body;
    body.set_body_id("body");
    *body.add_pieces() = PlacementOf("cube");
    *body.add_pieces() = bad;
    EXPECT_EQ(client().PutBody(body).status().message(),
              absl::StrCat("pieces[1].radius is ", text, rule));
    v1::BatchCheckCollisionsRequest batch;
    *batch.add_placements() = PlacementOf("cube");
    *batch.add_placements() = bad;
    batch.add_pairs(0);
    batch.add_pairs(1);
    v1::BatchCheckCollisionsResponse answer;
    ASSERT_TRUE(client()
                    .BatchCheckCollisions(batch,
                                          [&](const v1::BatchCheckCollisionsResponse& part) {
                                            answer.MergeFrom(part);
                                            return absl::OkStatus();
                                          })
                    .ok());
    EXPECT_THAT(answer.columns().relations(), ElementsAre(v1::RELATION_UNSPECIFIED));
    ASSERT_EQ(answer.placement_problems_size(), 1);
    EXPECT_EQ(answer.placement_problems(0).message(),
              absl::StrCat("placements[1].radius is ", text, rule));
  }
}

TEST_F(RoundedPlacements, TextbookRefusesThem) {
  Put("cube", Cube());
  v1::CheckCollisionRequest request = Pair(Rounded(PlacementOf("cube"), 0.5), PlacementOf("cube"));
  request.set_method(v1::METHOD_TEXTBOOK_SAT);
  const grpc::Status status = CheckError(request);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(
      status.error_message(),
      "a.radius is 0.5, but METHOD_TEXTBOOK_SAT applies to hulls without a radius; omit one of "
      "them");
}

TEST_F(RoundedPlacements, RadiiOfBodiesAddToThoseOfTheirPieces) {
  PutRow();
  const v1::Placement row = Rounded(PlacementOf("row"), 0.5);
  // A ball at the first cube, a ball at the second, and the next double of each.
  ExpectProven(row, Ball(0.25, -0.75, 0.5, 0.5), kTouching);
  ExpectProven(row, Ball(std::nextafter(0.25, 0), -0.75, 0.5, 0.5), kSeparated);
  ExpectProven(row, Ball(0.25, 6, 0.5, 0.5), kTouching);
  ExpectProven(row, Ball(0.25, std::nextafter(6.0, 0), 0.5, 0.5), kOverlapping);
  ExpectProven(row, Rounded(PlacementOf("row", 0, 2.5), 0.5), kTouching);
  const auto body = client().GetBody("row");
  ASSERT_TRUE(body.ok());
  EXPECT_EQ(body->pieces(0).radius(), 0);
  EXPECT_EQ(body->pieces(1).radius(), 0.25);
}

TEST_F(RoundedPlacements, EveryCallReturnsTheSameRelation) {
  PutRow();
  v1::FindCollisionsRequest scene;
  for (int i = 0; i < 60; ++i) {
    const v1::Placement placement = i % 5 == 0   ? PlacementOf("row", i % 7, i % 11, i % 3)
                                    : i % 2 == 0 ? PlacementOf("cube", i % 13, i % 6, 0)
                                                 : Ball(0, i % 12, i % 9, i % 4);
    *scene.add_placements() = Rounded(placement, (i % 4) / 4.0);
  }
  std::vector<uint32_t> expected;
  v1::BatchCheckCollisionsRequest batch;
  v1::CollisionStreamOpen open;
  for (uint32_t a = 0; a < 60; ++a) {
    for (uint32_t b = a + 1; b < 60; ++b) {
      for (const uint32_t i : {a, b}) {
        batch.add_pairs(i);
        open.add_pairs(i);
      }
      if (RelationOf(scene.placements(static_cast<int>(a)),
                     scene.placements(static_cast<int>(b))) == kSeparated) {
        continue;
      }
      expected.push_back(a);
      expected.push_back(b);
    }
  }
  EXPECT_GT(expected.size(), 100u);
  std::vector<uint32_t> found;
  const auto take = [&found](const v1::FindCollisionsResponse& part) {
    found.insert(found.end(), part.pairs().begin(), part.pairs().end());
    return absl::OkStatus();
  };
  ASSERT_TRUE(client().FindCollisions(scene, take).ok());
  EXPECT_EQ(found, expected);
  const auto colliding = [](const auto& relations, const auto& pairs) {
    std::vector<uint32_t> all;
    for (int i = 0; i < relations.size(); ++i) {
      if (relations[i] != kSeparated) all.insert(all.end(), {pairs[2 * i], pairs[2 * i + 1]});
    }
    return all;
  };
  *batch.mutable_packed_placements() = PackPlacements(scene.placements());
  google::protobuf::RepeatedField<int> relations;
  ASSERT_TRUE(client()
                  .BatchCheckCollisions(batch,
                                        [&](const v1::BatchCheckCollisionsResponse& part) {
                                          relations.MergeFrom(part.columns().relations());
                                          return absl::OkStatus();
                                        })
                  .ok());
  EXPECT_EQ(colliding(relations, batch.pairs()), expected);
  *open.mutable_packed_placements() = batch.packed_placements();
  const auto stream = client().OpenCollisionStream();
  const auto opened = stream->Open(open);
  ASSERT_TRUE(opened.ok()) << opened.status();
  EXPECT_EQ(colliding(opened->columns().relations(), open.pairs()), expected);
}

TEST_F(RoundedPlacements, WatchesReportWhenRadiiMeet) {
  Put("cube", Cube());
  v1::CollisionWatchOpen open;
  *open.add_placements() = Rounded(PlacementOf("cube"), 0.5);
  *open.add_placements() = Ball(1, 3, 0.5, 0.5);
  const auto watch = client().WatchCollisions(open);
  EXPECT_EQ(ReadRound(*watch).events_size(), 0);
  v1::CollisionWatchUpdate update;
  update.add_placements(1);
  for (const double number : {1.0, 0.0, 0.0, 0.0, 2.5, 0.5, 0.5}) update.add_poses(number);
  ASSERT_TRUE(watch->Update(update).ok());
  const v1::WatchCollisionsResponse touching = ReadRound(*watch);
  ASSERT_EQ(touching.events_size(), 1);
  EXPECT_EQ(touching.events(0).kind(), v1::COLLISION_EVENT_KIND_TOUCH);
}

StoredBody TwoPieces(double radius) {
  StoredBody body;
  body.record = {"body", 3, 4};
  body.hull_ids = {"cube"};
  body.pieces = {{0, {}, 0}, {0, {}, radius}};
  return body;
}

TEST(BodyRecord, KeepsRadiiAndReadsRecordsWithoutThem) {
  const auto read = DecodeStoredBody("body", EncodeStoredBody(TwoPieces(0.75)));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->pieces[0].radius, 0);
  EXPECT_EQ(read->pieces[1].radius, 0.75);
  // Two numbers follow the record without radii.
  const std::string plain = EncodeStoredBody(TwoPieces(0));
  EXPECT_EQ(EncodeStoredBody(TwoPieces(0.75)).size(), plain.size() + 2 * sizeof(double));
  const auto old = DecodeStoredBody("body", plain);
  ASSERT_TRUE(old.ok()) << old.status();
  EXPECT_EQ(old->pieces[1].radius, 0);
}

TEST(BodyRecord, DamagedRadiiAreDataLoss) {
  for (const double radius : {-1.0, std::nan(""), HUGE_VAL}) {
    std::string record = EncodeStoredBody(TwoPieces(1));
    record.replace(record.size() - sizeof(radius), sizeof(radius),
                   reinterpret_cast<const char*>(&radius), sizeof(radius));
    EXPECT_EQ(DecodeStoredBody("body", record).status().message(),
              "the radius of its piece 1 is invalid");
  }
  std::string record = EncodeStoredBody(TwoPieces(1));
  record.pop_back();
  EXPECT_EQ(DecodeStoredBody("body", record).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace rounded_placements_test
}  // namespace hulld::server
