// Workloads over the wire with many growing hulls, with hulls just read from disk, and with the
// frames of a depth camera.
//
//   live_workload_benchmark [HULLD [SCALE [WORK]]]
//
// Starts a hulld with a durable store for each. Prints one row of CSV per case; ratios are relative
// to the first case of the same workload, except for the camera. SCALE, 1 by default: the amount of
// work. WORK: runs only this workload.
//
//   scene       FindCollisions over 1000 hulls of 64 vertices: at rest, directly after one of them
//               received an acknowledged point, and directly after each of them did.
//   stream      StreamCollisions that resolves its hulls again at every step: 1024 pairs of 32
//               hulls of 1000 vertices and a probe, and one pair with a hull of 100000; at rest and
//               directly after a point was acknowledged.
//   camera      One ReplaceHull per frame of 848 x 480 depths in single precision, from which the
//               client drops NaNs, then a query about the hull: the time of both, and of the query
//               alone.
//   cold scene  FindCollisions over 10000 hulls of 64 vertices: with all in memory, and as the
//               first call after a restart, when each hull has to be read.

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "tests/bench/csv_reporter.h"
#include "tests/bench/service/ball_hull.h"
#include "tests/bench/service/child_server.h"
#include "tests/bench/service/growing_writer.h"

namespace hulld::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr char kProbe[] = "probe";

double Microseconds(Clock::duration duration) {
  return std::chrono::duration<double, std::micro>(duration).count();
}

// Runs `work` and returns its time in microseconds.
double Timed(const std::function<void()>& work) {
  const auto start = Clock::now();
  work();
  return Microseconds(Clock::now() - start);
}

// A temporary directory for a store, deleted with this, and the command of a server on it.
class Store {
 public:
  explicit Store(const std::string& program)
      : directory_((std::filesystem::temp_directory_path() / "hulld-live-XXXXXX").string()) {
    if (mkdtemp(directory_.data()) == nullptr) std::abort();
    command_ = {program,    "--listen",    "127.0.0.1:0", "--data-dir",
                directory_, "--log-level", "info"};
  }
  ~Store() { std::filesystem::remove_all(directory_); }
  const std::vector<std::string>& command() const { return command_; }

 private:
  std::string directory_;
  std::vector<std::string> command_;
};

struct Row {
  const char* work;
  std::string name;
  std::vector<double> times = {};
};

// first: the reference of the ratios.
void Print(Row row, Row first) {
  std::sort(row.times.begin(), row.times.end());
  std::sort(first.times.begin(), first.times.end());
  double total = 0;
  for (const double time : row.times) total += time;
  const double p50 = Percentile(row.times, 0.5);
  const double p99 = Percentile(row.times, 0.99);
  std::printf("\"%s\",\"%s\",%zu,%.0f,%.0f,%.3g,%.3g,%.4g,\"%s\",\"%s\"\n", row.work,
              row.name.c_str(), row.times.size(), p50, p99, p50 / Percentile(first.times, 0.5),
              p99 / Percentile(first.times, 0.99),
              1e6 * static_cast<double>(row.times.size()) / total, CompilerName().c_str(),
              CpuName().c_str());
  std::fflush(stdout);
}

std::string HullId(int i) { return "live/" + std::to_string(i); }

// Creates hulls 0 to count - 1 on several concurrent connections, so that they share syncs of the
// disk.
void MakeHulls(const std::string& address, int count, int vertices) {
  constexpr int kConnections = 8;
  std::vector<std::jthread> threads;
  for (int first = 0; first < kConnections; ++first) {
    threads.emplace_back([&address, count, vertices, first] {
      const auto stub = v1::HullService::NewStub(ConnectAlone(address));
      for (int i = first; i < count; i += kConnections) {
        MakeBallHull(*stub, HullId(i), vertices, 1);
      }
    });
  }
}

// Each hull has its own place on a lattice, so close to its neighbors that boxes overlap.
v1::FindCollisionsRequest SceneOf(int count) {
  constexpr double kApart = 2.3;
  const int side = static_cast<int>(std::ceil(std::cbrt(count)));
  v1::FindCollisionsRequest request;
  v1::PackedPlacements& packed = *request.mutable_packed_placements();
  for (int i = 0; i < count; ++i) {
    packed.add_hull_ids(HullId(i));
    packed.add_hulls(static_cast<uint32_t>(i));
    const int place[] = {i % side, i / side % side, i / side / side};
    packed.add_poses(1);
    for (int k = 0; k < 3; ++k) packed.add_poses(0);
    for (const int at : place) packed.add_poses(kApart * at);
  }
  return request;
}

