// The trail of changes: each change of a hull leaves one line in the log, which names the caller.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/server/harness/captured_log.h"
#include "tests/server/harness/test_certificates.h"
#include "tests/server/harness/test_server.h"
#include "tests/server/harness/test_tokens.h"

namespace hulld::server {
namespace trail_test {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kTraceparent[] = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01";

// Returns the value of a key in metadata; empty if missing.
std::string ValueOf(const std::multimap<grpc::string_ref, grpc::string_ref>& metadata,
                    const char* key) {
  const auto found = metadata.find(key);
  return found == metadata.end() ? "" : std::string(found->second.data(), found->second.size());
}

class Trail : public ServerTest {
 protected:
  void SetUp() override {
    path_ = testing::TempDir() + "/trail-tokens-" + std::to_string(getpid());
    WriteSecret(path_, TokenLine("robot", "read-write", "*", "robot's secret"));
    Config config = TestConfig();
    config.tokens_file = path_;
    Restart(config);
  }
  ~Trail() override { std::filesystem::remove(path_); }

  static void BeRobot(grpc::ClientContext& context, const std::string& request_id) {
    Authorize(context, "robot's secret");
    context.AddMetadata("x-request-id", request_id);
  }

  std::string path_;
};

TEST_F(Trail, EachChangeOfAHullNamesItsAuthor) {
  const CapturedLog log;
  grpc::ClientContext create_context;
  BeRobot(create_context, "c-1");
  v1::CreateHullRequest create;
  create.set_hull_id("a");
  v1::CreateHullResponse created;
  ASSERT_TRUE(hulls_->CreateHull(&create_context, create, &created).ok());

  grpc::ClientContext append_context;
  BeRobot(append_context, "a-1");
  const auto append = hulls_->AppendPoints(&append_context);
  v1::AppendPointsResponse reply;
  ASSERT_TRUE(append->Write(OpenMessage("a", "arm")) && append->Read(&reply));
  for (const uint64_t sequence : {1, 2}) {
    ASSERT_TRUE(append->Write(ChunkMessage(sequence, Cube(sequence))) && append->Read(&reply));
  }
  append->WritesDone();
  ASSERT_TRUE(append->Finish().ok());

  grpc::ClientContext replace_context;
  BeRobot(replace_context, "r-1");
  v1::ReplaceHullResponse replaced;
  const auto replace = hulls_->ReplaceHull(&replace_context, &replaced);
  v1::ReplaceHullRequest part;
  part.mutable_open()->set_hull_id("a");
  replace->Write(part);
  for (const double number : Cube()) part.mutable_points()->add_xyz(number);
  replace->Write(part);
  part.mutable_points()->clear_xyz();
  replace->Write(part);
  replace->WritesDone();
  ASSERT_TRUE(replace->Finish().ok());

  grpc::ClientContext delete_context;
  BeRobot(delete_context, "d-1");
  v1::DeleteHullRequest remove;
  remove.set_hull_id("a");
  v1::DeleteHullResponse removed;
  ASSERT_TRUE(hulls_->DeleteHull(&delete_context, remove, &removed).ok());

  server_.reset();  // so that nothing logs any more
  const std::string who = " token=robot peer=ipv4:127.0.0.1:[0-9]+ hull=a ";
  EXPECT_THAT(log.text(), ContainsRegex("info hull created rpc=CreateHull request_id=c-1" + who +
                                        "revision=1\n"));
  EXPECT_THAT(log.text(), ContainsRegex("info points appended rpc=AppendPoints request_id=a-1" +
                                        who + "revision=3 writer=arm chunks=2 points=16\n"));
  EXPECT_THAT(log.text(), ContainsRegex("info hull replaced rpc=ReplaceHull request_id=r-1" + who +
                                        "revision=4\n"));
  EXPECT_THAT(log.text(), ContainsRegex("info hull deleted rpc=DeleteHull request_id=d-1" + who +
                                        "revision=5\n"));
  EXPECT_THAT(log.text(), Not(HasSubstr("secret")));
}

TEST_F(Trail, AStreamThatChangedNothingLeavesNoLine) {
  Restart(TestConfig());
  Put("a", Cube());
  // Its line may come after its answer.
  ASSERT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
  const CapturedLog log;
  {
    Appender again(*hulls_, "a", "put");
    // Applied already.
    ASSERT_TRUE(again.Append(1, Cube()).has_value());
    ASSERT_TRUE(again.Finish().ok());
  }
  server_.reset();
  EXPECT_THAT(log.text(), Not(HasSubstr("points appended")));
}

// gRPC no longer knows the peer after the connection is closed.
TEST_F(Trail, ADisconnectedWriterIsStillNamed) {
  Restart(TestConfig());
  const CapturedLog log;
  for (int i = 0; i < 20; ++i) {
    const auto channel =
        grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(), [] {
          grpc::ChannelArguments own;
          own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
          return own;
        }());
    const auto stub = v1::HullService::NewStub(channel);
    Appender writer(*stub, "h" + std::to_string(i), "w", true);
    ASSERT_TRUE(writer.Append(1, Cube()).has_value());
    writer.Cancel();
  }
  ASSERT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
  server_.reset();
  EXPECT_THAT(log.text(), ContainsRegex("points appended .* peer=ipv4:127.0.0.1:[0-9]+ hull=h19 "));
  EXPECT_THAT(log.text(), Not(HasSubstr("peer=unknown")));
}

TEST_F(Trail, ATraceAppearsInTheLogAndTheReply) {
  const CapturedLog log;
  const auto ask = [this](const std::vector<std::string>& traceparents,
                          const std::string& hull_id) {
    grpc::ClientContext context;
    Authorize(context, "robot's secret");
    for (const std::string& text : traceparents) context.AddMetadata("traceparent", text);
    v1::CreateHullRequest request;
    request.set_hull_id(hull_id);
    v1::CreateHullResponse response;
    EXPECT_TRUE(hulls_->CreateHull(&context, request, &response).ok());
    return ValueOf(context.GetServerTrailingMetadata(), "traceparent");
  };
  EXPECT_EQ(ask({kTraceparent}, "a"), kTraceparent);
  // A malformed or repeated header does not count as a trace.
  EXPECT_EQ(ask({"00-00000000000000000000000000000000-b7ad6b7169203331-01"}, "b"), "");
  EXPECT_EQ(ask({kTraceparent, kTraceparent}, "c"), "");
  EXPECT_EQ(ask({}, "d"), "");
  server_.reset();
  EXPECT_THAT(log.text(),
              ContainsRegex("info hull created rpc=CreateHull request_id=[^ ]+ "
                            "trace_id=0af7651916cd43dd8448eb211c80319c parent_id=b7ad6b7169203331 "
                            "token=robot peer=[^ ]+ hull=a "));
  EXPECT_THAT(log.text(), ContainsRegex("request_id=[^ ]+ token=robot peer=[^ ]+ hull=b "));
}

}  // namespace trail_test
}  // namespace hulld::server
