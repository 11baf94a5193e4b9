// Servers over two databases, each a primary with a synchronous standby, under load: the primary of
// one is lost for good while the other goes on.
//
// HULLD_FAILOVERS: how often one is lost; HULLD_TEST_SEED: the seed.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hulld/v1/collision.grpc.pb.h"
#include "tests/server/harness/history/history_client.h"
#include "tests/server/harness/postgres/postgres_cluster.h"
#include "tests/server/shards/sharded_histories.h"

namespace hulld::server {
namespace {

// Names of clients.
constexpr const char* kMeanwhile = "meanwhile";
constexpr const char* kAfterwards = "afterwards";
// Each takes up to ten seconds, and a server that is there comes back within a few.
constexpr int kMostAttempts = 20;
constexpr std::chrono::milliseconds kWhile(200);

class ShardedFailover : public ShardedHistories {
 protected:
  void BeginWithStandbys() {
    const std::string path = directory_ + "/standbys.shards";
    std::ofstream file(path);
    for (size_t shard = 0; shard < kShards; ++shard) {
      Database& database = databases_[shard];
      database.primary = std::make_unique<PostgresCluster>();
      database.standby =
          std::make_unique<PostgresCluster>(PostgresCluster::StandbyOf{*database.primary});
      const std::string hosts = absl::StrCat(database.primary->socket_directory(), ",",
                                             database.standby->socket_directory());
      file << (shard == 0 ? "0-511 " : "512-1023 ")
           << database.primary->WriteConninfo(database.primary->MakeDatabase(), hosts) << "\n";
    }
    file.close();
    Begin(std::vector<std::string>(kServers, path));
  }

  // The primary's machine is gone, and its standby takes its place once all servers have answered
  // calls about the other database.
  void FailOver(size_t shard, uint64_t seed, HullHistory& history) {
    Database& database = databases_[shard];
    database.primary->KillAll();
    ExpectNoAnswer(seed % kServers, IdIn(shard));
    ExpectNoPair(seed % kServers);
    for (size_t i = 0; i < kServers; ++i) CallMeanwhile(i, 1 - shard, history);
    database.standby->Promote();
    std::swap(database.primary, database.standby);
    for (size_t i = 0; i < kServers; ++i) CallAfterwards(i, history);
    ++failovers_;
  }
  // The one that was lost comes back as the standby.
  void Follow(size_t shard) { databases_[shard].standby->Follow(*databases_[shard].primary); }

  // That all that was asked meanwhile was answered, and pairs of both databases after each loss.
  void ExpectAnswers(const HullHistory& history) {
    size_t meanwhile = 0;
    size_t pairs = 0;
    for (const auto& [hull_id, operations] : history.operations()) {
      for (const Operation& operation : operations) {
        const bool is_answered = operation.outcome != Operation::Outcome::kUnknown;
        meanwhile += is_answered && operation.writer == kMeanwhile;
        pairs += is_answered && operation.writer == kAfterwards &&
                 operation.kind == Operation::Kind::kPair;
      }
    }
    EXPECT_EQ(meanwhile, failovers_ * kServers * kCallsMeanwhile);
    EXPECT_EQ(pairs, failovers_ * kServers);
  }

 private:
  struct Database {
    std::unique_ptr<PostgresCluster> primary;
    std::unique_ptr<PostgresCluster> standby;
  };
  // Calls of CallMeanwhile that are recorded.
  static constexpr size_t kCallsMeanwhile = 4;

  static std::string IdIn(size_t shard) {
    int number = 0;
    std::string id;
    do {
      id = absl::StrCat("unanswered-", ++number);
    } while (SlotOf(id) / (kSlots / kShards) != shard);
    return id;
  }
  // That how hulls of both stand to each other is not said, as it may have changed.
  void ExpectNoPair(size_t server) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kWhile);
    v1::CheckCollisionRequest request;
    v1::CheckCollisionResponse response;
    *request.mutable_a() = PlacementOf(kHulls[0]);
    *request.mutable_b() = PlacementOf(kHulls[1]);
    const auto stub = v1::CollisionService::NewStub(Connect(server));
    const grpc::Status status = stub->CheckCollision(&context, request, &response);
    EXPECT_TRUE(status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED ||
                status.error_code() == grpc::StatusCode::UNAVAILABLE)
        << status.error_code() << " " << status.error_message();
  }
  void CallMeanwhile(size_t server, size_t shard, HullHistory& history) {
    HistoryClient client(Connect(server), history, kMeanwhile, server);
    client.TellStores();
    EXPECT_TRUE(client.Create(kHulls[shard], true));
    EXPECT_TRUE(client.Get(kHulls[shard]));
    EXPECT_TRUE(client.Mesh(kHulls[shard]));
    EXPECT_TRUE(client.GetBody(kBodies[shard]));
  }
  // As soon as the server finds the other primary.
  void CallAfterwards(size_t server, HullHistory& history) {
    HistoryClient client(Connect(server), history, kAfterwards, server);
    client.TellStores();
    const std::function<bool()> calls[] = {[&] { return client.Create(kHulls[0], true); },
                                           [&] { return client.Create(kHulls[1], true); },
                                           [&] { return client.Pair(kHulls[0], kHulls[1]); }};
    for (const auto& call : calls) {
      int attempts = 1;
      while (!call() && attempts < kMostAttempts) ++attempts;
      EXPECT_LT(attempts, kMostAttempts) << "server " << server << " does not come back";
    }
  }

  Database databases_[kShards];
  size_t failovers_ = 0;
};

TEST_F(ShardedFailover, OneDatabaseIsLostAndTheOtherGoesOn) {
  const uint64_t seed = NumberIn("HULLD_TEST_SEED", 0);
  const uint64_t failovers = NumberIn("HULLD_FAILOVERS", 1);
  BeginWithStandbys();
  HullHistory history;
  std::vector<Fault> faults;
  for (uint64_t failover = 0; failover < failovers; ++failover) {
    const size_t shard = (seed + failover) % kShards;
    if (failover >= kShards) faults.push_back([this, shard] { Follow(shard); });
    faults.push_back(
        [this, shard, number = seed + failover, &history] { FailOver(shard, number, history); });
    faults.push_back([this, victim = (seed + failover) % kServers] { Replace(victim); });
  }
  Calls calls = CallsOf(8000 + seed);
  calls.each = 40 * static_cast<int>(failovers) + 40;
  Run(calls, faults, history);
  ExpectLinearizable(history, seed);
  ExpectAnswers(history);
  Count(history);
  ExpectAllKinds(1);
}

}  // namespace
}  // namespace hulld::server
