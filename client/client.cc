#include "client/client.h"

#include <grpcpp/generic/generic_stub.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <utility>

#include "client/base/status_macros.h"
#include "client/calls/grpc_status.h"
#include "client/point_messages.h"
#include "client/server_address.h"

namespace hulld {
namespace {

// The server splits replies at about 1 MiB. Bounds the memory that a faulty server can claim.
constexpr int kMaxReceiveBytes = 64 << 20;
// Keepalive interval and timeout: those of the server.
constexpr int kKeepaliveTimeMs = 60'000;
constexpr int kKeepaliveTimeoutMs = 20'000;

std::shared_ptr<grpc::Channel> Connect(const ClientOptions& options) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxReceiveBytes);
  // Lets a retry reach a restarted server within a second. By default gRPC resolves the name,
  // addresses included, at most every 30 s before it reconnects.
  arguments.SetInt(GRPC_ARG_DNS_MIN_TIME_BETWEEN_RESOLUTIONS_MS, 100);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
  // Timeout of a connection attempt, TLS handshake included.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 5000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 500);
  // Detects a server that vanished silently, for which a watch would otherwise wait forever.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveTimeMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  if (options.own_connection) arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // By default gRPC uses the environment's proxy even for services on this machine.
  if (IsLoopback(options.server)) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  return OpenChannel(options.server, options.security, arguments);
}

// Returns the timeout, or the nearest one from 0 to a year, which no clock overflows.
std::chrono::milliseconds BoundTimeout(std::chrono::milliseconds timeout) {
  constexpr std::chrono::milliseconds kLongest = std::chrono::hours(24 * 365);
  return std::clamp(timeout, std::chrono::milliseconds::zero(), kLongest);
}

ClientOptions WithFiniteTimeout(ClientOptions options) {
  options.timeout = BoundTimeout(options.timeout);
  return options;
}

absl::Status AddPart(const v1::GetHullMeshResponse& part, HullMesh* mesh) {
  switch (part.part_case()) {
    case v1::GetHullMeshResponse::kHeader:
      mesh->header = part.header();
      return absl::OkStatus();
    case v1::GetHullMeshResponse::kVertices:
      mesh->xyz.insert(mesh->xyz.end(), part.vertices().xyz().begin(), part.vertices().xyz().end());
      return absl::OkStatus();
    case v1::GetHullMeshResponse::kFacets:
      mesh->facet_sizes.insert(mesh->facet_sizes.end(), part.facets().sizes().begin(),
                               part.facets().sizes().end());
      mesh->facet_indices.insert(mesh->facet_indices.end(), part.facets().indices().begin(),
                                 part.facets().indices().end());
      return absl::OkStatus();
    case v1::GetHullMeshResponse::PART_NOT_SET:
      break;
  }
  return absl::InternalError("the mesh stream contains a message of an unknown kind");
}

// Code that draws, writes, or verifies the mesh relies on these checks.
absl::Status CheckConsistent(const HullMesh& mesh) {
  if (mesh.xyz.size() != 3 * mesh.header.vertex_count() ||
      mesh.facet_sizes.size() != mesh.header.facet_count()) {
    return absl::InternalError(
        "the mesh stream ended early, or the counts of its header are wrong");
  }
  uint64_t corners = 0;
  for (const uint32_t size : mesh.facet_sizes) corners += size;
  if (corners != mesh.facet_indices.size()) {
    return absl::InternalError("the mesh stream's facet sizes and indices disagree");
  }
  const size_t vertices = mesh.vertex_count();
  const auto in_range = [vertices](uint32_t index) { return index < vertices; };
  if (!std::all_of(mesh.facet_indices.begin(), mesh.facet_indices.end(), in_range)) {
    return absl::InternalError("the mesh stream refers to a vertex that it does not contain");
  }
  const auto is_finite = [](double x) { return std::isfinite(x); };
  if (!std::all_of(mesh.xyz.begin(), mesh.xyz.end(), is_finite)) {
    return absl::InternalError("the mesh stream contains a coordinate that is not finite");
  }
  return absl::OkStatus();
}

