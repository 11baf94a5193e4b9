#include "tests/fuzz/service_fuzz.h"

#include <spdlog/sinks/null_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

#include "tests/fuzz/service_program.h"

namespace hulld::fuzz {
namespace {

// Small, so that programs of a hundred bytes reach them.
server::Config SmallConfig(const std::string& socket) {
  server::Config config;
  config.listen = "unix:" + socket;
  config.store = "memory";
  config.threads = 2;
  config.limits.max_message_bytes = 64 << 10;
  config.limits.max_points_per_chunk = 64;
  config.limits.max_vertices_per_hull = 12;
  config.limits.max_hulls = 7;
  config.limits.max_pairs_per_batch = 60;
  config.limits.max_textbook_axes = 100;
  return config;
}

struct KnownHull {
  const char* id;
  std::vector<double> xyz;
};

std::vector<double> CubeAt(double x) {
  std::vector<double> xyz;
  for (int corner = 0; corner < 8; ++corner) {
    xyz.insert(xyz.end(), {x + (corner & 1), static_cast<double>((corner >> 1) & 1),
                           static_cast<double>(corner >> 2)});
  }
  return xyz;
}

// What programs find when they start.
std::vector<KnownHull> FirstHulls() {
  return {{"cube", CubeAt(0)},
          {"tetra", {0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 2}},
          {"empty", {}},
          {"flat", {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 3, 1, 0}},
          {"cell-1/arm", {-1, -1, -1, 1, 1, 1}}};
}

// Those that no program can name.
std::vector<KnownHull> Guards() { return {{"guard/a", CubeAt(0)}, {"guard/b", CubeAt(0)}}; }

std::string Put(v1::HullService::Stub& hulls, const KnownHull& hull) {
  grpc::ClientContext context;
  const auto stream = hulls.AppendPoints(&context);
  v1::AppendPointsRequest request;
  request.mutable_open()->set_hull_id(hull.id);
  request.mutable_open()->set_create_if_absent(true);
  stream->Write(request);
  if (!hull.xyz.empty()) {
    request.mutable_chunk()->set_sequence(1);
    request.mutable_chunk()->mutable_points()->mutable_xyz()->Assign(hull.xyz.begin(),
                                                                     hull.xyz.end());
    stream->Write(request);
  }
  stream->WritesDone();
  v1::AppendPointsResponse response;
  while (stream->Read(&response)) {
  }
  const grpc::Status status = stream->Finish();
  return status.ok() ? "" : std::string("cannot put ") + hull.id + ": " + status.error_message();
}

}  // namespace

ServiceFuzz::ServiceFuzz() {
  // What is logged is formatted, and goes nowhere.
  auto logger =
      std::make_shared<spdlog::logger>("fuzz", std::make_shared<spdlog::sinks::null_sink_mt>());
  logger->set_level(spdlog::level::debug);
  spdlog::set_default_logger(std::move(logger));
  char directory[] = "/tmp/hulld-fuzz-XXXXXX";
  if (mkdtemp(directory) == nullptr) std::abort();
  socket_ = std::string(directory) + "/socket";
  auto started = server::Server::Start(SmallConfig(socket_));
  if (!started.ok()) {
    std::fprintf(stderr, "%s\n", started.status().ToString().c_str());
    std::abort();
  }
  server_ = *std::move(started);
  channel_ = grpc::CreateChannel("unix:" + socket_, grpc::InsecureChannelCredentials());
  hulls_ = v1::HullService::NewStub(channel_);
  collisions_ = v1::CollisionService::NewStub(channel_);
  status_ = v1::StatusService::NewStub(channel_);
  generic_ = std::make_unique<grpc::GenericStub>(channel_);
  for (const KnownHull& hull : Guards()) {
    if (!Put(*hulls_, hull).empty()) std::abort();
  }
}

ServiceFuzz::~ServiceFuzz() {
  channel_.reset();
  server_.reset();
  unlink(socket_.c_str());
  rmdir(socket_.substr(0, socket_.find_last_of('/')).c_str());
}

// Removes what the program before has left.
std::string ServiceFuzz::Prepare() {
  grpc::ClientContext context;
  v1::ListHullsResponse all;
  if (!hulls_->ListHulls(&context, {}, &all).ok()) return "hulls cannot be listed";
  for (const v1::HullInfo& hull : all.hulls()) {
    if (hull.hull_id().rfind("guard/", 0) == 0) continue;
    grpc::ClientContext deletion;
    v1::DeleteHullRequest request;
    v1::DeleteHullResponse response;
    request.set_hull_id(hull.hull_id());
    const grpc::Status status = hulls_->DeleteHull(&deletion, request, &response);
    if (!status.ok()) return "cannot delete: " + status.error_message();
  }
  for (const KnownHull& hull : FirstHulls()) {
    if (std::string finding = Put(*hulls_, hull); !finding.empty()) return finding;
  }
  return {};
}

std::string ServiceFuzz::Run(std::span<const uint8_t> program) {
  std::string finding = Prepare();
  if (!finding.empty()) return finding;
  {
    ServiceProgram run(*this, program);
    finding = run.Run();
    if (finding.empty()) finding = run.CheckGuards();
  }
  if (!finding.empty()) return finding;
  constexpr std::chrono::seconds kPatience(60);
  return server_->WaitIdle(kPatience) ? "" : "calls outlive the program that made them";
}

}  // namespace hulld::fuzz
