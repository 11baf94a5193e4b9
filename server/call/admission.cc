#include "server/call/admission.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "server/access/guard.h"
#include "server/contract/errors.h"

namespace hulld::server {
namespace {

// Retry delays: a unary call takes well under a millisecond, a batch about a second.
constexpr std::chrono::milliseconds kRetryCall(100);
constexpr std::chrono::milliseconds kRetryBatch(1000);
// A call that polls notices its deadline itself and reports it better than a cancellation does.
constexpr std::chrono::seconds kGrace(2);

bool IsAnonymous(Rpc rpc) { return PermissionFor(rpc) == Permission::kNone; }

}  // namespace

bool UsesWriters(Rpc rpc) { return rpc == Rpc::kAppendPoints || rpc == Rpc::kReplaceHull; }

Admission::Ticket::Ticket(Admission* admission, Rpc rpc)
    : admission_(admission), rpc_(rpc), kind_(KindOf(rpc)) {}

// NOLINTNEXTLINE(performance-move-constructor-init): no member is cheaper to move than to copy.
Admission::Ticket::Ticket(Ticket&& other) noexcept : Ticket(other) { other.admission_ = nullptr; }

ClientId Admission::Ticket::client() const { return {client_->second.number, connection_}; }

Admission::Ticket::~Ticket() {
  if (admission_ != nullptr) admission_->Leave(*this);
}

Admission::Admission(const Limits& limits, Metrics& metrics, ConnectionTable& connections,
                     const Guard* guard)
    : limits_(limits),
      metrics_(metrics),
      connections_(connections),
      guard_(guard),
      request_memory_(limits.request_memory) {
  metrics_.AddGauge("hulld_request_bytes", "Bytes held by requests in flight.",
                    [this] { return static_cast<double>(request_memory_.taken_bytes()); });
  watchdog_ = std::thread([this] { CancelOverdue(); });
}

Admission::~Admission() {
  HULLD_CHECK(running_ == 0);
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    watched_changed_.notify_all();
  }
  watchdog_.join();
}

Admission::Ticket::Share Admission::ShareOf(const Arrival& arrival, uint64_t connection) const {
  using Share = Ticket::Share;
  if (!IsAnonymous(arrival.rpc)) return Share::kCalls;
  if (arrival.rpc != Rpc::kHealthWatch) return Share::kAnonymous;
  // The peer of a unix socket is a program on this machine, such as a proxy for many clients.
  const bool is_first = connection != 0 && !watching_health_.contains(connection);
  return is_first || !arrival.peer.has_value() ? Share::kFree : Share::kAnonymous;
}

absl::Status Admission::CheckAnonymousRoom(const Ticket::Client& client) const {
  const uint64_t of_client =
      std::max<uint64_t>(1, limits_.max_anonymous_calls / Limits::kAnonymousShare);
  if (anonymous_ < limits_.max_anonymous_calls && client.anonymous < of_client) {
    return absl::OkStatus();
  }
  return Overloaded(
      absl::StrCat(anonymous_, " calls without a token are running, ", client.anonymous,
                   " of them from this client, whose limit is ", of_client),
      limits_.max_anonymous_calls, "max-anonymous-calls", kRetryBatch);
}

