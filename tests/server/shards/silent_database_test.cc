// A server over two databases of which one does not answer: calls that need it wait, and those
// about hulls of the other one do not wait for them.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <list>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client/client.h"
#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "tests/server/harness/postgres/postgres_cluster.h"
#include "tests/server/shards/sharded_histories.h"

namespace hulld::server {
namespace {

// More than a pool has threads.
constexpr size_t kWaiting = 16;

class SilentDatabase : public ShardedHistories {
 protected:
  void SetUp() override {
    ShardedHistories::SetUp();
    if (IsSkipped()) return;
    PostgresCluster& cluster = PostgresCluster::Shared();
    for (std::string& database : databases_) database = cluster.MakeDatabase();
    const std::string path = directory_ + "/silent.shards";
    std::ofstream(path) << "0-511 " << cluster.WriteConninfo(databases_[0]) << "\n512-1023 "
                        << cluster.WriteConninfo(databases_[1]) << "\n";
    Begin({path});
  }

  // A session that looks into this table of the second database waits as long as the result lives.
  std::shared_ptr<void> Hold(const std::string& table) const {
    return PostgresCluster::Shared().HoldTable(databases_[1], table);
  }

 private:
  std::string databases_[kShards];
};

TEST_F(SilentDatabase, DoesNotHoldUpReadsOfAnother) {
  constexpr size_t kOthers = 200;
  std::shared_ptr<void> held = Hold("hulld.store");
  const auto hulls = v1::HullService::NewStub(Connect(0));
  struct Call {
    grpc::ClientContext context;
    v1::GetHullResponse response;
    grpc::Status status;
  };
  grpc::CompletionQueue queue;
  const auto ask = [&](Call& call, const char* hull_id) {
    v1::GetHullRequest request;
    request.set_hull_id(hull_id);
    hulls->AsyncGetHull(&call.context, request, &queue)
        ->Finish(&call.response, &call.status, &call);
  };
  const auto next = [&] {
    void* tag = nullptr;
    bool ok = false;
    EXPECT_TRUE(queue.Next(&tag, &ok));
    return static_cast<Call*>(tag);
  };
  std::vector<Call> waiting(kWaiting);
  for (Call& call : waiting) ask(call, kHulls[1]);
  // Long before the last of them the server has all that wait.
  std::list<Call> others;
  size_t ended = 0;
  const Call* last = nullptr;
  do {
    ask(others.emplace_back(), kHulls[0]);
    last = next();
    ++ended;
  } while (last == &others.back() && others.size() < kOthers);
  EXPECT_EQ(last, &others.back()) << "after " << others.size() << " calls";
  held.reset();
  for (; ended < waiting.size() + others.size(); ++ended) next();
  for (const Call& call : others) {
    EXPECT_EQ(call.status.error_code(), grpc::StatusCode::NOT_FOUND) << call.status.error_message();
  }
}

// Batches, scenes and streams, which share threads with those about hulls of several databases.
TEST_F(SilentDatabase, DoesNotHoldUpQueriesOfAnother) {
  constexpr size_t kOthers = 20;
  // Queries of each kind: more than a pool has threads, and half of what one client may have.
  constexpr size_t kQueries = 4;
  // Where they are held up, the test is to end.
  constexpr std::chrono::seconds kPatience{60};
  std::shared_ptr<void> held = Hold("hulld.store");
  const auto collisions = v1::CollisionService::NewStub(Connect(0));
  const auto fill = [](auto* request, const char* hull_id) {
    for (int i = 0; i < 2; ++i) request->add_placements()->set_hull_id(hull_id);
  };
  const auto read_all = [](auto& stream, auto response) {
    while (stream.Read(&response)) continue;
    return stream.Finish();
  };
  const auto ask_batch = [&](const char* hull_id) {
    v1::BatchCheckCollisionsRequest request;
    fill(&request, hull_id);
    request.add_pairs(0);
    request.add_pairs(1);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    return read_all(*collisions->BatchCheckCollisions(&context, request),
                    v1::BatchCheckCollisionsResponse());
  };
  const auto find = [&](const char* hull_id) {
    v1::FindCollisionsRequest request;
    fill(&request, hull_id);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    return read_all(*collisions->FindCollisions(&context, request), v1::FindCollisionsResponse());
  };
  const auto follow = [&](const char* hull_id) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    const auto stream = collisions->StreamCollisions(&context);
    v1::StreamCollisionsRequest request;
    fill(request.mutable_open(), hull_id);
    v1::StreamCollisionsResponse response;
    stream->Write(request);
    const bool is_open = stream->Read(&response);
    request.mutable_update()->set_refresh_hulls(true);
    if (is_open && stream->Write(request)) stream->Read(&response);
    stream->WritesDone();
    return stream->Finish();
  };
  std::atomic<size_t> ended = 0;
  std::vector<std::thread> waiting;
  const auto wait = [&](const auto& ask) {
    for (size_t i = 0; i < kQueries; ++i) {
      waiting.emplace_back([&, ask] {
        ask(kHulls[1]);
        ++ended;
      });
    }
  };
  wait(ask_batch);
  wait(find);
  wait(follow);
  for (size_t i = 0; i < kOthers && !HasFailure(); ++i) {
    for (const grpc::Status& status : {ask_batch(kHulls[0]), find(kHulls[0]), follow(kHulls[0])}) {
      EXPECT_TRUE(status.ok()) << status.error_message();
    }
    EXPECT_EQ(ended, 0);
  }
  held.reset();
  for (std::thread& thread : waiting) thread.join();
}

// What was appended under a writer's name before is read when its stream opens.
TEST_F(SilentDatabase, DoesNotHoldUpChangesOfAnother) {
  constexpr size_t kOthers = 50;
  ClientOptions server;
  server.server = address(0);
  const auto append = [&](const char* hull_id, size_t writer) -> absl::Status {
    AppendOptions options;
    options.create_if_absent = true;
    options.writer_id = absl::StrCat("writer-", writer);
    const auto stream = Client(server).OpenAppend(hull_id, options);
    if (!stream.ok()) return stream.status();
    v1::PointBlock points;
    for (int i = 0; i < 3; ++i) points.add_xyz(static_cast<double>(writer));
    const absl::Status appended = (*stream)->Append(points);
    return appended.ok() ? (*stream)->Finish() : appended;
  };
  for (const char* hull_id : kHulls) {
    const absl::Status status = append(hull_id, 0);
    ASSERT_TRUE(status.ok()) << status;
  }
  std::shared_ptr<void> held = Hold("hulld.writers");
  std::atomic<size_t> ended = 0;
  std::vector<std::thread> waiting;
  for (size_t i = 1; i <= kWaiting; ++i) {
    waiting.emplace_back([&, i] {
      append(kHulls[1], i).IgnoreError();
      ++ended;
    });
  }
  for (size_t i = 1; i <= kOthers && !HasFailure(); ++i) {
    const absl::Status status = append(kHulls[0], i);
    EXPECT_TRUE(status.ok()) << status;
  }
  EXPECT_EQ(ended, 0);
  held.reset();
  for (std::thread& thread : waiting) thread.join();
}

}  // namespace
}  // namespace hulld::server
