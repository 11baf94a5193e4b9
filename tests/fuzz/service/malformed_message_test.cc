// Regression tests for findings of the raw calls in service_program.cc.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hulld/v1/collision.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "server/server.h"
#include "tests/fuzz/service/raw_call.h"

namespace hulld::fuzz {
namespace malformed_message_test {

using server::Rpc;
using testing::HasSubstr;

// A length beyond the end.
constexpr char kCutShort[] = "\x0a\x7f";

class MalformedMessage : public testing::Test {
 protected:
  void SetUp() override {
    server::Config config;
    config.listen = "127.0.0.1:0";
    config.store = "memory";
    auto started = server::Server::Start(config);
    ASSERT_TRUE(started.ok()) << started.status().ToString();
    server_ = *std::move(started);
    channel_ = grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials());
  }

  grpc::Status Send(Rpc rpc, std::vector<std::string> messages) {
    grpc::GenericStub stub(channel_);
    grpc::ClientContext context;
    return MakeRawCall(stub, context, {rpc, std::move(messages), true});
  }

  std::unique_ptr<server::Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
};

// Formerly, these streams ended OK, as if half-closed.
TEST_F(MalformedMessage, FirstOfAStreamIsRefused) {
  for (const Rpc rpc : {Rpc::kAppendPoints, Rpc::kStreamCollisions, Rpc::kWatchCollisions}) {
    const grpc::Status status = Send(rpc, {kCutShort});
    EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT) << server::RpcName(rpc);
    EXPECT_THAT(status.error_message(), HasSubstr("a message is malformed"));
  }
}

// Formerly, these ended UNIMPLEMENTED, because gRPC parsed them.
TEST_F(MalformedMessage, AMalformedUnaryRequestIsRefused) {
  for (const Rpc rpc :
       {Rpc::kCreateHull, Rpc::kGetHull, Rpc::kGetHullMesh, Rpc::kListHulls, Rpc::kDeleteHull,
        Rpc::kCheckCollision, Rpc::kBatchCheckCollisions, Rpc::kFindCollisions, Rpc::kGetStatus,
        Rpc::kSaveBackup, Rpc::kPutBody, Rpc::kGetBody, Rpc::kListBodies, Rpc::kDeleteBody}) {
    const grpc::Status status = Send(rpc, {kCutShort});
    EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT) << server::RpcName(rpc);
    EXPECT_THAT(status.error_message(), HasSubstr("a message is malformed"));
  }
}

TEST_F(MalformedMessage, AMalformedStreamMessageKeepsEarlierOnes) {
  v1::AppendPointsRequest open;
  open.mutable_open()->set_hull_id("a");
  open.mutable_open()->set_create_if_absent(true);
  const std::string opening = open.SerializeAsString();
  EXPECT_EQ(Send(Rpc::kAppendPoints, {opening, kCutShort}).error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_EQ(Send(Rpc::kAppendPoints, {opening}).error_code(), grpc::OK);
  v1::GetHullRequest get;
  get.set_hull_id("a");
  EXPECT_EQ(Send(Rpc::kGetHull, {get.SerializeAsString()}).error_code(), grpc::OK);

  v1::StreamCollisionsRequest ask;
  ask.mutable_open();
  EXPECT_EQ(Send(Rpc::kStreamCollisions, {ask.SerializeAsString(), kCutShort}).error_code(),
            grpc::INVALID_ARGUMENT);
  EXPECT_EQ(Send(Rpc::kStreamCollisions, {ask.SerializeAsString()}).error_code(), grpc::OK);
}

// An empty message is a message; the absence of a message is an end.
TEST_F(MalformedMessage, DiffersFromAnEmptyMessageAndFromNone) {
  for (const Rpc rpc : {Rpc::kAppendPoints, Rpc::kStreamCollisions, Rpc::kWatchCollisions}) {
    EXPECT_EQ(Send(rpc, {}).error_code(), grpc::OK) << server::RpcName(rpc);
    EXPECT_THAT(Send(rpc, {""}).error_message(), HasSubstr("the message is empty"));
  }
}

// The message is compressed to a thousandth of its size: formerly, 64 MiB were unpacked before they
// were counted.
TEST_F(MalformedMessage, CompressedMessagesAreNotDecompressed) {
  const auto stub = v1::HullService::NewStub(channel_);
  v1::CreateHullRequest request;
  request.set_hull_id(std::string(64 << 20, 'a'));
  for (const auto algorithm : {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE}) {
    grpc::ClientContext context;
    context.set_compression_algorithm(algorithm);
    v1::CreateHullResponse response;
    const grpc::Status status = stub->CreateHull(&context, request, &response);
    EXPECT_EQ(status.error_code(), grpc::UNIMPLEMENTED) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr("ompression algorithm"));
  }
}

}  // namespace malformed_message_test
}  // namespace hulld::fuzz
