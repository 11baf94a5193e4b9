#include "tests/fuzz/service/service_fuzz.h"

#include <absl/strings/str_cat.h>
#include <spdlog/sinks/null_sink.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>
#include <vector>

#include "client/backup_file.h"
#include "tests/fuzz/service/service_program.h"

namespace hulld::fuzz {
namespace {

// Programs between reopenings of a durable store.
constexpr int kProgramsPerOpening = 8;
// Fits only some of the programs' hulls, so that the rest are read from the store.
constexpr uint64_t kSmallMemory = 64 << 10;

// Small limits, so that programs of a hundred bytes reach them.
server::Config SmallConfig() {
  server::Config config;
  config.threads = 2;
  config.limits.max_message_bytes = 64 << 10;
  config.limits.max_points_per_chunk = 64;
  config.limits.max_vertices_per_hull = 12;
  config.limits.max_hulls = 8;
  config.limits.max_pieces_per_body = 5;
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

// Returns the hulls that exist when a program starts.
std::vector<KnownHull> FirstHulls() {
  return {{"cube", CubeAt(0)},
          {"tetra", {0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 2}},
          {"empty", {}},
          {"flat", {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 3, 1, 0}},
          {"cell-1/arm", {-1, -1, -1, 1, 1, 1}}};
}

// Returns the hulls that no program can name.
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

ServiceFuzz::ServiceFuzz(const std::string& store) : store_(store) {
  // Log lines are formatted and discarded.
  auto logger =
      std::make_shared<spdlog::logger>("fuzz", std::make_shared<spdlog::sinks::null_sink_mt>());
  logger->set_level(spdlog::level::debug);
  spdlog::set_default_logger(std::move(logger));
  char directory[] = "/tmp/hulld-fuzz-XXXXXX";
  if (mkdtemp(directory) == nullptr) std::abort();
  directory_ = directory;
  data_dir_ = directory_ + "/data";
  Start();
  for (const KnownHull& hull : Guards()) {
    if (!Put(*hulls_, hull).empty()) std::abort();
  }
}

ServiceFuzz::~ServiceFuzz() {
  Stop();
  std::error_code error;
  std::filesystem::remove_all(directory_, error);
}

void ServiceFuzz::Start() {
  server::Config config = SmallConfig();
  // A channel to a new address shares nothing with earlier channels.
  config.listen = absl::StrCat("unix:", directory_, "/socket-", ++opened_);
  config.store = store_;
  config.data_dir = data_dir_;
  if (store_ == "rocksdb") config.limits.memory_limit = kSmallMemory;
  auto started = server::Server::Start(config);
  if (!started.ok()) {
    std::fprintf(stderr, "%s\n", started.status().ToString().c_str());
    std::abort();
  }
  server_ = *std::move(started);
  channel_ = grpc::CreateChannel(config.listen, grpc::InsecureChannelCredentials());
  hulls_ = v1::HullService::NewStub(channel_);
  bodies_ = v1::BodyService::NewStub(channel_);
  collisions_ = v1::CollisionService::NewStub(channel_);
  status_ = v1::StatusService::NewStub(channel_);
  maintenance_ = v1::MaintenanceService::NewStub(channel_);
  generic_ = std::make_unique<grpc::GenericStub>(channel_);
}

void ServiceFuzz::Stop() {
  channel_.reset();
  server_.reset();
}

std::map<std::string, v1::HullInfo> ServiceFuzz::Hulls() {
  grpc::ClientContext context;
  v1::ListHullsResponse all;
  std::map<std::string, v1::HullInfo> hulls;
  if (!hulls_->ListHulls(&context, {}, &all).ok() || !all.next_page_token().empty()) return hulls;
  for (const v1::HullInfo& hull : all.hulls()) hulls[hull.hull_id()] = hull;
  return hulls;
}

std::map<std::string, std::string> ServiceFuzz::Contents() {
  std::map<std::string, std::string> contents;
  for (const auto& [hull_id, hull] : Hulls()) {
    std::string& text = contents[hull_id] = hull.SerializeAsString();
    grpc::ClientContext get;
    v1::GetHullMeshRequest request;
    request.set_hull_id(hull_id);
    const auto reader = hulls_->GetHullMesh(&get, request);
    v1::GetHullMeshResponse part;
    while (reader->Read(&part)) {
      absl::StrAppend(&text, part.vertices().SerializeAsString(),
                      part.facets().SerializeAsString());
    }
    absl::StrAppend(&text, reader->Finish().error_message());

    grpc::ClientContext append;
    const auto stream = hulls_->AppendPoints(&append);
    v1::AppendPointsRequest open;
    open.mutable_open()->set_hull_id(hull_id);
    open.mutable_open()->set_writer_id("w");
    stream->Write(open);
    stream->WritesDone();
    v1::AppendPointsResponse opened;
    stream->Read(&opened);
    absl::StrAppend(&text, "writer at ", opened.opened().last_sequence(), " ",
                    stream->Finish().error_message());
  }
  grpc::ClientContext listing;
  v1::ListBodiesResponse bodies;
  absl::StrAppend(&contents["bodies"], bodies_->ListBodies(&listing, {}, &bodies).error_message());
  for (const v1::BodyInfo& body : bodies.bodies()) {
    grpc::ClientContext get;
    v1::GetBodyRequest request;
    v1::GetBodyResponse response;
    request.set_body_id(body.body_id());
    std::string& text = contents["body " + body.body_id()];
    text = bodies_->GetBody(&get, request, &response).error_message();
    for (const v1::Placement& piece : response.pieces()) {
      absl::StrAppend(&text, piece.SerializeAsString());
    }
    absl::StrAppend(&text, body.SerializeAsString());
  }
  return contents;
}

std::string ServiceFuzz::Reopen() {
  const std::map<std::string, std::string> before = Contents();
  std::string former;
  // Every other time, a backup replaces the store.
  if (opened_ % 2 == 0) {
    const std::string file = absl::StrCat(directory_, "/backup-", opened_);
    BackupWriter writer(file);
    absl::Status status = writer.Open();
    grpc::ClientContext context;
    const auto reader = maintenance_->SaveBackup(&context, {});
    v1::SaveBackupResponse part;
    while (reader->Read(&part) && status.ok()) status = writer.Write(part);
    if (status.ok()) status = writer.Finish();
    former = std::exchange(data_dir_, absl::StrCat(directory_, "/restored-", opened_));
    if (status.ok()) status = RestoreBackup(file, data_dir_).status();
    if (!status.ok()) return "a backup cannot be restored: " + status.ToString();
    std::filesystem::remove(file);
  }
  Stop();
  Start();
  if (!former.empty()) {
    std::filesystem::remove_all(former);
    // A restored store has another ID.
    store_id_.clear();
  }
  if (Contents() != before) return "the contents of a store differ after reopening";
  ++reached_[former.empty() ? "store opened again" : "backup opened"];
  return {};
}

// Removes everything left by the previous program.
std::string ServiceFuzz::Prepare() {
  const std::map<std::string, v1::HullInfo> hulls = Hulls();
  if (hulls.empty()) return "hulls cannot be listed";
  for (const auto& [hull_id, hull] : hulls) {
    if (hull_id.rfind("guard/", 0) == 0) continue;
    grpc::ClientContext deletion;
    v1::DeleteHullRequest request;
    v1::DeleteHullResponse response;
    request.set_hull_id(hull_id);
    const grpc::Status status = hulls_->DeleteHull(&deletion, request, &response);
    if (!status.ok()) return "cannot delete: " + status.error_message();
  }
  grpc::ClientContext listing;
  v1::ListBodiesResponse bodies;
  const grpc::Status listed = bodies_->ListBodies(&listing, {}, &bodies);
  if (!listed.ok()) return "bodies cannot be listed: " + listed.error_message();
  for (const v1::BodyInfo& body : bodies.bodies()) {
    grpc::ClientContext deletion;
    v1::DeleteBodyRequest request;
    v1::DeleteBodyResponse response;
    request.set_body_id(body.body_id());
    const grpc::Status status = bodies_->DeleteBody(&deletion, request, &response);
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
  ServiceProgram run(*this, Hulls(), program);
  finding = run.Run();
  if (finding.empty()) finding = run.CheckGuards();
  if (!finding.empty()) return finding;
  constexpr std::chrono::seconds kPatience(60);
  if (!server_->WaitIdle(kPatience)) return "calls outlive their program";
  finding = run.CheckAcknowledged();
  const bool due = ++programs_ % kProgramsPerOpening == 0;
  return finding.empty() && due && store_ != "memory" ? Reopen() : finding;
}

}  // namespace hulld::fuzz