// Follows the pages of a list; `items` returns the items of a page.
template <typename Request, typename Response, typename Items, typename ListPage>
absl::StatusOr<Response> ListAll(const std::string& prefix, uint64_t limit,
                                 const std::optional<v1::Freshness>& freshness, const Items& items,
                                 const ListPage& list_page) {
  constexpr uint64_t kLargestPage = 1000;
  Response all;
  Request request;
  if (freshness.has_value()) *request.mutable_freshness() = *freshness;
  const bool is_linearizable =
      !request.freshness().has_max_staleness() && request.freshness().at_least_revision() == 0;
  request.set_prefix(prefix);
  const auto count = [&] { return static_cast<uint64_t>(items(all)->size()); };
  do {
    const uint64_t missing = limit == 0 ? kLargestPage : limit - count();
    request.set_page_size(static_cast<uint32_t>(std::min(missing, kLargestPage)));
    HULLD_ASSIGN_OR_RETURN(Response page, list_page(request));
    *all.mutable_header() = page.header();
    items(all)->MergeFrom(*items(page));
    if (!page.next_page_token().empty() && page.next_page_token() == request.page_token()) {
      return absl::InternalError("the server returned the same page token twice");
    }
    all.set_next_page_token(page.next_page_token());
    // Otherwise a later page could come from an older snapshot and lack items.
    if (!is_linearizable) {
      request.mutable_freshness()->set_at_least_revision(page.header().revision());
      request.mutable_freshness()->set_store_id(page.header().store_id());
    }
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty() && (limit == 0 || count() < limit));
  return all;
}

// HealthCheckResponse.status, field 1 of grpc.health.v1. Debian packages no generated code for it.
enum HealthStatus { kUnknown = 0, kServing = 1 };

HealthStatus DecodeHealth(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  if (!buffer.Dump(&slices).ok()) return kUnknown;
  std::string bytes;
  for (const grpc::Slice& slice : slices) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return bytes == std::string("\x08\x01", 2) ? kServing : kUnknown;
}

}  // namespace

Client::Client(ClientOptions options) : Client(options, Connect(options)) {}

Client::Client(ClientOptions options, std::shared_ptr<grpc::Channel> channel)
    : options_(WithFiniteTimeout(std::move(options))),
      channel_(std::move(channel)),
      hulls_(v1::HullService::NewStub(channel_)),
      collisions_(v1::CollisionService::NewStub(channel_)),
      bodies_(v1::BodyService::NewStub(channel_)),
      status_(v1::StatusService::NewStub(channel_)),
      maintenance_(v1::MaintenanceService::NewStub(channel_)) {}

template <typename Request>
const Request& Client::WithFreshness(const Request& request, Request* copy) const {
  if (!options_.freshness.has_value() || request.has_freshness()) return request;
  *copy = request;
  *copy->mutable_freshness() = *options_.freshness;
  return *copy;
}

Deadline Client::NextDeadline() const { return options_.retry.Now() + options_.timeout; }

template <typename Response, typename Request, typename Stub>
absl::StatusOr<Response> Client::Call(Stub* stub,
                                      grpc::Status (Stub::*method)(grpc::ClientContext*,
                                                                   const Request&, Response*),
                                      const Request& request, bool retry) const {
  const Deadline deadline = NextDeadline();
  Response response;
  const auto attempt = [&] {
    grpc::ClientContext context;
    context.set_deadline(options_.retry.ForCall(deadline));
    response.Clear();
    const grpc::Status status = (stub->*method)(&context, request, &response);
    return FromGrpcStatus(status, context);
  };
  HULLD_RETURN_IF_ERROR(retry ? CallWithRetries(options_.retry, deadline, attempt) : attempt());
  return response;
}

