#include "tests/client/fake_hulld.h"

#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server_builder.h>

#include <algorithm>
#include <utility>

#include "hulld/rpc/error_details.pb.h"

namespace hulld {
namespace {

constexpr char kStoreId[] = "fake-store";

void FillInfo(const std::string& hull_id, const FakeHull& hull, v1::HullInfo* info) {
  info->set_hull_id(hull_id);
  info->set_create_revision(hull.create_revision);
  info->set_revision(hull.revision);
  info->set_dimension(hull.xyz.empty() ? -1 : 3);
  info->set_vertex_count(hull.xyz.size() / 3);
  info->mutable_counts()->set_received(hull.xyz.size() / 3);
  info->mutable_counts()->set_outside(hull.xyz.size() / 3);
}

grpc::Status NoSuchHull(const std::string& hull_id) {
  return HulldError(grpc::StatusCode::NOT_FOUND, "hull \"" + hull_id + "\" not found",
                    v1::ERROR_REASON_HULL_NOT_FOUND, {{"hull_id", hull_id}});
}

}  // namespace

grpc::Status HulldError(grpc::StatusCode code, const std::string& message, v1::ErrorReason reason,
                        const std::map<std::string, std::string>& metadata) {
  rpc::ErrorInfo info;
  info.set_reason(v1::ErrorReason_Name(reason).substr(std::string("ERROR_REASON_").size()));
  info.set_domain("hulld");
  info.mutable_metadata()->insert(metadata.begin(), metadata.end());
  rpc::Status status;
  status.set_code(code);
  status.set_message(message);
  google::protobuf::Any* const detail = status.add_details();
  detail->set_type_url("type.googleapis.com/google.rpc.ErrorInfo");
  detail->set_value(info.SerializeAsString());
  return {code, message, status.SerializeAsString()};
}

class FakeHulld::Hulls final : public v1::HullService::Service {
 public:
  explicit Hulls(FakeHulld* fake) : fake_(*fake) {}

  grpc::Status CreateHull(grpc::ServerContext*, const v1::CreateHullRequest* request,
                          v1::CreateHullResponse* response) override {
    if (auto status = fake_.Enter("CreateHull"); !status.ok()) return status;
    const std::lock_guard lock(fake_.mutex_);
    const bool exists = fake_.hulls_.count(request->hull_id()) > 0;
    if (exists && !request->if_absent()) {
      return {grpc::StatusCode::ALREADY_EXISTS,
              "hull \"" + request->hull_id() + "\" already exists"};
    }
    if (!exists) Create(request->hull_id());
    FillInfo(request->hull_id(), fake_.hulls_[request->hull_id()], response->mutable_hull());
    response->set_created(!exists);
    return grpc::Status::OK;
  }

  grpc::Status AppendPoints(grpc::ServerContext* context,
                            grpc::ServerReaderWriter<v1::AppendPointsResponse,
                                                     v1::AppendPointsRequest>* stream) override {
    if (auto status = fake_.Enter("AppendPoints"); !status.ok()) return status;
    v1::AppendPointsRequest request;
    if (!stream->Read(&request) || !request.has_open()) {
      return {grpc::StatusCode::INVALID_ARGUMENT, "no open"};
    }
    const v1::AppendOpen open = request.open();
    StreamScript script;
    if (auto status = Open(open, &script, stream); !status.ok()) return status;
    int committed = 0;
    int unacknowledged = 0;
    std::vector<v1::AppendPointsResponse> held;
    while (stream->Read(&request)) {
      v1::AppendPointsResponse response;
      if (auto status = Commit(open, request.chunk(), script, &response); !status.ok()) {
        return status;
      }
      {
        const std::lock_guard lock(fake_.mutex_);
        fake_.max_unacknowledged_ = std::max(fake_.max_unacknowledged_, ++unacknowledged);
        fake_.changed_.notify_all();
      }
      if (script.hold_acks) {
        std::unique_lock lock(fake_.mutex_);
        fake_.changed_.wait(lock, [this] { return fake_.released_; });
      }
      if (!script.lose_acks && unacknowledged >= script.ack_every) {
        stream->Write(response);
        unacknowledged = 0;
      }
      if (++committed == script.break_after) return Break(script, context);
    }
    return grpc::Status::OK;
  }

