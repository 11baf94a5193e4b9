// Error reasons as parsed by the client library: distinctions that a program can make without
// parsing text.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <optional>
#include <string>

#include "client/calls/grpc_status.h"
#include "client/client.h"
#include "server/access/caller.h"
#include "server/contract/errors.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace error_reason_test {

using Metadata = std::map<std::string, std::string>;

class ErrorReasons : public ServerTest {
 protected:
  Client MakeClient() const {
    ClientOptions options;
    options.retry.max_attempts = 1;
    return Client(options, channel_);
  }

  static void Expect(const absl::Status& status, absl::StatusCode code, v1::ErrorReason reason,
                     const Metadata& metadata) {
    EXPECT_EQ(status.code(), code) << status;
    EXPECT_EQ(v1::ErrorReason_Name(hulld::ReasonOf(status)), v1::ErrorReason_Name(reason));
    for (const auto& [key, value] : metadata) {
      EXPECT_EQ(hulld::MetadataOf(status, key), value) << key;
    }
  }
  static void Expect(const grpc::Status& status, absl::StatusCode code, v1::ErrorReason reason,
                     const Metadata& metadata) {
    Expect(FromGrpcStatus(status), code, reason, metadata);
  }
};

TEST_F(ErrorReasons, HullsAreNamed) {
  const Client client = MakeClient();
  const v1::HullInfo hull = Create("arm/3");
  Expect(client.GetHull("none").status(), absl::StatusCode::kNotFound,
         v1::ERROR_REASON_HULL_NOT_FOUND, {{"hull_id", "none"}});
  Expect(client.CreateHull("arm/3").status(), absl::StatusCode::kAlreadyExists,
         v1::ERROR_REASON_HULL_EXISTS, {{"hull_id", "arm/3"}});
  Expect(client.CreateHull("/").status(), absl::StatusCode::kInvalidArgument,
         v1::ERROR_REASON_INVALID_REQUEST, {});
  Expect(client.DeleteHull("arm/3", 77).status(), absl::StatusCode::kAborted,
         v1::ERROR_REASON_REVISION_MISMATCH,
         {{"hull_id", "arm/3"},
          {"if_revision", "77"},
          {"current_revision", std::to_string(hull.revision())}});
}

TEST_F(ErrorReasons, ReplacingAMissingHullReportsRevisionZero) {
  v1::ReplaceOpen open;
  open.set_hull_id("none");
  open.set_if_revision(5);
  const auto feed = [](const Client::PointSink& sink) {
    v1::PointBlock points;
    for (const double x : {1, 2, 3}) points.add_xyz(x);
    return sink(points);
  };
  Expect(MakeClient().ReplaceHull(open, feed).status(), absl::StatusCode::kAborted,
         v1::ERROR_REASON_REVISION_MISMATCH,
         {{"hull_id", "none"}, {"if_revision", "5"}, {"current_revision", "0"}});
}

TEST_F(ErrorReasons, AGapNamesTheExpectedSequence) {
  Appender writer(*hulls_, "h", "w", /*create_if_absent=*/true);
  ASSERT_TRUE(writer.Append(1, Cube()).has_value());
  EXPECT_TRUE(writer.Send(ChunkMessage(5, Cube())));
  Expect(writer.Finish(), absl::StatusCode::kFailedPrecondition, v1::ERROR_REASON_SEQUENCE_GAP,
         {{"hull_id", "h"}, {"sequence", "5"}, {"expected_sequence", "2"}});
}

TEST_F(ErrorReasons, AStreamToADeletedHullReportsThatItIsGone) {
  Appender writer(*hulls_, "h", "w", /*create_if_absent=*/true);
  ASSERT_TRUE(writer.is_open());
  ASSERT_TRUE(Delete("h").ok());
  Expect(writer.Finish(), absl::StatusCode::kFailedPrecondition, v1::ERROR_REASON_HULL_GONE,
         {{"hull_id", "h"}});
}

TEST_F(ErrorReasons, LimitsNameTheirFlagAndTheirNumber) {
  Config config = TestConfig();
  config.limits.max_hulls = 1;
  config.limits.max_calls = 1;
  Restart(config);
  Create("first");
  // A call releases its slot after its reply is sent.
  ASSERT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
  Expect(MakeClient().CreateHull("second").status(), absl::StatusCode::kResourceExhausted,
         v1::ERROR_REASON_LIMIT_EXCEEDED, {{"flag", "max-hulls"}, {"limit", "1"}});
  ASSERT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
  Appender running(*hulls_, "first", "w");
  ASSERT_TRUE(running.is_open());
  const absl::Status full = MakeClient().GetHull("first").status();
  Expect(full, absl::StatusCode::kResourceExhausted, v1::ERROR_REASON_OVERLOADED,
         {{"flag", "max-calls"}, {"limit", "1"}});
  EXPECT_TRUE(RetryHintOf(full).has_value());
  EXPECT_TRUE(running.Finish().ok());
}

