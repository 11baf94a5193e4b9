// Several hulld over a PostgreSQL primary with a synchronous standby, under load. Either database
// is suspended or permanently lost, with all data not yet sent to the other.
//
// HULLD_FAILOVERS: number of losses of the primary. HULLD_TEST_SEED: the seed.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/server/harness/history/history_client.h"
#include "tests/server/harness/postgres/many_servers.h"
#include "tests/server/harness/postgres/postgres_cluster.h"

namespace hulld::server {
namespace standby_test {

uint64_t NumberIn(const char* variable, uint64_t otherwise) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

class Standby : public ManyServersTest {
 protected:
  void SetUp() override {
    ManyServersTest::SetUp();
    if (IsSkipped()) return;
    primary_ = std::make_unique<PostgresCluster>();
    standby_ = std::make_unique<PostgresCluster>(PostgresCluster::StandbyOf{*primary_});
    const std::string hosts =
        absl::StrCat(primary_->socket_directory(), ",", standby_->socket_directory());
    const std::string database = primary_->MakeDatabase();
    Begin(std::vector<std::string>(kServers, primary_->WriteConninfo(database, hosts)));
  }

  // Suspends it: it neither closes connections nor answers, so every change waits.
  void StandStill(PostgresCluster& cluster) {
    cluster.Suspend();
    ExpectNoAnswer(0);
    cluster.Resume();
  }
  void ServerStandsStill(size_t i, HullHistory& history) {
    server(i).Signal(SIGSTOP);
    HistoryClient client(Connect((i + 1) % kServers), history, "meanwhile", i);
    for (int call = 0; call < 5; ++call) client.CallAtRandom("shared/a");
    server(i).Signal(SIGCONT);
  }
  // Kills the primary's machine and promotes the standby.
  void FailOver() {
    primary_->KillAll();
    standby_->Promote();
    std::swap(primary_, standby_);
  }

  std::unique_ptr<PostgresCluster> primary_;
  std::unique_ptr<PostgresCluster> standby_;
};

// Acknowledged changes are on both databases.
TEST_F(Standby, NothingAcknowledgedIsLostWhenItReplacesThePrimary) {
  const uint64_t seed = NumberIn("HULLD_TEST_SEED", 0);
  const uint64_t failovers = NumberIn("HULLD_FAILOVERS", 1);
  HullHistory history;
  std::vector<Fault> faults;
  for (uint64_t failover = 0; failover < failovers; ++failover) {
    if (failover > 0) faults.push_back([this] { standby_->Follow(*primary_); });
    faults.push_back([this] { StandStill(*primary_); });
    faults.push_back([this] { StandStill(*standby_); });
    faults.push_back([this, i = failover, &history] { ServerStandsStill(i % kServers, history); });
    faults.push_back([this, i = failover] { Replace((i + 1) % kServers); });
    faults.push_back([this] { FailOver(); });
  }
  Run({.each = 40 * static_cast<int>(failovers) + 40, .seed = seed}, faults, history);
  ExpectLinearizable(history, seed);
}

}  // namespace standby_test
}  // namespace hulld::server
