#ifndef HULLD_SERVER_UNARY_CALL_H_
#define HULLD_SERVER_UNARY_CALL_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <functional>
#include <optional>

#include "server/admission.h"
#include "server/call_lifetime.h"
#include "server/worker_pool.h"

namespace hulld::server {

// One unary call, answered on any thread; it owns itself until gRPC is done with it.
class UnaryCall : public grpc::ServerUnaryReactor {
 public:
  // Admits a call and hands it to `start`, which must see to it that End is called exactly once,
  // now or later. A call that is not admitted ends at once.
  static grpc::ServerUnaryReactor* Start(const grpc::CallbackServerContext& context,
                                         Admission& admission,
                                         const std::function<void(UnaryCall*)>& start);

  // Starts a call that `work` answers here and now; for work of microseconds.
  static grpc::ServerUnaryReactor* Answer(const grpc::CallbackServerContext& context,
                                          Admission& admission,
                                          const std::function<absl::Status()>& work);

  // Starts a call that `work` answers on `pool`.
  static grpc::ServerUnaryReactor* AnswerOn(WorkerPool& pool,
                                            const grpc::CallbackServerContext& context,
                                            Admission& admission,
                                            std::function<absl::Status(const CallLifetime&)> work);

  // Sends the reply; the call, its request and its response must not be touched afterwards.
  void End(const absl::Status& status);

  const CallLifetime& lifetime() const { return lifetime_; }

 private:
  explicit UnaryCall(const grpc::CallbackServerContext& context) : lifetime_(context.deadline()) {}

  void OnCancel() override { lifetime_.Cancel(); }
  void OnDone() override { delete this; }

  CallLifetime lifetime_;
  std::optional<Admission::Ticket> ticket_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_UNARY_CALL_H_
