#include "server/admin/health_service.h"

#include <absl/status/status.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "server/call/call_stream.h"
#include "server/call/message_bytes.h"
#include "server/contract/errors.h"

namespace hulld::server {
namespace {

using grpc::health::v1::HealthCheckRequest;
using grpc::health::v1::HealthCheckResponse;

HealthCheckResponse ResponseOf(HealthCheckResponse::ServingStatus status) {
  HealthCheckResponse response;
  response.set_status(status);
  return response;
}

}  // namespace

// A Watch call: reports the status when it starts and when the server stops serving.
class HealthService::WatchCall
    : public RequestStream<QueuedStream<WriteReactor, HealthCheckResponse>, HealthCheckRequest> {
 public:
  WatchCall(CallContext& context, HealthService& service, const Bytes& bytes)
      : RequestStream(bytes, context, service.admission_, Rpc::kHealthWatch), service_(service) {}

  // Queues a report, and the end of the call if `then` is given.
  void Report(Status status, const std::optional<absl::Status>& then) {
    Locked([&] {
      if (end().has_value()) return;
      Queue(ResponseOf(status));
      if (then.has_value()) End(*then);
    });
  }

 private:
  void Open() override {
    Status status;
    {
      const std::lock_guard lock(service_.mutex_);
      status = service_.StatusOf(request().service());
      if (status == HealthCheckResponse::UNKNOWN) status = HealthCheckResponse::SERVICE_UNKNOWN;
      service_.watches_.insert(std::static_pointer_cast<WatchCall>(shared_from_this()));
    }
    Report(status, std::nullopt);
  }
  void OnDone() override {
    const auto self = std::static_pointer_cast<WatchCall>(shared_from_this());
    RequestStream::OnDone();
    const std::lock_guard lock(service_.mutex_);
    service_.watches_.erase(self);
  }

  HealthService& service_;
};

HealthService::HealthService(Admission& admission, std::vector<std::string> services)
    : admission_(admission), services_(std::move(services)) {
  services_.emplace_back();
}

HealthService::Status HealthService::StatusOf(const std::string& service) const {
  if (std::find(services_.begin(), services_.end(), service) == services_.end()) {
    return HealthCheckResponse::UNKNOWN;
  }
  return serving_ ? HealthCheckResponse::SERVING : HealthCheckResponse::NOT_SERVING;
}

UnaryReactor* HealthService::Check(CallContext* context, const Bytes* request, Bytes* response) {
  UnaryReactor* const reactor = context->DefaultReactor();
  HealthCheckRequest message;
  RequestMemory::Share share;
  Bytes bytes = StealBytes(*request);
  const absl::Status parsed = ParseRequest(bytes, admission_.request_memory(), &message, share);
  if (!parsed.ok()) {
    reactor->Finish(ToGrpc(parsed));
    return reactor;
  }
  Status status;
  {
    const std::lock_guard lock(mutex_);
    status = StatusOf(message.service());
  }
  if (status == HealthCheckResponse::UNKNOWN) {
    reactor->Finish({grpc::StatusCode::NOT_FOUND, "the server has no service of this name"});
    return reactor;
  }
  *response = SerializeReply(ResponseOf(status));
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

WriteReactor* HealthService::Watch(CallContext* context, const Bytes* request) {
  return WatchCall::Launch(std::make_shared<WatchCall>(*context, *this, *request));
}

void HealthService::EndServing() {
  std::set<std::shared_ptr<WatchCall>> open;
  {
    const std::lock_guard lock(mutex_);
    serving_ = false;
    open = watches_;
  }
  for (const std::shared_ptr<WatchCall>& watch : open) {
    watch->Report(HealthCheckResponse::NOT_SERVING, Draining());
  }
}

}  // namespace hulld::server
