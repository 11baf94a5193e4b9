// Several processes that are active at once over one PostgreSQL database. Clients go from one to
// another, and what they saw is checked against the specification.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <cstdlib>
#include <functional>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/harness/history_client.h"
#include "tests/server/harness/hull_history.h"
#include "tests/server/harness/hulld_process.h"
#include "tests/server/harness/postgres/postgres_cluster.h"

namespace hulld::server {
namespace {

class ManyServers : public ::testing::Test {
 protected:
  static constexpr int kServers = 3;
  static constexpr int kClients = 6;

  void SetUp() override {
    if (!PostgresCluster::IsInstalled()) GTEST_SKIP() << PostgresCluster::kMissing;
  }

  // Servers over an empty database.
  void Begin() {
    servers_.clear();
    addresses_.clear();
    PostgresCluster& cluster = PostgresCluster::Shared();
    conninfo_ = cluster.WriteConninfo(cluster.MakeDatabase());
    for (int i = 0; i < kServers; ++i) servers_.push_back(Start());
    for (int i = 0; i < kServers; ++i) addresses_.push_back(AddressOf(*servers_[i]));
  }

  std::unique_ptr<Process> Start() const {
    return std::make_unique<Process>(std::vector<std::string>{
        "--listen", "127.0.0.1:0", "--store", "postgres", "--postgres-conninfo-file", conninfo_,
        "--postgres-servers", "many"});
  }
  // It must come to listen.
  static std::string AddressOf(Process& hulld) {
    const std::string line = hulld.ReadLineWith("listening on ");
    if (line.empty()) {
      for (const std::string& said : hulld.lines()) ADD_FAILURE() << said;
      std::abort();
    }
    return AddressIn(line);
  }
  std::shared_ptr<grpc::Channel> Connect(size_t server) {
    const std::lock_guard lock(mutex_);
    grpc::ChannelArguments own;
    own.SetInt("hulld.test.channel", ++channels_);
    return grpc::CreateCustomChannel(addresses_[server], grpc::InsecureChannelCredentials(), own);
  }
  void Replace(size_t server) {
    servers_[server] = Start();
    const std::string address = AddressOf(*servers_[server]);
    const std::lock_guard lock(mutex_);
    addresses_[server] = address;
  }

  // Every client goes to another server now and then. fault: called once, when half of the calls
  // were made.
  void Run(int calls, uint64_t seed, const std::function<void()>& fault, HullHistory& history) {
    HistoryClient(Connect(0), history, "probe", 0).MakeProbe();
    std::atomic<int> made = 0;
    std::vector<std::thread> clients;
    for (int i = 0; i < kClients; ++i) {
      clients.emplace_back([&, i] {
        std::mt19937_64 random(100 * seed + i);
        HistoryClient client(Connect(i % kServers), history, absl::StrCat("client-", i),
                             100 * seed + i);
        for (int call = 0; call < calls; ++call) {
          const bool is_answered = client.CallAtRandom(call % 3 == 0 ? "shared/a" : "shared/b");
          if (!is_answered || random() % 5 == 0) client.Connect(Connect(random() % kServers));
          ++made;
          made.notify_one();
        }
      });
    }
    int seen = 0;
    while ((seen = made) < kClients * calls / 2) made.wait(seen);
    fault();
    for (std::thread& client : clients) client.join();
  }

  // How many runs: few unless HULLD_MANY_RUNS says otherwise.
  static int Runs() {
    const char* const runs = std::getenv("HULLD_MANY_RUNS");
    return runs == nullptr ? 2 : std::atoi(runs);
  }

  std::string conninfo_;
  std::vector<std::unique_ptr<Process>> servers_;
  std::mutex mutex_;
  // Guarded by mutex_.
  std::vector<std::string> addresses_;
  int channels_ = 0;
};

TEST_F(ManyServers, ClientsThatGoFromOneToAnotherSeeOneStore) {
  for (int run = 0; run < Runs(); ++run) {
    Begin();
    HullHistory history;
    Run(
        80, run, [] {}, history);
    ASSERT_EQ(HistoryFault(history), "") << "run " << run;
    size_t acknowledged = 0;
    for (const auto& [hull_id, operations] : history.operations()) {
      for (const Operation& operation : operations) {
        acknowledged += operation.outcome == Operation::Outcome::kOk;
      }
    }
    EXPECT_GT(acknowledged, size_t{kClients * 80 / 2});
  }
}

TEST_F(ManyServers, TheOthersGoOnWhenOneIsKilled) {
  for (int run = 0; run < Runs(); ++run) {
    Begin();
    HullHistory history;
    const size_t victim = run % kServers;
    Run(
        80, 1000 + run,
        [&] {
          servers_[victim]->Signal(SIGKILL);
          servers_[victim]->Wait();
          Replace(victim);
        },
        history);
    ASSERT_EQ(HistoryFault(history), "") << "run " << run;
  }
}

TEST_F(ManyServers, OneThatStoodStillFindsWhatTheOthersDid) {
  Begin();
  HullHistory history;
  Run(
      80, 2000,
      [&] {
        servers_[0]->Signal(SIGSTOP);
        HistoryClient client(Connect(1), history, "meanwhile", 2);
        for (int call = 0; call < 20; ++call) client.CallAtRandom("shared/a");
        servers_[0]->Signal(SIGCONT);
      },
      history);
  EXPECT_EQ(HistoryFault(history), "");
}

}  // namespace
}  // namespace hulld::server
