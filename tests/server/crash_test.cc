// Kills hulld many times while clients call it, and restarts it on the same store.

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "client/appender.h"
#include "client/client.h"
#include "core/hull/growth/hull_builder.h"
#include "tests/server/harness/history/history_client.h"
#include "tests/server/harness/history/hull_history.h"
#include "tests/server/harness/postgres/postgres_cluster.h"
#include "tests/server/harness/restartable_server.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace crash_test {

// Returns the number of kills: HULLD_CRASHES in the environment; use hundreds in manual runs.
int Crashes() {
  const char* given = std::getenv("HULLD_CRASHES");
  if (given != nullptr) return std::atoi(given);
  return 12;
}

uint64_t Seed() {
  const char* given = std::getenv("HULLD_TEST_SEED");
  return given != nullptr ? std::strtoull(given, nullptr, 10) : 0;
}

constexpr int kWriters = 8;
constexpr int kReaders = 8;
constexpr int kHulls = 5;

// Runs over each persistent store: "rocksdb", "postgres".
class Crash : public RestartableServer, public ::testing::WithParamInterface<const char*> {
 protected:
  Crash() {
    for (int i = 0; i < kWriters + kReaders; ++i) {
      clients_.push_back(std::make_unique<HistoryClient>(
          Channel(i), history_, absl::StrCat("client-", i), Seed() + static_cast<uint64_t>(i)));
    }
  }

  void SetUp() override {
    if (GetParam() == std::string_view("rocksdb")) return;
    if (!PostgresCluster::IsInstalled()) GTEST_SKIP() << PostgresCluster::kMissing;
    PostgresCluster& cluster = PostgresCluster::Shared();
    store_ = {"--store", "postgres", "--postgres-conninfo-file",
              cluster.WriteConninfo(cluster.MakeDatabase())};
  }

