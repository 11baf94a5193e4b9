#include <google/protobuf/util/time_util.h>

#include <chrono>

#include "hulld/v1/status.grpc.pb.h"
#include "server/admin/admin_services.h"
#include "server/call/unary_call.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

class StatusService
    : public v1::StatusService::WithRawCallbackMethod_GetStatus<v1::StatusService::Service> {
 public:
  explicit StatusService(const ServiceParts& parts) : parts_(parts) {}

  UnaryReactor* GetStatus(CallContext* context, const Bytes* request, Bytes* response) override {
    return UnaryCall<v1::GetStatusRequest, v1::GetStatusResponse>::Start(
        context, parts_.admission, Rpc::kGetStatus, request, response, [this](auto* call) {
          Fill(call->call().caller(), &call->response());
          call->End(absl::OkStatus());
        });
  }

 private:
  void Fill(const Caller& caller, v1::GetStatusResponse* response) const {
    const RegistrySizes sizes = parts_.registry.Sizes();
    EncodeHeader(parts_.store, sizes.store_revision, response->mutable_header());
    response->set_version(HULLD_VERSION);
    const std::chrono::nanoseconds started = started_.time_since_epoch();
    *response->mutable_started() =
        google::protobuf::util::TimeUtil::NanosecondsToTimestamp(started.count());
    EncodeDuration(std::chrono::steady_clock::now() - started_steady_, response->mutable_uptime());
    response->set_store_kind(parts_.store.kind());
    if (caller.sees_all()) {
      response->set_hull_count(sizes.hull_count);
      response->set_vertex_count(sizes.vertex_count);
      response->set_body_count(sizes.body_count);
    }
    const Limits& limits = parts_.registry.limits();
    v1::Limits* message = response->mutable_limits();
    message->set_max_points_per_chunk(limits.max_points_per_chunk);
    message->set_max_vertices_per_hull(limits.max_vertices_per_hull);
    message->set_max_hulls(limits.max_hulls);
    message->set_max_pairs_per_batch(limits.max_pairs_per_batch);
    message->set_max_textbook_axes(limits.max_textbook_axes);
    message->set_max_writers_per_hull(limits.max_writers_per_hull);
    message->set_max_pieces_per_body(limits.max_pieces_per_body);
    message->set_memory_limit_bytes(limits.memory_limit);
    message->set_max_message_bytes(limits.max_message_bytes);
    message->set_max_points_per_hull(limits.max_points_per_hull);
    message->set_max_placements(limits.max_placements);
    message->set_max_calls(limits.max_calls);
    message->set_max_waiting_calls(limits.max_waiting_calls);
    message->set_max_calls_per_client(limits.max_calls_per_client);
    message->set_max_batches_per_client(limits.max_batches_per_client);
    message->set_request_memory_bytes(limits.request_memory);
    message->set_max_streams_per_client(limits.max_streams_per_client);
    message->set_max_concurrent_batches(limits.max_concurrent_batches);
    if (limits.max_request_time > std::chrono::milliseconds::zero()) {
      EncodeDuration(limits.max_request_time, message->mutable_max_request_time());
    }
  }

  const ServiceParts& parts_;
  const std::chrono::system_clock::time_point started_ = std::chrono::system_clock::now();
  const std::chrono::steady_clock::time_point started_steady_ = std::chrono::steady_clock::now();
};

}  // namespace

std::unique_ptr<grpc::Service> MakeStatusService(const ServiceParts& parts) {
  return std::make_unique<StatusService>(parts);
}

}  // namespace hulld::server