TEST_F(ErrorReasons, ALimitOfAQueryNamesItsNumberToo) {
  Config config = TestConfig();
  config.limits.max_textbook_axes = 155;
  Restart(config);
  Put("cube", Cube());
  v1::CheckCollisionRequest pair;
  *pair.mutable_a() = PlacementOf("cube");
  *pair.mutable_b() = PlacementOf("cube", 3);
  pair.set_method(v1::METHOD_TEXTBOOK_SAT);
  Expect(MakeClient().CheckCollision(pair).status(), absl::StatusCode::kResourceExhausted,
         v1::ERROR_REASON_LIMIT_EXCEEDED, {{"flag", "max-textbook-axes"}, {"limit", "155"}});
}

TEST_F(ErrorReasons, DrainingAndAStoreInMemoryHaveTheirOwnReasons) {
  const Client client = MakeClient();
  Expect(client.SaveBackup([](const auto&) { return absl::OkStatus(); }),
         absl::StatusCode::kFailedPrecondition, v1::ERROR_REASON_STORE_IN_MEMORY, {});
  server_->BeginDrain();
  Expect(client.GetHull("h").status(), absl::StatusCode::kUnavailable, v1::ERROR_REASON_DRAINING,
         {});
}

TEST_F(ErrorReasons, ProblemsInRepliesHaveReasons) {
  Put("cube", Cube());
  v1::BatchCheckCollisionsRequest request;
  *request.add_placements() = PlacementOf("cube");
  *request.add_placements() = PlacementOf("none");
  *request.add_placements() = PlacementOf("/");
  for (const uint32_t i : {0, 0, 0, 1, 0, 2}) request.add_pairs(i);
  std::map<uint32_t, v1::ErrorReason> reasons;
  const absl::Status status = MakeClient().BatchCheckCollisions(request, [&](const auto& part) {
    for (const v1::PlacementProblem& problem : part.placement_problems()) {
      reasons[problem.placement()] = problem.reason();
    }
    return absl::OkStatus();
  });
  ASSERT_TRUE(status.ok()) << status;
  const std::map<uint32_t, v1::ErrorReason> expected = {{1, v1::ERROR_REASON_HULL_NOT_FOUND},
                                                        {2, v1::ERROR_REASON_INVALID_REQUEST}};
  EXPECT_EQ(reasons, expected);
}

TEST_F(ErrorReasons, ErrorsOfGrpcHaveNoReason) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() - std::chrono::seconds(1));
  v1::GetStatusResponse response;
  const grpc::Status late = status_->GetStatus(&context, {}, &response);
  Expect(late, absl::StatusCode::kDeadlineExceeded, v1::ERROR_REASON_UNSPECIFIED, {});
  // gRPC's status of a call that reaches a server during its shutdown.
  Expect(grpc::Status(grpc::StatusCode::CANCELLED, ""), absl::StatusCode::kUnavailable,
         v1::ERROR_REASON_UNSPECIFIED, {});
  // A domain other than hulld's.
  Expect(absl::UnavailableError("elsewhere"), absl::StatusCode::kUnavailable,
         v1::ERROR_REASON_UNSPECIFIED, {});
}

TEST(ErrorInfo, IsCarriedUnderAPrefixAndImpliedByItsCode) {
  const absl::Status given =
      Prefixed("chunk 3: ", WithReason(absl::AbortedError("no"), v1::ERROR_REASON_HULL_GONE,
                                       {{"hull_id", "a"}, {"sequence", uint64_t{7}}}));
  EXPECT_EQ(ReasonOf(given), v1::ERROR_REASON_HULL_GONE);
  EXPECT_EQ(MetadataOf(given, "hull_id"), "a");
  EXPECT_EQ(MetadataOf(given, "sequence"), "7");
  EXPECT_EQ(MetadataOf(given, "limit"), std::nullopt);
  EXPECT_EQ(ReasonOf(absl::InvalidArgumentError("x")), v1::ERROR_REASON_INVALID_REQUEST);
  EXPECT_EQ(ReasonOf(absl::DataLossError("x")), v1::ERROR_REASON_HULL_DAMAGED);
  EXPECT_EQ(ReasonOf(absl::CancelledError("x")), v1::ERROR_REASON_UNSPECIFIED);
  EXPECT_FALSE(ErrorInfoOf(absl::InternalError("x")).has_value());
}

TEST(ErrorInfo, PermissionErrorsNameTheMissingPermission) {
  const absl::Status low = CheckPermission({"bob", Permission::kRead, ""}, Rpc::kDeleteHull);
  EXPECT_EQ(ReasonOf(low), v1::ERROR_REASON_ROLE_TOO_LOW);
  EXPECT_EQ(MetadataOf(low, "role"), "read-only");
  EXPECT_EQ(MetadataOf(low, "needed_role"), "read-write");
  const absl::Status outside =
      CheckHullId({"bob", Permission::kRead, "cell/"}, "other/1", "hull_id");
  EXPECT_EQ(ReasonOf(outside), v1::ERROR_REASON_OUTSIDE_PREFIX);
  EXPECT_EQ(MetadataOf(outside, "prefix"), "cell/");
}

}  // namespace error_reason_test
}  // namespace hulld::server
