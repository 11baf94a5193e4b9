#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "tests/bench/postgres/libpq_floor.h"
#include "tests/bench/postgres/rounds.h"
#include "tests/bench/postgres/stores.h"
#include "tests/bench/postgres/suites.h"
#include "tests/bench/service/ball_hull.h"
#include "tests/bench/service/child_server.h"
#include "tests/bench/service/growing_writer.h"

namespace hulld::bench {
namespace {

// One client: its connection, and the queries that it cycles through.
struct Caller {
  std::unique_ptr<v1::CollisionService::Stub> stub;
  std::vector<v1::CheckCollisionRequest> requests;
  size_t next = 0;
};
using Callers = std::vector<Caller>;

constexpr int kQueryHulls = 16;
std::string QueryHull(uint64_t i) { return "queries/" + std::to_string(i % kQueryHulls); }

void MakeQueryHulls(const ChildServer& server) {
  const auto hulls = v1::HullService::NewStub(ConnectAlone(server.address()));
  for (int i = 0; i < kQueryHulls; ++i) MakeBallHull(*hulls, QueryHull(i), kVertices, 1);
}

Caller MakeCaller(const std::string& address, bool bounded, int seed) {
  Caller caller;
  caller.stub = v1::CollisionService::NewStub(ConnectAlone(address));
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  constexpr int kRequests = 256;
  // About one pair in three collides.
  constexpr double kHalfRoom = 1.3;
  for (int i = 0; i < kRequests; ++i) {
    v1::CheckCollisionRequest& request = caller.requests.emplace_back();
    for (v1::Placement* placement : {request.mutable_a(), request.mutable_b()}) {
      placement->set_hull_id(QueryHull(random()));
      v1::Quaternion* const q = placement->mutable_pose()->mutable_rotation();
      q->set_w(1.5 + unit(random));
      q->set_x(unit(random));
      q->set_y(unit(random));
      q->set_z(unit(random));
      v1::Vector3* const t = placement->mutable_pose()->mutable_translation();
      t->set_x(kHalfRoom * unit(random));
      t->set_y(kHalfRoom * unit(random));
      t->set_z(kHalfRoom * unit(random));
    }
    constexpr int kBoundNanoseconds = 200'000'000;
    if (bounded) request.mutable_freshness()->mutable_max_staleness()->set_nanos(kBoundNanoseconds);
  }
  return caller;
}

Callers MakeCallers(const Arguments& arguments, const ChildServer& server, bool bounded) {
  Callers callers;
  for (int i = 0; i < arguments.clients; ++i) {
    callers.push_back(MakeCaller(server.address(), bounded, i));
  }
  return callers;
}

// Returns microseconds.
double Check(Caller& caller, const v1::CheckCollisionRequest& request) {
  grpc::ClientContext context;
  // Many connect concurrently.
  context.set_wait_for_ready(true);
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30));
  v1::CheckCollisionResponse response;
  const Clock::time_point start = Clock::now();
  Require(caller.stub->CheckCollision(&context, request, &response), "CheckCollision");
  return 1e6 * Since(start);
}

// Runs `ask` for each caller on a separate thread; returns all results.
std::vector<double> OnThreads(size_t callers,
                              const std::function<std::vector<double>(size_t)>& ask) {
  std::vector<std::vector<double>> taken(callers);
  std::vector<std::thread> threads;
  for (size_t i = 0; i < callers; ++i) {
    threads.emplace_back([&, i] { taken[i] = ask(i); });
  }
  for (std::thread& thread : threads) thread.join();
  std::vector<double> all;
  for (const std::vector<double>& each : taken) all.insert(all.end(), each.begin(), each.end());
  return all;
}

// Runs all callers concurrently, for a while.
std::vector<double> RunAll(Callers& callers, double seconds) {
  const Clock::time_point begin = Clock::now();
  return OnThreads(callers.size(), [&](size_t i) {
    Caller& caller = callers[i];
    std::vector<double> taken;
    while (Since(begin) < seconds) {
      taken.push_back(Check(caller, caller.requests[caller.next++ % caller.requests.size()]));
    }
    return taken;
  });
}

// Callers are warmed up; each round takes this many seconds.
Subject MakeSubject(const Arguments& arguments, const std::string& name, const ChildServer& server,
                    bool bounded, double seconds) {
  const auto callers = std::make_shared<Callers>(MakeCallers(arguments, server, bounded));
  RunAll(*callers, 0.5);
  return {.name = name, .server = &server, .run = [=] { return RunAll(*callers, seconds); }};
}

}  // namespace