void FindAll(v1::CollisionService::Stub& stub, const v1::FindCollisionsRequest& request) {
  grpc::ClientContext context;
  context.set_wait_for_ready(true);
  const auto reader = stub.FindCollisions(&context, request);
  for (v1::FindCollisionsResponse part; reader->Read(&part);) {
    if (part.placement_problems_size() > 0) std::abort();
  }
  Require(reader->Finish(), "FindCollisions");
}

void MeasureScene(const std::string& program, double scale) {
  constexpr int kHulls = 1000;
  const int rounds = std::max(1, static_cast<int>(10 * scale));
  constexpr int kCalls = 20;
  const Store store(program);
  const ChildServer server(store.command());
  MakeHulls(server.address(), kHulls, 64);
  const v1::FindCollisionsRequest request = SceneOf(kHulls);
  const auto stub = v1::CollisionService::NewStub(ConnectAlone(server.address()));
  const auto writers = ConnectAlone(server.address());
  const auto find = [&] { FindAll(*stub, request); };
  for (int i = 0; i < 100; ++i) find();
  Row rest = {"scene of 1000 hulls", "at rest"};
  Row one = {rest.work, "after an append to one"};
  Row each = {rest.work, "after an append to each"};
  for (int round = 0; round < rounds; ++round) {
    for (int i = 0; i < kCalls; ++i) rest.times.push_back(Timed(find));
    {
      GrowingWriter writer(writers, HullId(round), "one" + std::to_string(round));
      for (int i = 0; i < kCalls; ++i) {
        writer.SendAndReceive();
        one.times.push_back(Timed(find));
      }
    }
    for (int turn = 0; turn < 2; ++turn) {
      const std::string id = std::to_string(2 * round + turn);
      for (int i = 0; i < kHulls; ++i) {
        GrowingWriter(writers, HullId(i), "each" + id).SendAndReceive();
      }
      each.times.push_back(Timed(find));
    }
  }
  for (const Row& row : {rest, one, each}) Print(row, rest);
}

// A stream that moves one placement at each step.
class Follower {
 public:
  Follower(const std::string& address, int hulls, int pairs)
      : stub_(v1::CollisionService::NewStub(ConnectAlone(address))),
        stream_(stub_->StreamCollisions(&context_)),
        pairs_(pairs) {
    v1::StreamCollisionsRequest request;
    v1::CollisionStreamOpen& open = *request.mutable_open();
    for (int i = 0; i < 2 * pairs; ++i) {
      v1::Placement& placement = *open.add_placements();
      placement.set_hull_id(i % 2 == 0 ? HullId(i / 2 % hulls) : kProbe);
      if (i % 2 == 1) {
        placement.mutable_pose()->mutable_translation()->set_x(0.9 + 1e-3 * (i % 500));
        placement.mutable_pose()->mutable_translation()->set_z(0.9);
      }
      open.add_pairs(static_cast<uint32_t>(i));
    }
    Exchange(request);
  }
  ~Follower() {
    stream_->WritesDone();
    Require(stream_->Finish(), "StreamCollisions");
  }

  void Step() {
    v1::StreamCollisionsRequest request;
    v1::CollisionStreamUpdate& update = *request.mutable_update();
    update.set_refresh_hulls(true);
    ++steps_;
    update.add_placements(static_cast<uint32_t>(2 * (steps_ % pairs_) + 1));
    for (const double number : {1.0, 0.0, 0.0, 0.0, 0.9 + 1e-3 * (steps_ % 500), 0.0, 0.9}) {
      update.add_poses(number);
    }
    Exchange(request);
  }

 private:
  void Exchange(const v1::StreamCollisionsRequest& request) {
    if (!stream_->Write(request)) std::abort();
    v1::StreamCollisionsResponse part;
    do {
      if (!stream_->Read(&part)) std::abort();
      if (part.placement_problems_size() > 0) std::abort();
    } while (!part.last());
  }

  std::unique_ptr<v1::CollisionService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<
      grpc::ClientReaderWriter<v1::StreamCollisionsRequest, v1::StreamCollisionsResponse>>
      stream_;
  const int pairs_;
  int steps_ = 0;
};