  grpc::Status GetHull(grpc::ServerContext*, const v1::GetHullRequest* request,
                       v1::GetHullResponse* response) override {
    if (auto status = fake_.Enter("GetHull"); !status.ok()) return status;
    const std::lock_guard lock(fake_.mutex_);
    const auto found = fake_.hulls_.find(request->hull_id());
    if (found == fake_.hulls_.end()) return NoSuchHull(request->hull_id());
    FillInfo(request->hull_id(), found->second, response->mutable_hull());
    response->mutable_box_min()->set_x(-1);
    response->mutable_box_max()->set_x(0.1);
    if (request->properties()) {
      v1::HullProperties* const properties = response->mutable_properties();
      properties->mutable_volume()->set_value(8);
      properties->mutable_area()->set_value(24);
      properties->mutable_area()->set_bound(4e-15);
      properties->mutable_centroid()->set_y(0.5);
      properties->mutable_centroid_bounds()->set_y(1e-17);
      properties->mutable_inertia()->set_zz(3);
      properties->mutable_inertia()->set_xy(-0.25);
      properties->mutable_inertia_bounds()->set_xx(2e-16);
    }
    if (request->audit()) {
      response->mutable_audit()->set_ok(fake_.audit_finding.empty());
      response->mutable_audit()->set_finding(fake_.audit_finding);
    }
    return grpc::Status::OK;
  }

  grpc::Status GetHullMesh(grpc::ServerContext*, const v1::GetHullMeshRequest* request,
                           grpc::ServerWriter<v1::GetHullMeshResponse>* writer) override {
    if (auto status = fake_.Enter("GetHullMesh"); !status.ok()) return status;
    fake_.last_mesh_request = *request;
    if (fake_.mesh_parts.empty()) return NoSuchHull(request->hull_id());
    for (const v1::GetHullMeshResponse& part : fake_.mesh_parts) writer->Write(part);
    return grpc::Status::OK;
  }

  grpc::Status ListHulls(grpc::ServerContext*, const v1::ListHullsRequest* request,
                         v1::ListHullsResponse* response) override {
    if (auto status = fake_.Enter("ListHulls"); !status.ok()) return status;
    const std::lock_guard lock(fake_.mutex_);
    fake_.list_requests_.push_back(*request);
    response->mutable_header()->set_store_id("store");
    response->mutable_header()->set_revision(100 + fake_.list_requests_.size());
    // Pages are small, so that clients follow several.
    const int requested = static_cast<int>(request->page_size());
    const int size = requested == 0 ? 3 : std::min(3, requested);
    auto at = request->page_token().empty() ? fake_.hulls_.lower_bound(request->prefix())
                                            : fake_.hulls_.upper_bound(request->page_token());
    for (; at != fake_.hulls_.end() && at->first.rfind(request->prefix(), 0) == 0; ++at) {
      if (response->hulls_size() == size) {
        response->set_next_page_token(response->hulls(size - 1).hull_id());
        break;
      }
      FillInfo(at->first, at->second, response->add_hulls());
    }
    return grpc::Status::OK;
  }

  grpc::Status DeleteHull(grpc::ServerContext*, const v1::DeleteHullRequest* request,
                          v1::DeleteHullResponse* response) override {
    if (auto status = fake_.Enter("DeleteHull"); !status.ok()) return status;
    const std::lock_guard lock(fake_.mutex_);
    const auto found = fake_.hulls_.find(request->hull_id());
    if (found == fake_.hulls_.end()) return NoSuchHull(request->hull_id());
    if (request->has_if_revision() && request->if_revision() != found->second.revision) {
      return {grpc::StatusCode::ABORTED, "hull is at another revision"};
    }
    fake_.hulls_.erase(found);
    response->mutable_header()->set_revision(++fake_.revision_);
    return grpc::Status::OK;
  }

 private:
  static grpc::Status Break(const StreamScript& script, grpc::ServerContext* context) {
    if (script.retry_hint.has_value()) {
      context->AddTrailingMetadata("grpc-retry-pushback-ms",
                                   std::to_string(script.retry_hint->count()));
    }
    if (script.exhausted) return {grpc::StatusCode::RESOURCE_EXHAUSTED, "too many calls"};
    return {grpc::StatusCode::UNAVAILABLE, "Socket closed"};
  }

  // Requires: the lock.
  void Create(const std::string& hull_id) {
    FakeHull& hull = fake_.hulls_[hull_id];
    hull.create_revision = hull.revision = ++fake_.revision_;
  }

  grpc::Status Open(
      const v1::AppendOpen& open, StreamScript* script,
      grpc::ServerReaderWriter<v1::AppendPointsResponse, v1::AppendPointsRequest>* stream) {
    v1::AppendPointsResponse response;
    {
      const std::lock_guard lock(fake_.mutex_);
      if (fake_.hulls_.count(open.hull_id()) == 0) {
        if (!open.create_if_absent()) return NoSuchHull(open.hull_id());
        Create(open.hull_id());
      }
      if (!fake_.scripts_.empty()) {
        *script = fake_.scripts_.front();
        fake_.scripts_.pop_front();
      }
      FakeHull& hull = fake_.hulls_[open.hull_id()];
      v1::AppendOpened& opened = *response.mutable_opened();
      opened.mutable_header()->set_store_id(kStoreId);
      FillInfo(open.hull_id(), hull, opened.mutable_hull());
      opened.set_writer_id(open.writer_id());
      opened.set_last_sequence(hull.last_sequence[open.writer_id()]);
    }
    stream->Write(response);
    return grpc::Status::OK;
  }

