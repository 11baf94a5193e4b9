#ifndef HULLD_SERVER_SHARDS_WAITING_CALLS_H_
#define HULLD_SERVER_SHARDS_WAITING_CALLS_H_

#include <absl/status/status.h>

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/process/synchronization.h"
#include "server/shards/shard_types.h"

namespace hulld::server {

class Shards;

// Calls that wait for the store without a thread each. One thread for all of them ends those that
// nobody waits for any more; it sleeps while there are none. Thread-safe.
class WaitingCalls {
 public:
  // One that waits. It is over once it was told or withdrawn; its functions are not called then.
  class Wait {
   public:
    // Calls `done`, unless it is over.
    void Tell(const absl::Status& status);
    // Whether it was not over: `done` is never called then.
    bool Withdraw();

   private:
    friend class WaitingCalls;
    using Done = std::function<void(const absl::Status&)>;

    Wait(WaitingCalls& calls, std::function<bool()> should_stop, Done done)
        : calls_(calls), should_stop_(std::move(should_stop)), done_(std::move(done)) {}
    // Empty: it is over.
    Done Take();
    // Whether it still is to be looked at.
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
  // Requires that all waits are over.
  ~WaitingCalls();

  // `done` is called once, with what Tell is given or, on a thread of this, with CANCELLED once
  // should_stop says so. Cost: some 100 ns.
  std::shared_ptr<Wait> Add(std::function<bool()> should_stop,
                            std::function<void(const absl::Status&)> done);

  // For a call that names these: has the stores asked that hold nothing here that is as fresh as
  // this, and calls `done` as above when all have answered. False, and nothing, where there are
  // none. Cost: as Shards::StartFresh.
  bool AwaitFresh(Shards& shards, std::span<const std::string> ids,
                  const ShardsFreshness& freshness, std::function<bool()> should_stop,
                  std::function<void(const absl::Status&)> done);

  // Those that are not over.
  size_t count() const { return count_.load(std::memory_order_relaxed); }

 private:
  void Run();

  std::atomic<size_t> count_ = 0;
  Mutex mutex_;
  // The rest is guarded by mutex_.
  ConditionVariable changed_;
  // Those of the last poll, and the ones that were not over then.
  std::vector<std::shared_ptr<Wait>> waits_;
  bool ending_ = false;
  Thread thread_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_SHARDS_WAITING_CALLS_H_
