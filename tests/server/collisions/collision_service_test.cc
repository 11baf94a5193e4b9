#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace collision_service_test {

using ::testing::HasSubstr;

class CheckCollisionCall : public ServerTest {
 protected:
  static v1::CheckCollisionRequest Pair(const v1::Placement& a, const v1::Placement& b,
                                        v1::Method method = v1::METHOD_UNSPECIFIED) {
    v1::CheckCollisionRequest request;
    *request.mutable_a() = a;
    *request.mutable_b() = b;
    request.set_method(method);
    return request;
  }
};

TEST_F(CheckCollisionCall, BothMethodsDistinguishTheThreeRelations) {
  Put("cube", Cube());
  for (const v1::Method method :
       {v1::METHOD_UNSPECIFIED, v1::METHOD_CERTIFIED_SEARCH, v1::METHOD_TEXTBOOK_SAT}) {
    const auto relation = [&](double x) {
      return Check(Pair(PlacementOf("cube"), PlacementOf("cube", x), method)).relation();
    };
    EXPECT_EQ(relation(0.5), v1::RELATION_OVERLAPPING);
    EXPECT_EQ(relation(std::nextafter(1, 0)), v1::RELATION_OVERLAPPING);
    EXPECT_EQ(relation(1), v1::RELATION_TOUCHING);
    EXPECT_EQ(relation(std::nextafter(1, 2)), v1::RELATION_SEPARATED);
  }
}

TEST_F(CheckCollisionCall, AnswersNameTheVersionsOfTheirHulls) {
  Put("a", Cube());
  Put("b", Cube());
  const v1::CheckCollisionResponse response = Check(Pair(PlacementOf("a"), PlacementOf("b", 3)));
  EXPECT_EQ(response.hull_a().hull_id(), "a");
  EXPECT_EQ(response.hull_a().revision(), Get("a").hull().revision());
  EXPECT_EQ(response.hull_b().revision(), Get("b").hull().revision());
  EXPECT_EQ(response.hull_b().create_revision(), Get("b").hull().create_revision());
  EXPECT_EQ(response.header().revision(), Get("b").header().revision());
  EXPECT_NE(response.rung(), v1::RUNG_UNSPECIFIED);
  EXPECT_FALSE(response.has_axis());
  EXPECT_FALSE(response.has_analysis());
}

TEST_F(CheckCollisionCall, TextbookReportsItsAxisAndSizes) {
  Put("cube", Cube());
  v1::CheckCollisionRequest request =
      Pair(PlacementOf("cube"), PlacementOf("cube", 1), v1::METHOD_TEXTBOOK_SAT);
  request.mutable_wanted()->set_axis(true);
  request.mutable_wanted()->set_analysis(true);
  const v1::CheckCollisionResponse response = Check(request);
  EXPECT_EQ(response.relation(), v1::RELATION_TOUCHING);
  EXPECT_EQ(response.axis().kind(), v1::AXIS_KIND_FACET_A);
  EXPECT_EQ(response.axis().direction().x(), 1);
  EXPECT_EQ(response.axis().feature_a().vertex_indices_size(), 4);
  EXPECT_EQ(response.axis().feature_a().xyz_size(), 12);
  EXPECT_EQ(response.axis().feature_a().xyz(0), 1);
  EXPECT_EQ(response.axis().feature_b().xyz(0), 0);
  EXPECT_EQ(response.analysis().size_a().vertices(), 8);
  EXPECT_EQ(response.analysis().size_b().edges(), 12);
  EXPECT_EQ(response.analysis().size_b().facets(), 6);
  EXPECT_EQ(response.analysis().axes_total(), 6 + 6 + 12 * 12);
  EXPECT_EQ(response.analysis().stage(), v1::AXIS_KIND_FACET_A);
}

TEST_F(CheckCollisionCall, AnEmptyHullIsSeparatedFromAll) {
  Put("cube", Cube());
  Create("empty");
  for (const v1::Method method : {v1::METHOD_CERTIFIED_SEARCH, v1::METHOD_TEXTBOOK_SAT}) {
    v1::CheckCollisionRequest request = Pair(PlacementOf("cube"), PlacementOf("empty"), method);
    request.mutable_wanted()->set_axis(true);
    const v1::CheckCollisionResponse response = Check(request);
    EXPECT_EQ(response.relation(), v1::RELATION_SEPARATED);
    EXPECT_FALSE(response.has_axis());
  }
}

