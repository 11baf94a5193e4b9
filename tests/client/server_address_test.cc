#include "client/server_address.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <vector>

#include "client/client.h"
#include "tests/client/fake_hulld.h"

namespace hulld {
namespace server_address_test {

using testing::HasSubstr;

std::string Problem(const std::string& server) {
  return std::string(ValidateServer(server).message());
}

TEST(ServerAddress, IsAHostAndPortOrAListOrATargetName) {
  for (const char* text : {"127.0.0.1:50551", "localhost:1", "[::1]:50551", "hull.example:65535",
                           "unix:/tmp/x", "unix:x", "unix:///tmp/x", "[fe80::1%eth0]:1",
                           "dns:///hull.example", "10.0.0.1:1,10.0.0.2:1", "[::1]:1,[fe80::1]:2"}) {
    EXPECT_TRUE(ValidateServer(text).ok()) << text;
  }
  for (const char* text :
       {"", "localhost", ":1", "localhost:", "localhost:0", "localhost:65536", "localhost:http",
        "localhost:+1", "http://localhost:1", "::1", "1:2:3", ",", "10.0.0.1:1,", "10.0.0.1:1,2",
        " localhost:1", "=localhost:1", "me@localhost:1", "unix:", "unix://x"}) {
    EXPECT_FALSE(ValidateServer(text).ok()) << text;
  }
  EXPECT_TRUE(ValidateServer("unix:" + std::string(107, 'x')).ok());
  EXPECT_THAT(Problem("unix:" + std::string(108, 'x')), HasSubstr("at most 107 characters"));
}

TEST(ServerAddress, InvalidListsSuggestValidOnes) {
  EXPECT_THAT(Problem("a.example:1,b.example:1"), HasSubstr("dns:///hulls.example:50551"));
  EXPECT_THAT(Problem("10.0.0.1:1,[::1]:1"), HasSubstr("use one kind"));
  EXPECT_THAT(Problem("10.0.0.1:1, 10.0.0.2:1"), HasSubstr("\" 10.0.0.2:1\""));
}

TEST(ServerAddress, ListsBecomeTargetNames) {
  EXPECT_EQ(TargetName("10.0.0.1:1,10.0.0.2:2"), "ipv4:10.0.0.1:1,10.0.0.2:2");
  EXPECT_EQ(TargetName("[::1]:1,[::2]:2"), "ipv6:[::1]:1,[::2]:2");
  EXPECT_EQ(TargetName("hull.example:1"), "hull.example:1");
  EXPECT_EQ(TargetName("unix:/tmp/a,b"), "unix:/tmp/a,b");
}

TEST(ServerAddress, IsLocalIfAllAddressesAreLocal) {
  for (const char* here : {"127.0.0.1:50551", "127.1.2.3:1", "localhost:1", "[::1]:1", "unix:/s",
                           "127.0.0.1:1,127.0.0.1:2"}) {
    EXPECT_TRUE(IsLoopback(here)) << here;
  }
  for (const char* elsewhere :
       {"127.0.0.1.example.org:50551", "127.example.org:1", "localhost.org:1", "10.0.0.1:1",
        "[::2]:1", "127.0.0.999:1", "127.0.0.1:1,10.0.0.1:1", "dns:///localhost:1"}) {
    EXPECT_FALSE(IsLoopback(elsewhere)) << elsewhere;
  }
}

TEST(ServerAddress, ACertificateForSeveralAddressesNeedsAName) {
  ConnectionSecurity security;
  security.tls = true;
  EXPECT_THAT(std::string(ValidateSecurity(security, "10.0.0.1:1,10.0.0.2:1").message()),
              HasSubstr("--server-name"));
  security.server_name = "hulls.example";
  EXPECT_TRUE(ValidateSecurity(security, "10.0.0.1:1,10.0.0.2:1").ok());
}

class SeveralServers : public testing::Test {
 protected:
  void SetUp() override {
    ClientOptions options;
    options.server.clear();
    for (auto& server : servers_) {
      server = std::make_unique<FakeHulld>();
      if (server != servers_.front()) options.server += ",";
      options.server += server->address();
    }
    options.own_connection = true;
    client_ = std::make_unique<Client>(options);
  }
  // Throws if the call fails, which ends any loop.
  void Call() const {
    const absl::Status status = client_->GetStatus().status();
    if (!status.ok()) throw std::runtime_error(status.ToString());
  }
  int CallsOf(size_t i) { return servers_[i]->calls("GetStatus"); }
  // Calls until 20 consecutive calls miss server `i`: the client notices with a delay.
  void CallUntilNoneReaches(size_t i) {
    for (int before = -1; before != CallsOf(i);) {
      before = CallsOf(i);
      for (int call = 0; call < 20; ++call) Call();
    }
  }

  std::vector<std::unique_ptr<FakeHulld>> servers_ = std::vector<std::unique_ptr<FakeHulld>>(3);
  std::unique_ptr<Client> client_;
};

TEST_F(SeveralServers, ShareTheCalls) {
  while (CallsOf(0) == 0 || CallsOf(1) == 0 || CallsOf(2) == 0) Call();
  const int before[] = {CallsOf(0), CallsOf(1), CallsOf(2)};
  for (int call = 0; call < 30; ++call) Call();
  for (size_t i = 0; i < 3; ++i) EXPECT_EQ(CallsOf(i) - before[i], 10);
}

TEST_F(SeveralServers, AreSkippedWhileTheyReportNotServing) {
  while (CallsOf(0) == 0) Call();
  servers_[0]->SetServing(false);
  CallUntilNoneReaches(0);
  const int before = CallsOf(0);
  servers_[0]->SetServing(true);
  while (CallsOf(0) == before) Call();
}

TEST_F(SeveralServers, CanStopWithoutFailedCalls) {
  while (CallsOf(0) == 0 || CallsOf(1) == 0) Call();
  servers_[0].reset();
  servers_[1].reset();
  for (int call = 0; call < 20; ++call) Call();
  EXPECT_GE(CallsOf(2), 20);
}

}  // namespace server_address_test
}  // namespace hulld
