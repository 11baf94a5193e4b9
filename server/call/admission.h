#ifndef HULLD_SERVER_CALL_ADMISSION_H_
#define HULLD_SERVER_CALL_ADMISSION_H_

#include <absl/status/statusor.h>
#include <grpc/grpc.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <unordered_map>
#include <unordered_set>

#include "server/access/caller.h"
#include "server/call/call_lifetime.h"
#include "server/call/message_bytes.h"
#include "server/contract/rpc.h"
#include "server/network/connection_table.h"
#include "server/process/fair_queue.h"
#include "server/process/metrics.h"
#include "server/settings/config.h"

namespace hulld::server {

class Guard;

// Returns true if a call waits for the writer pool; false if it waits for the reader and answer
// pools.
bool UsesWriters(Rpc rpc);

// Admits calls within the limits until the server drains, counts running calls, ends calls with a
// revoked token, and cancels overdue calls that neither end nor poll, for example because the
// client stopped reading.
//
// Each client has a share of the calls, streams, and batches. Part of the total, and of each
// client's share, is reserved for single calls, so that long calls never crowd them out. Calls
// without a token have a separate share, so that they never crowd out calls with a token; they do
// not protect their connection from eviction. The first health watch of a connection counts toward
// no share, because clients open one automatically.
class Admission {
 public:
  // An admitted call. The call ends when its ticket is destroyed.
  class Ticket {
   public:
    Ticket(Ticket&& other) noexcept;
    Ticket& operator=(Ticket&&) = delete;
    ~Ticket();

    // Client and connection charged for the call in fair scheduling of the threads.
    ClientId client() const;
    // True if the client had more than kBusyCalls running calls when this one was admitted.
    bool is_client_busy() const { return is_client_busy_; }

   private:
    friend class Admission;
    enum class Share : uint8_t { kCalls, kAnonymous, kFree };
    struct Client {
      uint64_t number = 0;
      // All running calls.
      uint64_t running = 0;
      // Running calls by share: --max-calls-per-client, and the client's part of
      // --max-anonymous-calls.
      uint64_t calls = 0;
      uint64_t anonymous = 0;
      uint64_t batches = 0;
      uint64_t streams = 0;
    };
    // Nodes of an unordered_map have stable addresses.
    using Clients = std::unordered_map<std::string, Client>;
    // A call to end when its token is revoked or when it is overdue.
    struct Watched {
      // The owner of the token; without a token, Caller().
      Caller caller;
      CallLifetime* lifetime;
      std::function<void()> on_revoked;
      // May be null; otherwise owns a reference.
      grpc_call* call;
      // Time at which the call is cancelled.
      std::chrono::steady_clock::time_point end;
    };
    Ticket(Admission* admission, Rpc rpc);
    // For the move constructor only: a copy would end the call twice.
    Ticket(const Ticket&) = default;

    Admission* admission_;
    Rpc rpc_;
    CallKind kind_;
    Clients::value_type* client_ = nullptr;
    Share share_ = Share::kCalls;
    bool is_client_busy_ = false;
    // The caller's connection in the ConnectionTable; 0 if unknown.
    uint64_t connection_ = 0;
    // Set for calls with a token, and for downloads and batches while --max-request-time limits
    // them.
    std::optional<std::list<Watched>::iterator> watched_;
  };

  // connections: records connections with calls. guard: authenticates callers; without one, they
  // have all permissions. All must outlive this object.
  Admission(const Limits& limits, Metrics& metrics, ConnectionTable& connections,
            const Guard* guard = nullptr);
  Admission(const Admission&) = delete;
  Admission& operator=(const Admission&) = delete;
  // Requires that no call is running.
  ~Admission();

  // A client with more running calls than this is busy: its calls are not answered on arrival, but
  // take turns in the pools, by client and by connection.
  static constexpr uint64_t kBusyCalls = 16;

  const Limits& limits() const { return limits_; }
  const Guard* guard() const { return guard_; }
  Metrics& metrics() { return metrics_; }

  // Memory of the admitted requests.
  RequestMemory& request_memory() { return request_memory_; }

  // Sets the function that returns the length of the queue that a call would join;
  // --max-waiting-calls limits it. Requires: no call has arrived yet.
  void SetBacklog(std::function<size_t(Rpc)> backlog) { backlog_ = std::move(backlog); }

  // Properties of a call that determine its admission.
  struct Arrival {
    Rpc rpc;
    // Client charged for the call.
    std::string client;
    // Address of the peer; unset for a unix socket.
    std::optional<PeerAddress> peer = {};
    // gRPC's object for the call.
    grpc_call* call = nullptr;
    // Owner of the call's token, if any. In that case, `lifetime` ends when the token is revoked
    // and must outlive the ticket. on_revoked, if set, is then called on any thread, possibly after
    // the ticket is destroyed, to end a call that waits without polling.
    Caller caller = {};
    CallLifetime* lifetime = nullptr;
    std::function<void()> on_revoked = {};
  };

  // Admits a call. UNAVAILABLE: the server is draining. RESOURCE_EXHAUSTED, with a retry delay: the
  // named limit is reached.
  absl::StatusOr<Ticket> Admit(const Arrival& arrival);

  // Ends every call whose token the guard no longer knows, with UNAUTHENTICATED. Returns the number
  // of such calls. A call that does not end by itself within two seconds, for example because its
  // client does not read, is cancelled without error details.
  size_t EndRevoked();

  void BeginDrain();

  // Blocks until no call is running. Returns false if calls are still running at `deadline`.
  bool WaitIdle(std::chrono::steady_clock::time_point deadline);

  // Number of running calls.
  size_t running() const { return running_.load(std::memory_order_relaxed); }

 private:
  // Require the mutex (not checked, because a std::mutex does not record its owner).
  absl::Status CheckRoom(Rpc rpc, const Ticket::Client& client);
  absl::Status CheckAnonymousRoom(const Ticket::Client& client) const;
  // Returns the share of a call, given its connection.
  Ticket::Share ShareOf(const Arrival& arrival, uint64_t connection) const;
  // Adds a call to the counts or, with `by` = -1 (modulo 2^64), removes it.
  void Count(const Ticket& ticket, uint64_t by);
  void Watch(const Arrival& arrival, Ticket* ticket);

  void Leave(Ticket& ticket);
  // Body of the watchdog thread.
  void CancelOverdue();

  static constexpr auto kNever = std::chrono::steady_clock::time_point::max();

  const Limits limits_;
  Metrics& metrics_;
  ConnectionTable& connections_;
  const Guard* const guard_;
  RequestMemory request_memory_;
  std::function<size_t(Rpc)> backlog_;

  std::mutex mutex_;
  // The mutex guards the members below, and changes of `running_`.
  std::condition_variable idle_;
  bool draining_ = false;
  std::atomic<size_t> running_ = 0;
  size_t batches_ = 0;
  // Running calls of these kinds.
  size_t single_calls_ = 0;
  size_t anonymous_ = 0;
  // Running calls that count toward --max-calls.
  size_t calls_ = 0;
  // Connections with a health watch that counts toward no share.
  std::unordered_set<uint64_t> watching_health_;
  // Contains only clients with running calls.
  Ticket::Clients clients_;
  uint64_t last_client_ = 0;
  std::list<Ticket::Watched> watched_;
  // Time of the watchdog's next check, unless notified earlier.
  std::chrono::steady_clock::time_point next_check_ = kNever;
  std::condition_variable watched_changed_;
  bool ending_ = false;
  std::thread watchdog_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_ADMISSION_H_
