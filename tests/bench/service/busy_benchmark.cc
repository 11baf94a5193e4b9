// Slowdown of batches, scenes, and steps of streams next to busy programs, and of single pairs next
// to busy programs and to batches.
//
//   busy_benchmark [HULLD [ROUNDS [FLAG OF hulld...]]]
//
// Starts its own hulld. The busy programs are processes of ordinary priority that compute
// endlessly, one for each core. Fair scheduling explains a ratio of 2; anything more is due to the
// server. One row of CSV per kind of work and load. The loads alternate, ROUNDS (5) times, so that
// machine drift affects all of them; percentiles are of the calls of all rounds, and ratios are to
// the load "alone". A call is abandoned after 20 s and counted as 20 s. Run it with
// run_busy_benchmark.sh.

#include <grpcpp/grpcpp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "tests/bench/service/ball_hull.h"
#include "tests/bench/service/child_server.h"

namespace hulld::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr char kBall[] = "busy/ball";
constexpr int kVertices = 64;
constexpr std::chrono::seconds kMaxPerCall(20);
// For one kind of work in one round.
constexpr std::chrono::seconds kMaxPerTurn(2);

// A process that computes until this is destroyed.
class BusyProgram {
 public:
  BusyProgram() : pid_(fork()) {
    if (pid_ != 0) return;
    // Ends with its parent in any case.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (volatile uint64_t sum = 0;;) sum = sum + 1;
  }
  BusyProgram(const BusyProgram&) = delete;
  BusyProgram& operator=(const BusyProgram&) = delete;
  ~BusyProgram() {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }

 private:
  pid_t pid_;
};

v1::Placement PlaceBall(std::mt19937_64& random, double size) {
  std::uniform_real_distribution<double> coordinate(-size, size);
  v1::Placement placement;
  placement.set_hull_id(kBall);
  v1::Vector3* const t = placement.mutable_pose()->mutable_translation();
  t->set_x(coordinate(random));
  t->set_y(coordinate(random));
  t->set_z(coordinate(random));
  return placement;
}

// Half of the pairs are near each other, so that they reach several rungs.
v1::BatchCheckCollisionsRequest MakeBatch(int pairs) {
  constexpr int kPlacements = 1000;
  std::mt19937_64 random(3);
  v1::BatchCheckCollisionsRequest request;
  for (int i = 0; i < kPlacements; ++i) *request.add_placements() = PlaceBall(random, 3);
  for (int i = 0; i < 2 * pairs; ++i) {
    request.add_pairs(static_cast<uint32_t>(random() % kPlacements));
  }
  return request;
}

// About 40,000 pairs with intersecting boxes.
v1::FindCollisionsRequest MakeScene() {
  constexpr int kPlacements = 4000;
  std::mt19937_64 random(5);
  v1::FindCollisionsRequest request;
  for (int i = 0; i < kPlacements; ++i) *request.add_placements() = PlaceBall(random, 12);
  return request;
}

std::unique_ptr<v1::CollisionService::Stub> Connect(const std::string& address) {
  grpc::ChannelArguments own;  // a separate connection
  own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  own.SetMaxReceiveMessageSize(-1);
  return v1::CollisionService::NewStub(
      grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), own));
}

// Ends the program unless the call succeeded or was abandoned.
void RequireOrGivenUp(const grpc::Status& status, const char* what) {
  if (status.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED) Require(status, what);
}

void RunBatch(v1::CollisionService::Stub& stub, const v1::BatchCheckCollisionsRequest& request) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kMaxPerCall);
  const auto reader = stub.BatchCheckCollisions(&context, request);
  v1::BatchCheckCollisionsResponse part;
  while (reader->Read(&part)) {
  }
  RequireOrGivenUp(reader->Finish(), "BatchCheckCollisions");
}

void RunScene(v1::CollisionService::Stub& stub, const v1::FindCollisionsRequest& request) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kMaxPerCall);
  const auto reader = stub.FindCollisions(&context, request);
  v1::FindCollisionsResponse part;
  while (reader->Read(&part)) {
  }
  RequireOrGivenUp(reader->Finish(), "FindCollisions");
}

void RunSingle(v1::CollisionService::Stub& stub, int i) {
  v1::CheckCollisionRequest request;
  request.mutable_a()->set_hull_id(kBall);
  request.mutable_b()->set_hull_id(kBall);
  request.mutable_b()->mutable_pose()->mutable_translation()->set_x(1.5 + 1e-3 * (i % 1000));
  grpc::ClientContext context;
  v1::CheckCollisionResponse response;
  Require(stub.CheckCollision(&context, request, &response), "CheckCollision");
}

// One StreamCollisions call of all pairs of some placements; each step moves all of them.
class PoseStream {
 public:
  explicit PoseStream(v1::CollisionService::Stub& stub)
      : stream_(stub.StreamCollisions(&context_)) {
    constexpr uint32_t kPlacements = 200;
    std::mt19937_64 random(7);
    v1::StreamCollisionsRequest open;
    for (uint32_t i = 0; i < kPlacements; ++i) {
      *open.mutable_open()->add_placements() = PlaceBall(random, 6);
      step_.mutable_update()->add_placements(i);
      for (uint32_t j = 0; j < i; ++j) {
        open.mutable_open()->add_pairs(j);
        open.mutable_open()->add_pairs(i);
      }
    }
    Exchange(open);
  }
  ~PoseStream() {
    stream_->WritesDone();
    Require(stream_->Finish(), "StreamCollisions");
  }