absl::Status Admission::CheckRoom(Rpc rpc, const Ticket::Client& client) {
  const CallKind kind = KindOf(rpc);
  // Long calls leave a part of each limit to single calls.
  const auto room = [kind](uint64_t limit) {
    return kind == CallKind::kUnary ? limit : limit - limit / Limits::kKeptForSingleCalls;
  };
  const auto kept = [&](uint64_t limit) {
    return room(limit) == limit ? std::string()
                                : absl::StrCat(", and ", limit - room(limit),
                                               " slots are reserved for single calls");
  };
  if (calls_ >= room(limits_.max_calls)) {
    return Overloaded(absl::StrCat(calls_, " calls are running", kept(limits_.max_calls)),
                      limits_.max_calls, "max-calls", kRetryCall);
  }
  size_t waiting = backlog_ ? backlog_(rpc) : 0;
  // Tasks queued by streams, such as thousands of watches opened or notified together, must not
  // crowd out single calls, because clients take turns.
  if (kind == CallKind::kUnary) waiting = std::min(waiting, single_calls_);
  if (waiting >= limits_.max_waiting_calls) {
    return Overloaded(absl::StrCat(waiting, " calls wait for a thread"), limits_.max_waiting_calls,
                      "max-waiting-calls", kRetryCall);
  }
  if (kind == CallKind::kBatch && batches_ >= limits_.max_concurrent_batches) {
    return Overloaded(absl::StrCat(batches_, " batches and scenes are running"),
                      limits_.max_concurrent_batches, "max-concurrent-batches", kRetryBatch);
  }
  if (kind == CallKind::kStream && client.streams >= limits_.max_streams_per_client) {
    return Overloaded(absl::StrCat("this client has ", client.streams, " streams open"),
                      limits_.max_streams_per_client, "max-streams-per-client", kRetryBatch);
  }
  if (kind == CallKind::kBatch && client.batches >= limits_.max_batches_per_client) {
    return Overloaded(
        absl::StrCat("this client has ", client.batches, " batches and scenes running"),
        limits_.max_batches_per_client, "max-batches-per-client", kRetryBatch);
  }
  if (client.calls >= room(limits_.max_calls_per_client)) {
    return Overloaded(absl::StrCat("this client has ", client.calls, " calls running",
                                   kept(limits_.max_calls_per_client)),
                      limits_.max_calls_per_client, "max-calls-per-client", kRetryCall);
  }
  return absl::OkStatus();
}

absl::StatusOr<Admission::Ticket> Admission::Admit(const Arrival& arrival) {
  Ticket ticket(nullptr, arrival.rpc);
  const std::lock_guard lock(mutex_);
  if (draining_) return Draining();
  const auto known = clients_.find(arrival.client);
  const Ticket::Client before = known == clients_.end() ? Ticket::Client{} : known->second;
  // A call without a token does not protect its connection from eviction.
  if (IsAnonymous(arrival.rpc)) ticket.connection_ = connections_.Find(arrival.peer);
  ticket.share_ = ShareOf(arrival, ticket.connection_);
  absl::Status room;
  if (ticket.share_ == Ticket::Share::kAnonymous) room = CheckAnonymousRoom(before);
  // Operators' status calls must succeed even if the server is full.
  if (ticket.share_ == Ticket::Share::kCalls && arrival.rpc != Rpc::kGetStatus) {
    room = CheckRoom(arrival.rpc, before);
  }
  if (!room.ok()) return room;
  ticket.is_client_busy_ = before.calls >= kBusyCalls;
  ticket.client_ =
      known != clients_.end()
          ? &*known
          : &*clients_.emplace(arrival.client, Ticket::Client{.number = ++last_client_}).first;
  ticket.admission_ = this;
  Count(ticket, 1);
  metrics_.RunningCalls(arrival.rpc).Increment();
  if (ticket.share_ == Ticket::Share::kCalls) {
    ticket.connection_ = connections_.BeginCall(arrival.peer);
  }
  if (ticket.share_ == Ticket::Share::kFree && ticket.connection_ != 0) {
    watching_health_.insert(ticket.connection_);
  }
  Watch(arrival, &ticket);
  return ticket;
}

void Admission::Count(const Ticket& ticket, uint64_t by) {
  Ticket::Client& client = ticket.client_->second;
  client.running += by;
  running_.fetch_add(by, std::memory_order_relaxed);
  if (ticket.share_ == Ticket::Share::kCalls) {
    client.calls += by;
    calls_ += by;
  } else if (ticket.share_ == Ticket::Share::kAnonymous) {
    client.anonymous += by;
    anonymous_ += by;
  }
  if (ticket.kind_ == CallKind::kUnary) single_calls_ += by;
  if (ticket.kind_ == CallKind::kBatch) {
    client.batches += by;
    batches_ += by;
  }
  if (ticket.kind_ == CallKind::kStream && !IsAnonymous(ticket.rpc_)) client.streams += by;
}

