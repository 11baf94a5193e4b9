// Tests of the hulld program: start, calls, termination by a signal.

#include "tests/server/harness/hulld_process.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "client/appender.h"
#include "client/client.h"
#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "hulld/v1/status.grpc.pb.h"

namespace hulld::server {
namespace hulld_process_test {

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

// Returns the fields of /proc/PID/stat after the name, which may contain any character.
std::vector<std::string> StatFields(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string text;
  std::getline(file, text);
  std::istringstream rest(text.substr(text.rfind(')') + 1));
  return {std::istream_iterator<std::string>(rest), {}};
}

// A thread of lower priority starves when another program is busy, and so does every thread that
// waits for it.
TEST(HulldProgram, EveryThreadHasThePriorityOfTheProcess) {
  constexpr size_t kNice = 16;
  Process hulld({"--store", "memory", "--listen", "127.0.0.1:0"});
  const std::string address = AddressIn(hulld.ReadLineWith("listening on "));
  const auto stub = v1::CollisionService::NewStub(
      grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  // After a batch, because threads may start lazily.
  grpc::ClientContext context;
  v1::BatchCheckCollisionsRequest request;
  request.add_placements()->set_hull_id("none");
  for (int i = 0; i < 20'000; ++i) request.add_pairs(0);
  const auto answers = stub->BatchCheckCollisions(&context, request);
  v1::BatchCheckCollisionsResponse part;
  while (answers->Read(&part)) {
  }
  ASSERT_TRUE(answers->Finish().ok());
  const std::filesystem::path process = "/proc/" + std::to_string(hulld.pid());
  size_t threads = 0;
  for (const auto& thread : std::filesystem::directory_iterator(process / "task")) {
    const std::vector<std::string> fields = StatFields(thread.path() / "stat");
    ASSERT_GT(fields.size(), kNice);
    EXPECT_EQ(fields[kNice], StatFields("/proc/self/stat").at(kNice)) << thread.path();
    ++threads;
  }
  EXPECT_GT(threads, 4u);
}

TEST(HulldProgram, APortInUseAndAnInvalidFlagAreFatal) {
  Process first({"--store", "memory", "--listen", "127.0.0.1:0"});
  const std::string address = AddressIn(first.ReadLineWith("listening on "));
  Process second({"--store", "memory", "--listen", address});
  EXPECT_NE(second.ReadLineWith("the port is in use"), "");
  EXPECT_EQ(second.Wait(), 1);
  Process third({"--max-hulls", "none"});
  EXPECT_NE(third.ReadLineWith("--max-hulls"), "");
  EXPECT_EQ(third.Wait(), 2);
  Process fourth({"--store", "memory", "--listen", "0.0.0.0:0"});
  EXPECT_NE(fourth.ReadLineWith("--insecure"), "");
  EXPECT_EQ(fourth.Wait(), 1);
}

TEST(HulldProgram, AnAddressInUseCreatesNoDirectory) {
  Process first({"--store", "memory", "--listen", "127.0.0.1:0"});
  const std::string address = AddressIn(first.ReadLineWith("listening on "));
  const std::string directory = ::testing::TempDir() + "/hulld_address_in_use";
  const std::string free = "127.0.0.1:0";
  for (const auto& [listen, metrics] : {std::pair(address, free), std::pair(free, address)}) {
    Process second({"--data-dir", directory, "--listen", listen, "--metrics-address", metrics});
    EXPECT_NE(second.ReadLineWith("the port is in use"), "");
    EXPECT_EQ(second.Wait(), 1);
    EXPECT_FALSE(std::filesystem::exists(directory)) << metrics;
  }
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
  EXPECT_NE(hulld.ReadLineWith("the drain timeout expired"), "");
  EXPECT_EQ(hulld.Wait(), 0);
}

// Calls of a client that knows both servers never fail during the drain, and soon use the second
// server only.
TEST(HulldProgram, ClientsOfADrainingServerMoveToAnother) {
  Process draining({"--store", "memory", "--listen", "127.0.0.1:0", "--drain-timeout", "600"});
  Process other({"--store", "memory", "--listen", "127.0.0.1:0"});
  const std::string address = AddressIn(draining.ReadLineWith("listening on "));
  ClientOptions options;
  options.server = absl::StrCat(address, ",", AddressIn(other.ReadLineWith("listening on ")));
  const Client client(options);
  const auto answering_store = [&client] {
    const auto status = client.GetStatus();
    if (!status.ok()) throw std::runtime_error(status.status().ToString());
    return status->header().store_id();
  };
  const std::string first = answering_store();
  std::string second = first;
  while (second == first) second = answering_store();

  // Delays the drain until the test has observed it.
  ClientOptions options_of_writer;
  options_of_writer.server = address;
  const Client writer(options_of_writer);
  const std::string leaving = writer.GetStatus()->header().store_id();
  AppendOptions append;
  append.create_if_absent = true;
  auto stream = writer.OpenAppend("h", append);
  ASSERT_TRUE(stream.ok()) << stream.status();
  draining.Signal(SIGTERM);
  for (int in_turn = 0; in_turn < 20;) {
    in_turn = answering_store() == leaving ? 0 : in_turn + 1;
  }
  // Running calls continue.
  v1::PointBlock point;
  for (const double x : {1, 2, 3}) point.add_xyz(x);
  EXPECT_TRUE((*stream)->Append(point).ok());
  EXPECT_TRUE((*stream)->Finish().ok());
  stream->reset();
  EXPECT_EQ(draining.Wait(), 0);
}

}  // namespace hulld_process_test
}  // namespace hulld::server
