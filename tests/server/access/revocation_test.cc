// Open calls end when their token is revoked.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "client/calls/grpc_status.h"
#include "tests/server/harness/captured_log.h"
#include "tests/server/harness/test_certificates.h"
#include "tests/server/harness/test_server.h"
#include "tests/server/harness/test_tokens.h"

namespace hulld::server {
namespace revocation_test {

using ::testing::HasSubstr;

class Revocation : public ServerTest {
 protected:
  void SetUp() override {
    path_ = testing::TempDir() + "/hulld_revocation_test_" + std::to_string(getpid());
    kept_ = TokenLine("kept", "admin", "*", "kept secret");
    WriteSecret(path_, kept_ + TokenLine("gone", "admin", "*", "gone secret"));
    Config config = TestConfig();
    config.tokens_file = path_;
    Restart(config);
    grpc::ClientContext context;
    Be(context, "kept secret");
    const auto append = hulls_->AppendPoints(&context);
    v1::AppendPointsResponse reply;
    ASSERT_TRUE(append->Write(OpenMessage("cube", "w", true)) && append->Read(&reply));
    ASSERT_TRUE(append->Write(ChunkMessage(1, Cube())) && append->Read(&reply));
    append->WritesDone();
    ASSERT_TRUE(append->Finish().ok());
  }
  ~Revocation() override { std::filesystem::remove(path_); }

  // The deadline bounds calls that a faulty server leaves open; no passing test waits for it.
  static void Be(grpc::ClientContext& context, const std::string& token) {
    Authorize(context, token);
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(1));
  }

  void ReplaceTokens(const std::string& lines) {
    WriteSecret(path_, lines);
    server_->ReloadFiles();
  }

  static void ExpectRevoked(const grpc::Status& status) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr("no longer valid"));
    EXPECT_EQ(ReasonOf(FromGrpcStatus(status)), v1::ERROR_REASON_TOKEN_UNKNOWN);
  }

  std::string path_;
  std::string kept_;
};

TEST_F(Revocation, EndsIdleStreamsOfTheRevokedTokenOnly) {
  v1::AppendPointsResponse appended;
  v1::WatchHullsResponse change;
  v1::StreamCollisionsResponse answer;
  v1::StreamCollisionsRequest open;
  *open.mutable_open()->add_placements() = PlacementOf("cube");
  *open.mutable_open()->add_placements() = PlacementOf("cube", 9);
  open.mutable_open()->add_pairs(0);
  open.mutable_open()->add_pairs(1);

  grpc::ClientContext append_context;
  Be(append_context, "gone secret");
  const auto append = hulls_->AppendPoints(&append_context);
  ASSERT_TRUE(append->Write(OpenMessage("cube", "g")) && append->Read(&appended));
  grpc::ClientContext watch_context;
  Be(watch_context, "gone secret");
  const auto watch = hulls_->WatchHulls(&watch_context, {});
  ASSERT_TRUE(watch->Read(&change));
  grpc::ClientContext poses_context;
  Be(poses_context, "gone secret");
  const auto poses = collisions_->StreamCollisions(&poses_context);
  ASSERT_TRUE(poses->Write(open) && poses->Read(&answer));
  v1::WatchCollisionsResponse event;
  v1::WatchCollisionsRequest pairs;
  *pairs.mutable_open()->mutable_placements() = open.open().placements();
  grpc::ClientContext pairs_context;
  Be(pairs_context, "gone secret");
  const auto watched_pairs = collisions_->WatchCollisions(&pairs_context);
  ASSERT_TRUE(watched_pairs->Write(pairs) && watched_pairs->Read(&event));
  grpc::ClientContext kept_context;
  Be(kept_context, "kept secret");
  const auto kept = collisions_->StreamCollisions(&kept_context);
  ASSERT_TRUE(kept->Write(open) && kept->Read(&answer));

  const CapturedLog log;
  ReplaceTokens(kept_);
  while (append->Read(&appended)) {
  }
  ExpectRevoked(append->Finish());
  while (watch->Read(&change)) {
  }
  ExpectRevoked(watch->Finish());
  while (poses->Read(&answer)) {
  }
  ExpectRevoked(poses->Finish());
  while (watched_pairs->Read(&event)) {
  }
  ExpectRevoked(watched_pairs->Finish());

  v1::StreamCollisionsRequest update;
  update.mutable_update()->add_placements(1);
  for (const double number : {1.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0}) {
    update.mutable_update()->add_poses(number);
  }
  ASSERT_TRUE(kept->Write(update) && kept->Read(&answer));
  kept->WritesDone();
  EXPECT_TRUE(kept->Finish().ok());
  server_.reset();
  EXPECT_THAT(log.text(), HasSubstr("info ended 4 calls whose tokens were revoked"));
}