TEST_F(CheckCollisionCall, ReadersSeeEachCommittedChunk) {
  Appender appender(*hulls_, "grow", "w", true);
  Put("point", {10, 0, 0});
  for (uint64_t i = 1; i <= 10; ++i) {
    ASSERT_TRUE(appender.Append(i, {static_cast<double>(i), 0, 0}).has_value());
    const v1::Relation relation = Check(Pair(PlacementOf("grow"), PlacementOf("point"))).relation();
    EXPECT_EQ(relation, i < 10 ? v1::RELATION_SEPARATED : v1::RELATION_TOUCHING);
  }
}

// A reader thread answers the first query of a hull and prepares the query data; the arriving
// thread answers later ones.
TEST_F(CheckCollisionCall, AnswersDoNotDependOnWhereTheyAreComputed) {
  Put("cube", Cube());
  Put("ball", Sphere(200, 1.25));
  v1::CheckCollisionRequest request;
  *request.mutable_a() = PlacementOf("cube");
  *request.mutable_b() = PlacementOf("ball");
  const v1::CheckCollisionResponse first = Check(request);
  EXPECT_EQ(first.relation(), v1::RELATION_OVERLAPPING);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(Check(request).ShortDebugString(), first.ShortDebugString());
  }
  request.mutable_wanted()->set_axis(true);
  EXPECT_EQ(Check(request).ShortDebugString(), first.ShortDebugString());
  ASSERT_TRUE(Delete("ball").ok());
  request.clear_wanted();
  EXPECT_EQ(CheckError(request).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(CheckCollisionCall, ErrorsNameTheField) {
  Put("cube", Cube());
  const auto expect = [&](const v1::CheckCollisionRequest& request, grpc::StatusCode code,
                          const std::string& what) {
    const grpc::Status status = CheckError(request);
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(what));
  };
  const v1::Placement cube = PlacementOf("cube");
  v1::CheckCollisionRequest half;
  *half.mutable_a() = cube;
  expect(half, grpc::StatusCode::INVALID_ARGUMENT, "b is missing");
  expect(Pair(cube, PlacementOf("x/")), grpc::StatusCode::INVALID_ARGUMENT,
         "b.hull_id \"x/\" has an empty segment");
  expect(Pair(PlacementOf("nope"), cube), grpc::StatusCode::NOT_FOUND, "hull \"nope\" not found");
  v1::Placement zero = cube;
  zero.mutable_pose()->mutable_rotation();
  expect(Pair(zero, cube), grpc::StatusCode::INVALID_ARGUMENT, "a.pose.rotation is zero");
  expect(Pair(cube, PlacementOf("cube", 0, 0, std::numeric_limits<double>::infinity())),
         grpc::StatusCode::INVALID_ARGUMENT, "b.pose.translation.z is infinite");
  expect(Pair(cube, cube, static_cast<v1::Method>(7)), grpc::StatusCode::INVALID_ARGUMENT,
         "method is 7");
}

TEST_F(CheckCollisionCall, MalformedOrConflictingRequestsAreRejected) {
  Put("cube", Cube());
  const auto expect = [&](const std::function<void(v1::CheckCollisionRequest*)>& change,
                          const std::string& what) {
    v1::CheckCollisionRequest request = Pair(PlacementOf("cube"), PlacementOf("cube", 3));
    change(&request);
    const grpc::Status status = CheckError(request);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(what));
  };
  expect([](auto* r) { r->set_tolerance(-0.5); }, "tolerance is -0.5; it must be a length");
  expect([](auto* r) { r->set_tolerance(NAN); }, "tolerance is NaN");
  expect([](auto* r) { r->mutable_wanted()->set_max_error(-1); }, "wanted.max_error is -1");
  expect([](auto* r) { r->mutable_wanted()->set_clearance(NAN); }, "wanted.clearance is NaN");
  const auto exclude = [&](const std::function<void(v1::CheckCollisionRequest*)>& change,
                           const std::string& what) {
    expect(
        [&](v1::CheckCollisionRequest* request) {
          request->set_tolerance(0.1);
          change(request);
        },
        "tolerance is 0.1, but " + what);
  };
  exclude([](auto* r) { r->set_method(v1::METHOD_TEXTBOOK_SAT); }, "METHOD_TEXTBOOK_SAT");
  exclude([](auto* r) { r->mutable_wanted()->set_certificate(true); }, "wanted.certificate");
  exclude([](auto* r) { r->mutable_wanted()->set_separation(true); }, "wanted.separation");
  exclude([](auto* r) { r->mutable_wanted()->set_witness(true); }, "wanted.witness");
  exclude([](auto* r) { r->mutable_wanted()->set_clearance(1); }, "wanted.clearance");
}

