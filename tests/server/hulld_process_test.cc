// The program itself: started, talked to, ended by a signal.

#include "tests/server/harness/hulld_process.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <string>

#include "hulld/v1/hull.grpc.pb.h"
#include "hulld/v1/status.grpc.pb.h"

namespace hulld::server {
namespace {

using ::testing::HasSubstr;

class HulldProcess : public ::testing::TestWithParam<int> {};

TEST_P(HulldProcess, ServesOnTheLoggedAddressAndEndsCleanlyOnASignal) {
  Process hulld({"--store", "memory", "--listen", "127.0.0.1:0", "--log-format", "json"});
  const std::string address = AddressIn(hulld.ReadLineWith("listening on "));
  ASSERT_THAT(address, HasSubstr("127.0.0.1:"));
  const auto stub =
      v1::StatusService::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  v1::GetStatusResponse response;
  EXPECT_TRUE(stub->GetStatus(&context, {}, &response).ok());
  hulld.Signal(GetParam());
  EXPECT_NE(hulld.ReadLineWith("draining"), "");
  EXPECT_NE(hulld.ReadLineWith("ended"), "");
  EXPECT_EQ(hulld.Wait(), 0);
  for (const std::string& line : hulld.lines()) {
    EXPECT_THAT(line, ::testing::StartsWith("{\"time\":\""));
    EXPECT_THAT(line, ::testing::EndsWith("\"}\n"));
  }
}

INSTANTIATE_TEST_SUITE_P(Signals, HulldProcess, ::testing::Values(SIGTERM, SIGINT));

TEST(HulldProgram, ATakenPortAndAWrongFlagEndItWithAnError) {
  Process first({"--store", "memory", "--listen", "127.0.0.1:0"});
  const std::string address = AddressIn(first.ReadLineWith("listening on "));
  Process second({"--store", "memory", "--listen", address});
  EXPECT_NE(second.ReadLineWith("the port is taken"), "");
  EXPECT_EQ(second.Wait(), 1);
  Process third({"--max-hulls", "none"});
  EXPECT_NE(third.ReadLineWith("--max-hulls"), "");
  EXPECT_EQ(third.Wait(), 2);
  Process fourth({"--store", "memory", "--listen", "0.0.0.0:0"});
  EXPECT_NE(fourth.ReadLineWith("--insecure"), "");
  EXPECT_EQ(fourth.Wait(), 1);
}

TEST(HulldProgram, AnIdleStreamDoesNotOutliveTheDrainTimeout) {
  Process hulld({"--store", "memory", "--listen", "127.0.0.1:0", "--drain-timeout", "0.05"});
  const std::string address = AddressIn(hulld.ReadLineWith("listening on "));
  const auto stub =
      v1::HullService::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  auto stream = stub->AppendPoints(&context);
  v1::AppendPointsRequest open;
  open.mutable_open()->set_hull_id("h");
  open.mutable_open()->set_create_if_absent(true);
  ASSERT_TRUE(stream->Write(open));
  v1::AppendPointsResponse response;
  ASSERT_TRUE(stream->Read(&response));
  hulld.Signal(SIGTERM);
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_FALSE(stream->Finish().ok());
  EXPECT_NE(hulld.ReadLineWith("the drain timeout passed"), "");
  EXPECT_EQ(hulld.Wait(), 0);
}

}  // namespace
}  // namespace hulld::server
