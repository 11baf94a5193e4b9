// Rays in one call: 100,000 rays against 1000 hulls of 64 vertices.
//
//   ray_benchmark [PROGRAM]
//
// Starts its own hulld with an in-memory store, which uses all cores. A ray is a point that
// translates, and the call is FindCollisions with packed placements, as cast() of the Python client
// sends it, without certificates. Rows of CSV; medians of kRounds rounds, in which the rows
// alternate:
//
//   hulld     the time of each hit, 0 for a ray that starts inside
//   Bullet    every hit of btCollisionWorld::rayTest, a call per ray, on one thread in this
//             process; it omits rays that start inside
//
// Columns: `hits`, pairs of a ray and a hull; `rays_per_second`, by the wall clock; `cores`, the
// processor time of the server over the time of the call.

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "tests/bench/bench_random.h"
#include "tests/bench/csv_reporter.h"
#include "tests/bench/motions/ray_scene.h"
#include "tests/bench/service/ball_hull.h"
#include "tests/bench/service/child_server.h"

namespace hulld::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kHulls = 1000;
constexpr int kVertices = 64;
constexpr size_t kRays = 100'000;
constexpr int kRounds = 3;
// Half the side of the cube that contains the hulls, about three radii of room for each.
constexpr double kHalf = 15;

std::string HullId(size_t hull) { return "ray/" + std::to_string(hull); }

Vector InCube(Random& random) {
  return {random.Between(-kHalf, kHalf), random.Between(-kHalf, kHalf),
          random.Between(-kHalf, kHalf)};
}

// Returns ellipsoids with axes between 0.5 and 1.5.
RayScene MakeScene() {
  Random random(20261126);
  RayScene scene;
  for (int i = 0; i < kHulls; ++i) {
    const Vector axes(random.Between(0.5, 1.5), random.Between(0.5, 1.5), random.Between(0.5, 1.5));
    HullBuilder builder;
    for (int k = 0; k < kVertices; ++k) {
      const std::vector<Vector> point = {random.UnitVector().cwiseProduct(axes)};
      if (!builder.Add(point).ok()) std::abort();
    }
    scene.hulls.push_back(builder.Snapshot());
    scene.targets.push_back({scene.hulls.size() - 1, {random.Rotation(), InCube(random)}});
  }
  return scene;
}

// Rays of a length from random points of the cube.
std::vector<RayScene::Ray> MakeRays(double length) {
  Random random(20261127);
  std::vector<RayScene::Ray> rays;
  for (size_t i = 0; i < kRays; ++i) {
    const Vector start = InCube(random);
    rays.push_back({start, start + length * random.UnitVector()});
  }
  return rays;
}

void PutHulls(const std::shared_ptr<grpc::Channel>& channel, const RayScene& scene) {
  const auto stub = v1::HullService::NewStub(channel);
  for (size_t i = 0; i < scene.hulls.size(); ++i) {
    grpc::ClientContext context;
    const auto stream = stub->AppendPoints(&context);
    v1::AppendPointsRequest open;
    open.mutable_open()->set_hull_id(HullId(i));
    open.mutable_open()->set_create_if_absent(true);
    v1::AppendPointsResponse reply;
    v1::AppendPointsRequest request;
    request.mutable_chunk()->set_sequence(1);
    for (const Vector& p : scene.hulls[i].vertices()) {
      for (const double x : p) request.mutable_chunk()->mutable_points()->add_xyz(x);
    }
    if (stream->Write(open) && stream->Read(&reply) && stream->Write(request)) {
      stream->Read(&reply);
    }
    stream->WritesDone();
    Require(stream->Finish(), "AppendPoints");
  }
}

void AddPoses(const Pose& start, const Pose& end, v1::PackedPlacements* packed) {
  for (const double number : start.q) packed->add_poses(number);
  for (const double number : start.t) packed->add_poses(number);
  for (const double number : end.q) packed->add_end_poses(number);
  for (const double number : end.t) packed->add_end_poses(number);
}

