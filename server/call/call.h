#ifndef HULLD_SERVER_CALL_CALL_H_
#define HULLD_SERVER_CALL_CALL_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "core/base/check.h"
#include "server/access/caller.h"
#include "server/call/admission.h"
#include "server/call/call_lifetime.h"
#include "server/call/trace_context.h"
#include "server/contract/rpc.h"
#include "server/process/log.h"

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
  // The caller. Requires that Begin succeeded.
  const Caller& caller() const {
    HULLD_CHECK(ticket_.has_value());
    return caller_;
  }
  // The request ID: the client's (metadata x-request-id), or ours, which is made when it is first
  // needed, as most calls succeed and nothing is logged about them. All that is logged about the
  // call carries it, and so does the reply of a call that is logged or fails, or whose client gave
  // one.
  const std::string& request_id() const;
  // Whose share of the threads it uses. Requires that Begin succeeded.
  ClientId client() const {
    HULLD_CHECK(ticket_.has_value());
    return ticket_->client();
  }
  // When it came; in a stream that BeginMessage is called for, when the message that is under way
  // came.
  std::chrono::steady_clock::time_point arrival() const { return arrival_; }
  std::chrono::steady_clock::time_point message_arrival() const { return message_arrival_; }
  Metrics& metrics() const { return admission_.metrics(); }
  RequestMemory& request_memory() const { return admission_.request_memory(); }

  const CallLifetime& lifetime() const { return lifetime_; }
  bool ShouldStop() const { return lifetime_.ShouldStop(); }
  bool is_revoked() const { return lifetime_.is_revoked(); }
  // Requires ShouldStop(), as CallLifetime::StopStatus does.
  absl::Status StopStatus() const { return lifetime_.StopStatus(); }
  void Cancel() { lifetime_.Cancel(); }

  // Finds out who calls and lets the call in; it must be ended with the error if there is one.
  // on_revoked: as Admission::Arrival says.
  // UNAUTHENTICATED, PERMISSION_DENIED: as Authenticator::Authenticate. UNAVAILABLE: the server
  // drains. RESOURCE_EXHAUSTED: a limit on calls.
  absl::Status Begin(std::function<void()> on_revoked = {});

  // Counts what the call asked for.
  void AddPairs(uint64_t pairs) { pairs_.fetch_add(pairs, std::memory_order_relaxed); }
  void AddPoints(uint64_t points) { points_.fetch_add(points, std::memory_order_relaxed); }

  // A stream took up a message, and made its answer ready: messages are timed one by one, as the
  // stream itself lasts as long as its client likes.
  void BeginMessage();
  void EndMessage() { EndMessage(message_arrival_); }
  // The same where several messages are under way: `arrival` is that of the one.
  void EndMessage(std::chrono::steady_clock::time_point arrival);

  // Counts a limit that was met without ending the call, as by one pair of a batch.
  void CountLimit(const absl::Status& status) const;

  // Logs one line about this call, with the trace that it is part of.
  void Log(LogLevel level, const std::string& message, LogFields fields = {}) const;
  // Logs a change of a hull or a body, as {"hull", ID}, and who made it: the token's name and the
  // peer.
  void LogChange(const std::string& message, const LogField& changed, uint64_t revision,
                 const LogFields& fields = {}) const;

  // What the reactor is to finish with.
  grpc::Status End(const absl::Status& status);

 private:
  using Clock = std::chrono::steady_clock;

  // Fills caller_.
  absl::Status Authenticate();
  std::string Client() const;
  void LogSlow(Clock::duration duration, const absl::Status& status, const char* what) const;

  grpc::CallbackServerContext& context_;
  Admission& admission_;
  const Rpc rpc_;
  const Clock::time_point arrival_ = Clock::now();
  mutable std::string request_id_;
  mutable std::once_flag request_id_made_;
  // The client gave one, or something names it: the reply is to carry it.
  mutable std::atomic<bool> request_id_told_ = false;
  // Known from the start: a connection that is gone has no peer.
  const std::string peer_ = context_.peer();
  std::optional<TraceContext> trace_;
  CallLifetime lifetime_;
  std::atomic<uint64_t> pairs_ = 0;
  std::atomic<uint64_t> points_ = 0;
  Clock::time_point message_arrival_;
  Caller caller_;
  // Taken by Begin, given back when the reactor goes.
  std::optional<Admission::Ticket> ticket_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_CALL_H_
