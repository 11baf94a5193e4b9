#ifndef HULLD_SERVER_CALL_H_
#define HULLD_SERVER_CALL_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <optional>

#include "server/admission.h"
#include "server/call_lifetime.h"
#include "server/caller.h"
#include "server/rpc.h"

namespace hulld::server {

// What every running call has, unary or stream: one part of each reactor, as long-lived as that.
//
// Begin comes first and End last, each once; both may be called on any thread, and so may the rest
// between them.
class Call {
 public:
  // Context and admission must outlive this.
  Call(grpc::CallbackServerContext& context, Admission& admission, Rpc rpc)
      : context_(context), admission_(admission), rpc_(rpc), lifetime_(context.deadline()) {}

  Rpc rpc() const { return rpc_; }
  // Who calls. Requires that Begin succeeded.
  const Caller& caller() const { return caller_; }
  const CallLifetime& lifetime() const { return lifetime_; }
  bool ShouldStop() const { return lifetime_.ShouldStop(); }
  // Requires ShouldStop().
  absl::Status StopStatus() const { return lifetime_.StopStatus(); }
  void Cancel() { lifetime_.Cancel(); }

  // Finds out who calls and lets the call in; it must be ended with the error if there is one.
  // UNAUTHENTICATED, PERMISSION_DENIED: as Authenticator::Authenticate. UNAVAILABLE: the server
  // drains.
  absl::Status Begin();

  // What the reactor is to finish with.
  grpc::Status End(const absl::Status& status);

 private:
  // Fills caller_.
  absl::Status Authenticate();

  grpc::CallbackServerContext& context_;
  Admission& admission_;
  const Rpc rpc_;
  CallLifetime lifetime_;
  Caller caller_;
  // Taken by Begin, given back when the reactor goes.
  std::optional<Admission::Ticket> ticket_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_H_
