#include "client/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "client/calls/grpc_status.h"
#include "tests/client/fake_hulld.h"

namespace hulld {
namespace client_test {

using testing::ElementsAre;
using testing::HasSubstr;

class ClientTest : public testing::Test {
 protected:
  Client MakeClient(std::chrono::milliseconds timeout = std::chrono::seconds(30)) {
    ClientOptions options;
    options.server = fake_.address();
    options.timeout = timeout;
    options.retry.max_attempts = 4;
    options.retry.wait = [](std::chrono::milliseconds) {};
    return Client(options);
  }

  static std::string Text(const absl::Status& status) {
    return std::string(status.message().data(), status.message().size());
  }

  const grpc::Status unavailable_{grpc::StatusCode::UNAVAILABLE, "draining"};
  FakeHulld fake_;
};

TEST_F(ClientTest, ErrorsCarryTheServersCodeAndMessage) {
  const auto hull = MakeClient().GetHull("arm/3");
  EXPECT_EQ(hull.status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(std::string(hull.status().message()), "hull \"arm/3\" not found");
  EXPECT_EQ(ReasonOf(hull.status()), v1::ERROR_REASON_HULL_NOT_FOUND);
  EXPECT_EQ(MetadataOf(hull.status(), "hull_id"), "arm/3");
}

TEST_F(ClientTest, SafeCallsAreRetried) {
  fake_.PutHull("a", {});
  const Client client = MakeClient();
  for (const char* method : {"GetHull", "ListHulls", "CheckCollision", "GetStatus", "CreateHull",
                             "BatchCheckCollisions", "AppendPoints"}) {
    fake_.FailNext(method, {unavailable_, unavailable_});
  }
  EXPECT_TRUE(client.GetHull("a").ok());
  EXPECT_TRUE(client.ListHulls({}).ok());
  EXPECT_TRUE(client.CheckCollision({}).ok());
  EXPECT_TRUE(client.GetStatus().ok());
  EXPECT_TRUE(client.CreateHull("b", /*if_absent=*/true).ok());
  EXPECT_TRUE(client.BatchCheckCollisions({}, [](const auto&) { return absl::OkStatus(); }).ok());
  EXPECT_TRUE(client.OpenAppend("a").ok());
  for (const char* method : {"GetHull", "ListHulls", "CheckCollision", "GetStatus", "CreateHull",
                             "BatchCheckCollisions", "AppendPoints"}) {
    EXPECT_EQ(fake_.calls(method), 3) << method;
  }
}

// gRPC ends a call with CANCELLED if it reaches a server during its shutdown.
TEST_F(ClientTest, CallsAndStreamsSurviveTheShutdownOfAServer) {
  fake_.PutHull("a", {});
  v1::GetHullMeshResponse header;
  header.mutable_header();
  fake_.mesh_parts = {header};
  const grpc::Status cancelled(grpc::StatusCode::CANCELLED, "CANCELLED");
  for (const char* method : {"GetHull", "GetHullMesh", "BatchCheckCollisions", "AppendPoints"}) {
    fake_.FailNext(method, {cancelled});
  }
  const Client client = MakeClient();
  EXPECT_TRUE(client.GetHull("a").ok());
  EXPECT_TRUE(client.GetHullMesh("a").ok());
  EXPECT_TRUE(client.BatchCheckCollisions({}, [](const auto&) { return absl::OkStatus(); }).ok());
  EXPECT_TRUE(client.OpenAppend("a").ok());
}

TEST_F(ClientTest, UnsafeCallsAreNotRetried) {
  fake_.PutHull("a", {});
  fake_.FailNext("DeleteHull", {unavailable_});
  fake_.FailNext("CreateHull", {unavailable_});
  const Client client = MakeClient();
  EXPECT_TRUE(absl::IsUnavailable(client.DeleteHull("a").status()));
  EXPECT_TRUE(absl::IsUnavailable(client.CreateHull("b").status()));
  EXPECT_EQ(fake_.calls("DeleteHull"), 1);
  EXPECT_EQ(fake_.calls("CreateHull"), 1);
}

TEST_F(ClientTest, RetriesStopAfterTheAllowedAttempts) {
  fake_.FailNext("GetStatus", std::vector<grpc::Status>(10, unavailable_));
  EXPECT_EQ(MakeClient().GetStatus().status(), absl::UnavailableError("draining"));
  EXPECT_EQ(fake_.calls("GetStatus"), 4);
}

TEST_F(ClientTest, AServerThatDoesNotAnswerCausesADeadlineError) {
  fake_.Hang("GetHull");
  const auto hull = MakeClient(std::chrono::milliseconds(50)).GetHull("a");
  EXPECT_TRUE(absl::IsDeadlineExceeded(hull.status())) << hull.status();
}

TEST_F(ClientTest, ACollisionStreamWithoutAnswerKeepsItsDeadlineError) {
  fake_.Hang("StreamCollisions");
  const auto stream = MakeClient(std::chrono::milliseconds(50)).OpenCollisionStream();
  for (int i = 0; i < 2; ++i) {
    const absl::Status status = stream->Open({}).status();
    EXPECT_TRUE(absl::IsDeadlineExceeded(status)) << status;
  }
  EXPECT_TRUE(absl::IsDeadlineExceeded(stream->Close()));
}

TEST_F(ClientTest, ClosingACollisionStreamWaitsNoLongerThanTheTimeout) {
  fake_.Hang("StreamCollisions end");
  const auto stream = MakeClient(std::chrono::milliseconds(50)).OpenCollisionStream();
  const absl::Status status = stream->Close();
  EXPECT_TRUE(absl::IsDeadlineExceeded(status)) << status;
}

TEST_F(ClientTest, TheLongestTimeoutIsAccepted) {
  fake_.PutHull("a", {});
  const auto hull = MakeClient(std::chrono::milliseconds::max()).GetHull("a");
  EXPECT_TRUE(hull.ok()) << hull.status();
}

TEST_F(ClientTest, NegativeTimeoutsAreNoLongerThanZero) {
  fake_.PutHull("a", {});
  const auto least = std::chrono::milliseconds::min();
  const auto hull = MakeClient(least).GetHull("a");
  EXPECT_TRUE(absl::IsDeadlineExceeded(hull.status())) << hull.status();
  const absl::Status saved =
      MakeClient().SaveBackup([](const auto&) { return absl::OkStatus(); }, least);
  EXPECT_TRUE(absl::IsDeadlineExceeded(saved)) << saved;
}

TEST_F(ClientTest, AMissingServerIsUnavailable) {
  ClientOptions options;
  options.server = "127.0.0.1:1";
  options.retry.max_attempts = 2;
  options.retry.wait = [](std::chrono::milliseconds) {};
  EXPECT_TRUE(absl::IsUnavailable(Client(options).GetStatus().status()));
}

TEST_F(ClientTest, ListingFollowsPagesUpToTheLimit) {
  for (const char* id : {"a", "b/1", "b/2", "b/3", "b/4", "b/5", "b/6", "b/7", "c"}) {
    fake_.PutHull(id, {});
  }
  const Client client = MakeClient();
  const auto all = client.ListAllHulls("");
  ASSERT_TRUE(all.ok()) << all.status();
  EXPECT_EQ(all->hulls_size(), 9);
  EXPECT_EQ(all->next_page_token(), "");
  const auto some = client.ListAllHulls("b/");
  ASSERT_EQ(some->hulls_size(), 7);
  EXPECT_EQ(some->hulls(6).hull_id(), "b/7");
  const auto limited = client.ListAllHulls("b/", 4);
  ASSERT_EQ(limited->hulls_size(), 4);
  EXPECT_NE(limited->next_page_token(), "");
}

TEST_F(ClientTest, StalePagesHaveAtLeastTheRevisionOfTheFirst) {
  for (const char* id : {"a", "b", "c", "d", "e", "f", "g"}) fake_.PutHull(id, {});
  ClientOptions options = MakeClient().options();
  // Pages stay linearizable by default and with empty freshness options.
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(Client(options).ListAllHulls("").ok());
    for (const v1::ListHullsRequest& request : fake_.list_requests()) {
      EXPECT_EQ(request.freshness().at_least_revision(), 0);
    }
    options.freshness.emplace();
  }
  options.freshness->mutable_max_staleness()->set_seconds(1);
  const size_t before = fake_.list_requests().size();
  ASSERT_TRUE(Client(options).ListAllHulls("").ok());
  const std::vector<v1::ListHullsRequest> requests = fake_.list_requests();
  ASSERT_EQ(requests.size(), before + 3);
  EXPECT_EQ(requests[before].freshness().at_least_revision(), 0);
  for (size_t i = before; i < requests.size(); ++i) {
    EXPECT_EQ(requests[i].freshness().max_staleness().seconds(), 1);
    if (i == before) continue;
    // The fake server's revision after each page.
    EXPECT_EQ(requests[i].freshness().at_least_revision(), 100 + i);
    EXPECT_EQ(requests[i].freshness().store_id(), "store");
  }
}

TEST_F(ClientTest, DeleteForwardsTheRevision) {
  FakeHull hull;
  hull.revision = 7;
  fake_.PutHull("a", hull);
  const Client client = MakeClient();
  EXPECT_TRUE(absl::IsAborted(client.DeleteHull("a", 6).status()));
  EXPECT_TRUE(client.DeleteHull("a", 7).ok());
}

v1::GetHullMeshResponse Header(uint64_t vertices, uint64_t facets) {
  v1::GetHullMeshResponse part;
  part.mutable_header()->mutable_hull()->set_vertex_count(vertices);
  part.mutable_header()->set_vertex_count(vertices);
  part.mutable_header()->set_facet_count(facets);
  return part;
}

v1::GetHullMeshResponse Vertices(const std::vector<double>& xyz) {
  v1::GetHullMeshResponse part;
  part.mutable_vertices()->mutable_xyz()->Add(xyz.begin(), xyz.end());
  return part;
}

v1::GetHullMeshResponse Facets(const std::vector<uint32_t>& sizes,
                               const std::vector<uint32_t>& indices) {
  v1::GetHullMeshResponse part;
  part.mutable_facets()->mutable_sizes()->Add(sizes.begin(), sizes.end());
  part.mutable_facets()->mutable_indices()->Add(indices.begin(), indices.end());
  return part;
}

TEST_F(ClientTest, AMeshIsAssembledFromItsParts) {
  fake_.mesh_parts = {Header(3, 2), Vertices({0, 0, 0, 1, 0, 0}), Vertices({0, 1, 0}),
                      Facets({3}, {0, 1, 2}), Facets({3}, {2, 1, 0})};
  const auto mesh = MakeClient().GetHullMesh("a");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertex_count(), 3u);
  EXPECT_THAT(mesh->facet_sizes, ElementsAre(3, 3));
  EXPECT_THAT(mesh->facet_indices, ElementsAre(0, 1, 2, 2, 1, 0));
}

TEST_F(ClientTest, AnInconsistentMeshIsRefused) {
  const Client client = MakeClient();
  const std::vector<double> xyz(9, 0.5);
  const std::vector<std::vector<v1::GetHullMeshResponse>> wrong = {
      {Header(4, 1), Vertices(xyz), Facets({3}, {0, 1, 2})},
      {Header(3, 2), Vertices(xyz), Facets({3}, {0, 1, 2})},
      {Header(3, 1), Vertices(xyz), Facets({3}, {0, 1, 3})},
      {Header(3, 1), Vertices(xyz), Facets({4000000000u}, {0, 1, 2})},
      {Header(3, 1), Vertices(xyz), Facets({2}, {0, 1, 2})},
      {Header(3, 1), v1::GetHullMeshResponse()},
      {Header(3, 1), Vertices({0, 0, 0, 1, 0, 0, 0, 1, NAN}), Facets({3}, {0, 1, 2})},
      {Header(3, 1), Vertices({0, 0, 0, 1, 0, 0, 0, INFINITY, 0}), Facets({3}, {0, 1, 2})},
  };
  for (const auto& parts : wrong) {
    fake_.mesh_parts = parts;
    EXPECT_TRUE(absl::IsInternal(client.GetHullMesh("a").status()));
  }
}

TEST_F(ClientTest, AnErrorOfTheReceiverEndsABatch) {
  fake_.batch_answers = std::vector<v1::BatchCheckCollisionsResponse>(3);
  int received = 0;
  const absl::Status status = MakeClient().BatchCheckCollisions({}, [&](const auto&) {
    ++received;
    return absl::UnavailableError("the receiver is full");
  });
  EXPECT_EQ(status, absl::UnavailableError("the receiver is full"));
  EXPECT_EQ(received, 1);
  EXPECT_EQ(fake_.calls("BatchCheckCollisions"), 1);
}

TEST_F(ClientTest, HealthReportsTheServersState) {
  const Client client = MakeClient();
  EXPECT_TRUE(client.CheckHealth().ok()) << client.CheckHealth();
  fake_.SetServing(false);
  EXPECT_TRUE(absl::IsFailedPrecondition(client.CheckHealth()));
}

}  // namespace client_test
}  // namespace hulld
