// Encoding of all answer contents, from hand-written answers.
#include "server/wire/answer_columns.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/hull/growth/hull_builder.h"
#include "core/query/placed/live_hull.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace answer_columns_test {

using ::testing::ElementsAre;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Hull Tetrahedron() {
  const Vector points[] = {{0, 0, 0}, {0, 0, 4}, {0, 4, 0}, {4, 0, 0}};
  HullBuilder builder;
  EXPECT_TRUE(builder.Add(points).ok());
  return builder.Snapshot();
}

v1::Wanted Everything() {
  v1::Wanted wanted;
  wanted.set_axis(true);
  wanted.set_analysis(true);
  wanted.set_certificate(true);
  wanted.set_separation(true);
  wanted.set_witness(true);
  wanted.set_normal(true);
  wanted.set_clearance(1);
  return wanted;
}

Answer FullAnswer() {
  Answer answer;
  answer.relation = Relation::kOverlapping;
  answer.rung = Rung::kExact;
  answer.certificate = Certificate();
  answer.certificate->pairs = {{1, 2}, {3, 0}};
  answer.separation = Separation{-0.5, 0x1p-60};
  answer.witness = Witness{{1, 2, 3}, {4, 5, 6}, 0.25};
  answer.normal = hulld::Normal{{0, 0.6, 0.8}, 0x1p-50};
  answer.within_clearance = true;
  return answer;
}

TEST(EncodeCertificate, DirectionsAreDoublesOrIntegers) {
  const Hull hull = Tetrahedron();
  Certificate certificate;
  certificate.direction = Vector(1, -0.5, 1e-300);
  v1::Certificate message;
  EncodeCertificate(certificate, hull, hull, &message);
  EXPECT_EQ(message.direction().y(), -0.5);
  EXPECT_EQ(message.direction().z(), 1e-300);
  EXPECT_FALSE(message.has_integer_direction());
  IntegerVector integers;
  integers.x = (Integer(1) << 200) + 1;
  integers.y = -Integer(1'000'000'000'000'000'000);
  certificate.direction = integers;
  message.Clear();
  EncodeCertificate(certificate, hull, hull, &message);
  EXPECT_FALSE(message.has_direction());
  EXPECT_EQ(message.integer_direction().x(),
            "1606938044258990275541962092341162602522202993782792835301377");
  EXPECT_EQ(message.integer_direction().y(), "-1000000000000000000");
  EXPECT_EQ(message.integer_direction().z(), "0");
}

TEST(EncodeCertificate, PairsCarryTheirVertices) {
  const Hull hull = Tetrahedron();
  v1::Certificate message;
  EncodeCertificate(*FullAnswer().certificate, hull, hull, &message);
  ASSERT_EQ(message.pairs_size(), 2);
  EXPECT_EQ(message.exact_direction_case(), v1::Certificate::EXACT_DIRECTION_NOT_SET);
  EXPECT_EQ(message.pairs(0).index_a(), 1);
  EXPECT_EQ(message.pairs(0).index_b(), 2);
  EXPECT_EQ(message.pairs(0).vertex_a().z(), hull.vertices()[1][2]);
  EXPECT_EQ(message.pairs(1).vertex_a().x(), hull.vertices()[3][0]);
  EXPECT_EQ(message.pairs(1).vertex_b().x(), hull.vertices()[0][0]);
}

TEST(AnswerColumns, EachColumnHoldsAnEntryPerPair) {
  const Hull hull = Tetrahedron();
  const QueryHull query_hull(hull);
  const v1::Wanted wanted = Everything();
  Answer bare;
  bare.relation = Relation::kSeparated;
  bare.separation = Separation{kInfinity, kInfinity};
  bare.within_clearance = false;
  v1::AnswerColumns columns;
  size_t bytes =
      AddAnswer(absl::StatusOr<Answer>(FullAnswer()), query_hull, query_hull, wanted, &columns);
  bytes += AddUnanswered(wanted, &columns);
  bytes += AddAnswer(absl::StatusOr<Answer>(bare), query_hull, query_hull, wanted, &columns);
  bytes += AddAnswer(absl::StatusOr<Answer>(absl::ResourceExhaustedError("why")), query_hull,
                     query_hull, wanted, &columns);
  EXPECT_GE(bytes, columns.ByteSizeLong() - 64);
  EXPECT_THAT(columns.relations(), ElementsAre(v1::RELATION_OVERLAPPING, v1::RELATION_UNSPECIFIED,
                                               v1::RELATION_SEPARATED, v1::RELATION_UNSPECIFIED));
  EXPECT_EQ(columns.rungs_size(), 4);
  EXPECT_EQ(columns.axes_size(), 4);
  EXPECT_EQ(columns.analyses_size(), 4);
  ASSERT_EQ(columns.certificates_size(), 4);
  EXPECT_EQ(columns.certificates(0).pairs_size(), 2);
  EXPECT_EQ(columns.certificates(1).pairs_size(), 0);
  ASSERT_EQ(columns.separations_size(), 4);
  EXPECT_EQ(columns.separations(0), -0.5);
  EXPECT_EQ(columns.separation_bounds(0), 0x1p-60);
  EXPECT_TRUE(std::isnan(columns.separations(1)));
  EXPECT_EQ(columns.separations(2), kInfinity);
  ASSERT_EQ(columns.witness_xyz_size(), 24);
  EXPECT_EQ(columns.witness_xyz(1), 2);
  EXPECT_EQ(columns.witness_xyz(5), 6);
  EXPECT_TRUE(std::isnan(columns.witness_xyz(12)));
  ASSERT_EQ(columns.witness_errors_size(), 4);
  EXPECT_EQ(columns.witness_errors(0), 0.25);
  ASSERT_EQ(columns.normal_xyz_size(), 12);
  EXPECT_EQ(columns.normal_xyz(2), 0.8);
  EXPECT_TRUE(std::isnan(columns.normal_xyz(3)));
  ASSERT_EQ(columns.normal_angle_bounds_size(), 4);
  EXPECT_EQ(columns.normal_angle_bounds(0), 0x1p-50);
  EXPECT_TRUE(std::isnan(columns.normal_angle_bounds(2)));
  EXPECT_THAT(columns.within_clearance(), ElementsAre(true, false, false, false));
  ASSERT_EQ(columns.pair_problems_size(), 1);
  EXPECT_EQ(columns.pair_problems(0).row(), 3);
  EXPECT_EQ(columns.pair_problems(0).message(), "why");
  EXPECT_EQ(columns.pair_problems(0).reason(), v1::ERROR_REASON_LIMIT_EXCEEDED);
}

// Then hulls without a canonical snapshot suffice.
TEST(AnswerColumns, UnrequestedColumnsAreNotSent) {
  const LiveHull live({{0, 0, 0}, {0, 0, 4}, {0, 4, 0}, {4, 0, 0}}, 3);
  const std::shared_ptr<const QueryHull> query_hull = live.VersionAt(live.Now());
  v1::AnswerColumns columns;
  AddAnswer(absl::StatusOr<Answer>(FullAnswer()), *query_hull, *query_hull, v1::Wanted(), &columns);
  AddUnanswered(v1::Wanted(), &columns);
  v1::AnswerColumns expected;
  expected.add_relations(v1::RELATION_OVERLAPPING);
  expected.add_relations(v1::RELATION_UNSPECIFIED);
  expected.add_rungs(v1::RUNG_EXACT);
  expected.add_rungs(v1::RUNG_UNSPECIFIED);
  EXPECT_EQ(columns.ShortDebugString(), expected.ShortDebugString());
}

}  // namespace answer_columns_test
}  // namespace hulld::server
