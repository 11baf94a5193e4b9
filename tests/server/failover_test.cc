// Two processes over one PostgreSQL database: the second waits as a standby and takes over.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <memory>
#include <string>
#include <vector>

#include "client/appender.h"
#include "client/client.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "tests/server/harness/hulld_process.h"
#include "tests/server/harness/postgres/postgres_cluster.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace failover_test {

using ::testing::HasSubstr;
using ::testing::Not;

class Failover : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!PostgresCluster::IsInstalled()) GTEST_SKIP() << PostgresCluster::kMissing;
    PostgresCluster& cluster = PostgresCluster::Shared();
    conninfo_ = cluster.WriteConninfo(cluster.MakeDatabase());
  }

  std::unique_ptr<Process> Start(const std::vector<std::string>& options = {},
                                 const std::string& address = "127.0.0.1:0") const {
    std::vector<std::string> arguments = {
        "--listen", address, "--store", "postgres", "--postgres-conninfo-file", conninfo_};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return std::make_unique<Process>(arguments);
  }
  static std::unique_ptr<v1::HullService::Stub> Connect(Process& hulld) {
    return v1::HullService::NewStub(grpc::CreateChannel(
        AddressIn(hulld.ReadLineWith("listening on ")), grpc::InsecureChannelCredentials()));
  }
  static void Put(v1::HullService::Stub& stub, const Coordinates& xyz) {
    Appender appender(stub, "h", "w", true);
    ASSERT_TRUE(appender.Append(appender.opened().last_sequence() + 1, xyz));
    EXPECT_TRUE(appender.Finish().ok());
  }
  static uint64_t Received(v1::HullService::Stub& stub) {
    grpc::ClientContext context;
    v1::GetHullRequest request;
    v1::GetHullResponse response;
    request.set_hull_id("h");
    request.set_audit(true);
    const grpc::Status status = stub.GetHull(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    EXPECT_TRUE(response.audit().ok());
    return response.hull().counts().received();
  }

  std::string conninfo_;
};

TEST_F(Failover, TheNextServerTakesOverWhenTheActiveOneIsKilled) {
  const std::unique_ptr<Process> active = Start();
  Put(*Connect(*active), Cube());
  const std::unique_ptr<Process> next = Start();
  EXPECT_NE(next->ReadLineWith("another hulld is active on this database"), "");
  active->Signal(SIGKILL);
  const auto stub = Connect(*next);
  EXPECT_EQ(Received(*stub), 8);
  Put(*stub, {9, 9, 9});
  EXPECT_EQ(Received(*stub), 9);
}

// A writer and a reader, given both addresses, never learn which server is active.
TEST_F(Failover, ClientsThatKnowBothServersContinue) {
  const std::string addresses[] = {UnusedAddress(), UnusedAddress()};
  std::unique_ptr<Process> active = Start({}, addresses[0]);
  EXPECT_NE(active->ReadLineWith("listening on "), "");
  std::unique_ptr<Process> next = Start({}, addresses[1]);
  EXPECT_NE(next->ReadLineWith("another hulld is active on this database"), "");

  ClientOptions options;
  options.server = absl::StrCat(addresses[0], ",", addresses[1]);
  options.timeout = std::chrono::minutes(2);
  options.retry.max_attempts = 10000;
  options.retry.max_backoff = std::chrono::milliseconds(20);
  const Client client(options);
  AppendOptions append;
  append.create_if_absent = true;
  auto appender = client.OpenAppend("h", append);
  ASSERT_TRUE(appender.ok()) << appender.status();
  constexpr int kPoints = 40;
  for (int i = 0; i < kPoints; ++i) {
    v1::PointBlock point;
    for (const double x : {1., 1. * i, 1. * i * i}) point.add_xyz(x);
    ASSERT_TRUE((*appender)->Append(point).ok());
    if (i != kPoints / 2) continue;
    ASSERT_TRUE(client.GetHull("h").ok());
    active->Signal(SIGKILL);
  }
  const absl::Status finished = (*appender)->Finish();
  EXPECT_TRUE(finished.ok()) << finished;
  const auto hull = client.GetHull("h");
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->hull().counts().received(), kPoints);
  EXPECT_GE((*appender)->totals().reconnects, 1);
}

// The suspended process may resume at any later time; it must then exit without changing anything.
TEST_F(Failover, TheNextServerTakesOverWhenTheActiveOneHangs) {
  const std::unique_ptr<Process> active = Start();
  const auto former = Connect(*active);
  Put(*former, Cube());
  const std::unique_ptr<Process> next = Start();
  EXPECT_NE(next->ReadLineWith("another hulld is active on this database"), "");
  active->Signal(SIGSTOP);
  const auto stub = Connect(*next);
  Put(*stub, {9, 9, 9});
  active->Signal(SIGCONT);
  Appender appender(*former, "h", "late");
  appender.Append(1, {7, 7, 7});
  EXPECT_FALSE(appender.Finish().ok());
  EXPECT_NE(active->ReadLineWith("another hulld took over the store"), "");
  EXPECT_EQ(active->Wait(), 1);
  EXPECT_EQ(Received(*stub), 9);
}

TEST_F(Failover, TakingOverEndsTheActiveServer) {
  const std::unique_ptr<Process> active = Start();
  Put(*Connect(*active), Cube());
  const std::unique_ptr<Process> next = Start({"--take-over"});
  EXPECT_EQ(Received(*Connect(*next)), 8);
  EXPECT_EQ(active->Wait(), 1);
}

TEST_F(Failover, AServerThatWaitsEndsCleanlyOnASignal) {
  const std::unique_ptr<Process> active = Start();
  active->ReadLineWith("listening on ");
  const std::unique_ptr<Process> next = Start();
  EXPECT_NE(next->ReadLineWith("another hulld is active on this database"), "");
  next->Signal(SIGTERM);
  EXPECT_EQ(next->Wait(), 0);
  active->Signal(SIGTERM);
  EXPECT_EQ(active->Wait(), 0);
}

TEST_F(Failover, NoLogLineContainsThePassword) {
  const std::unique_ptr<Process> active = Start({"--log-level", "debug"});
  active->ReadLineWith("listening on ");
  active->Signal(SIGTERM);
  active->ReadToEnd();
  EXPECT_EQ(active->Wait(), 0);
  for (const std::string& line : active->lines()) {
    EXPECT_THAT(line, Not(HasSubstr(PostgresCluster::kPassword)));
  }
}

}  // namespace failover_test
}  // namespace hulld::server
