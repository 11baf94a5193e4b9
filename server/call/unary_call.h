#ifndef HULLD_SERVER_CALL_UNARY_CALL_H_
#define HULLD_SERVER_CALL_UNARY_CALL_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <functional>
#include <optional>

#include "server/call/call.h"
#include "server/process/worker_pool.h"

namespace hulld::server {

// One unary call, answered on any thread; it owns itself until gRPC is done with it.
class UnaryCall : public grpc::ServerUnaryReactor {
 public:
  // Admits a call and hands it to `start`, which must see to it that End is called exactly once,
  // now or later. A call that is not admitted ends at once.
  static grpc::ServerUnaryReactor* Start(grpc::CallbackServerContext& context, Admission& admission,
                                         Rpc rpc, const std::function<void(UnaryCall*)>& start);

  // Starts a call that `work` answers here and now; for work of microseconds.
  static grpc::ServerUnaryReactor* Answer(grpc::CallbackServerContext& context,
                                          Admission& admission, Rpc rpc,
                                          const std::function<absl::Status(const Call&)>& work);

  // Starts a call that `work` answers on `pool`.
  static grpc::ServerUnaryReactor* AnswerOn(WorkerPool& pool, grpc::CallbackServerContext& context,
                                            Admission& admission, Rpc rpc,
                                            std::function<absl::Status(const Call&)> work);

  // Sends the reply; the call, its request and its response must not be touched afterwards.
  void End(const absl::Status& status);

  const Call& call() const { return call_; }

 private:
  UnaryCall(grpc::CallbackServerContext& context, Admission& admission, Rpc rpc)
      : call_(context, admission, rpc) {}

  void OnCancel() override { call_.Cancel(); }
  void OnDone() override { delete this; }
  // Both reactions are trivial: gRPC need not wake a thread of its executor for each call's OnDone.
  // Not part of gRPC's API; without it calls only take longer
  // (tests/bench/service/remote_benchmark.cc).
  bool InternalInlineable() override { return true; }

  Call call_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_UNARY_CALL_H_
