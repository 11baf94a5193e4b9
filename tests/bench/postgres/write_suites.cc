#include <absl/strings/str_format.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

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

// Returns points in a ball of radius 1, in chunks of about 1 MiB.
std::vector<v1::AppendPointsRequest> MakeBall(int points) {
  constexpr int kPointsPerChunk = (1 << 20) / 24;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<v1::AppendPointsRequest> chunks;
  for (int i = 0; i < points;) {
    const double p[] = {unit(random), unit(random), unit(random)};
    if (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] > 1) continue;
    if (i++ % kPointsPerChunk == 0) {
      chunks.emplace_back().mutable_chunk()->set_sequence(chunks.size());
    }
    for (const double x : p) chunks.back().mutable_chunk()->mutable_points()->add_xyz(x);
  }
  return chunks;
}

// Sends the chunks into a new hull.
void SendAll(v1::HullService::Stub& stub, const std::string& hull_id,
             const std::vector<v1::AppendPointsRequest>& chunks) {
  grpc::ClientContext context;
  const auto stream = stub.AppendPoints(&context);
  v1::AppendPointsRequest open;
  open.mutable_open()->set_hull_id(hull_id);
  open.mutable_open()->set_create_if_absent(true);
  stream->Write(open);
  std::thread reader([&] {
    v1::AppendPointsResponse reply;
    while (stream->Read(&reply)) {
    }
  });
  for (const v1::AppendPointsRequest& chunk : chunks) stream->Write(chunk);
  stream->WritesDone();
  reader.join();
  Require(stream->Finish(), "AppendPoints");
}

}  // namespace

void MeasureCommits(const Arguments& arguments) {
  constexpr int kCommitsEach = 200;
  const Stores stores(arguments);
  std::vector<std::unique_ptr<ChildServer>> servers;
  std::vector<std::unique_ptr<GrowingWriter>> writers;
  std::vector<std::unique_ptr<LibpqFloor>> floors;
  std::vector<Subject> subjects;
  const auto add = [&](const std::string& name, const ChildServer* server,
                       const std::function<void()>& once) {
    subjects.push_back(
        {.name = name, .server = server, .run = [once] { return Timed(kCommitsEach, once); }});
  };
  const auto add_server = [&](const std::string& name, std::unique_ptr<ChildServer> server) {
    const auto channel = ConnectAlone(server->address());
    if (name != "gRPC alone") {
      MakeBallHull(*v1::HullService::NewStub(channel), kGrowingHull, kVertices, 1);
    }
    writers.push_back(std::make_unique<GrowingWriter>(channel, kGrowingHull, "bench"));
    add(name, server.get(), [writer = writers.back().get()] { writer->SendAndReceive(); });
    servers.push_back(std::move(server));
  };
  for (const std::string kind : {"one", "many"}) {
    floors.push_back(stores.MakeLibpqFloor(kind, "bench_libpq_" + kind));
    add("libpq as " + kind, nullptr, [floor = floors.back().get()] { floor->Commit(); });
    add_server(kind, stores.StartEmpty(kind));
  }
  add_server("rocksdb", stores.StartEmpty("rocksdb"));
  add_server("gRPC alone", stores.StartFloor());
  // Both floors, in sequence: the minimum cost of a commit over the network.
  GrowingWriter* const network = writers.back().get();
  for (const std::string kind : {"one", "many"}) {
    LibpqFloor* const floor = floors[kind == "one" ? 0 : 1].get();
    add("gRPC and libpq as " + kind, nullptr, [=] {
      network->SendAndReceive();
      floor->Commit();
    });
  }
  RunRounds(subjects, arguments.seconds);
  Report(arguments, subjects,
         {{"one", "libpq as one"},
          {"many", "libpq as many"},
          {"gRPC and libpq as one", "libpq as one"},
          {"gRPC and libpq as many", "libpq as many"}});
}

void MeasureIngest(const Arguments& arguments) {
  constexpr int kPoints = 4'000'000;
  const std::vector<v1::AppendPointsRequest> chunks = MakeBall(kPoints);
  const Stores stores(arguments);
  std::vector<std::unique_ptr<ChildServer>> servers;
  std::vector<Subject> subjects;
  for (const std::string kind : {"rocksdb", "one", "many"}) {
    servers.push_back(stores.StartEmpty(kind));
    const std::shared_ptr<v1::HullService::Stub> stub =
        v1::HullService::NewStub(ConnectAlone(servers.back()->address()));
    const auto run = [&chunks, stub, round = 0]() mutable {
      const Clock::time_point start = Clock::now();
      SendAll(*stub, "ingest/" + std::to_string(++round), chunks);
      // Reports time per point instead of per request.
      return std::vector<double>(1, 1e6 * Since(start) / kPoints);
    };
    subjects.push_back({.name = kind, .server = servers.back().get(), .run = run});
  }
  RunRounds(subjects, arguments.seconds);
  for (Subject& subject : subjects) {
    for (double& value : subject.rate) value *= kPoints;
    for (std::vector<double>* each : {&subject.cpu_us, &subject.database_cpu_us}) {
      for (double& value : *each) value /= kPoints;
    }
  }
  Rows rows(arguments.out, "server,points,per_second,min_per_second,cpu_us,database_cpu_us,rounds");
  for (const Subject& subject : subjects) {
    rows.Add(absl::StrFormat("%s,%d,%.0f,%.0f,%.4f,%.4f,%d", subject.name, kPoints,
                             Median(subject.rate), std::ranges::min(subject.rate),
                             Median(subject.cpu_us), Mean(subject.database_cpu_us),
                             subject.rate.size()));
  }
}

}  // namespace hulld::bench
