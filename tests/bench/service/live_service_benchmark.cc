// Cost of a query about a growing hull over the wire, compared with one about the same hull at
// rest.
//
//   live_service_benchmark [HULLD [VERTICES...]]
//
// For each number of vertices (by default 64 to 1000000, in powers of ten from 1000 on), starts its
// own hulld on a durable store and runs single queries about a hull of that many vertices and a
// probe near it:
//
// - at rest;
// - directly after each acknowledged chunk with an outside point;
// - then about another hull, which shows the cost of the append to any following call;
// - while another connection streams such chunks at full rate;
// - in the same situation about another hull, which shows the cost of the server's load alone;
// - in the same situation about a hull of another server, which shows the cost of the machine's
// load
//   alone;
// - as the first query after a restart.
//
// One row of CSV per case: percentiles of the queries, their ratios to the case at rest, and the
// writer's rate. The row "writer alone" has the rate without a reader. The cases alternate, so that
// machine drift affects all of them.

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "tests/bench/service/ball_hull.h"
#include "tests/bench/service/child_server.h"
#include "tests/bench/service/growing_writer.h"

namespace hulld::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr char kHull[] = "live/ball";
constexpr char kResting[] = "live/resting";
constexpr char kProbe[] = "live/probe";
constexpr int kRounds = 5;
constexpr int kRestarts = 5;
constexpr int kCallsPerTurn = 400;
constexpr std::chrono::seconds kMaxPerTurn(2);
// Chunks in flight, as of a client that does not wait for each.
constexpr uint64_t kWindow = 32;

// A writer at full rate, until destroyed.
class StreamingWriter {
 public:
  StreamingWriter(const std::string& address, const std::string& writer_id)
      : thread_([this, address, writer_id] {
          GrowingWriter writer(ConnectAlone(address), kHull, writer_id);
          while (!ending_) {
            while (writer.waiting() < kWindow) writer.Send();
            writer.Receive();
            received_ = writer.received();
          }
          while (writer.waiting() > 0) writer.Receive();
        }) {}
  ~StreamingWriter() {
    ending_ = true;
    thread_.join();
  }
  uint64_t received() const { return received_; }

 private:
  std::atomic<bool> ending_ = false;
  std::atomic<uint64_t> received_ = 0;
  std::thread thread_;
};

double Microseconds(Clock::duration duration) {
  return std::chrono::duration<double, std::micro>(duration).count();
}

// Returns the time of a query, in microseconds.
double Check(v1::CollisionService::Stub& stub, const char* hull_id, int i) {
  v1::CheckCollisionRequest request;
  request.mutable_a()->set_hull_id(hull_id);
  request.mutable_b()->set_hull_id(kProbe);
  v1::Vector3* const t = request.mutable_b()->mutable_pose()->mutable_translation();
  t->set_x(0.9 + 1e-3 * (i % 500));
  t->set_z(0.9);
  grpc::ClientContext context;
  context.set_wait_for_ready(true);
  v1::CheckCollisionResponse response;
  const auto sent = Clock::now();
  Require(stub.CheckCollision(&context, request, &response), "CheckCollision");
  return Microseconds(Clock::now() - sent);
}

struct Row {
  const char* name;
  std::vector<double> times = {};
  double chunks = 0;
  double seconds = 0;
};

// `before` is called before each query, and not timed.
void MeasureTurn(v1::CollisionService::Stub& stub, const char* hull_id,
                 const std::function<void()>& before, Row* row) {
  const auto start = Clock::now();
  for (int i = 0; i < kCallsPerTurn && Clock::now() - start < kMaxPerTurn; ++i) {
    before();
    row->times.push_back(Check(stub, hull_id, i));
  }
}

void Count(const StreamingWriter& writer, const std::function<void()>& meanwhile, Row* row) {
  while (writer.received() == 0) std::this_thread::yield();
  const uint64_t before = writer.received();
  const auto start = Clock::now();
  meanwhile();
  row->seconds += Microseconds(Clock::now() - start) * 1e-6;
  row->chunks += static_cast<double>(writer.received() - before);
}