  // Runs clients until the server is killed, after about `calls` more answers.
  void CallUntilKilled(uint64_t calls) {
    const uint64_t end = answered_ + calls;
    std::vector<std::thread> threads;
    for (int i = 0; i < kWriters + kReaders; ++i) {
      threads.emplace_back([this, i, end] {
        HistoryClient& client = *clients_[static_cast<size_t>(i)];
        client.Connect(Channel(i));
        std::mt19937_64 random(Seed() + end * 100 + static_cast<uint64_t>(i));
        while (true) {
          const std::string hull = absl::StrCat("crash/", random() % kHulls);
          if (!(i < kWriters ? client.ChangeAtRandom(hull) : client.ReadAtRandom(hull))) return;
          if (++answered_ == end) server_->Signal(SIGKILL);
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(server_->Wait(), -1) << "hulld ended by itself" << Said();
    history_.Settle();
  }

  // Runs clients continuously while the database is killed and restarted, each time after about
  // `calls` more answers.
  void CallWhileTheDatabaseIsKilled(int kills, uint64_t calls) {
    std::atomic<bool> ending = false;
    std::vector<std::thread> threads;
    for (int i = 0; i < kWriters + kReaders; ++i) {
      threads.emplace_back([this, i, &ending] {
        HistoryClient& client = *clients_[static_cast<size_t>(i)];
        client.Connect(Channel(i));
        std::mt19937_64 random(Seed() + static_cast<uint64_t>(i));
        while (!ending) {
          const std::string hull = absl::StrCat("crash/", random() % kHulls);
          if (!(i < kWriters ? client.ChangeAtRandom(hull) : client.ReadAtRandom(hull))) continue;
          ++answered_;
          answered_.notify_all();
        }
      });
    }
    for (int kill = 0; kill <= kills; ++kill) {
      const uint64_t enough = answered_ + calls;
      for (uint64_t now = answered_; now < enough; now = answered_) answered_.wait(now);
      if (kill == kills) break;
      PostgresCluster::Shared().StopImmediately();
      PostgresCluster::Shared().Start();
    }
    ending = true;
    for (std::thread& thread : threads) thread.join();
  }

  void AuditAll() {
    const auto stub = v1::HullService::NewStub(Channel(-1));
    for (int i = 0; i < kHulls; ++i) {
      grpc::ClientContext context;
      v1::GetHullRequest request;
      v1::GetHullResponse response;
      request.set_hull_id(absl::StrCat("crash/", i));
      request.set_audit(true);
      const grpc::Status status = stub->GetHull(&context, request, &response);
      if (status.error_code() == grpc::StatusCode::NOT_FOUND) continue;
      ASSERT_TRUE(status.ok()) << status.error_message();
      EXPECT_TRUE(response.audit().ok()) << response.audit().finding();
      ++audited_;
    }
  }

  HullHistory history_;
  std::vector<std::unique_ptr<HistoryClient>> clients_;
  std::atomic<uint64_t> answered_ = 0;
  int audited_ = 0;
};

INSTANTIATE_TEST_SUITE_P(Stores, Crash, ::testing::Values("rocksdb", "postgres"),
                         [](const auto& kind) { return std::string(kind.param); });

// Every answered call survives the restart exactly once; an unanswered one survives completely or
// not at all. The history over all lives of the store is linearizable.
TEST_P(Crash, NothingAcknowledgedIsLostOverManyKills) {
  RecordProperty("seed", std::to_string(Seed()));
  std::mt19937_64 random(Seed());
  const int crashes = Crashes();
  for (int crash = 0; crash < crashes; ++crash) {
    StartServer();
    if (crash == 0) clients_[0]->Connect(Channel(0));
    if (crash == 0) clients_[0]->MakeProbe();
    AuditAll();
    ASSERT_FALSE(HasFailure()) << "at start " << crash << ", seed " << Seed();
    CallUntilKilled(20 + random() % 500);
  }
  StartServer();
  AuditAll();
  EXPECT_EQ(HistoryFault(history_), "") << "seed " << Seed();
  size_t lost = 0;
  size_t replaced = 0;
  for (const auto& [hull_id, operations] : history_.operations()) {
    for (const Operation& operation : operations) {
      lost += operation.outcome == Operation::Outcome::kUnknown;
      replaced += operation.kind == Operation::Kind::kReplace &&
                  operation.outcome == Operation::Outcome::kOk;
    }
  }
  std::printf(
      "%d kills, %zu calls recorded, %zu of them unanswered, %zu hulls replaced, %d audits\n",
      crashes, history_.size(), lost, replaced, audited_);
  EXPECT_GT(history_.size(), static_cast<size_t>(crashes) * 20);
  EXPECT_GT(lost, static_cast<size_t>(crashes));
  EXPECT_GT(replaced, static_cast<size_t>(crashes));
  EXPECT_GT(audited_, crashes);
}

class DatabaseCrash : public Crash {};

INSTANTIATE_TEST_SUITE_P(Stores, DatabaseCrash, ::testing::Values("postgres"),
                         [](const auto& kind) { return std::string(kind.param); });

// The server keeps running, and so do the calls that wait during the outage.
TEST_P(DatabaseCrash, NothingAcknowledgedIsLostWhenTheDatabaseIsKilled) {
  RecordProperty("seed", std::to_string(Seed()));
  StartServer();
  clients_[0]->Connect(Channel(0));
  clients_[0]->MakeProbe();
  CallWhileTheDatabaseIsKilled(Crashes() / 3, 300);
  AuditAll();
  EXPECT_EQ(HistoryFault(history_), "") << "seed " << Seed();
  Kill();
  StartServer();
  AuditAll();
  EXPECT_GT(audited_, 0);
}

// Returns `count` blocks of points in a growing ball, so that each block changes the hull.
std::vector<std::vector<Vector>> GrowingBall(int count, int points) {
  std::mt19937_64 random(Seed() + 77);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  std::vector<std::vector<Vector>> blocks(static_cast<size_t>(count));
  for (size_t i = 0; i < blocks.size(); ++i) {
    while (blocks[i].size() < static_cast<size_t>(points)) {
      const Vector p(coordinate(random), coordinate(random), coordinate(random));
      if (p.squaredNorm() <= 1) blocks[i].push_back(p * (1 + 0.01 * static_cast<double>(i)));
    }
  }
  return blocks;
}

std::vector<double> Flat(std::span<const Vector> points) {
  std::vector<double> xyz;
  for (const Vector& p : points) xyz.insert(xyz.end(), {p.x(), p.y(), p.z()});
  return xyz;
}

class Interrupted : public RestartableServer {
 protected:
  Client MakeClient() const {
    ClientOptions options;
    // Retries through any restart, with short waits to lose little time.
    options.retry.max_attempts = std::numeric_limits<int>::max();
    options.retry.initial_backoff = std::chrono::milliseconds(5);
    options.retry.max_backoff = std::chrono::milliseconds(20);
    options.timeout = std::chrono::minutes(2);
    return Client(options, grpc::CreateCustomChannel(address(), grpc::InsecureChannelCredentials(),
                                                     ReconnectAtOnce()));
  }

  // Expects that the hull is bitwise that of these points, each received exactly once.
  void ExpectHullOf(const std::string& hull_id, const std::vector<std::vector<Vector>>& blocks) {
    HullBuilder builder;
    uint64_t points = 0;
    for (const std::vector<Vector>& block : blocks) {
      ASSERT_TRUE(builder.Add(block).ok());
      points += block.size();
    }
    const Client client = MakeClient();
    const auto hull = client.GetHull(hull_id, true);
    ASSERT_TRUE(hull.ok()) << hull.status();
    EXPECT_TRUE(hull->audit().ok()) << hull->audit().finding();
    EXPECT_EQ(hull->hull().counts().received(), points);
    const auto mesh = client.GetHullMesh(hull_id);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->xyz, Flat(builder.Snapshot().vertices()));
  }
};

TEST_F(Interrupted, AWriterThatReconnectsLosesAndRepeatsNothing) {
  const int kills = Crashes();
  const std::vector<std::vector<Vector>> blocks = GrowingBall(20 * kills, 200);
  StartServer();
  std::atomic<size_t> sent = 0;
  const auto write = [&] {
    const Client client = MakeClient();
    AppendOptions options;
    options.create_if_absent = true;
    options.writer_id = "survivor";
    // Few, so that most kills hit chunks in flight.
    options.max_in_flight_chunks = 4;
    auto appender = client.OpenAppend("interrupted/append", options);
    ASSERT_TRUE(appender.ok()) << appender.status();
    for (const std::vector<Vector>& block : blocks) {
      v1::PointBlock message;
      const std::vector<double> xyz = Flat(block);
      message.mutable_xyz()->Assign(xyz.begin(), xyz.end());
      const absl::Status appended = (*appender)->Append(std::move(message));
      ASSERT_TRUE(appended.ok()) << appended;
      ++sent;
      sent.notify_all();
    }
    const absl::Status finished = (*appender)->Finish();
    EXPECT_TRUE(finished.ok()) << finished;
    EXPECT_GE((*appender)->totals().reconnects, 1u);
    std::printf("%d kills, %llu reconnects, %llu chunks recovered\n", kills,
                static_cast<unsigned long long>((*appender)->totals().reconnects),
                static_cast<unsigned long long>((*appender)->totals().chunks_recovered));
  };
  std::thread writer([&] {
    write();
    // Releases the waiting thread, regardless of the outcome.
    sent = blocks.size();
    sent.notify_all();
  });
  for (int kill = 1; kill <= kills; ++kill) {
    // After a number of chunks rather than a time; all may have been sent by the last kill.
    const size_t enough =
        blocks.size() * static_cast<size_t>(kill) / static_cast<size_t>(kills + 1);
    for (size_t now = sent; now < enough; now = sent) sent.wait(now);
    Kill();
    StartServer();
  }
  writer.join();
  ExpectHullOf("interrupted/append", blocks);
}

// Clients disappear in the middle of a stream. Everything committed stays, and the next client with
// the same writer ID continues from there.
TEST_F(Interrupted, DisconnectedClientsLeaveWholeChunks) {
  const std::vector<std::vector<Vector>> blocks = GrowingBall(60, 300);
  StartServer();
  std::mt19937_64 random(Seed());
  uint64_t committed = 0;
  int vanished = 0;
  while (committed < blocks.size()) {
    const auto stub = v1::HullService::NewStub(Channel(0));
    Appender appender(*stub, "interrupted/client", "ghost", true);
    ASSERT_TRUE(appender.is_open());
    EXPECT_GE(appender.opened().last_sequence(), committed);
    committed = appender.opened().last_sequence();
    EXPECT_EQ(appender.opened().hull().counts().received(), committed * 300);
    // Sends without waiting for acks, then disappears.
    const uint64_t end = std::min<uint64_t>(blocks.size(), committed + 1 + random() % 5);
    for (uint64_t i = committed; i < end; ++i) {
      ASSERT_TRUE(appender.Send(ChunkMessage(i + 1, Flat(blocks[i]))));
    }
    if (random() % 3 == 0) {
      EXPECT_TRUE(appender.Finish().ok());
    } else {
      appender.Cancel();
      ++vanished;
    }
  }
  EXPECT_GT(vanished, 5);
  ExpectHullOf("interrupted/client", blocks);
}

TEST_F(Interrupted, AServerStoppedDuringABatchEndsTheBatchAndExits) {
  for (const int signal : {SIGTERM, SIGKILL}) {
    StartServer({"--drain-timeout", "0.1"});
    const Client client = MakeClient();
    const auto stub = v1::CollisionService::NewStub(Channel(0));
    {
      const auto hulls = v1::HullService::NewStub(Channel(0));
      Appender appender(*hulls, "interrupted/batch", "w", true);
      ASSERT_TRUE(appender.Append(appender.opened().last_sequence() + 1, Sphere(100)));
      ASSERT_TRUE(appender.Finish().ok());
    }
    v1::BatchCheckCollisionsRequest request;
    // The slowest method, so that it cannot finish before the signal.
    request.set_method(v1::METHOD_TEXTBOOK_SAT);
    *request.add_placements() = PlacementOf("interrupted/batch");
    *request.add_placements() = PlacementOf("interrupted/batch", 0.5);
    for (int i = 0; i < 100000; ++i) {
      request.add_pairs(0);
      request.add_pairs(1);
    }
    grpc::ClientContext context;
    const auto reader = stub->BatchCheckCollisions(&context, request);
    reader->WaitForInitialMetadata();
    server_->Signal(signal);
    v1::BatchCheckCollisionsResponse response;
    while (reader->Read(&response)) {
    }
    EXPECT_FALSE(reader->Finish().ok());
    EXPECT_EQ(server_->Wait(), signal == SIGTERM ? 0 : -1);
  }
}

}  // namespace crash_test
}  // namespace hulld::server
