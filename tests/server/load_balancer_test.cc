// Tests of docker/haproxy/haproxy.cfg: haproxy in front of several processes.

#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <memory>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "client/appender.h"
#include "client/client.h"
#include "tests/server/harness/hulld_process.h"
#include "tests/source_tree.h"

namespace hulld::server {
namespace load_balancer_test {

constexpr char kHaproxy[] = "/usr/sbin/haproxy";
// Two servers, and the address of a third that is not running.
class LoadBalancer : public ::testing::Test {
 protected:
  void SetUp() override {
    if (access(kHaproxy, X_OK) != 0) GTEST_SKIP() << kHaproxy << " is not installed";
    std::ostringstream text;
    text << std::ifstream(SourceTree() / "docker/haproxy/haproxy.cfg").rdbuf();
    for (int i = 0; i < 2; ++i) {
      servers_[i] = Start();
      addresses_[i] = AddressIn(servers_[i]->ReadLineWith("listening on "));
    }
    const std::string settings =
        absl::StrReplaceAll(text.str(), {{"bind :50551", absl::StrCat("bind ", address_)},
                                         {"hulld-1:50551", addresses_[0]},
                                         {"hulld-2:50551", addresses_[1]},
                                         {"hulld-3:50551", UnusedAddress()}});
    settings_ = ::testing::TempDir() + absl::StrCat("haproxy.", getpid(), ".cfg");
    std::ofstream(settings_) << settings;
    haproxy_ =
        std::make_unique<Process>(kHaproxy, std::vector<std::string>{"-db", "-f", settings_});
    // haproxy's last finding: it checks the third server first within a second.
    EXPECT_NE(haproxy_->ReadLineWith("hulld-3 is DOWN"), "");
  }
  void TearDown() override {
    if (!settings_.empty()) std::remove(settings_.c_str());
  }

  static std::unique_ptr<Process> Start() {
    return std::make_unique<Process>(std::vector<std::string>{
        "--store", "memory", "--listen", "127.0.0.1:0", "--drain-timeout", "600"});
  }
  // Connects over a separate connection.
  static Client Connect(const std::string& address) {
    ClientOptions options;
    options.server = address;
    options.own_connection = true;
    return Client(options);
  }
  static std::string StoreOf(const Client& client) {
    const auto status = client.GetStatus();
    if (!status.ok()) throw std::runtime_error(status.status().ToString());
    return status->header().store_id();
  }

  const std::string address_ = UnusedAddress();
  std::unique_ptr<Process> servers_[2];
  std::string addresses_[2];
  std::string settings_;
  std::unique_ptr<Process> haproxy_;
};

TEST_F(LoadBalancer, ConnectionsAreSpreadOverServingServers) {
  std::vector<Client> clients;
  std::set<std::string> stores;
  for (int i = 0; i < 8; ++i) {
    clients.push_back(Connect(address_));
    stores.insert(StoreOf(clients.back()));
  }
  EXPECT_EQ(stores.size(), 2);
}

// Streams on the draining server continue; later calls go to another server, and none fails.
TEST_F(LoadBalancer, DrainingServersAreAvoided) {
  const Client client = Connect(address_);
  const std::string leaving = StoreOf(client);
  AppendOptions options;
  options.create_if_absent = true;
  auto stream = client.OpenAppend("h", options);
  ASSERT_TRUE(stream.ok()) << stream.status();
  Client other = Connect(address_);
  while (StoreOf(other) == leaving) other = Connect(address_);
  Process& server = *servers_[StoreOf(Connect(addresses_[0])) == leaving ? 0 : 1];
  server.Signal(SIGTERM);
  EXPECT_NE(server.ReadLineWith("draining"), "");
  for (int in_turn = 0; in_turn < 20;) {
    in_turn = StoreOf(client) == leaving ? 0 : in_turn + 1;
  }
  v1::PointBlock point;
  for (const double x : {1, 2, 3}) point.add_xyz(x);
  EXPECT_TRUE((*stream)->Append(point).ok());
  EXPECT_TRUE((*stream)->Finish().ok());
  stream->reset();
  EXPECT_EQ(server.Wait(), 0);
}

}  // namespace load_balancer_test
}  // namespace hulld::server