void MeasureQueries(const Arguments& arguments) {
  const double turn = arguments.clients == 1 ? 0.5 : 1;
  const Stores stores(arguments);
  std::vector<std::unique_ptr<ChildServer>> servers;
  std::vector<Subject> subjects;
  std::map<std::string, std::string> peer_of;
  for (const std::string kind : {"rocksdb", "one", "many", "gRPC alone"}) {
    const bool is_floor = kind == "gRPC alone";
    servers.push_back(is_floor ? stores.StartFloor() : stores.StartEmpty(kind));
    const ChildServer& server = *servers.back();
    if (!is_floor) MakeQueryHulls(server);
    for (const bool bounded : {true, false}) {
      if (!bounded && (is_floor || kind == "one")) continue;
      const std::string name = is_floor ? kind : kind + (bounded ? " bounded" : " linearizable");
      peer_of[name] = bounded ? "rocksdb bounded" : "rocksdb linearizable";
      subjects.push_back(MakeSubject(arguments, name, server, bounded, turn));
    }
  }
  // The read index of --postgres-servers many, by libpq alone.
  std::unique_ptr<LibpqFloor> floor;
  if (arguments.clients == 1) {
    floor = stores.MakeLibpqFloor("many", "bench_libpq_queries");
    subjects.push_back({.name = "libpq query", .run = [&] {
                          std::vector<double> taken;
                          const Clock::time_point begin = Clock::now();
                          while (Since(begin) < turn) {
                            taken.push_back(Timed(1, [&] { floor->Follow(); }).front());
                          }
                          return taken;
                        }});
  }
  RunRounds(subjects, arguments.seconds);
  Report(arguments, subjects, peer_of);
}

void MeasureBounded(const Arguments& arguments) {
  constexpr double kTurn = 0.25;
  const Stores stores(arguments);
  std::vector<std::unique_ptr<ChildServer>> servers;
  std::vector<Subject> subjects;
  std::map<std::string, std::string> peer_of;
  for (const std::string name : {"rocksdb", "rocksdb again", "one", "many"}) {
    servers.push_back(name == "rocksdb again" ? stores.StartEmpty("rocksdb", "bench_again")
                                              : stores.StartEmpty(name));
    MakeQueryHulls(*servers.back());
    peer_of[name] = "rocksdb";
    subjects.push_back(MakeSubject(arguments, name, *servers.back(), true, kTurn));
  }
  RunRounds(subjects, arguments.seconds);
  Report(arguments, subjects, peer_of);
}

void MeasureCold(const Arguments& arguments) {
  const Stores stores(arguments);
  const int hulls =
      std::stoi(RunSql(stores.Conninfo(kStartDatabase), "SELECT count(*) FROM hulld.hulls"));
  std::vector<int> order(hulls);
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937_64(1));
  const std::unique_ptr<ChildServer> server = stores.Start("many", kStartDatabase);
  Callers callers = MakeCallers(arguments, *server, true);
  // Each caller has its own pairs; none is repeated.
  const auto ask = [&](size_t i) {
    const Clock::time_point begin = Clock::now();
    Caller& caller = callers[i];
    std::vector<double> taken;
    while (Since(begin) < arguments.seconds / 4) {
      const size_t pair = i + callers.size() * caller.next++;
      if (2 * pair + 1 >= order.size()) break;
      v1::CheckCollisionRequest request = caller.requests[pair % caller.requests.size()];
      request.mutable_a()->set_hull_id(StartHull(order[2 * pair]));
      request.mutable_b()->set_hull_id(StartHull(order[2 * pair + 1]));
      taken.push_back(Check(caller, request));
    }
    return taken;
  };
  std::vector<Subject> subjects;
  subjects.push_back({.name = "many cold", .server = server.get(), .run = [&] {
                        return OnThreads(callers.size(), ask);
                      }});
  const double before = server->ResidentMebibytes();
  RunRounds(subjects, arguments.seconds);
  Report(arguments, subjects, {});
  const auto pairs = static_cast<double>(subjects[0].all.size());
  std::printf("%.0f bytes of memory a hull\n",
              (server->ResidentMebibytes() - before) * (1 << 20) / (2 * pairs));
}

}  // namespace hulld::bench