absl::StatusOr<v1::CreateHullResponse> Client::CreateHull(const std::string& hull_id,
                                                          bool if_absent) const {
  v1::CreateHullRequest request;
  request.set_hull_id(hull_id);
  request.set_if_absent(if_absent);
  return Call(hulls_.get(), &v1::HullService::Stub::CreateHull, request, if_absent);
}

absl::StatusOr<std::unique_ptr<Appender>> Client::OpenAppend(const std::string& hull_id,
                                                             AppendOptions options) const {
  v1::AppendOpen open;
  open.set_hull_id(hull_id);
  open.set_writer_id(options.writer_id);
  open.set_create_if_absent(options.create_if_absent);
  std::unique_ptr<Appender> appender(
      new Appender(hulls_, std::move(open), std::move(options), options_.timeout, options_.retry));
  HULLD_RETURN_IF_ERROR(appender->OpenFirst());
  return appender;
}

absl::StatusOr<v1::ReplaceHullResponse> Client::ReplaceHull(
    const v1::ReplaceOpen& open, const PointFeed& feed,
    std::optional<std::chrono::milliseconds> timeout) const {
  grpc::ClientContext context;
  if (timeout.has_value()) {
    context.set_deadline(std::chrono::system_clock::now() + BoundTimeout(*timeout));
  }
  v1::ReplaceHullResponse response;
  const auto writer = hulls_->ReplaceHull(&context, &response);
  v1::ReplaceHullRequest request;
  *request.mutable_open() = open;
  // A failed write means that the call has ended; Finish returns the status.
  bool writable = writer->Write(request);
  const absl::Status fed = feed([&](const v1::PointBlock& points) {
    *request.mutable_points() = points;
    writable = writable && writer->Write(request);
    return writable ? absl::OkStatus() : absl::CancelledError("the call has ended");
  });
  if (fed.ok() && writable) {
    // A message without points marks the stream as complete.
    request.mutable_points()->Clear();
    writer->Write(request);
  } else if (writable) {
    context.TryCancel();
  }
  writer->WritesDone();
  const absl::Status status = FromGrpcStatus(writer->Finish());
  if (!fed.ok() && writable) return fed;
  if (!status.ok()) return status;
  return response;
}

absl::Status Client::PutHull(const std::string& hull_id, const PointFeed& feed) const {
  v1::ReplaceOpen open;
  open.set_hull_id(hull_id);
  open.set_create_if_absent(true);
  return ReplaceHull(open, feed).status();
}

absl::Status Client::PutHull(const std::string& hull_id, std::span<const double> xyz) const {
  return PutHull(hull_id, [xyz](const PointSink& sink) { return SendInMessages(xyz, sink); });
}

absl::Status Client::SaveBackup(
    const std::function<absl::Status(const v1::SaveBackupResponse&)>& receive,
    std::optional<std::chrono::milliseconds> timeout) const {
  grpc::ClientContext context;
  if (timeout.has_value()) {
    context.set_deadline(std::chrono::system_clock::now() + BoundTimeout(*timeout));
  }
  const auto reader = maintenance_->SaveBackup(&context, v1::SaveBackupRequest());
  v1::SaveBackupResponse part;
  while (reader->Read(&part)) {
    if (absl::Status status = receive(part); !status.ok()) {
      context.TryCancel();
      reader->Finish();
      return status;
    }
  }
  return FromGrpcStatus(reader->Finish());
}

absl::StatusOr<v1::GetHullResponse> Client::GetHull(const std::string& hull_id, bool audit) const {
  v1::GetHullRequest request;
  request.set_hull_id(hull_id);
  request.set_audit(audit);
  return GetHull(request);
}

absl::StatusOr<v1::GetHullResponse> Client::GetHull(const v1::GetHullRequest& request) const {
  v1::GetHullRequest copy;
  return Call(hulls_.get(), &v1::HullService::Stub::GetHull, WithFreshness(request, &copy), true);
}

absl::StatusOr<HullMesh> Client::GetHullMesh(const std::string& hull_id) const {
  v1::GetHullMeshRequest request;
  request.set_hull_id(hull_id);
  return GetHullMesh(request);
}