v1::FindCollisionsRequest MakeRequest(const RayScene& scene,
                                      const std::vector<RayScene::Ray>& rays) {
  v1::FindCollisionsRequest request;
  v1::PackedPlacements* const packed = request.mutable_packed_placements();
  for (size_t i = 0; i < scene.hulls.size(); ++i) packed->add_hull_ids(HullId(i));
  packed->add_shape_sizes(1);
  for (int k = 0; k < 3; ++k) packed->mutable_shape_points()->add_xyz(0);
  for (const RayScene::Ray& ray : rays) {
    packed->add_hulls(packed->hull_ids_size());
    request.add_groups(0);
    AddPoses({{1, 0, 0, 0}, ray.start}, {{1, 0, 0, 0}, ray.end}, packed);
  }
  for (const RayScene::Target& target : scene.targets) {
    packed->add_hulls(static_cast<uint32_t>(target.hull));
    request.add_groups(1);
    AddPoses(target.X_WH, target.X_WH, packed);
  }
  // No pairs of two rays or of two hulls.
  request.set_ignore_same_group(true);
  request.set_movers(static_cast<uint32_t>(rays.size()));
  return request;
}

uint64_t CastInOneCall(v1::CollisionService::Stub& stub, const v1::FindCollisionsRequest& request) {
  uint64_t hits = 0;
  grpc::ClientContext context;
  const auto reader = stub.FindCollisions(&context, request);
  for (v1::FindCollisionsResponse part; reader->Read(&part);) hits += part.pairs_size() / 2;
  Require(reader->Finish(), "FindCollisions");
  return hits;
}

// A row: repeated in each round.
struct Row {
  double length;
  const char* library;
  std::function<uint64_t()> cast;
  std::vector<double> seconds = {};
  std::vector<double> cores = {};
  uint64_t hits = 0;
};

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

int Run(int argc, char** argv) {
  const ChildServer server({argc > 1 ? argv[1] : HULLD_PROGRAM, "--listen", "127.0.0.1:0",
                            "--store", "memory", "--log-level", "info"});
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  const auto channel =
      grpc::CreateCustomChannel(server.address(), grpc::InsecureChannelCredentials(), arguments);
  const auto stub = v1::CollisionService::NewStub(channel);
  const RayScene scene = MakeScene();
  PutHulls(channel, scene);
  BulletRays bullet(scene);
  std::vector<Row> rows;
  for (const double length : {3.0, 30.0}) {
    const auto rays = std::make_shared<std::vector<RayScene::Ray>>(MakeRays(length));
    const auto request = std::make_shared<v1::FindCollisionsRequest>(MakeRequest(scene, *rays));
    rows.push_back({length, "hulld", [=, &stub] { return CastInOneCall(*stub, *request); }});
    rows.push_back({length, "Bullet", [=, &bullet] { return bullet.Cast(*rays); }});
  }
  for (int round = 0; round < kRounds; ++round) {
    for (Row& row : rows) {
      const double before = server.ProcessorSeconds();
      const auto start = Clock::now();
      row.hits = row.cast();
      row.seconds.push_back(std::chrono::duration<double>(Clock::now() - start).count());
      row.cores.push_back((server.ProcessorSeconds() - before) / row.seconds.back());
    }
  }
  std::printf("length,library,rays,hulls,hits,milliseconds,rays_per_second,cores,compiler,cpu\n");
  for (const Row& row : rows) {
    const double seconds = Median(row.seconds);
    std::printf("%g,%s,%zu,%d,%llu,%.1f,%.0f,%.2f,%s,%s\n", row.length, row.library, kRays, kHulls,
                static_cast<unsigned long long>(row.hits), 1e3 * seconds,
                static_cast<double>(kRays) / seconds, Median(row.cores), CompilerName().c_str(),
                CpuName().c_str());
  }
  return 0;
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) { return hulld::bench::Run(argc, argv); }