TEST_F(CheckCollisionCall, DetailsAreReturnedOnRequest) {
  Put("cube", Cube());
  Create("empty");
  const auto check = [&](const v1::Placement& b, double clearance) {
    v1::CheckCollisionRequest request = Pair(PlacementOf("cube"), b);
    request.mutable_wanted()->set_certificate(true);
    request.mutable_wanted()->set_separation(true);
    request.mutable_wanted()->set_witness(true);
    request.mutable_wanted()->set_normal(true);
    request.mutable_wanted()->set_clearance(clearance);
    return Check(request);
  };
  const v1::CheckCollisionResponse apart = check(PlacementOf("cube", 3), 2);
  EXPECT_LE(std::abs(apart.separation().value() - 2), apart.separation().bound());
  EXPECT_LE(apart.separation().bound(), 1e-11);
  EXPECT_TRUE(apart.within_clearance());
  EXPECT_NEAR(apart.witness().point_a().x(), 1, apart.witness().error());
  EXPECT_NEAR(apart.witness().point_b().x(), 3, apart.witness().error());
  EXPECT_LE(apart.witness().error(), 1e-11);
  EXPECT_NEAR(apart.normal().direction().x(), 1, 1e-11);
  EXPECT_LE(apart.normal().angle_bound(), 1e-6);
  EXPECT_TRUE(apart.certificate().has_direction());
  EXPECT_FALSE(check(PlacementOf("cube", 3), std::nextafter(2, 0)).within_clearance());
  const v1::CheckCollisionResponse touching = check(PlacementOf("cube", 1), 0);
  EXPECT_EQ(touching.separation().value(), 0);
  EXPECT_TRUE(touching.within_clearance());
  EXPECT_GT(touching.certificate().pairs_size(), 0);
  const v1::CheckCollisionResponse deep = check(PlacementOf("cube", 0.5), 0);
  EXPECT_LE(std::abs(deep.separation().value() + 0.5), deep.separation().bound());
  EXPECT_TRUE(deep.within_clearance());
  EXPECT_EQ(deep.normal().direction().x(), 1);
  EXPECT_LE(deep.normal().angle_bound(), 1e-10);
  const v1::CheckCollisionResponse nothing = check(PlacementOf("empty"), 5);
  EXPECT_EQ(nothing.separation().value(), std::numeric_limits<double>::infinity());
  EXPECT_FALSE(nothing.has_normal());
  EXPECT_TRUE(nothing.has_within_clearance());
  EXPECT_FALSE(nothing.within_clearance());
  EXPECT_FALSE(nothing.has_witness() || nothing.has_certificate());
  const v1::CheckCollisionResponse bare = Check(Pair(PlacementOf("cube"), PlacementOf("cube", 3)));
  EXPECT_FALSE(bare.has_separation() || bare.has_witness() || bare.has_certificate() ||
               bare.has_within_clearance());
}

TEST_F(CheckCollisionCall, AToleranceAllowsAnAnswerWithinTolerance) {
  Put("cube", Cube());
  const auto relation = [&](double x, double tolerance) {
    v1::CheckCollisionRequest request = Pair(PlacementOf("cube"), PlacementOf("cube", x));
    request.set_tolerance(tolerance);
    return Check(request).relation();
  };
  EXPECT_EQ(relation(3, 0.5), v1::RELATION_SEPARATED);
  EXPECT_EQ(relation(0, 0.5), v1::RELATION_OVERLAPPING);
  EXPECT_EQ(relation(1, 0.5), v1::RELATION_WITHIN_TOLERANCE);
  EXPECT_EQ(relation(1, 0), v1::RELATION_TOUCHING);
}

TEST_F(CheckCollisionCall, TextbookAxesAreLimited) {
  Config config = TestConfig();
  config.limits.max_textbook_axes = 155;
  Restart(config);
  Put("cube", Cube());
  const grpc::Status status =
      CheckError(Pair(PlacementOf("cube"), PlacementOf("cube", 3), v1::METHOD_TEXTBOOK_SAT));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("the limit is 155 (--max-textbook-axes)"));
  EXPECT_EQ(Check(Pair(PlacementOf("cube"), PlacementOf("cube", 3))).relation(),
            v1::RELATION_SEPARATED);
}

TEST_F(CheckCollisionCall, ADeadlineEndsALongTextbookQuery) {
  Put("ball", Sphere(700));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(200));
  v1::CheckCollisionResponse response;
  const grpc::Status status = collisions_->CheckCollision(
      &context, Pair(PlacementOf("ball"), PlacementOf("ball", 0.5), v1::METHOD_TEXTBOOK_SAT),
      &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  // Its thread is free again: a short query gets through.
  Put("small", Sphere(100));
  EXPECT_EQ(Check(Pair(PlacementOf("small"), PlacementOf("small", 5), v1::METHOD_TEXTBOOK_SAT))
                .relation(),
            v1::RELATION_SEPARATED);
}

}  // namespace collision_service_test
}  // namespace hulld::server
