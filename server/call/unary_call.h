#ifndef HULLD_SERVER_CALL_UNARY_CALL_H_
#define HULLD_SERVER_CALL_UNARY_CALL_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <utility>

#include "server/call/call.h"
#include "server/call/message_bytes.h"
#include "server/process/task_pool.h"

namespace hulld::server {

// A unary call, answered on any thread. Owns itself until gRPC releases it.
template <typename Request, typename Response>
class UnaryCall : public UnaryReactor {
 public:
  // Admits a call, parses its request, and passes it to `start`, which must ensure that End is
  // called exactly once, now or later. A refused or malformed call ends immediately. request,
  // response: held by gRPC until the call ends.
  template <typename Step>
  static UnaryReactor* Start(CallContext* context, Admission& admission, Rpc rpc,
                             const Bytes* request, Bytes* response, Step&& start) {
    auto* call = new UnaryCall(*context, admission, rpc, response);
    absl::Status begun = call->call_.Begin();
    if (begun.ok()) {
      Bytes bytes = StealBytes(*request);
      begun = ParseRequest(bytes, admission.request_memory(), &call->request_, call->share_);
    }
    if (begun.ok()) {
      start(call);
    } else {
      call->End(begun);
    }
    return call;
  }

  // Ends the call with the result of `work`, run on `pool`. Requires: the call has not ended
  // (unchecked: an ended call may have been destroyed).
  template <typename Work>
  void EndOn(TaskPool& pool, Work work) {
    pool.Submit(
        [this, work = std::move(work)] { End(call_.ShouldStop() ? call_.StopStatus() : work()); },
        call_.client());
  }

  // Sends the response or the error; the call must not be used afterwards.
  void End(const absl::Status& status) {
    if (status.ok()) *response_bytes_ = SerializeReply(response_);
    Finish(call_.End(status));
  }

  const Call& call() const { return call_; }
  const Request& request() const { return request_; }
  Response& response() { return response_; }

 private:
  UnaryCall(CallContext& context, Admission& admission, Rpc rpc, Bytes* response)
      : call_(context, admission, rpc), response_bytes_(response) {}

  void OnCancel() override { call_.Cancel(); }
  void OnDone() override { delete this; }
  // Both reactions are trivial, so gRPC need not wake an executor thread for each call's OnDone.
  // This function is not part of gRPC's public API; without it, calls only take longer
  // (tests/bench/service/remote_benchmark.cc).
  bool InternalInlineable() override { return true; }

  Call call_;
  Bytes* const response_bytes_;
  RequestMemory::Share share_;
  Request request_;
  Response response_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_UNARY_CALL_H_