absl::StatusOr<HullMesh> Client::GetHullMesh(
    const v1::GetHullMeshRequest& request,
    const std::function<void(const HullMesh&)>& on_part) const {
  v1::GetHullMeshRequest copy;
  const v1::GetHullMeshRequest& fresh = WithFreshness(request, &copy);
  const Deadline deadline = NextDeadline();
  HullMesh mesh;
  absl::Status status = CallWithRetries(options_.retry, deadline, [&] {
    mesh = HullMesh();
    grpc::ClientContext context;
    context.set_deadline(options_.retry.ForCall(deadline));
    const auto reader = hulls_->GetHullMesh(&context, fresh);
    absl::Status part_status;
    v1::GetHullMeshResponse part;
    while (part_status.ok() && reader->Read(&part)) {
      part_status = AddPart(part, &mesh);
      if (part_status.ok() && on_part) on_part(mesh);
    }
    if (!part_status.ok()) context.TryCancel();
    const grpc::Status end = reader->Finish();
    return part_status.ok() ? FromGrpcStatus(end, context) : part_status;
  });
  if (status.ok()) status = CheckConsistent(mesh);
  if (!status.ok()) return status;
  return mesh;
}

absl::StatusOr<v1::ListHullsResponse> Client::ListHulls(const v1::ListHullsRequest& request) const {
  v1::ListHullsRequest copy;
  return Call(hulls_.get(), &v1::HullService::Stub::ListHulls, WithFreshness(request, &copy), true);
}

absl::StatusOr<v1::ListHullsResponse> Client::ListAllHulls(const std::string& prefix,
                                                           uint64_t limit) const {
  return ListAll<v1::ListHullsRequest, v1::ListHullsResponse>(
      prefix, limit, options_.freshness,
      [](v1::ListHullsResponse& page) { return page.mutable_hulls(); },
      [this](const v1::ListHullsRequest& request) { return ListHulls(request); });
}

absl::StatusOr<v1::PutBodyResponse> Client::PutBody(const v1::PutBodyRequest& request) const {
  return Call(bodies_.get(), &v1::BodyService::Stub::PutBody, request, !request.has_if_revision());
}

absl::StatusOr<v1::GetBodyResponse> Client::GetBody(const std::string& body_id) const {
  v1::GetBodyRequest request;
  request.set_body_id(body_id);
  if (options_.freshness.has_value()) *request.mutable_freshness() = *options_.freshness;
  return Call(bodies_.get(), &v1::BodyService::Stub::GetBody, request, true);
}

absl::StatusOr<v1::ListBodiesResponse> Client::ListBodies(
    const v1::ListBodiesRequest& request) const {
  v1::ListBodiesRequest copy;
  return Call(bodies_.get(), &v1::BodyService::Stub::ListBodies, WithFreshness(request, &copy),
              true);
}

absl::StatusOr<v1::ListBodiesResponse> Client::ListAllBodies(const std::string& prefix,
                                                             uint64_t limit) const {
  return ListAll<v1::ListBodiesRequest, v1::ListBodiesResponse>(
      prefix, limit, options_.freshness,
      [](v1::ListBodiesResponse& page) { return page.mutable_bodies(); },
      [this](const v1::ListBodiesRequest& request) { return ListBodies(request); });
}

absl::StatusOr<v1::DeleteBodyResponse> Client::DeleteBody(
    const std::string& body_id, std::optional<uint64_t> if_revision) const {
  v1::DeleteBodyRequest request;
  request.set_body_id(body_id);
  if (if_revision) request.set_if_revision(*if_revision);
  return Call(bodies_.get(), &v1::BodyService::Stub::DeleteBody, request, false);
}

absl::StatusOr<v1::DeleteHullResponse> Client::DeleteHull(
    const std::string& hull_id, std::optional<uint64_t> if_revision) const {
  v1::DeleteHullRequest request;
  request.set_hull_id(hull_id);
  if (if_revision) request.set_if_revision(*if_revision);
  return Call(hulls_.get(), &v1::HullService::Stub::DeleteHull, request, false);
}

