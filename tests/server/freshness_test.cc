// Several servers over one PostgreSQL database, and reads that specify the freshness of their
// answers.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <list>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "hulld/v1/body.grpc.pb.h"
#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "tests/server/harness/history/history_client.h"
#include "tests/server/harness/history/hull_history.h"
#include "tests/server/harness/hulld_process.h"
#include "tests/server/harness/postgres/postgres_cluster.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace freshness_test {

int NumberIn(const char* variable, int otherwise) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? otherwise : std::atoi(text);
}

class FreshReads : public ::testing::Test {
 protected:
  static constexpr int kServers = 3;
  static constexpr int kCallsPerClient = 24;

  void SetUp() override {
    if (!PostgresCluster::IsInstalled()) GTEST_SKIP() << PostgresCluster::kMissing;
    PostgresCluster& cluster = PostgresCluster::Shared();
    database_ = cluster.MakeDatabase();
    const std::string conninfo = cluster.WriteConninfo(database_);
    for (int i = 0; i < kServers; ++i) {
      servers_.push_back(std::make_unique<Process>(std::vector<std::string>{
          "--listen", "127.0.0.1:0", "--store", "postgres", "--postgres-conninfo-file", conninfo,
          "--postgres-servers", "many", "--max-calls-per-client", absl::StrCat(kCallsPerClient)}));
    }
    for (const auto& server : servers_) {
      const std::string line = server->ReadLineWith("listening on ");
      ASSERT_FALSE(line.empty());
      addresses_.push_back(AddressIn(line));
      // Drains the server's log, so that the server never blocks on it.
      readers_.emplace_back([&server] { server->ReadToEnd(); });
    }
  }
  void TearDown() override {
    for (const auto& server : servers_) server->Signal(SIGKILL);
    for (std::thread& reader : readers_) reader.join();
  }

  std::shared_ptr<grpc::Channel> Connect(size_t server, int channel = 0) const {
    grpc::ChannelArguments own;
    own.SetInt("hulld.test.channel", channel);
    return grpc::CreateCustomChannel(addresses_[server], grpc::InsecureChannelCredentials(), own);
  }
  // Appends a point through this server; returns the header of its ack.
  v1::ResponseHeader Append(size_t server, const std::string& hull_id, uint64_t sequence) const {
    const auto stub = v1::HullService::NewStub(Connect(server));
    Appender appender(*stub, hull_id, "w", true);
    const auto ack = appender.Append(sequence, {static_cast<double>(sequence), 0, 0});
    EXPECT_TRUE(ack.has_value());
    EXPECT_TRUE(appender.Finish().ok());
    return ack.has_value() ? ack->header() : v1::ResponseHeader();
  }

  // Blocks reads of the store's row until the handle is destroyed.
  std::shared_ptr<void> HoldStore() const {
    return PostgresCluster::Shared().HoldTable(database_, "hulld.store");
  }

  bool Knows(size_t server, const std::string& hull_id) const {
    const auto stub = v1::HullService::NewStub(Connect(server));
    grpc::ClientContext context;
    v1::GetHullRequest request;
    v1::GetHullResponse response;
    request.set_hull_id(hull_id);
    return stub->GetHull(&context, request, &response).ok();
  }

  std::string database_;
  std::vector<std::unique_ptr<Process>> servers_;
  std::vector<std::string> addresses_;
  std::vector<std::thread> readers_;
};

// Every server sees a revision acknowledged by any server.
TEST_F(FreshReads, TheRevisionOfAnAcknowledgementIsSeenOnEveryServer) {
  for (uint64_t sequence = 1; sequence <= 20; ++sequence) {
    const v1::ResponseHeader header = Append(sequence % kServers, "h", sequence);
    for (size_t server = 0; server < kServers; ++server) {
      const auto stub = v1::HullService::NewStub(Connect(server));
      grpc::ClientContext context;
      v1::GetHullRequest request;
      v1::GetHullResponse response;
      request.set_hull_id("h");
      request.mutable_freshness()->set_at_least_revision(header.revision());
      request.mutable_freshness()->set_store_id(header.store_id());
      const grpc::Status status = stub->GetHull(&context, request, &response);
      ASSERT_TRUE(status.ok()) << status.error_message();
      EXPECT_GE(response.header().revision(), header.revision());
      EXPECT_EQ(response.hull().counts().received(), sequence);
    }
  }
}

