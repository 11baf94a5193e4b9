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
#include "server/call/message_bytes.h"
#include "server/call/trace_context.h"
#include "server/contract/rpc.h"
#include "server/process/log.h"

namespace hulld::server {

// State common to all running calls, unary and streaming. Each reactor has one as a member.
//
// Begin must be called first and End last, each exactly once. All functions may be called on any
// thread.
class Call {
 public:
  // Context and admission must outlive this object.
  Call(CallContext& context, Admission& admission, Rpc rpc)
      : context_(context), admission_(admission), rpc_(rpc), lifetime_(context.deadline()) {}

  Rpc rpc() const { return rpc_; }
  // The caller. Requires that Begin succeeded.
  const Caller& caller() const {
    HULLD_CHECK(ticket_.has_value());
    return caller_;
  }
  // Request ID, supplied by the client (metadata x-request-id) or generated at first use, because
  // most calls succeed without a log line. Every log line about the call includes it. The reply
  // includes it if the call is logged or fails, or if the client supplied it.
  const std::string& request_id() const;
  // Client and connection charged for the call in fair scheduling of the threads. Requires that
  // Begin succeeded.
  ClientId client() const {
    HULLD_CHECK(ticket_.has_value());
    return ticket_->client();
  }
  // True if the client had many running calls when this one arrived (Admission::kBusyCalls).
  // Requires that Begin succeeded.
  bool is_client_busy() const {
    HULLD_CHECK(ticket_.has_value());
    return ticket_->is_client_busy();
  }
  // Arrival time of the call or, in a stream that calls BeginMessage, of the message being
  // processed.
  std::chrono::steady_clock::time_point arrival() const { return arrival_; }
  std::chrono::steady_clock::time_point message_arrival() const { return message_arrival_; }
  Metrics& metrics() const { return admission_.metrics(); }
  RequestMemory& request_memory() const { return admission_.request_memory(); }

  const CallLifetime& lifetime() const { return lifetime_; }
  bool ShouldStop() const { return lifetime_.ShouldStop(); }
  // Returns ShouldStop as a function, which must not outlive this object.
  std::function<bool()> should_stop() const {
    return [this] { return ShouldStop(); };
  }
  bool is_revoked() const { return lifetime_.is_revoked(); }
  // Requires ShouldStop(), as CallLifetime::StopStatus does.
  absl::Status StopStatus() const { return lifetime_.StopStatus(); }
  void Cancel() { lifetime_.Cancel(); }

  // Authenticates and admits the call. After an error, the caller must end the call with it.
  // on_revoked: as in Admission::Arrival. UNAUTHENTICATED, PERMISSION_DENIED: see
  // Guard::Authenticate. UNAVAILABLE: the server is draining. RESOURCE_EXHAUSTED: a limit on calls
  // is reached.
  absl::Status Begin(std::function<void()> on_revoked = {});

  // Count the work requested by the call.
  void AddPairs(uint64_t pairs) { pairs_.fetch_add(pairs, std::memory_order_relaxed); }
  void AddPoints(uint64_t points) { points_.fetch_add(points, std::memory_order_relaxed); }

  // Mark the start of processing of a stream's message, and the completion of its answer. Messages
  // are timed individually, because the client determines the duration of the stream.
  void BeginMessage();
  void EndMessage() { EndMessage(message_arrival_); }
  // For streams with several messages in flight. arrival: the time at which the message arrived.
  void EndMessage(std::chrono::steady_clock::time_point arrival);

  // Counts, in the metrics, a limit that was reached without ending the call, for example by one
  // pair of a batch.
  void CountLimit(const absl::Status& status) const;

  // Logs one line about this call, with its trace.
  void Log(LogLevel level, const std::string& message, LogFields fields = {}) const;
  // Logs a change of a hull or a body with its author: the token's name and the peer. changed: for
  // example {"hull", ID}.
  void LogChange(const std::string& message, const LogField& changed, uint64_t revision,
                 const LogFields& fields = {}) const;

  // Returns the status with which the reactor must finish. If the call stopped, the reason replaces
  // CANCELLED from the work.
  grpc::Status End(absl::Status status);

 private:
  using Clock = std::chrono::steady_clock;

  // Returns the client charged for the call: the token's name or, without tokens, the peer's
  // network or gRPC's name for the peer of a unix socket.
  std::string Client(const std::optional<PeerAddress>& peer) const;
  void LogSlow(Clock::duration duration, const absl::Status& status, const char* what) const;

  CallContext& context_;
  Admission& admission_;
  const Rpc rpc_;
  const Clock::time_point arrival_ = Clock::now();
  mutable std::string request_id_;
  mutable std::once_flag request_id_made_;
  // True if the reply must include the ID: the client supplied it, or a log line or error names it.
  mutable std::atomic<bool> request_id_exposed_ = false;
  // Saved at the start, because a closed connection has no peer.
  const std::string peer_ = context_.peer();
  std::optional<TraceContext> trace_;
  CallLifetime lifetime_;
  std::atomic<uint64_t> pairs_ = 0;
  std::atomic<uint64_t> points_ = 0;
  Clock::time_point message_arrival_;
  Caller caller_;
  // Acquired by Begin, released when the reactor is destroyed.
  std::optional<Admission::Ticket> ticket_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_CALL_H_