void Print(int vertices, Row* row, const std::vector<double>* rest) {
  std::printf("%d,%s,%zu,", vertices, row->name, row->times.size());
  if (row->times.empty()) {
    std::printf(",,,,");
  } else {
    std::sort(row->times.begin(), row->times.end());
    const double p50 = Percentile(row->times, 0.5);
    const double p99 = Percentile(row->times, 0.99);
    std::printf("%.0f,%.0f,%.3g,%.3g,", p50, p99, p50 / Percentile(*rest, 0.5),
                p99 / Percentile(*rest, 0.99));
  }
  if (row->seconds > 0) std::printf("%.0f", row->chunks / row->seconds);
  std::printf("\n");
  std::fflush(stdout);
}

void Measure(const std::string& program, int vertices) {
  std::string directory = (std::filesystem::temp_directory_path() / "hulld-live-XXXXXX").string();
  if (mkdtemp(directory.data()) == nullptr) std::abort();
  const std::vector<std::string> command = {program,      "--listen",    "127.0.0.1:0",
                                            "--data-dir", directory,     "--max-vertices-per-hull",
                                            "10000000",   "--log-level", "info"};
  Row rest = {"at rest"};
  Row after = {"after an append"};
  Row after_other = {"another hull after an append"};
  Row beside = {"beside a writer"};
  Row other = {"another hull beside a writer"};
  Row elsewhere = {"another server beside a writer"};
  Row alone = {"writer alone"};
  Row cold = {"first after a restart"};
  {
    const ChildServer server(command);
    const ChildServer idle({program, "--listen", "127.0.0.1:0", "--store", "memory"});
    for (const ChildServer* each : {&server, &idle}) {
      const auto hulls = v1::HullService::NewStub(ConnectAlone(each->address()));
      MakeBallHull(*hulls, kHull, vertices, 1);
      MakeBallHull(*hulls, kResting, vertices, 1.1);
      MakeBallHull(*hulls, kProbe, 64, 0.5);
    }
    const auto nothing = [] {};
    const auto pause = [] { std::this_thread::sleep_for(std::chrono::milliseconds(500)); };
    const auto stub = v1::CollisionService::NewStub(ConnectAlone(server.address()));
    const auto idle_stub = v1::CollisionService::NewStub(ConnectAlone(idle.address()));
    // warm up, until all worthwhile preparation is done
    for (int i = 0; i < 1000; ++i) {
      Check(*stub, kHull, i);
      Check(*idle_stub, kHull, i);
    }
    for (int round = 0; round < kRounds; ++round) {
      const std::string number = std::to_string(round);
      MeasureTurn(*stub, kHull, nothing, &rest);
      {
        GrowingWriter writer(ConnectAlone(server.address()), kHull, "after" + number);
        const auto append = [&] { writer.SendAndReceive(); };
        MeasureTurn(*stub, kHull, append, &after);
        MeasureTurn(*stub, kResting, append, &after_other);
      }
      const StreamingWriter writer(server.address(), "beside" + number);
      Count(
          writer, [&] { MeasureTurn(*stub, kHull, nothing, &beside); }, &beside);
      Count(
          writer, [&] { MeasureTurn(*stub, kResting, nothing, &other); }, &other);
      Count(
          writer, [&] { MeasureTurn(*idle_stub, kHull, nothing, &elsewhere); }, &elsewhere);
      Count(writer, pause, &alone);
    }
  }
  for (int i = 0; i < kRestarts; ++i) {
    const ChildServer server(command);
    const auto channel = ConnectAlone(server.address());
    // A query about other hulls, which opens the connection.
    grpc::ClientContext context;
    context.set_wait_for_ready(true);
    v1::ListHullsResponse page;
    Require(v1::HullService::NewStub(channel)->ListHulls(&context, {}, &page), "ListHulls");
    cold.times.push_back(Check(*v1::CollisionService::NewStub(channel), kHull, 0));
  }
  for (Row* row : {&rest, &after, &after_other, &beside, &other, &elsewhere, &alone, &cold})
    Print(vertices, row, &rest.times);
  std::filesystem::remove_all(directory);
}

int Run(int argc, char** argv) {
  const std::string program = argc > 1 ? argv[1] : HULLD_PROGRAM;
  std::vector<int> counts;
  for (int i = 2; i < argc; ++i) counts.push_back(std::atoi(argv[i]));
  if (counts.empty()) counts = {64, 1000, 10'000, 100'000, 1'000'000};
  std::printf("vertices,case,queries,p50_us,p99_us,p50_ratio,p99_ratio,writer_chunks_per_s\n");
  for (const int vertices : counts) Measure(program, vertices);
  return 0;
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) { return hulld::bench::Run(argc, argv); }
