#include "server/unary_call.h"

#include <utility>

#include "server/status_map.h"

namespace hulld::server {

grpc::ServerUnaryReactor* UnaryCall::Start(const grpc::CallbackServerContext& context,
                                           Admission& admission,
                                           const std::function<void(UnaryCall*)>& start) {
  auto* call = new UnaryCall(context);
  absl::StatusOr<Admission::Ticket> ticket = admission.Admit();
  if (ticket.ok()) {
    call->ticket_ = *std::move(ticket);
    start(call);
  } else {
    call->End(ticket.status());
  }
  return call;
}

grpc::ServerUnaryReactor* UnaryCall::Answer(const grpc::CallbackServerContext& context,
                                            Admission& admission,
                                            const std::function<absl::Status()>& work) {
  return Start(context, admission, [&](UnaryCall* call) { call->End(work()); });
}

grpc::ServerUnaryReactor* UnaryCall::AnswerOn(
    WorkerPool& pool, const grpc::CallbackServerContext& context, Admission& admission,
    std::function<absl::Status(const CallLifetime&)> work) {
  return Start(context, admission, [&](UnaryCall* call) {
    pool.Submit([call, task = std::move(work)] {
      const CallLifetime& lifetime = call->lifetime();
      call->End(lifetime.ShouldStop() ? lifetime.StopStatus() : task(lifetime));
    });
  });
}

void UnaryCall::End(const absl::Status& status) {
  // What stopped the work is better known here than where it was noticed.
  const bool stopped = status.code() == absl::StatusCode::kCancelled && lifetime_.ShouldStop();
  Finish(ToGrpc(stopped ? lifetime_.StopStatus() : status));
}

}  // namespace hulld::server