void MeasureStream(const std::string& program, double scale, const char* work, int hulls,
                   int vertices, int pairs) {
  const int rounds = std::max(1, static_cast<int>(10 * scale));
  constexpr int kSteps = 100;
  const Store store(program);
  const ChildServer server(store.command());
  MakeHulls(server.address(), hulls, vertices);
  MakeBallHull(*v1::HullService::NewStub(ConnectAlone(server.address())), kProbe, 64, 0.5);
  Follower follower(server.address(), hulls, pairs);
  const auto writers = ConnectAlone(server.address());
  const auto step = [&] { follower.Step(); };
  for (int i = 0; i < 500; ++i) step();
  Row rest = {work, "at rest"};
  Row after = {work, "after an append to one"};
  for (int round = 0; round < rounds; ++round) {
    for (int i = 0; i < kSteps; ++i) rest.times.push_back(Timed(step));
    GrowingWriter writer(writers, HullId(round % hulls), std::to_string(round));
    for (int i = 0; i < kSteps; ++i) {
      writer.SendAndReceive();
      after.times.push_back(Timed(step));
    }
  }
  for (const Row& row : {rest, after}) Print(row, rest);
}

// A table with a ball in front of a wall, seen by a camera that looks along z: the depth of each
// pixel, with noise, or NaN if the camera has none.
class Camera {
 public:
  Camera() {
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        rays_.push_back({(static_cast<float>(u) - kWidth / 2.0f) / kFocal,
                         (static_cast<float>(v) - kHeight / 2.0f) / kFocal});
      }
    }
  }

  std::vector<float> NextFrame() {
    std::normal_distribution<float> noise(0, 1e-3f);
    std::uniform_real_distribution<float> chance(0, 1);
    const float ball_x = -0.4f + 0.01f * static_cast<float>(frames_++ % 80);
    std::vector<float> depths;
    depths.reserve(rays_.size());
    for (const auto& [x, y] : rays_) {
      constexpr float kWall = 2;
      constexpr float kTableBelow = 0.5f;
      float depth = y * kWall > kTableBelow ? kTableBelow / y : kWall;
      if (const std::optional<float> ball = DepthOfBall(x, y, ball_x)) depth = *ball;
      depth *= 1 + noise(random_);
      depths.push_back(chance(random_) < kMissing ? std::numeric_limits<float>::quiet_NaN()
                                                  : depth);
    }
    return depths;
  }

  // Replaces the hull with the points of a frame.
  void Put(v1::HullService::Stub& stub, const std::string& hull_id,
           const std::vector<float>& depths) const {
    constexpr size_t kPointsPerMessage = 100'000;
    grpc::ClientContext context;
    v1::ReplaceHullResponse response;
    const auto writer = stub.ReplaceHull(&context, &response);
    v1::ReplaceHullRequest request;
    request.mutable_open()->set_hull_id(hull_id);
    request.mutable_open()->set_create_if_absent(true);
    bool is_open = writer->Write(request);
    for (size_t i = 0; i < depths.size() && is_open;) {
      auto& xyz = *request.mutable_points()->mutable_xyz_float();
      xyz.Clear();
      xyz.Reserve(3 * kPointsPerMessage);
      for (; i < depths.size() && static_cast<size_t>(xyz.size()) < 3 * kPointsPerMessage; ++i) {
        if (std::isnan(depths[i])) continue;
        xyz.AddAlreadyReserved(rays_[i][0] * depths[i]);
        xyz.AddAlreadyReserved(rays_[i][1] * depths[i]);
        xyz.AddAlreadyReserved(depths[i]);
      }
      is_open = writer->Write(request);
    }
    // An empty block marks the end.
    request.mutable_points()->Clear();
    if (is_open) writer->Write(request);
    writer->WritesDone();
    Require(writer->Finish(), "ReplaceHull");
    if (response.durability() != v1::DURABILITY_SYNC) std::abort();
  }

 private:
  static constexpr int kWidth = 848;
  static constexpr int kHeight = 480;
  static constexpr float kFocal = 430;
  static constexpr float kMissing = 0.06f;

  // Returns the depth along z at which the ray through (x, y, 1) meets a ball of radius 0.3.
  static std::optional<float> DepthOfBall(float x, float y, float ball_x) {
    constexpr float kZ = 1.5f;
    constexpr float kRadius = 0.3f;
    const float a = x * x + y * y + 1;
    const float b = x * ball_x + kZ;
    const float c = ball_x * ball_x + kZ * kZ - kRadius * kRadius;
    const float d = b * b - a * c;
    return d > 0 ? std::optional((b - std::sqrt(d)) / a) : std::nullopt;
  }

  std::vector<std::array<float, 2>> rays_;
  std::mt19937 random_{20261122};
  int frames_ = 0;
};