  grpc::Status Commit(const v1::AppendOpen& open, const v1::AppendChunk& chunk,
                      const StreamScript& script, v1::AppendPointsResponse* response) {
    const std::lock_guard lock(fake_.mutex_);
    const auto found = fake_.hulls_.find(open.hull_id());
    if (found == fake_.hulls_.end()) {
      return {grpc::StatusCode::FAILED_PRECONDITION, "hull was deleted"};
    }
    FakeHull& hull = found->second;
    uint64_t& last = hull.last_sequence[open.writer_id()];
    if (chunk.sequence() == script.refuse_sequence) {
      return {grpc::StatusCode::INVALID_ARGUMENT,
              "sequence " + std::to_string(chunk.sequence()) + ": points[0].x is NaN"};
    }
    if (chunk.sequence() > last + 1) {
      return HulldError(grpc::StatusCode::FAILED_PRECONDITION, "a chunk is missing",
                        v1::ERROR_REASON_SEQUENCE_GAP,
                        {{"expected_sequence", std::to_string(last + 1)}});
    }
    v1::AppendAck& ack = *response->mutable_ack();
    ack.set_sequence(chunk.sequence());
    if (chunk.sequence() <= last) {
      ack.set_outcome(v1::APPEND_OUTCOME_ALREADY_APPLIED);
      return grpc::Status::OK;
    }
    last = chunk.sequence();
    const v1::PointBlock& points = chunk.points();
    hull.xyz.insert(hull.xyz.end(), points.xyz().begin(), points.xyz().end());
    hull.xyz.insert(hull.xyz.end(), points.xyz_float().begin(), points.xyz_float().end());
    hull.revision = ++fake_.revision_;
    const uint64_t count = static_cast<uint64_t>(points.xyz_size() + points.xyz_float_size()) / 3;
    ack.set_outcome(v1::APPEND_OUTCOME_APPLIED);
    ack.set_hull_revision(hull.revision);
    ack.set_vertex_count(hull.xyz.size() / 3);
    ack.mutable_counts()->set_received(count);
    ack.mutable_counts()->set_outside(count);
    return grpc::Status::OK;
  }

  FakeHulld& fake_;
};

class FakeHulld::Collisions final : public v1::CollisionService::Service {
 public:
  explicit Collisions(FakeHulld* fake) : fake_(*fake) {}

  grpc::Status CheckCollision(grpc::ServerContext*, const v1::CheckCollisionRequest* request,
                              v1::CheckCollisionResponse* response) override {
    if (auto status = fake_.Enter("CheckCollision"); !status.ok()) return status;
    const std::lock_guard lock(fake_.mutex_);
    fake_.last_collision_request_ = *request;
    *response = fake_.collision_answer;
    return grpc::Status::OK;
  }

  // Every pair is TOUCHING, except pairs with a missing hull.
  grpc::Status BatchCheckCollisions(
      grpc::ServerContext*, const v1::BatchCheckCollisionsRequest* request,
      grpc::ServerWriter<v1::BatchCheckCollisionsResponse>* writer) override {
    if (auto status = fake_.Enter("BatchCheckCollisions"); !status.ok()) return status;
    const std::lock_guard lock(fake_.mutex_);
    fake_.batch_requests_.push_back(*request);
    if (fake_.batch_answers) {
      for (const auto& answer : *fake_.batch_answers) writer->Write(answer);
      return grpc::Status::OK;
    }
    v1::BatchCheckCollisionsResponse response;
    std::vector<bool> bad;
    for (const v1::Placement& placement : request->placements()) {
      bad.push_back(fake_.hulls_.count(placement.hull_id()) == 0);
      response.add_hulls();
      if (!bad.back()) continue;
      v1::PlacementProblem& problem = *response.add_placement_problems();
      problem.set_placement(static_cast<uint32_t>(bad.size() - 1));
      problem.set_code(grpc::StatusCode::NOT_FOUND);
      problem.set_message("hull \"" + placement.hull_id() + "\" not found");
    }
    // As with a long table of hulls: the answers begin in another message.
    writer->Write(response);
    response.Clear();
    v1::AnswerColumns& columns = *response.mutable_columns();
    for (int i = 0; i < request->pairs_size(); i += 2) {
      const bool failed = bad[request->pairs(i)] || bad[request->pairs(i + 1)];
      columns.add_relations(failed ? v1::RELATION_UNSPECIFIED : v1::RELATION_TOUCHING);
      columns.add_rungs(v1::RUNG_EXACT);
      if (request->wanted().axis()) columns.add_axes()->set_kind(v1::AXIS_KIND_EDGE_EDGE);
      if (request->wanted().analysis()) columns.add_analyses()->set_axes_tested(7);
    }
    writer->Write(response);
    return grpc::Status::OK;
  }

