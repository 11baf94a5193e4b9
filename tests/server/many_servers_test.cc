// Several active processes over one PostgreSQL database. Clients switch between them, and their
// history is checked against the specification.

#include "tests/server/harness/postgres/many_servers.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "client/appender.h"
#include "client/client.h"
#include "client/verify/answer_check.h"
#include "tests/server/harness/history/history_client.h"
#include "tests/server/harness/postgres/cutting_proxy.h"
#include "tests/server/harness/postgres/postgres_cluster.h"

namespace hulld::server {
namespace many_servers_test {

using Cut = CuttingProxy::Cut;

uint64_t NumberIn(const char* variable, uint64_t otherwise) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

class ManyServers : public ManyServersTest {
 protected:
  // Delays the next piece until its connection is gone.
  static void Delay(CuttingProxy& proxy, Cut cut) {
    proxy.CutNext(cut);
    // Clients may have no change left that could be held.
    proxy.DeliverOnceHeld(std::chrono::seconds(1));
  }
  Client ClientOf(size_t server) {
    ClientOptions options;
    options.server = address(server);
    options.own_connection = true;
    return Client(options);
  }
  // Runs a few times, or HULLD_MANY_RUNS times, each with a different seed.
  void ForEachRun(const std::function<void(uint64_t seed)>& run) {
    const uint64_t first = NumberIn("HULLD_TEST_SEED", 0);
    const uint64_t end = first + NumberIn("HULLD_MANY_RUNS", 2);
    for (uint64_t seed = first; seed < end && !HasFailure(); ++seed) run(seed);
  }
};

TEST_F(ManyServers, ClientsThatSwitchServersSeeOneStore) {
  ForEachRun([this](uint64_t seed) {
    Begin();
    HullHistory history;
    Run({.seed = seed}, {}, history);
    ExpectLinearizable(history, seed);
    size_t acknowledged = 0;
    for (const auto& [hull_id, operations] : history.operations()) {
      for (const Operation& operation : operations) {
        acknowledged += operation.outcome == Operation::Outcome::kOk;
      }
    }
    EXPECT_GT(acknowledged, kClients * 80 / 2);
  });
}

TEST_F(ManyServers, PeersContinueAfterOneIsKilled) {
  ForEachRun([this](uint64_t seed) {
    Begin();
    HullHistory history;
    Run({.seed = 1000 + seed}, {[&] { Replace(seed % kServers); }}, history);
    ExpectLinearizable(history, seed);
  });
}

// One store: at any freshness, all of an answer, including a list page, has one revision.
TEST_F(ManyServers, BatchesStreamsAndListsReadOneRevisionOfTheStore) {
  size_t batches = 0;
  size_t whole = 0;
  uint64_t runs = 0;
  ForEachRun([&](uint64_t seed) {
    Begin();
    HullHistory history;
    Run({.each = 60,
         .seed = 9000 + seed,
         .pairs = true,
         .bodies = {"body/a", "body/b"},
         .several = true,
         .any_freshness = true},
        {[&] { Replace(seed % kServers); }}, history);
    ExpectLinearizable(history, seed);
    ++runs;
    for (const auto& [hull_id, operations] : history.operations()) {
      for (const Operation& operation : operations) {
        if (operation.kind != Operation::Kind::kBatch) continue;
        ++batches;
        whole += operation.others.size() >= 4;
      }
    }
  });
  EXPECT_GT(batches, 40 * runs);
  EXPECT_GT(whole, 20 * runs);
}

TEST_F(ManyServers, AServerThatHungAppliesPeerChanges) {
  Begin();
  HullHistory history;
  const auto stand_still = [&] {
    server(0).Signal(SIGSTOP);
    HistoryClient client(Connect(1), history, "meanwhile", 2);
    for (int call = 0; call < 20; ++call) client.CallAtRandom("shared/a");
    server(0).Signal(SIGCONT);
  };
  Run({.seed = 2000}, {stand_still}, history);
  ExpectLinearizable(history, 2000);
}

// Each server reaches the database through a network that loses a COMMIT or its answer, delivers
// either after its connection is gone, or is down for a while. Pairs of clients share a writer ID.
TEST_F(ManyServers, NothingIsLostBehindAFailingNetwork) {
  constexpr int kFaults = 8;
  ForEachRun([this](uint64_t seed) {
    PostgresCluster& cluster = PostgresCluster::Shared();
    const std::string database = cluster.MakeDatabase();
    std::vector<std::unique_ptr<CuttingProxy>> proxies;
    std::vector<std::string> files;
    for (size_t i = 0; i < kServers; ++i) {
      proxies.push_back(std::make_unique<CuttingProxy>(cluster.socket_directory()));
      files.push_back(cluster.WriteConninfo(database, proxies.back()->directory()));
    }
    Begin(files);
    std::mt19937_64 random(seed);
    std::vector<Fault> faults;
    for (int i = 0; i < kFaults; ++i) {
      const size_t victim = random() % kServers;
      CuttingProxy& proxy = *proxies[victim];
      switch (random() % 5) {
        case 0:
          faults.push_back([&proxy] { proxy.CutNext(Cut::kBeforeCommit); });
          break;
        case 1:
          faults.push_back([&proxy] { proxy.CutNext(Cut::kAfterCommit); });
          break;
        case 2:
          faults.push_back([&proxy] { Delay(proxy, Cut::kHold); });
          break;
        case 3:
          faults.push_back([&proxy] { Delay(proxy, Cut::kHoldCommit); });
          break;
        default:
          faults.push_back([this, &proxy, victim] {
            proxy.SetDown(true);
            ExpectNoAnswer(victim);
            proxy.SetDown(false);
          });
          break;
      }
    }
    HullHistory history;
    Run({.seed = 3000 + seed, .share_writers = true}, faults, history);
    ExpectLinearizable(history, seed);
  });
}

TEST_F(ManyServers, ServersStartedTogetherOverAnEmptyDatabaseServeOneStore) {
  constexpr size_t kAtOnce = 8;
  PostgresCluster& cluster = PostgresCluster::Shared();
  BeginAtOnce(std::vector<std::string>(kAtOnce, cluster.WriteConninfo(cluster.MakeDatabase())));
  HullHistory history;
  Run({.each = 20, .seed = 4000}, {}, history);
  ExpectLinearizable(history, 4000);
}

// Two servers append to a hull concurrently while a third is queried; the first sometimes loses its
// notifications of peer changes. Every answer is proven, and at the end all servers agree with a
// server that received all points together.
TEST_F(ManyServers, AHullThatGrowsThroughSeveralServersIsTheHullOfAllPoints) {
  constexpr int kRounds = 60;
  PostgresCluster& cluster = PostgresCluster::Shared();
  const std::string database = cluster.MakeDatabase();
  CuttingProxy proxy(cluster.socket_directory());
  const std::string file = cluster.WriteConninfo(database);
  Begin({cluster.WriteConninfo(database, proxy.directory()), file, file});
  const Client clients[] = {ClientOf(0), ClientOf(1), ClientOf(2)};
  std::mt19937_64 random(7);
  v1::PointBlock all;
  // Most points lie outside the previous hull.
  const auto make_points = [&](int round) {
    std::uniform_int_distribution<int> coordinate(-10 - round, 10 + round);
    v1::PointBlock points;
    for (int i = 0; i < 3 * (1 + round % 4); ++i) points.add_xyz(coordinate(random));
    all.MergeFrom(points);
    return points;
  };
  v1::PointBlock cube;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) cube.add_xyz(corner >> axis & 1);
  }
  AppendOptions options;
  options.create_if_absent = true;
  const auto append = [&](const Client& client, const std::string& id,
                          const v1::PointBlock& points) {
    const auto stream = client.OpenAppend(id, options);
    ASSERT_TRUE(stream.ok()) << stream.status();
    ASSERT_TRUE((*stream)->Append(points).ok());
    const absl::Status finished = (*stream)->Finish();
    ASSERT_TRUE(finished.ok()) << finished;
  };
  append(clients[1], "cube", cube);
  // Its chunks are in flight while the other clients append.
  const auto stream = clients[0].OpenAppend("grown", options);
  ASSERT_TRUE(stream.ok()) << stream.status();
  std::set<v1::Relation> relations;
  for (int round = 0; round < kRounds; ++round) {
    ASSERT_TRUE((*stream)->Append(make_points(round)).ok());
    append(clients[1], "grown", make_points(round));
    if (round % 10 == 5) proxy.CutListeners();
    v1::CheckCollisionRequest request;
    request.mutable_a()->set_hull_id("grown");
    request.mutable_b()->set_hull_id("cube");
    request.mutable_b()->mutable_pose()->mutable_translation()->set_x(40);
    request.mutable_wanted()->set_certificate(true);
    const auto checked = CheckCollisionVerified(clients[round % 3 == 0 ? 2 : 0], request);
    ASSERT_TRUE(checked.ok()) << checked.status();
    // Another change may commit whenever the check fetches a hull.
    if (checked->verification.verdict == Verdict::kMoved) continue;
    EXPECT_EQ(checked->verification.verdict, Verdict::kValid) << checked->verification.reason;
    relations.insert(checked->response.relation());
  }
  const absl::Status finished = (*stream)->Finish();
  ASSERT_TRUE(finished.ok()) << finished;
  EXPECT_GE(relations.size(), 2);
  append(clients[2], "at-once", all);
  const auto expected = clients[2].GetHullMesh("at-once");
  ASSERT_TRUE(expected.ok()) << expected.status();
  for (const Client& client : clients) {
    const auto mesh = client.GetHullMesh("grown");
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->xyz, expected->xyz);
    EXPECT_EQ(mesh->facet_sizes, expected->facet_sizes);
    EXPECT_EQ(mesh->facet_indices, expected->facet_indices);
    const auto hull = client.GetHull("grown", true);
    ASSERT_TRUE(hull.ok()) << hull.status();
    EXPECT_EQ(hull->hull().counts().received(), all.xyz_size() / 3);
  }
}

}  // namespace many_servers_test
}  // namespace hulld::server