  void Step(int i) {
    v1::CollisionStreamUpdate& update = *step_.mutable_update();
    std::mt19937_64 random(i);
    std::uniform_real_distribution<double> coordinate(-6, 6);
    update.clear_poses();
    for (int k = 0; k < update.placements_size(); ++k) {
      for (const double q : {1.0, 0.0, 0.0, 0.0}) update.add_poses(q);
      for (int axis = 0; axis < 3; ++axis) update.add_poses(coordinate(random));
    }
    Exchange(step_);
  }

 private:
  void Exchange(const v1::StreamCollisionsRequest& request) {
    if (!stream_->Write(request)) std::abort();
    v1::StreamCollisionsResponse part;
    do {
      if (!stream_->Read(&part)) std::abort();
    } while (!part.last());
  }

  grpc::ClientContext context_;
  std::unique_ptr<
      grpc::ClientReaderWriter<v1::StreamCollisionsRequest, v1::StreamCollisionsResponse>>
      stream_;
  v1::StreamCollisionsRequest step_;
};

// Sends batches until destroyed.
class BatchClient {
 public:
  BatchClient(const std::string& address, const v1::BatchCheckCollisionsRequest& request)
      : thread_([this, address, &request] {
          const auto stub = Connect(address);
          while (!ending_) RunBatch(*stub, request);
        }) {}
  ~BatchClient() {
    ending_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> ending_ = false;
  std::thread thread_;
};

struct Load {
  const char* name;
  bool busy_programs;
  bool batches;
};

struct Row {
  const char* work;
  Load load;
  int calls_per_turn;
  std::function<void(int)> call;
  std::vector<double> milliseconds = {};
};

double Percentile(const std::vector<double>& sorted, double p) {
  return sorted[std::min(sorted.size() - 1, static_cast<size_t>(p * sorted.size()))];
}

void Measure(const std::string& address, const v1::BatchCheckCollisionsRequest& batch, Row* row) {
  std::vector<std::unique_ptr<BusyProgram>> programs;
  const unsigned cores = row->load.busy_programs ? std::thread::hardware_concurrency() : 0;
  for (unsigned i = 0; i < cores; ++i) programs.push_back(std::make_unique<BusyProgram>());
  std::unique_ptr<BatchClient> batches;
  if (row->load.batches) batches = std::make_unique<BatchClient>(address, batch);
  row->call(0);  // the effects of the load change have settled
  const auto start = Clock::now();
  for (int i = 1; i <= row->calls_per_turn && Clock::now() - start < kMaxPerTurn; ++i) {
    const auto sent = Clock::now();
    row->call(i);
    const std::chrono::duration<double, std::milli> taken = Clock::now() - sent;
    row->milliseconds.push_back(taken.count());
  }
}

int Main(const std::string& program, int rounds, const std::vector<std::string>& flags) {
  std::vector<std::string> command = {program, "--store", "memory", "--listen", "127.0.0.1:0"};
  command.insert(command.end(), flags.begin(), flags.end());
  const ChildServer server(command);
  const std::string& address = server.address();
  const auto stub = Connect(address);
  const auto hulls =
      v1::HullService::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  MakeBallHull(*hulls, kBall, kVertices, 1);
  const v1::BatchCheckCollisionsRequest small = MakeBatch(20'000);
  const v1::BatchCheckCollisionsRequest large = MakeBatch(500'000);
  const v1::FindCollisionsRequest scene = MakeScene();
  PoseStream stream(*stub);

  const auto run_small = [&](int) { RunBatch(*stub, small); };
  const auto run_large = [&](int) { RunBatch(*stub, large); };
  const auto run_scene = [&](int) { RunScene(*stub, scene); };
  const auto run_step = [&](int i) { stream.Step(i); };
  const auto run_single = [&](int i) { RunSingle(*stub, i); };
  constexpr Load kAlone = {"alone", false, false};
  constexpr Load kBusy = {"busy programs", true, false};
  std::vector<Row> rows = {
      {"batch of 20000 pairs", kAlone, 20, run_small},
      {"batch of 20000 pairs", kBusy, 20, run_small},
      {"batch of 500000 pairs", kAlone, 5, run_large},
      {"batch of 500000 pairs", kBusy, 5, run_large},
      {"scene of 4000 placements", kAlone, 10, run_scene},
      {"scene of 4000 placements", kBusy, 10, run_scene},
      {"step of 19900 pairs", kAlone, 50, run_step},
      {"step of 19900 pairs", kBusy, 50, run_step},
      {"single pair", kAlone, 2000, run_single},
      {"single pair", {"batches", false, true}, 2000, run_single},
      {"single pair", kBusy, 500, run_single},
      {"single pair", {"busy programs and batches", true, true}, 500, run_single},
  };
  for (int i = 0; i < 500; ++i) RunSingle(*stub, i);  // warm up
  for (int round = 0; round < rounds; ++round) {
    for (Row& row : rows) Measure(address, large, &row);
  }
  std::printf("work,load,calls,p50_ms,p99_ms,p50_ratio,p99_ratio\n");
  const std::vector<double>* alone = nullptr;
  for (Row& row : rows) {
    std::sort(row.milliseconds.begin(), row.milliseconds.end());
    if (!row.load.busy_programs && !row.load.batches) alone = &row.milliseconds;
    const double p50 = Percentile(row.milliseconds, 0.5);
    const double p99 = Percentile(row.milliseconds, 0.99);
    std::printf("%s,%s,%zu,%.3f,%.3f,%.3g,%.3g\n", row.work, row.load.name, row.milliseconds.size(),
                p50, p99, p50 / Percentile(*alone, 0.5), p99 / Percentile(*alone, 0.99));
  }
  return 0;
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) {
  std::vector<std::string> flags;
  for (int i = 3; i < argc; ++i) flags.emplace_back(argv[i]);
  return hulld::bench::Main(argc > 1 ? argv[1] : HULLD_PROGRAM, argc > 2 ? std::atoi(argv[2]) : 5,
                            flags);
}
