// Histories of clients that call servers over two databases: hulls of both, bodies with pieces in
// both, and reads of any freshness, while servers are killed and the network to a database fails.
//
// HULLD_MANY_RUNS: how many of each kind; HULLD_TEST_SEED: the first seed.
#include "tests/server/shards/sharded_histories.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <vector>

#include "tests/server/harness/postgres/cutting_proxy.h"

namespace hulld::server {
namespace {

using Cut = CuttingProxy::Cut;

// Two of the servers are far from one database, each from another one: what they find there is
// older than what they find nearby.
TEST_F(ShardedHistories, BodiesOverTwoShardsAreReadAtAnyFreshnessWhileServersAreKilled) {
  uint64_t runs = 0;
  ForEachRun([&](uint64_t seed) {
    BeginBehindProxies();
    PutFarAway(seed);
    HullHistory history;
    std::vector<Fault> faults;
    for (size_t kill = 0; kill < 3; ++kill) {
      faults.push_back([this, victim = (seed + kill) % kServers] { Replace(victim); });
    }
    Run(CallsOf(5000 + seed), faults, history);
    ExpectLinearizable(history, seed);
    Count(history);
    ++runs;
  });
  ExpectAllKinds(runs);
}

// The network between a server and one of its databases loses a COMMIT, or the answer to one, tells
// nothing of what others did, is slow, or is down; the other database of that server goes on.
TEST_F(ShardedHistories, BodiesOverTwoShardsAreReadAtAnyFreshnessBehindANetworkThatCuts) {
  constexpr int kFaults = 6;
  uint64_t runs = 0;
  ForEachRun([&](uint64_t seed) {
    BeginBehindProxies();
    HullHistory history;
    std::mt19937_64 random(seed);
    std::vector<Fault> faults;
    for (int i = 0; i < kFaults; ++i) {
      const size_t victim = random() % kServers;
      CuttingProxy& network = proxy(victim, random() % kShards);
      switch (random() % 6) {
        case 0:
          faults.push_back([&network] { network.CutNext(Cut::kBeforeCommit); });
          break;
        case 1:
          faults.push_back([&network] { network.CutNext(Cut::kAfterCommit); });
          break;
        case 2:
          faults.push_back([&network] { network.CutListeners(); });
          break;
        case 3:
          faults.push_back([&network] { network.SetDeaf(true); });
          faults.push_back([&network] { network.SetDeaf(false); });
          break;
        case 4:
          faults.push_back([&network] { network.SetDelay(kFar); });
          break;
        default:
          faults.push_back([&network] { network.SetDown(true); });
          faults.push_back([&network] { network.SetDown(false); });
          break;
      }
    }
    Run(CallsOf(6000 + seed), faults, history);
    ExpectLinearizable(history, seed);
    Count(history);
    ++runs;
  });
  ExpectAllKinds(runs);
}

}  // namespace
}  // namespace hulld::server
