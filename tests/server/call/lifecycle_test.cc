#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <thread>

#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace lifecycle_test {

using ::testing::HasSubstr;

// Calls of grpc.health and grpc.reflection; Debian does not ship their generated code.
class Lifecycle : public ServerTest {
 protected:
  static grpc::ByteBuffer Bytes(const std::string& text) {
    const grpc::Slice slice(text);
    return grpc::ByteBuffer(&slice, 1);
  }

  static std::string Text(const grpc::ByteBuffer& buffer) {
    std::vector<grpc::Slice> slices;
    if (!buffer.Dump(&slices).ok()) return "";
    std::string text;
    for (const grpc::Slice& slice : slices) {
      text.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
    }
    return text;
  }

  // Returns the reply to the only message of a call; empty if none.
  std::string Call(const std::string& method, const std::string& request) {
    grpc::GenericStub stub(channel_);
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    const auto stream = stub.PrepareCall(&context, method, &queue);
    const auto done = [&queue] {
      void* tag = nullptr;
      bool ok = false;
      return queue.Next(&tag, &ok) && ok;
    };
    grpc::ByteBuffer reply;
    stream->StartCall(nullptr);
    if (!done()) return "";
    stream->Write(Bytes(request), nullptr);
    if (!done()) return "";
    stream->WritesDone(nullptr);
    if (!done()) return "";
    stream->Read(&reply, nullptr);
    const bool replied = done();
    grpc::Status status;
    stream->Finish(&status, nullptr);
    done();
    return replied ? Text(reply) : "";
  }

  // Returns HealthCheckResponse.status of a service: 1 SERVING, 2 NOT_SERVING; 0 for none.
  int Health(const std::string& service) {
    const std::string request =
        service.empty() ? "" : "\n" + std::string(1, static_cast<char>(service.size())) + service;
    const std::string reply = Call("/grpc.health.v1.Health/Check", request);
    return reply.size() == 2 && reply[0] == 8 ? reply[1] : 0;
  }

  grpc::Status GetStatus() {
    grpc::ClientContext context;
    v1::GetStatusResponse response;
    return status_->GetStatus(&context, {}, &response);
  }
};

TEST_F(Lifecycle, EveryServiceIsHealthyUntilTheServerDrains) {
  const std::vector<std::string> services = {"", "hulld.v1.HullService",
                                             "hulld.v1.CollisionService", "hulld.v1.StatusService"};
  for (const std::string& service : services) EXPECT_EQ(Health(service), 1) << service;
  EXPECT_EQ(Health("hulld.v1.None"), 0);
  server_->BeginDrain();
  for (const std::string& service : services) EXPECT_EQ(Health(service), 2) << service;
}

TEST_F(Lifecycle, ReflectionListsTheServices) {
  const std::string reply =
      Call("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", {':', '\0'});
  for (const char* service : {"hulld.v1.HullService", "hulld.v1.CollisionService",
                              "hulld.v1.StatusService", "grpc.health.v1.Health"}) {
    EXPECT_THAT(reply, HasSubstr(service));
  }
}

TEST_F(Lifecycle, DrainingRefusesNewCallsAndLetsRunningOnesFinish) {
  Create("h");
  Put("cube", Cube());
  Appender running(*hulls_, "h", "w");
  ASSERT_TRUE(running.Append(1, Cube()).has_value());
  server_->BeginDrain();

  const grpc::Status refused = GetStatus();
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(refused.error_message(), HasSubstr("shutting down"));
  Appender late(*hulls_, "h", "late");
  EXPECT_FALSE(late.is_open());
  EXPECT_EQ(late.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  grpc::ClientContext mesh_context;
  v1::GetHullMeshRequest mesh_request;
  EXPECT_EQ(hulls_->GetHullMesh(&mesh_context, mesh_request)->Finish().error_code(),
            grpc::StatusCode::UNAVAILABLE);
  grpc::ClientContext batch_context;
  EXPECT_EQ(collisions_->BatchCheckCollisions(&batch_context, {})->Finish().error_code(),
            grpc::StatusCode::UNAVAILABLE);

  EXPECT_FALSE(server_->WaitIdle(std::chrono::milliseconds(0)));
  EXPECT_TRUE(running.Append(2, {5, 5, 5}).has_value());
  EXPECT_TRUE(running.Finish().ok());
  EXPECT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
}

TEST_F(Lifecycle, EndingTheServerCancelsRunningCalls) {
  Put("ball", Sphere(700));
  Create("h");
  Appender idle(*hulls_, "h", "w");
  ASSERT_TRUE(idle.is_open());
  v1::BatchCheckCollisionsRequest request;
  request.set_method(v1::METHOD_TEXTBOOK_SAT);
  *request.add_placements() = PlacementOf("ball", 5);
  *request.add_placements() = PlacementOf("ball", 0.5);
  request.add_pairs(0);
  request.add_pairs(1);
  for (int i = 0; i < 10'000; ++i) {
    request.add_pairs(1);
    request.add_pairs(1);
  }
  grpc::ClientContext context;
  auto stream = collisions_->BatchCheckCollisions(&context, request);
  v1::BatchCheckCollisionsResponse part;
  ASSERT_TRUE(stream->Read(&part));
  server_.reset();
  while (stream->Read(&part)) {
  }
  EXPECT_FALSE(stream->Finish().ok());
  EXPECT_FALSE(idle.Finish().ok());
}

TEST_F(Lifecycle, ATakenPortIsReported) {
  Config config = TestConfig();
  config.listen = server_->address();
  const absl::Status status = Server::Start(config).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()),
              HasSubstr("cannot listen on " + config.listen + ": the port is in use"));
}

TEST_F(Lifecycle, ReachableAddressesAreRefused) {
  Config config = TestConfig();
  config.listen = "0.0.0.0:0";
  const absl::Status status = Server::Start(config).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("--insecure"));
  config.insecure = true;
  EXPECT_TRUE(Server::Start(config).ok());
}

TEST_F(Lifecycle, ServesUnixSocketsAndDoesNotTakeThemOver) {
  Config config = TestConfig();
  config.listen = "unix:" + ::testing::TempDir() + "/hulld_lifecycle_test.sock";
  Restart(config);
  EXPECT_TRUE(GetStatus().ok());
  const absl::Status status = Server::Start(config).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), HasSubstr("another server is listening"));
  EXPECT_TRUE(GetStatus().ok());
}

TEST_F(Lifecycle, MessagesLargerThanTheLimitAreRefused) {
  Config config = TestConfig();
  config.limits.max_message_bytes = 1000;
  Restart(config);
  Create("h");
  Appender appender(*hulls_, "h", "w");
  ASSERT_TRUE(appender.is_open());
  EXPECT_FALSE(appender.Append(1, Coordinates(300, 1.0)).has_value());
  EXPECT_EQ(appender.Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

}  // namespace lifecycle_test
}  // namespace hulld::server