std::unique_ptr<HullWatch> Client::WatchHulls(const v1::WatchHullsRequest& request) const {
  return std::make_unique<HullWatch>(hulls_, request, options_.retry, options_.timeout);
}

absl::StatusOr<v1::CheckCollisionResponse> Client::CheckCollision(
    const v1::CheckCollisionRequest& request) const {
  v1::CheckCollisionRequest copy;
  return Call(collisions_.get(), &v1::CollisionService::Stub::CheckCollision,
              WithFreshness(request, &copy), true);
}

template <typename Response, typename Start>
absl::Status Client::Receive(const Start& start,
                             const std::function<absl::Status(const Response&)>& receive) const {
  const Deadline deadline = NextDeadline();
  bool received = false;
  absl::Status receiver_status;
  const auto attempt = [&] {
    grpc::ClientContext context;
    context.set_deadline(options_.retry.ForCall(deadline));
    const auto reader = start(&context);
    Response response;
    while (receiver_status.ok() && reader->Read(&response)) {
      received = true;
      receiver_status = receive(response);
    }
    if (!receiver_status.ok()) context.TryCancel();
    return FromGrpcStatus(reader->Finish(), context);
  };
  absl::Status status;
  int failures = 0;
  do {
    status = attempt();
  } while (MayRetry(status) && !received &&
           WaitBeforeRetry(options_.retry, ++failures, deadline, status));
  return receiver_status.ok() ? status : receiver_status;
}

absl::Status Client::BatchCheckCollisions(const v1::BatchCheckCollisionsRequest& request,
                                          const BatchReceiver& receive) const {
  v1::BatchCheckCollisionsRequest copy;
  const v1::BatchCheckCollisionsRequest& fresh = WithFreshness(request, &copy);
  return Receive<v1::BatchCheckCollisionsResponse>(
      [&](grpc::ClientContext* context) {
        return collisions_->BatchCheckCollisions(context, fresh);
      },
      receive);
}

absl::Status Client::FindCollisions(const v1::FindCollisionsRequest& request,
                                    const SceneReceiver& receive) const {
  v1::FindCollisionsRequest copy;
  const v1::FindCollisionsRequest& fresh = WithFreshness(request, &copy);
  return Receive<v1::FindCollisionsResponse>(
      [&](grpc::ClientContext* context) { return collisions_->FindCollisions(context, fresh); },
      receive);
}

std::unique_ptr<CollisionStream> Client::OpenCollisionStream() const {
  return std::make_unique<CollisionStream>(collisions_, options_.timeout, options_.freshness);
}

std::unique_ptr<CollisionWatch> Client::WatchCollisions(v1::CollisionWatchOpen open) const {
  return std::make_unique<CollisionWatch>(collisions_, std::move(open), options_.retry,
                                          options_.timeout);
}

absl::StatusOr<v1::GetStatusResponse> Client::GetStatus() const {
  return Call(status_.get(), &v1::StatusService::Stub::GetStatus, v1::GetStatusRequest(), true);
}

absl::Status Client::CheckHealth() const {
  grpc::GenericStub stub(channel_);
  grpc::ClientContext context;
  context.set_deadline(options_.retry.ForCall(NextDeadline()));
  // An empty HealthCheckRequest queries the server as a whole.
  const grpc::Slice empty;
  const grpc::ByteBuffer request(&empty, 1);
  grpc::ByteBuffer response;
  std::promise<grpc::Status> finished;
  stub.UnaryCall(&context, "/grpc.health.v1.Health/Check", grpc::StubOptions(), &request, &response,
                 [&finished](grpc::Status status) { finished.set_value(std::move(status)); });
  const grpc::Status status = finished.get_future().get();
  if (!status.ok()) return FromGrpcStatus(status);
  if (DecodeHealth(response) == kServing) return absl::OkStatus();
  return absl::FailedPreconditionError("the server is up but not serving");
}

}  // namespace hulld
