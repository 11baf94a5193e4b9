#include <absl/strings/str_format.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <memory>
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

std::string StartHull(int i) { return "start/" + std::to_string(i); }

void Fill(const Arguments& arguments) {
  // Many, so that the store commits many hulls together.
  constexpr int kWriters = 64;
  const Stores stores(arguments);
  if (arguments.from == 0) stores.Make(kStartDatabase);
  const std::unique_ptr<ChildServer> server = stores.Start("many", kStartDatabase);
  const double used = server->ProcessorSeconds();
  const double database = DatabaseSeconds();
  const Clock::time_point start = Clock::now();
  std::atomic<int> next = arguments.from;
  std::vector<std::thread> writers;
  for (int i = 0; i < kWriters; ++i) {
    writers.emplace_back([&] {
      const auto stub = v1::HullService::NewStub(ConnectAlone(server->address()));
      for (int hull = next++; hull < arguments.hulls && Since(start) < arguments.seconds;
           hull = next++) {
        MakeBallHull(*stub, StartHull(hull), kVertices, 1 + 1e-6 * hull);
      }
    });
  }
  for (std::thread& writer : writers) writer.join();
  const double count = std::min<int>(next - kWriters, arguments.hulls) - arguments.from;
  std::printf("hulls %d to %.0f: %.0f/s, %.0f us of hulld and %.0f us of the database each\n",
              arguments.from, arguments.from + count, count / Since(start),
              1e6 * (server->ProcessorSeconds() - used) / count,
              1e6 * (DatabaseSeconds() - database) / count);
  RunSql(stores.Conninfo(kStartDatabase), "CHECKPOINT");
}

void MeasureStarts(const Arguments& arguments) {
  constexpr int kStarts = 5;
  const Stores stores(arguments);
  const auto ask = [&](const char* statement) {
    return RunSql(stores.Conninfo(kStartDatabase), statement);
  };
  const double hulls = std::stod(ask("SELECT count(*) FROM hulld.hulls"));
  std::vector<double> listens, answers, resident, cpu;
  for (int i = 0; i < kStarts; ++i) {
    const Clock::time_point start = Clock::now();
    const std::unique_ptr<ChildServer> server = stores.Start("many", kStartDatabase);
    listens.push_back(1e3 * Since(start));
    const auto stub = v1::CollisionService::NewStub(ConnectAlone(server->address()));
    grpc::ClientContext context;
    v1::CheckCollisionRequest request;
    v1::CheckCollisionResponse response;
    request.mutable_a()->set_hull_id(StartHull(0));
    request.mutable_b()->set_hull_id(StartHull(static_cast<int>(hulls) - 1));
    Require(stub->CheckCollision(&context, request, &response), "CheckCollision");
    answers.push_back(1e3 * Since(start));
    resident.push_back(server->ResidentMebibytes());
    cpu.push_back(1e3 * server->ProcessorSeconds());
  }
  const double bytes = std::stod(ask("SELECT pg_database_size(current_database())"));
  Rows rows(arguments.out, "hulls,vertices,listens_ms,answers_ms,resident_mib,cpu_ms,store_mib",
            Rows::Mode::kAppend);
  rows.Add(absl::StrFormat("%.0f,%d,%.1f,%.1f,%.1f,%.1f,%.1f", hulls, kVertices, Median(listens),
                           Median(answers), Median(resident), Median(cpu), bytes / (1 << 20)));
}

}  // namespace hulld::bench