size_t Admission::EndRevoked() {
  const auto end = std::chrono::steady_clock::now() + kGrace;
  std::vector<std::function<void()>> waiting;
  size_t count = 0;
  {
    const std::lock_guard lock(mutex_);
    for (Ticket::Watched& call : watched_) {
      const bool is_revocable = !call.caller.name.empty() && !call.lifetime->is_revoked();
      if (!is_revocable || guard_->Knows(call.caller)) continue;
      call.lifetime->Revoke();
      call.end = std::min(call.end, end);
      if (call.on_revoked) waiting.push_back(std::move(call.on_revoked));
      ++count;
    }
    watched_changed_.notify_all();
  }
  // The calls may end before end_call returns.
  for (const std::function<void()>& end_call : waiting) end_call();
  return count;
}

void Admission::Watch(const Arrival& arrival, Ticket* ticket) {
  const bool has_token = !arrival.caller.name.empty();
  const bool sends_much = ticket->kind_ == CallKind::kBatch || ticket->kind_ == CallKind::kDownload;
  const bool is_limited = sends_much && arrival.call != nullptr &&
                          limits_.max_request_time > std::chrono::milliseconds::zero();
  if (!has_token && !is_limited) return;
  const auto end =
      is_limited ? std::chrono::steady_clock::now() + limits_.max_request_time + kGrace : kNever;
  if (arrival.call != nullptr) grpc_call_ref(arrival.call);
  ticket->watched_ = watched_.insert(
      watched_.end(), {arrival.caller, arrival.lifetime, arrival.on_revoked, arrival.call, end});
  if (end < next_check_) watched_changed_.notify_all();
}

// Searches all watched calls at each check. Checks are rare, because most calls end before they are
// overdue.
void Admission::CancelOverdue() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    const auto first = std::ranges::min_element(watched_, {}, &Ticket::Watched::end);
    next_check_ = first == watched_.end() ? kNever : first->end;
    if (next_check_ == kNever) {
      watched_changed_.wait(lock);
      continue;
    }
    if (std::chrono::steady_clock::now() < next_check_) {
      watched_changed_.wait_until(lock, next_check_);
      continue;
    }
    // Prevents a second cancellation.
    first->end = kNever;
    if (first->call == nullptr) continue;
    grpc_call* const call = first->call;
    const bool is_revoked = !first->caller.name.empty() && first->lifetime->is_revoked();
    grpc_call_ref(call);
    // gRPC may call back, and the calls may end, before the cancellation returns.
    lock.unlock();
    if (is_revoked) {
      grpc_call_cancel_with_status(call, GRPC_STATUS_UNAUTHENTICATED, CallLifetime::kRevoked,
                                   nullptr);
    } else {
      grpc_call_cancel(call, nullptr);
    }
    grpc_call_unref(call);
    lock.lock();
  }
}

void Admission::BeginDrain() {
  const std::lock_guard lock(mutex_);
  draining_ = true;
}

bool Admission::WaitIdle(std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  return idle_.wait_until(lock, deadline, [this] { return running_ == 0; });
}

void Admission::Leave(Ticket& ticket) {
  grpc_call* watched = nullptr;
  {
    // Notifies under the lock, because the waiting thread may destroy this object after its
    // release.
    const std::lock_guard lock(mutex_);
    if (ticket.watched_.has_value()) {
      watched = (*ticket.watched_)->call;
      watched_.erase(*ticket.watched_);
    }
    HULLD_CHECK(ticket.client_->second.running > 0);
    Count(ticket, uint64_t{0} - 1);
    if (ticket.share_ == Ticket::Share::kCalls && ticket.connection_ != 0) {
      connections_.EndCall(ticket.connection_);
    }
    if (ticket.share_ == Ticket::Share::kFree) watching_health_.erase(ticket.connection_);
    if (ticket.client_->second.running == 0) clients_.erase(clients_.find(ticket.client_->first));
    metrics_.RunningCalls(ticket.rpc_).Decrement();
    if (running_ == 0) idle_.notify_all();
  }
  if (watched != nullptr) grpc_call_unref(watched);
}

}  // namespace hulld::server
