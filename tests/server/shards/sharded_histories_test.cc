// Histories of clients that call servers over two databases: hulls of both, bodies with pieces in
// both, and reads of any freshness, while servers are killed and the network to a database fails.
//
// HULLD_MANY_RUNS: how many of each kind; HULLD_TEST_SEED: the first seed.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "server/shards/slots.h"
#include "tests/server/harness/postgres/cutting_proxy.h"
#include "tests/server/harness/postgres/many_servers.h"
#include "tests/server/harness/postgres/postgres_cluster.h"

namespace hulld::server {
namespace {

using Cut = CuttingProxy::Cut;
using Kind = Operation::Kind;
using Outcome = Operation::Outcome;

// In the first and in the second half of the slots: two hulls and two bodies.
constexpr const char* kHulls[] = {"shared/a", "shared/c"};
constexpr const char* kBodies[] = {"body/a", "body/c"};

uint64_t NumberIn(const char* variable, uint64_t otherwise) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

class ShardedHistories : public ManyServersTest {
 protected:
  static constexpr size_t kShards = 2;
  // Several times what an answer takes that is not delayed.
  static constexpr std::chrono::milliseconds kFar{5};

  void SetUp() override {
    ManyServersTest::SetUp();
    if (IsSkipped()) return;
    for (const auto& ids : {kHulls, kBodies}) {
      ASSERT_LT(SlotOf(ids[0]), kSlots / 2);
      ASSERT_GE(SlotOf(ids[1]), kSlots / 2);
    }
    std::string name = ::testing::TempDir() + "hulld_histories_XXXXXX";
    directory_ = mkdtemp(name.data());
  }
  void TearDown() override {
    if (!directory_.empty()) std::filesystem::remove_all(directory_);
  }

  // kServers over two empty databases, each server and database with a network of its own between.
  void BeginBehindProxies() {
    PostgresCluster& cluster = PostgresCluster::Shared();
    proxies_.clear();
    std::vector<std::string> databases;
    for (size_t shard = 0; shard < kShards; ++shard) databases.push_back(cluster.MakeDatabase());
    std::vector<std::string> files;
    for (size_t i = 0; i < kServers; ++i) {
      files.push_back(absl::StrCat(directory_, "/", databases[0], "-", i, ".shards"));
      std::ofstream file(files.back());
      for (size_t shard = 0; shard < kShards; ++shard) {
        proxies_.push_back(std::make_unique<CuttingProxy>(cluster.socket_directory()));
        file << (shard == 0 ? "0-511 " : "512-1023 ")
             << cluster.WriteConninfo(databases[shard], proxies_.back()->directory()) << "\n";
      }
    }
    Begin(files);
  }
  CuttingProxy& proxy(size_t i, size_t shard) { return *proxies_[i * kShards + shard]; }

  static Calls CallsOf(uint64_t seed) {
    return {.each = 60,
            .seed = seed,
            .hulls = {kHulls[0], kHulls[1]},
            .pairs = true,
            .bodies = {kBodies[0], kBodies[1]},
            .any_freshness = true};
  }
  // Few runs unless HULLD_MANY_RUNS says otherwise, each with a seed of its own.
  void ForEachRun(const std::function<void(uint64_t seed)>& run) {
    const uint64_t first = NumberIn("HULLD_TEST_SEED", 0);
    const uint64_t end = first + NumberIn("HULLD_MANY_RUNS", 2);
    for (uint64_t seed = first; seed < end && !HasFailure(); ++seed) run(seed);
  }

  // What the histories hold of what they are to test.
  void Count(const HullHistory& history) {
    for (const auto& [hull_id, operations] : history.operations()) {
      for (const Operation& operation : operations) {
        ++calls_;
        if (operation.outcome != Outcome::kOk) continue;
        from_the_past_ += operation.staleness > 0;
        of_a_revision_ += operation.at_least_revision > 0;
        puts_ += operation.kind == Kind::kPut;
        parts_ += operation.kind == Kind::kVersion || operation.is_part;
        pairs_ += operation.kind == Kind::kPair;
        if (operation.kind != Kind::kAsk || operation.is_part) continue;
        ++asked_;
        for (const Seen& other : operation.others) {
          over_two_shards_ += other.store_id != operation.store_id;
        }
      }
    }
  }
  void ExpectAllKinds(uint64_t runs) {
    for (const uint64_t count :
         {from_the_past_, of_a_revision_, puts_, parts_, pairs_, asked_, over_two_shards_}) {
      EXPECT_GE(count, runs);
    }
    const auto record = [](const char* name, uint64_t count) {
      RecordProperty(name, std::to_string(count));
    };
    record("calls", calls_);
    record("from_the_past", from_the_past_);
    record("of_a_revision", of_a_revision_);
    record("puts", puts_);
    record("parts", parts_);
    record("pairs", pairs_);
    record("asked", asked_);
    record("over_two_shards", over_two_shards_);
  }

  std::string directory_;
  // Of each server, one for each shard. They outlive the servers of a run.
  std::vector<std::unique_ptr<CuttingProxy>> proxies_;
  uint64_t calls_ = 0;
  uint64_t from_the_past_ = 0;
  uint64_t of_a_revision_ = 0;
  uint64_t puts_ = 0;
  uint64_t parts_ = 0;
  uint64_t pairs_ = 0;
  uint64_t asked_ = 0;
  uint64_t over_two_shards_ = 0;
};

// Two of the servers are far from one database, each from another one: what they find there is
// older than what they find nearby.
TEST_F(ShardedHistories, BodiesOverTwoShardsAreReadAtAnyFreshnessWhileServersAreKilled) {
  uint64_t runs = 0;
  ForEachRun([&](uint64_t seed) {
    BeginBehindProxies();
    for (size_t shard = 0; shard < kShards; ++shard) {
      proxy((seed + shard) % kServers, shard).SetDelay(kFar);
    }
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
