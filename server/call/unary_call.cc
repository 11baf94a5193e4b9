#include "server/call/unary_call.h"

#include <utility>

#include "server/contract/status_map.h"

namespace hulld::server {

grpc::ServerUnaryReactor* UnaryCall::Start(grpc::CallbackServerContext& context,
                                           Admission& admission, Rpc rpc,
                                           const std::function<void(UnaryCall*)>& start) {
  auto* call = new UnaryCall(context, admission, rpc);
  const absl::Status begun = call->call_.Begin();
  if (begun.ok()) {
    start(call);
  } else {
    call->End(begun);
  }
  return call;
}

grpc::ServerUnaryReactor* UnaryCall::Answer(grpc::CallbackServerContext& context,
                                            Admission& admission, Rpc rpc,
                                            const std::function<absl::Status(const Call&)>& work) {
  return Start(context, admission, rpc, [&](UnaryCall* call) { call->End(work(call->call_)); });
}

grpc::ServerUnaryReactor* UnaryCall::AnswerOn(WorkerPool& pool,
                                              grpc::CallbackServerContext& context,
                                              Admission& admission, Rpc rpc,
                                              std::function<absl::Status(const Call&)> work) {
  return Start(context, admission, rpc, [&](UnaryCall* call) {
    pool.Submit([call, task = std::move(work)] {
      const Call& common = call->call_;
      call->End(common.ShouldStop() ? common.StopStatus() : task(common));
    });
  });
}

void UnaryCall::End(const absl::Status& status) {
  // What stopped the work is better known here than where it was noticed.
  const bool stopped = status.code() == absl::StatusCode::kCancelled && call_.ShouldStop();
  Finish(call_.End(stopped ? call_.StopStatus() : status));
}

}  // namespace hulld::server