// Waiting queries use no thread; cancelled ones release their resources although the store does not
// answer.
TEST_F(FreshReads, QueriesThatWaitForTheStoreEndWhenCancelled) {
  Append(0, "h", 1);
  const auto collisions = v1::CollisionService::NewStub(Connect(0));
  v1::CheckCollisionRequest pair;
  pair.mutable_a()->set_hull_id("h");
  pair.mutable_b()->set_hull_id("h");
  auto holder = HoldStore();
  struct Call {
    grpc::ClientContext context;
    v1::CheckCollisionResponse response;
    grpc::Status status;
  };
  grpc::CompletionQueue queue;
  const auto ask = [&](Call& call) {
    collisions->AsyncCheckCollision(&call.context, pair, &queue)
        ->Finish(&call.response, &call.status, &call);
  };
  const auto next = [&] {
    void* tag = nullptr;
    bool ok = false;
    EXPECT_TRUE(queue.Next(&tag, &ok));
    return static_cast<Call*>(tag);
  };
  // One more call than may run: the first to end is refused, and the rest wait.
  std::vector<Call> calls(kCallsPerClient + 1);
  for (Call& call : calls) ask(call);
  EXPECT_EQ(next()->status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  const auto unanswered = [this] {
    return PostgresCluster::Shared().RunSql(
        database_,
        "SELECT pid || ' ' || query_start FROM pg_stat_activity WHERE wait_event_type = 'Lock' "
        "AND datname = current_database() ORDER BY query_start LIMIT 1");
  };
  std::vector<std::string> first;
  while (first.empty()) first = unanswered();
  for (Call& call : calls) call.context.TryCancel();
  for (int i = 0; i < kCallsPerClient; ++i) {
    EXPECT_EQ(next()->status.error_code(), grpc::StatusCode::CANCELLED);
  }
  // After the server notices a cancellation, it admits another call; before that, it refuses it.
  const auto hulls = v1::HullService::NewStub(Connect(0));
  grpc::Status status;
  do {
    grpc::ClientContext context;
    v1::GetHullRequest request;
    v1::GetHullResponse response;
    request.set_hull_id("h");
    request.mutable_freshness()->mutable_max_staleness()->set_seconds(3600);
    status = hulls->GetHull(&context, request, &response);
  } while (status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(status.ok()) << status.error_message();
  // The store has not answered in the meantime.
  EXPECT_EQ(unanswered(), first);
  holder.reset();
  Call last;
  ask(last);
  EXPECT_TRUE(next()->status.ok()) << last.status.error_message();
}

// Queries that wait without a thread count as those that wait for one.
TEST_F(FreshReads, QueriesThatWaitForTheStoreAreBounded) {
  constexpr int kMax = 8;
  constexpr int kSent = 200;
  constexpr size_t kSurelyRefused = 40;
  Append(0, "h", 1);
  const std::vector<std::string> words = {"--listen",
                                          "127.0.0.1:0",
                                          "--store",
                                          "postgres",
                                          "--postgres-conninfo-file",
                                          PostgresCluster::Shared().WriteConninfo(database_),
                                          "--postgres-servers",
                                          "many",
                                          "--max-waiting-calls",
                                          absl::StrCat(kMax)};
  Process server(words);
  const auto channel = grpc::CreateChannel(AddressIn(server.ReadLineWith("listening on ")),
                                           grpc::InsecureChannelCredentials());
  const auto collisions = v1::CollisionService::NewStub(channel);
  const auto hulls = v1::HullService::NewStub(channel);
  v1::CheckCollisionRequest pair;
  pair.mutable_a()->set_hull_id("h");
  pair.mutable_b()->set_hull_id("h");
  v1::GetHullRequest get;
  get.set_hull_id("h");
  struct Call {
    grpc::ClientContext context;
    v1::CheckCollisionResponse answer;
    v1::GetHullResponse hull;
    grpc::Status status;
  };
  grpc::CompletionQueue queue;
  const auto ask = [&](Call& call, bool is_pair) {
    if (is_pair) {
      collisions->AsyncCheckCollision(&call.context, pair, &queue)
          ->Finish(&call.answer, &call.status, &call);
    } else {
      hulls->AsyncGetHull(&call.context, get, &queue)->Finish(&call.hull, &call.status, &call);
    }
  };
  const auto next = [&] {
    void* tag = nullptr;
    bool ok = false;
    EXPECT_TRUE(queue.Next(&tag, &ok));
    return static_cast<Call*>(tag);
  };
  const auto is_refused = [](const Call& call) {
    return call.status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED &&
           call.status.error_message().find("--max-waiting-calls") != std::string::npos;
  };
  // A pair waits without a thread; GetHull waits on a thread or for one.
  for (const bool is_pair : {true, false}) {
    auto holder = HoldStore();
    // Admits slightly more than the limit: some admitted calls are not counted yet, and threads may
    // have dequeued some.
    std::list<Call> calls(kSent);
    for (Call& call : calls) ask(call, is_pair);
    size_t ended = 0;
    size_t others = 0;
    const auto end_one = [&] {
      const Call* const call = next();
      ++ended;
      others += !is_refused(*call);
    };
    while (ended < kSurelyRefused && others == 0) end_one();
    EXPECT_EQ(others, 0);
    // The waiting calls are answered and make room for new ones.
    holder.reset();
    while (ended < calls.size()) end_one();
    EXPECT_GE(others, kMax);
    const auto answered = std::ranges::count_if(calls, [](const Call& c) { return c.status.ok(); });
    EXPECT_EQ(others, answered);
    Call last;
    ask(last, is_pair);
    EXPECT_TRUE(next()->status.ok()) << last.status.error_message();
  }
}

// All reads check freshness. An unassigned revision, another store, and a malformed value give
// distinct errors.
TEST_F(FreshReads, EveryReadRefusesUnknownRevisions) {
  const v1::ResponseHeader header = Append(0, "h", 1);
  const auto channel = Connect(1);
  const auto hulls = v1::HullService::NewStub(channel);
  const auto bodies = v1::BodyService::NewStub(channel);
  const auto collisions = v1::CollisionService::NewStub(channel);
  // No message precedes the refusal.
  const auto finish = [](const auto& reader) { return reader->Finish(); };
  const auto expect_refusal = [&](const v1::Freshness& freshness, grpc::StatusCode code,
                                  const std::string& text) {
    const auto expect = [&](const char* call, const grpc::Status& status) {
      EXPECT_EQ(status.error_code(), code) << call << ": " << status.error_message();
      EXPECT_THAT(status.error_message(), ::testing::HasSubstr(text)) << call;
    };
    const auto ask = [&](auto request, const auto& call) {
      grpc::ClientContext context;
      *request.mutable_freshness() = freshness;
      return call(&context, request);
    };
    const auto with_hull = [](auto request) {
      request.set_hull_id("h");
      return request;
    };
    v1::CheckCollisionRequest pair;
    pair.mutable_a()->set_hull_id("h");
    pair.mutable_b()->set_hull_id("h");
    v1::GetHullResponse hull;
    expect("GetHull", ask(with_hull(v1::GetHullRequest()), [&](auto* context, const auto& request) {
             return hulls->GetHull(context, request, &hull);
           }));
    expect("GetHullMesh",
           ask(with_hull(v1::GetHullMeshRequest()), [&](auto* context, const auto& request) {
             return finish(hulls->GetHullMesh(context, request));
           }));
    v1::ListHullsResponse list;
    expect("ListHulls", ask(v1::ListHullsRequest(), [&](auto* context, const auto& request) {
             return hulls->ListHulls(context, request, &list);
           }));
    v1::GetBodyRequest body;
    body.set_body_id("b");
    v1::GetBodyResponse got;
    expect("GetBody", ask(body, [&](auto* context, const auto& request) {
             return bodies->GetBody(context, request, &got);
           }));
    v1::ListBodiesResponse body_list;
    expect("ListBodies", ask(v1::ListBodiesRequest(), [&](auto* context, const auto& request) {
             return bodies->ListBodies(context, request, &body_list);
           }));
    v1::CheckCollisionResponse answer;
    expect("CheckCollision", ask(pair, [&](auto* context, const auto& request) {
             return collisions->CheckCollision(context, request, &answer);
           }));
    v1::BatchCheckCollisionsRequest batch;
    batch.add_placements()->set_hull_id("h");
    expect("BatchCheckCollisions", ask(batch, [&](auto* context, const auto& request) {
             return finish(collisions->BatchCheckCollisions(context, request));
           }));
    v1::FindCollisionsRequest scene;
    scene.add_placements()->set_hull_id("h");
    expect("FindCollisions", ask(scene, [&](auto* context, const auto& request) {
             return finish(collisions->FindCollisions(context, request));
           }));
    v1::StreamCollisionsRequest open;
    open.mutable_open()->add_placements()->set_hull_id("h");
    *open.mutable_open()->mutable_freshness() = freshness;
    grpc::ClientContext context;
    const auto stream = collisions->StreamCollisions(&context);
    stream->Write(open);
    stream->WritesDone();
    expect("StreamCollisions", stream->Finish());
  };
  v1::Freshness freshness;
  freshness.set_store_id(header.store_id());
  freshness.set_at_least_revision(header.revision() + 1);
  expect_refusal(freshness, grpc::StatusCode::FAILED_PRECONDITION,
                 absl::StrCat("at_least_revision is ", header.revision() + 1));
  freshness.set_store_id("another");
  expect_refusal(freshness, grpc::StatusCode::FAILED_PRECONDITION, "differs from this store's ID");
  freshness.clear_store_id();
  expect_refusal(freshness, grpc::StatusCode::INVALID_ARGUMENT, "requires store_id");
  freshness.Clear();
  freshness.mutable_max_staleness()->set_seconds(-1);
  expect_refusal(freshness, grpc::StatusCode::INVALID_ARGUMENT, "it must be at least 0");
}

TEST_F(FreshReads, HistoriesMeetEachFreshnessGuarantee) {
  constexpr int kClients = 6;
  constexpr int kCalls = 120;
  const int first = NumberIn("HULLD_TEST_SEED", 0);
  const int runs = NumberIn("HULLD_MANY_RUNS", 2);
  size_t from_the_past = 0;
  size_t of_a_revision = 0;
  for (int run = first; run < first + runs; ++run) {
    HullHistory history;
    HistoryClient(Connect(0), history, "probe", 0).MakeProbe();
    // No server reads an older state than this, so the probe always exists.
    for (size_t server = 0; server < kServers; ++server) ASSERT_TRUE(Knows(server, kProbeHull));
    const std::string prefix = absl::StrCat("run-", run);
    std::vector<std::thread> clients;
    for (int i = 0; i < kClients; ++i) {
      clients.emplace_back([&, i] {
        std::mt19937_64 random(100 * run + i);
        HistoryClient client(Connect(i % kServers, i), history, absl::StrCat("client-", i),
                             1000 * run + i);
        client.ReadAtAnyFreshness();
        for (int call = 0; call < kCalls; ++call) {
          client.CallAtRandom(prefix + (call % 3 == 0 ? "/a" : "/b"));
          if (random() % 3 == 0) client.Connect(Connect(random() % kServers, i));
        }
      });
    }
    for (std::thread& client : clients) client.join();
    ASSERT_EQ(HistoryFault(history), "") << "run " << run;
    for (const auto& [hull_id, operations] : history.operations()) {
      for (const Operation& operation : operations) {
        from_the_past += operation.staleness > 0;
        of_a_revision += operation.at_least_revision > 0;
      }
    }
  }
  // The histories cover the intended cases.
  EXPECT_GT(from_the_past, static_cast<size_t>(runs) * 20);
  EXPECT_GT(of_a_revision, static_cast<size_t>(runs) * 20);
}

}  // namespace freshness_test
}  // namespace hulld::server