TEST_F(Revocation, EndsRunningComputations) {
  // 5e9 pairs take hours.
  v1::FindCollisionsRequest request;
  for (int i = 0; i < 100'000; ++i) *request.add_placements() = PlacementOf("cube");
  grpc::ClientContext context;
  Be(context, "gone secret");
  const auto scene = collisions_->FindCollisions(&context, request);
  v1::FindCollisionsResponse part;
  ASSERT_TRUE(scene->Read(&part));
  ReplaceTokens(kept_);
  while (scene->Read(&part)) {
  }
  ExpectRevoked(scene->Finish());
  EXPECT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
}

// A stream that waits for its client to read cannot send the reason, but it ends.
TEST_F(Revocation, EndsCallsWithoutAReader) {
  v1::FindCollisionsRequest request;
  for (int i = 0; i < 20'000; ++i) *request.add_placements() = PlacementOf("cube");
  request.mutable_wanted()->set_witness(true);
  grpc::ClientContext context;
  Be(context, "gone secret");
  const auto scene = collisions_->FindCollisions(&context, request);
  v1::FindCollisionsResponse part;
  ASSERT_TRUE(scene->Read(&part));
  ReplaceTokens(kept_);
  EXPECT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
}

// The last token is removed with its line, with all content, with the file, or by a dangling link.
TEST_F(Revocation, RevokingTheLastTokenRefusesEverything) {
  const auto create = [this](const std::string& token) {
    grpc::ClientContext context;
    Be(context, token);
    v1::CreateHullRequest request;
    request.set_hull_id("after");
    request.set_if_absent(true);
    v1::CreateHullResponse response;
    return hulls_->CreateHull(&context, request, &response);
  };
  const std::vector<std::function<void()>> ways = {
      [this] { WriteSecret(path_, "# nobody\n"); },
      [this] { WriteSecret(path_, ""); },
      [this] { std::filesystem::remove(path_); },
      [this] {
        std::filesystem::remove(path_);
        std::filesystem::create_symlink(path_ + ".gone", path_);
      },
  };
  for (size_t way = 0; way < ways.size(); ++way) {
    SCOPED_TRACE(way);
    std::filesystem::remove(path_);
    ReplaceTokens(kept_);
    ASSERT_TRUE(create("kept secret").ok());
    grpc::ClientContext context;
    Be(context, "kept secret");
    const auto watch = hulls_->WatchHulls(&context, {});
    v1::WatchHullsResponse change;
    ASSERT_TRUE(watch->Read(&change));
    CapturedLog log;
    ways[way]();
    server_->ReloadFiles();
    server_->ReloadFiles();
    while (watch->Read(&change)) {
    }
    ExpectRevoked(watch->Finish());
    ExpectRevoked(create("kept secret"));
    ExpectRevoked(create("gone secret"));
    EXPECT_THAT(log.text(), HasSubstr("error --tokens-file " + path_));
    // Logged once.
    EXPECT_EQ(log.text().find("all tokens are revoked"),
              log.text().rfind("all tokens are revoked"));
  }
}

// An unreadable file revokes nothing.
TEST_F(Revocation, IsNotCausedByAnUnreadableFile) {
  ReplaceTokens(kept_ + "half a li");
  grpc::ClientContext context;
  Be(context, "gone secret");
  v1::GetStatusResponse response;
  EXPECT_TRUE(status_->GetStatus(&context, {}, &response).ok());
}

// The name stays, but the token or its rights change.
TEST_F(Revocation, IncludesChangesOfTheTokenOrItsRights) {
  const std::string narrower = TokenLine("gone", "read-only", "cell-1/", "gone secret");
  for (const std::string& line : {TokenLine("gone", "admin", "*", "next secret"), narrower}) {
    ReplaceTokens(kept_ + TokenLine("gone", "admin", "*", "gone secret"));
    grpc::ClientContext context;
    Be(context, "gone secret");
    const auto watch = hulls_->WatchHulls(&context, {});
    v1::WatchHullsResponse change;
    ASSERT_TRUE(watch->Read(&change));
    ReplaceTokens(kept_ + line);
    while (watch->Read(&change)) {
    }
    ExpectRevoked(watch->Finish());
  }
}

}  // namespace revocation_test
}  // namespace hulld::server