  // Every answer is empty. "StreamCollisions end" is the end of the stream.
  grpc::Status StreamCollisions(
      grpc::ServerContext*,
      grpc::ServerReaderWriter<v1::StreamCollisionsResponse, v1::StreamCollisionsRequest>* stream)
      override {
    v1::StreamCollisionsRequest request;
    while (stream->Read(&request)) {
      if (auto status = fake_.Enter("StreamCollisions"); !status.ok()) return status;
      v1::StreamCollisionsResponse response;
      response.set_last(true);
      stream->Write(response);
    }
    return fake_.Enter("StreamCollisions end");
  }

 private:
  FakeHulld& fake_;
};

class FakeHulld::Status final : public v1::StatusService::Service {
 public:
  explicit Status(FakeHulld* fake) : fake_(*fake) {}

  grpc::Status GetStatus(grpc::ServerContext*, const v1::GetStatusRequest*,
                         v1::GetStatusResponse* response) override {
    if (auto status = fake_.Enter("GetStatus"); !status.ok()) return status;
    response->set_version("0.0-fake");
    response->set_store_kind("memory");
    return grpc::Status::OK;
  }

 private:
  FakeHulld& fake_;
};

FakeHulld::FakeHulld()
    : hull_service_(std::make_unique<Hulls>(this)),
      collision_service_(std::make_unique<Collisions>(this)),
      status_service_(std::make_unique<Status>(this)) {
  grpc::EnableDefaultHealthCheckService(true);
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(hull_service_.get());
  builder.RegisterService(collision_service_.get());
  builder.RegisterService(status_service_.get());
  server_ = builder.BuildAndStart();
  address_ = "127.0.0.1:" + std::to_string(port);
}

FakeHulld::~FakeHulld() {
  Release();
  server_->Shutdown(std::chrono::system_clock::now());
}

grpc::Status FakeHulld::Enter(const std::string& method) {
  std::unique_lock lock(mutex_);
  ++calls_[method];
  changed_.wait(lock, [&] { return released_ || !hanging_[method]; });
  std::deque<grpc::Status>& failures = failures_[method];
  if (failures.empty()) return grpc::Status::OK;
  grpc::Status status = failures.front();
  failures.pop_front();
  return status;
}

void FakeHulld::FailNext(const std::string& method, std::vector<grpc::Status> statuses) {
  const std::lock_guard lock(mutex_);
  failures_[method].assign(statuses.begin(), statuses.end());
}

void FakeHulld::Hang(const std::string& method) {
  const std::lock_guard lock(mutex_);
  hanging_[method] = true;
}

void FakeHulld::Release() {
  const std::lock_guard lock(mutex_);
  released_ = true;
  changed_.notify_all();
}

void FakeHulld::ScriptStreams(std::vector<StreamScript> scripts) {
  const std::lock_guard lock(mutex_);
  scripts_.assign(scripts.begin(), scripts.end());
}

void FakeHulld::SetServing(bool serving) {
  server_->GetHealthCheckService()->SetServingStatus(serving);
}

int FakeHulld::calls(const std::string& method) {
  const std::lock_guard lock(mutex_);
  return calls_[method];
}

FakeHull FakeHulld::hull(const std::string& hull_id) {
  const std::lock_guard lock(mutex_);
  return hulls_[hull_id];
}

void FakeHulld::PutHull(const std::string& hull_id, FakeHull hull) {
  const std::lock_guard lock(mutex_);
  hulls_[hull_id] = std::move(hull);
}

void FakeHulld::RemoveHull(const std::string& hull_id) {
  const std::lock_guard lock(mutex_);
  hulls_.erase(hull_id);
}

int FakeHulld::max_unacknowledged() {
  const std::lock_guard lock(mutex_);
  return max_unacknowledged_;
}

v1::CheckCollisionRequest FakeHulld::last_collision_request() {
  const std::lock_guard lock(mutex_);
  return last_collision_request_;
}

std::vector<v1::BatchCheckCollisionsRequest> FakeHulld::batch_requests() {
  const std::lock_guard lock(mutex_);
  return batch_requests_;
}

std::vector<v1::ListHullsRequest> FakeHulld::list_requests() {
  const std::lock_guard lock(mutex_);
  return list_requests_;
}

}  // namespace hulld
