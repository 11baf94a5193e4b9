#include "server/call/admission.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <utility>
#include <vector>

#include "core/base/check.h"
#include "server/contract/error_info.h"
#include "server/contract/limit_error.h"

namespace hulld::server {
namespace {

// A unary call takes well under a millisecond, a batch rather a second: when to try again.
constexpr std::chrono::milliseconds kRetryCall(100);
constexpr std::chrono::milliseconds kRetryBatch(1000);
// A call that polls notices by itself that its time is up, and says so better than a cancellation.
constexpr std::chrono::seconds kGrace(2);

}  // namespace

CallKind KindOf(Rpc rpc) {
  switch (rpc) {
    case Rpc::kCreateHull:
    case Rpc::kGetHull:
    case Rpc::kListHulls:
    case Rpc::kDeleteHull:
    case Rpc::kCheckCollision:
    case Rpc::kGetStatus:
    case Rpc::kPutBody:
    case Rpc::kGetBody:
    case Rpc::kListBodies:
    case Rpc::kDeleteBody:
      return CallKind::kUnary;
    case Rpc::kBatchCheckCollisions:
    case Rpc::kFindCollisions:
      return CallKind::kBatch;
    case Rpc::kGetHullMesh:
      return CallKind::kDownload;
    case Rpc::kAppendPoints:
    case Rpc::kReplaceHull:
    case Rpc::kStreamCollisions:
    case Rpc::kSaveBackup:
    case Rpc::kWatchHulls:
    case Rpc::kWatchCollisions:
    case Rpc::kServerReflectionInfo:
      return CallKind::kStream;
  }
  HULLD_UNREACHABLE();
}

Admission::Ticket::Ticket(Ticket&& other) noexcept
    : admission_(std::exchange(other.admission_, nullptr)),
      kind_(other.kind_),
      client_(std::move(other.client_)),
      watched_(other.watched_),
      is_watched_(other.is_watched_) {}

Admission::Ticket::~Ticket() {
  if (admission_ != nullptr) admission_->Leave(*this);
}

Admission::Admission(const Limits& limits, Metrics& metrics)
    : limits_(limits), metrics_(metrics), request_memory_(limits.request_memory) {
  metrics_.AddGauge("hulld_request_bytes", "Bytes that requests under way take.",
                    [this] { return static_cast<double>(request_memory_.taken_bytes()); });
  metrics_.AddGauge("hulld_requests_running", "Calls that run now, open streams included.",
                    [this] { return static_cast<double>(running()); });
  if (limits_.max_request_time > std::chrono::milliseconds::zero()) {
    watchman_ = std::thread([this] { CancelOverdue(); });
  }
}

Admission::~Admission() {
  HULLD_CHECK(running_ == 0);
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    watched_changed_.notify_all();
  }
  if (watchman_.joinable()) watchman_.join();
}

absl::Status Admission::CheckRoom(CallKind kind, const std::string& client) {
  if (running_ >= limits_.max_calls) {
    return Overloaded(absl::StrCat(running(), " calls are running"), limits_.max_calls, "max-calls",
                      kRetryCall);
  }
  if (const size_t waiting = backlog_ ? backlog_() : 0; waiting >= limits_.max_waiting_calls) {
    return Overloaded(absl::StrCat(waiting, " calls wait for a thread"), limits_.max_waiting_calls,
                      "max-waiting-calls", kRetryCall);
  }
  if (kind == CallKind::kBatch && batches_ >= limits_.max_concurrent_batches) {
    return Overloaded(absl::StrCat(batches_, " batches and scenes are running"),
                      limits_.max_concurrent_batches, "max-concurrent-batches", kRetryBatch);
  }
  if (kind != CallKind::kStream) return absl::OkStatus();
  const auto open = streams_.find(client);
  if (open == streams_.end() || open->second < limits_.max_streams_per_client) {
    return absl::OkStatus();
  }
  return Overloaded(absl::StrCat("this client has ", open->second, " streams open"),
                    limits_.max_streams_per_client, "max-streams-per-client", kRetryBatch);
}

absl::StatusOr<Admission::Ticket> Admission::Admit(Rpc rpc,
                                                   const std::function<std::string()>& client,
                                                   grpc_call* call) {
  Ticket ticket(nullptr, KindOf(rpc));
  if (ticket.kind_ == CallKind::kStream) ticket.client_ = client();
  const std::lock_guard lock(mutex_);
  if (draining_) return Draining();
  // What tells the operator how the server is must work when it is full, too.
  if (rpc != Rpc::kGetStatus) {
    if (absl::Status s = CheckRoom(ticket.kind_, ticket.client_); !s.ok()) return s;
  }
  ticket.admission_ = this;
  running_.fetch_add(1, std::memory_order_relaxed);
  if (ticket.kind_ == CallKind::kBatch) ++batches_;
  if (ticket.kind_ == CallKind::kStream) ++streams_[ticket.client_];
  Watch(call, &ticket);
  return ticket;
}

void Admission::Watch(grpc_call* call, Ticket* ticket) {
  const bool sends_much = ticket->kind_ == CallKind::kBatch || ticket->kind_ == CallKind::kDownload;
  if (!watchman_.joinable() || call == nullptr || !sends_much) return;
  const auto end = std::chrono::steady_clock::now() + limits_.max_request_time + kGrace;
  grpc_call_ref(call);
  ticket->watched_ = watched_.insert(watched_.end(), {end, call});
  ticket->is_watched_ = true;
  if (watched_.size() == 1) watched_changed_.notify_all();
}

void Admission::CancelOverdue() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    if (watched_.empty()) {
      watched_changed_.wait(lock);
      continue;
    }
    const auto end = watched_.front().end;
    if (std::chrono::steady_clock::now() < end) {
      watched_changed_.wait_until(lock, end);
      continue;
    }
    watched_.front().is_cancelled = true;
    grpc_call* const call = watched_.front().call;
    grpc_call_ref(call);
    cancelled_.splice(cancelled_.end(), watched_, watched_.begin());
    // gRPC may call back, and those calls may leave, before this returns.
    lock.unlock();
    grpc_call_cancel(call, nullptr);
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
    // Notified under the lock, as the thread that waits may destroy this once it is released.
    const std::lock_guard lock(mutex_);
    if (ticket.is_watched_) {
      watched = ticket.watched_->call;
      (ticket.watched_->is_cancelled ? cancelled_ : watched_).erase(ticket.watched_);
    }
    if (ticket.kind_ == CallKind::kBatch) {
      HULLD_CHECK(batches_ > 0);
      --batches_;
    }
    if (ticket.kind_ == CallKind::kStream) {
      const auto open = streams_.find(ticket.client_);
      HULLD_CHECK(open != streams_.end());
      if (--open->second == 0) streams_.erase(open);
    }
    if (running_.fetch_sub(1, std::memory_order_relaxed) == 1) idle_.notify_all();
  }
  if (watched != nullptr) grpc_call_unref(watched);
}

}  // namespace hulld::server
