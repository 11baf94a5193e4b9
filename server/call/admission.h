#ifndef HULLD_SERVER_CALL_ADMISSION_H_
#define HULLD_SERVER_CALL_ADMISSION_H_

#include <absl/status/statusor.h>
#include <grpc/grpc.h>
#include <prometheus/gauge.h>

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>

#include "server/access/caller.h"
#include "server/call/call_lifetime.h"
#include "server/call/request_memory.h"
#include "server/contract/rpc.h"
#include "server/process/fair_queue.h"
#include "server/process/metrics.h"
#include "server/settings/config.h"

namespace hulld::server {

// How a call loads the server, which decides what bounds it.
enum class CallKind {
  // One request, one short answer.
  kUnary,
  // Thousands of pairs, computed in slices: --max-concurrent-batches.
  kBatch,
  // One request, an answer of many messages.
  kDownload,
  // Lasts as long as its client or the size of the store demands: --max-streams-per-client.
  kStream,
};

CallKind KindOf(Rpc rpc);

class Authenticator;

// Whether a call waits for the writers' pool; others wait for the readers' and for that of answers.
bool UsesWriters(Rpc rpc);

// Lets calls in while the limits leave room and until the server drains, counts those that run,
// tells those to end whose token is no longer valid, and cancels those that neither end nor poll
// for their end, as when a client reads no more.
//
// Each client has its share of calls, streams and batches. A part of all calls, and of each
// client's, is kept for single calls, so calls that last never keep them out.
class Admission {
 public:
  // Sets what tells callers apart. Called before the first call; `authenticator` must outlive this.
  // Without one, everyone may do everything.
  void SetAuthenticator(const Authenticator& authenticator) { authenticator_ = &authenticator; }
  const Authenticator* authenticator() const { return authenticator_; }

  // One admitted call; it ends with its ticket.
  class Ticket {
   public:
    Ticket(Ticket&& other) noexcept;
    Ticket& operator=(Ticket&&) = delete;
    ~Ticket();

    // Whose share of the threads it uses.
    ClientId client() const;

   private:
    friend class Admission;
    struct Client {
      ClientId id;
      uint64_t calls = 0;
      uint64_t batches = 0;
      uint64_t streams = 0;
    };
    // The nodes of an unordered_map stay where they are.
    using Clients = std::unordered_map<std::string, Client>;
    struct Watched {
      std::chrono::steady_clock::time_point end;
      grpc_call* call;
      bool is_cancelled = false;
    };
    struct Revocable {
      Caller caller;
      grpc_call* call;
      CallLifetime* lifetime;
      std::function<void()> on_revoked;
      // Once it is revoked: when it is cancelled unless it ended by itself.
      std::chrono::steady_clock::time_point end = {};
      // The list that it is in.
      std::list<Revocable>* list = nullptr;
    };
    Ticket(Admission* admission, Rpc rpc);

    Admission* admission_;
    Rpc rpc_;
    CallKind kind_;
    Clients::value_type* client_ = nullptr;
    // Set for calls with a token.
    std::list<Revocable>::iterator revocable_;
    bool is_revocable_ = false;
    // Set for downloads and batches, while --max-request-time limits them.
    std::list<Watched>::iterator watched_;
    bool is_watched_ = false;
  };

  // The metrics must outlive this.
  Admission(const Limits& limits, Metrics& metrics);
  Admission(const Admission&) = delete;
  Admission& operator=(const Admission&) = delete;
  // Requires that no call runs.
  ~Admission();

  const Limits& limits() const { return limits_; }
  Metrics& metrics() { return metrics_; }

  // What the requests that were let in take.
  RequestMemory& request_memory() { return request_memory_; }

  // What waits for a thread where this call would, bounded by --max-waiting-calls. Set before the
  // first call.
  void SetBacklog(std::function<size_t(Rpc)> backlog) { backlog_ = std::move(backlog); }

  // What must be known of a call to let it in.
  struct Arrival {
    Rpc rpc;
    // Whose share it uses.
    std::string client;
    // gRPC's object of the call.
    grpc_call* call = nullptr;
    // Whose token it carries, if it does, and what ends when that is no longer valid, which must
    // outlive the ticket. Then on_revoked is called, if there is one, on any thread, perhaps when
    // the ticket is gone: it ends a call that waits and so polls for nothing.
    Caller caller = {};
    CallLifetime* lifetime = nullptr;
    std::function<void()> on_revoked = {};
  };

  // Lets a call in. UNAVAILABLE once the server drains; RESOURCE_EXHAUSTED naming the limit, with a
  // time to retry.
  absl::StatusOr<Ticket> Admit(const Arrival& arrival);

  // Ends every call of a token that `is_valid` does not know any more: UNAUTHENTICATED. A call that
  // does not end by itself within two seconds, as where the client does not read what is written,
  // is cancelled, and then without details of the error. How many.
  size_t EndRevoked(const std::function<bool(const Caller&)>& is_valid);

  void BeginDrain();

  // Waits until no call runs; false when some still run at `deadline`.
  bool WaitIdle(std::chrono::steady_clock::time_point deadline);

  // Calls that run now.
  size_t running() const { return running_.load(std::memory_order_relaxed); }

 private:
  // Both require the mutex; unchecked, as a std::mutex cannot tell who holds it.
  absl::Status CheckRoom(Rpc rpc, const Ticket::Client& client);
  void Watch(grpc_call* call, Ticket* ticket);
  static void MoveTo(std::list<Ticket::Revocable>& list,
                     std::list<Ticket::Revocable>::iterator call);

  void Leave(Ticket& ticket);
  // The watchman's thread.
  void CancelOverdue();

  const Limits limits_;
  Metrics& metrics_;
  RequestMemory request_memory_;
  std::function<size_t(Rpc)> backlog_;

  const Authenticator* authenticator_ = nullptr;
  // hulld_requests_running{rpc}.
  std::array<prometheus::Gauge*, kRpcCount> running_gauges_;

  std::mutex mutex_;
  // The rest is guarded by the mutex, `running_` for changes.
  std::condition_variable idle_;
  bool draining_ = false;
  std::atomic<size_t> running_ = 0;
  size_t batches_ = 0;
  // Those that have calls here alone.
  Ticket::Clients clients_;
  ClientId last_client_ = kNoClient;
  // Those with a valid token; those that are to end, in the order in which they are cancelled
  // otherwise; and those that were.
  std::list<Ticket::Revocable> revocable_;
  std::list<Ticket::Revocable> revoked_;
  std::list<Ticket::Revocable> cut_off_;
  // In the order in which they end, as all are given the same time.
  std::list<Ticket::Watched> watched_;
  // Those of which the time was up: nothing more is done about them.
  std::list<Ticket::Watched> cancelled_;
  // Notified when watched_ or revoked_ changes.
  std::condition_variable watched_changed_;
  bool ending_ = false;
  std::thread watchman_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_ADMISSION_H_
