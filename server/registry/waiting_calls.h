#ifndef HULLD_SERVER_REGISTRY_WAITING_CALLS_H_
#define HULLD_SERVER_REGISTRY_WAITING_CALLS_H_

#include <absl/status/status.h>

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "server/process/synchronization.h"
#include "server/registry/registry.h"

namespace hulld::server {

// Calls that wait for the store without occupying a thread each. A single thread cancels abandoned
// calls; it sleeps while no call waits. Thread-safe.
class WaitingCalls {
 public:
  // A waiting call. It is over after Finish; its functions are not called after that.
  class Wait {
   public:
    // Calls `done` unless the wait is over.
    void Finish(const absl::Status& status);

   private:
    friend class WaitingCalls;
    using Done = std::function<void(const absl::Status&)>;

    Wait(WaitingCalls& calls, std::function<bool()> should_stop, Done done)
        : calls_(calls), should_stop_(std::move(should_stop)), done_(std::move(done)) {}
    // Ends the wait if should_stop returns true. Returns true if the next poll must check it again.
    bool EndIfStopped();

    WaitingCalls& calls_;
    Mutex mutex_;
    // Guarded by mutex_.
    std::function<bool()> should_stop_;
    Done done_;
  };

  WaitingCalls() : thread_([this] { Run(); }) {}
  WaitingCalls(const WaitingCalls&) = delete;
  WaitingCalls& operator=(const WaitingCalls&) = delete;
  // Requires: all waits are over.
  ~WaitingCalls();

  // Calls `done` exactly once: with the status passed to Finish, or with CANCELLED on the polling
  // thread after should_stop returns true. Cost: about 100 ns.
  std::shared_ptr<Wait> Add(std::function<bool()> should_stop,
                            std::function<void(const absl::Status&)> done);

  // Like Add, but calls `done` once the registry satisfies `freshness`. Returns false and does
  // nothing if it already does. Cost: see PeerSync::StartFetch.
  bool AwaitFresh(Registry& registry, const Freshness& freshness, std::function<bool()> should_stop,
                  std::function<void(const absl::Status&)> done);

  // Number of waits that are not over.
  size_t count() const { return count_.load(std::memory_order_relaxed); }

 private:
  void Run();

  std::atomic<size_t> count_ = 0;
  Mutex mutex_;
  // mutex_ guards the members below.
  ConditionVariable changed_;
  // Waits that were not over at the last poll, and newer ones.
  std::vector<std::shared_ptr<Wait>> waits_;
  bool ending_ = false;
  Thread thread_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_WAITING_CALLS_H_