void MeasureCamera(const std::string& program, double scale) {
  const int count = std::max(2, static_cast<int>(150 * scale));
  const Store store(program);
  const ChildServer server(store.command());
  const auto channel = ConnectAlone(server.address());
  const auto hulls = v1::HullService::NewStub(channel);
  const auto collisions = v1::CollisionService::NewStub(channel);
  MakeBallHull(*hulls, kProbe, 64, 0.2);
  Camera camera;
  std::vector<std::vector<float>> frames;
  for (int i = 0; i < 16; ++i) frames.push_back(camera.NextFrame());
  v1::CheckCollisionRequest request;
  request.mutable_a()->set_hull_id(HullId(0));
  request.mutable_b()->set_hull_id(kProbe);
  request.mutable_b()->mutable_pose()->mutable_translation()->set_z(1.1);
  Row frame = {"depth camera, 848 x 480", "frame and query"};
  Row query = {frame.work, "query alone"};
  for (int i = 0; i < count; ++i) {
    double asking = 0;
    const double time = Timed([&] {
      camera.Put(*hulls, HullId(0), frames[static_cast<size_t>(i) % frames.size()]);
      asking = Timed([&] {
        grpc::ClientContext context;
        v1::CheckCollisionResponse response;
        Require(collisions->CheckCollision(&context, request, &response), "CheckCollision");
      });
    });
    frame.times.push_back(time);
    query.times.push_back(asking);
  }
  for (const Row& row : {frame, query}) Print(row, row);
}

void MeasureColdScene(const std::string& program, double scale) {
  const int count = std::max(100, static_cast<int>(10'000 * scale));
  constexpr int kRestarts = 3;
  constexpr int kCalls = 10;
  const Store store(program);
  {
    const ChildServer server(store.command());
    MakeHulls(server.address(), count, 64);
  }
  const v1::FindCollisionsRequest request = SceneOf(count);
  Row warm = {"scene of 10000 hulls", "warm"};
  Row cold = {warm.work, "first after a restart"};
  for (int i = 0; i < kRestarts; ++i) {
    const ChildServer server(store.command());
    const auto channel = ConnectAlone(server.address());
    // A query about other hulls, which opens the connection.
    grpc::ClientContext context;
    context.set_wait_for_ready(true);
    v1::ListHullsRequest list;
    list.set_page_size(1);
    v1::ListHullsResponse page;
    Require(v1::HullService::NewStub(channel)->ListHulls(&context, list, &page), "ListHulls");
    const auto stub = v1::CollisionService::NewStub(channel);
    const auto find = [&] { FindAll(*stub, request); };
    cold.times.push_back(Timed(find));
    for (int k = 0; k < kCalls; ++k) find();  // until all worthwhile preparation is done
    for (int k = 0; k < kCalls; ++k) warm.times.push_back(Timed(find));
  }
  for (const Row& row : {warm, cold}) Print(row, warm);
}

int Run(int argc, char** argv) {
  const std::string program = argc > 1 ? argv[1] : HULLD_PROGRAM;
  const double scale = argc > 2 ? std::atof(argv[2]) : 1;
  std::printf("work,case,times,p50_us,p99_us,p50_ratio,p99_ratio,per_second,compiler,cpu\n");
  const std::string only = argc > 3 ? argv[3] : "";
  const auto wants = [&](const char* work) { return only.empty() || only == work; };
  if (wants("scene")) MeasureScene(program, scale);
  if (wants("stream")) {
    MeasureStream(program, scale, "stream of 1024 pairs, 32 hulls of 1000", 32, 1000, 1024);
    MeasureStream(program, scale, "stream of one pair, a hull of 100000", 1, 100'000, 1);
  }
  if (wants("camera")) MeasureCamera(program, scale);
  if (wants("cold scene")) MeasureColdScene(program, scale);
  return 0;
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) { return hulld::bench::Run(argc, argv); }
