// Time of a single pair while the server is busy with batches: a client of a running hulld.
//
//   overload_benchmark ADDRESS [ROUNDS] [CALLS]
//
// One row of CSV per phase: "idle", and "batches" with N clients that send batches in sequence. The
// phases alternate, ROUNDS (5) times with CALLS (2000) calls of CheckCollision each, so that
// machine drift affects all of them; percentiles are of the calls of all rounds, and ratios are to
// "idle". Run it with run_overload_benchmark.sh.

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "tests/bench/service/ball_hull.h"

namespace hulld::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kVertices = 256;
constexpr int kPlacements = 1000;
constexpr int kPairsPerBatch = 200'000;

// Half of the pairs are near each other, so that they reach several rungs.
v1::BatchCheckCollisionsRequest MakeBatch() {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> coordinate(-3, 3);
  v1::BatchCheckCollisionsRequest request;
  for (int i = 0; i < kPlacements; ++i) {
    v1::Placement* const placement = request.add_placements();
    placement->set_hull_id("overload/ball");
    v1::Vector3* const t = placement->mutable_pose()->mutable_translation();
    t->set_x(coordinate(random));
    t->set_y(coordinate(random));
    t->set_z(coordinate(random));
  }
  for (int i = 0; i < 2 * kPairsPerBatch; ++i) {
    request.add_pairs(static_cast<uint32_t>(random() % kPlacements));
  }
  return request;
}

// Sends batches until destroyed.
class BatchClient {
 public:
  BatchClient(const std::string& address, const v1::BatchCheckCollisionsRequest& request,
              std::atomic<uint64_t>* pairs)
      : thread_([this, address, &request, pairs] {
          grpc::ChannelArguments own;  // a separate connection
          own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
          own.SetMaxReceiveMessageSize(-1);
          const auto stub = v1::CollisionService::NewStub(
              grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), own));
          while (!ending_) Run(*stub, request, pairs);
        }) {}
  ~BatchClient() {
    ending_ = true;
    thread_.join();
  }

 private:
  void Run(v1::CollisionService::Stub& stub, const v1::BatchCheckCollisionsRequest& request,
           std::atomic<uint64_t>* pairs) {
    grpc::ClientContext context;
    const auto reader = stub.BatchCheckCollisions(&context, request);
    v1::BatchCheckCollisionsResponse part;
    while (!ending_ && reader->Read(&part)) *pairs += part.columns().relations_size();
    if (ending_) context.TryCancel();
    const grpc::Status status = reader->Finish();
    if (!ending_) Require(status, "BatchCheckCollisions");
  }

  std::atomic<bool> ending_ = false;
  std::thread thread_;
};

struct Phase {
  const char* name;
  int batch_clients;
  std::vector<double> microseconds;
  uint64_t pairs = 0;
  double seconds = 0;
};

double Percentile(const std::vector<double>& sorted, double p) {
  return sorted[std::min(sorted.size() - 1, static_cast<size_t>(p * sorted.size()))];
}

void Measure(const std::string& address, v1::CollisionService::Stub& stub,
             const v1::BatchCheckCollisionsRequest& batch, int calls, Phase* phase) {
  std::atomic<uint64_t> pairs = 0;
  std::vector<std::unique_ptr<BatchClient>> clients;
  for (int i = 0; i < phase->batch_clients; ++i) {
    clients.push_back(std::make_unique<BatchClient>(address, batch, &pairs));
  }
  // Only while batches are answered.
  while (phase->batch_clients > 0 && pairs == 0) std::this_thread::yield();
  const uint64_t pairs_before = pairs;
  const auto start = Clock::now();
  v1::CheckCollisionRequest request;
  request.mutable_a()->set_hull_id("overload/ball");
  request.mutable_b()->set_hull_id("overload/ball");
  for (int i = 0; i < calls; ++i) {
    request.mutable_b()->mutable_pose()->mutable_translation()->set_x(1.5 + 1e-3 * (i % 1000));
    grpc::ClientContext context;
    v1::CheckCollisionResponse response;
    const auto sent = Clock::now();
    Require(stub.CheckCollision(&context, request, &response), "CheckCollision");
    const std::chrono::duration<double, std::micro> taken = Clock::now() - sent;
    phase->microseconds.push_back(taken.count());
  }
  phase->seconds += std::chrono::duration<double>(Clock::now() - start).count();
  phase->pairs += pairs - pairs_before;
}

int Main(const std::string& address, int rounds, int calls) {
  const auto channel = grpc::CreateChannel(address, grpc::InsecureChannelCredentials());
  const auto hulls = v1::HullService::NewStub(channel);
  const auto collisions = v1::CollisionService::NewStub(channel);
  MakeBallHull(*hulls, "overload/ball", kVertices, 1);
  const v1::BatchCheckCollisionsRequest batch = MakeBatch();
  Phase warm_up = {"warm-up", 0, {}};
  Measure(address, *collisions, batch, 500, &warm_up);
  std::vector<Phase> phases = {{"idle", 0, {}}, {"batches", 1, {}}, {"batches", 4, {}}};
  for (int round = 0; round < rounds; ++round) {
    for (Phase& phase : phases) Measure(address, *collisions, batch, calls, &phase);
  }
  std::printf("load,batch_clients,calls,p50_us,p99_us,p999_us,p50_ratio,p99_ratio,pairs_per_s\n");
  for (Phase& phase : phases) std::sort(phase.microseconds.begin(), phase.microseconds.end());
  const std::vector<double>& idle = phases.front().microseconds;
  for (const Phase& phase : phases) {
    const double p50 = Percentile(phase.microseconds, 0.5);
    const double p99 = Percentile(phase.microseconds, 0.99);
    std::printf("%s,%d,%zu,%.1f,%.1f,%.1f,%.3g,%.3g,%.4g\n", phase.name, phase.batch_clients,
                phase.microseconds.size(), p50, p99, Percentile(phase.microseconds, 0.999),
                p50 / Percentile(idle, 0.5), p99 / Percentile(idle, 0.99),
                static_cast<double>(phase.pairs) / phase.seconds);
  }
  return 0;
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) {
  if (argc < 2 || argc > 4) {
    std::fprintf(stderr, "usage: overload_benchmark ADDRESS [ROUNDS] [CALLS]\n");
    return 2;
  }
  return hulld::bench::Main(argv[1], argc > 2 ? std::atoi(argv[2]) : 5,
                            argc > 3 ? std::atoi(argv[3]) : 2000);
}
