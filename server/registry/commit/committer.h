#ifndef HULLD_SERVER_REGISTRY_COMMIT_COMMITTER_H_
#define HULLD_SERVER_REGISTRY_COMMIT_COMMITTER_H_

#include <absl/status/status.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "server/process/metrics.h"
#include "server/process/synchronization.h"
#include "server/registry/commit/commit_hold.h"
#include "server/registry/memory/locked.h"
#include "server/store/store.h"

namespace hulld::server {

// How changes reached the store so far.
struct CommitStatistics {
  uint64_t batches = 0;
  uint64_t changes = 0;
  uint64_t failed_batches = 0;
  // The last batch failed.
  bool failing = false;
  // Times that were held still for readers.
  uint64_t holds = 0;
};

// Brings changes to the store, in the order in which they are submitted. One thread takes all that
// waits as one batch, which the store keeps or refuses as a whole (group commit), again and again.
//
// A change may build on those submitted before it, although they are not committed yet. So when
// the store refuses a batch, everything that was submitted until then is refused with it, and the
// submitters undo it. The store is made to recover before the next batch.
//
// Two locks. `order` belongs to the submitters. They hold it while they submit, so the order of the
// queue is that of their records. The completions of a refused batch run under it in one go, which
// makes a refusal safe: from the moment when the queue is emptied to the last completion, no change
// that builds on a refused one can be submitted. Those of a batch that was kept let others pass
// after every kMostPerHold: each change stands for itself, and what is submitted in between follows
// as it does while the store works. The queue has a mutex of its own, so that the
// committer's thread takes the next batch without waiting for the records. That mutex is taken
// after `order`, and nothing is called under it. No lock is held while the store works.
class Committer {
 public:
  // Told whether a change is committed: OK, or why it was refused; and the change, with the
  // revisions that the store gave it if it is. Called once, on the committer's
  // thread, with `order` held: completions come in the order of submission, and no submission comes
  // between refusals of one batch. May submit the next change.
  using Completion = std::function<void(Locked& order, const absl::Status&, Change&)>;

  // Whether a change is refused because another server changed the same ID before it (a store that
  // is shared): what it was made of is not the last any more, and its submitter makes it anew.
  static bool IsSuperseded(const absl::Status& status) { return absl::IsAborted(status); }
  // Told what other servers committed, with `order` held: after the changes that this supersedes
  // were refused, the latest first, and before those of the same batch that were kept complete, as
  // they follow it. Nothing of these IDs is in flight then.
  using Others = std::function<void(Locked& order, const OtherChanges& others)>;
  // Asked, with `order` held, which of the hulls that others changed only grew and are wanted as
  // what they grew by: their points are then among what Others is told, if the store can give them.
  using Grown = std::function<std::vector<HullGrowth>(Locked& order, const OtherChanges& others)>;
  // Told, with `order` held, once Others was told of all that other servers had committed when it
  // was submitted, or why that could not be found out.
  using Follower = std::function<void(Locked& order, const absl::Status&)>;

  // Completions of kept changes within one hold of `order`; each takes about a microsecond.
  static constexpr size_t kMostPerHold = 128;

  // Both must outlive this.
  Committer(Store& store, FairMutex& order);
  Committer(const Committer&) = delete;
  Committer& operator=(const Committer&) = delete;
  ~Committer() { End(); }

  // Commits what is queued, and what is submitted as that completes, then ends its thread: nobody
  // is told anything afterwards, and Submit must not be called.
  void End();

  // Queues a change that follows all changes submitted before. Requires that `locked` holds
  // `order`, and that the thread has not ended. Cost: O(1).
  void Submit(const Locked& locked, Change change, Completion done);

  // For a store that is shared. Before the first change and the first follower.
  // grown: may be empty.
  void SetOthers(Others others, Grown grown = nullptr) {
    others_ = std::move(others);
    grown_ = std::move(grown);
  }
  // Requires that `locked` holds `order`. Cost: a question to the store, one for all that wait.
  void Follow(const Locked& locked, Follower follower);
  // The same for a thread that waits: where nothing else is under way, the question is sent on this
  // thread as soon as `order` is released, and not once the committer's thread has woken up.
  void FollowNow(Locked& locked, Follower follower);
  // Holds the store still from when Others was told of all that other servers had committed; what
  // was submitted before is committed or refused by then, and what is submitted later waits until
  // the hold ends. Requires that `locked` holds `order`. Cost: two round trips to a store that is
  // shared, for all that wait; what needs this thread waits meanwhile, at most
  // CommitHold::kLongestOfSeveral.
  void Hold(const Locked& locked, std::shared_ptr<CommitHold> hold);
  // Others is to be told soon, if there is anything to tell. Takes no lock but the queue's.
  void FollowSoon();
  // Others was told of all that other servers had committed by this time, at least: when the store
  // was sent the last question that it answered. None: it was not asked yet. Requires that `locked`
  // holds `order`.
  std::optional<SteadyClock::time_point> caught_up(const Locked& locked) const;
  // For a caller that asked the store itself, at this time, and told Others. Requires the same.
  void NoteCaughtUp(const Locked& locked, SteadyClock::time_point asked);

  CommitStatistics Statistics() const;
  // Where each batch is timed and counted; set before the first change, and outlives this.
  void SetMetrics(StoreMetrics& metrics) { metrics_ = &metrics; }

 private:
  struct Pending {
    Change change;
    Completion done;
  };

  // What is done at a time: any may be empty, and all are at the end.
  struct Round {
    std::vector<Pending> batch;
    std::vector<Follower> followers;
    std::vector<std::shared_ptr<CommitHold>> holds;
    // Set: the store was asked for the followers at this time, and nothing else is to be done.
    std::optional<SteadyClock::time_point> asked;

    bool IsEmpty() const { return batch.empty() && followers.empty() && holds.empty(); }
  };

  void Run();
  Round WaitForRound();
  void AskNow();
  void CommitAndFollow(Round round);
  void HoldFor(std::vector<std::shared_ptr<CommitHold>> holds);
  absl::Status RecoverIfFailing();
  absl::Status Write(std::vector<Pending>& batch);
  OtherChanges TakeOthers(const absl::Status& status);
  void Settle(Round& round, const absl::Status& status, const absl::Status& followed,
              SteadyClock::time_point asked);
  void TellOthers(Locked& locked, const OtherChanges& others, std::vector<Pending>& batch);

  Store& store_;
  FairMutex& order_;
  StoreMetrics* metrics_ = nullptr;
  Others others_;
  Grown grown_;
  // Guarded by order_.
  std::optional<SteadyClock::time_point> caught_up_;

  mutable Mutex mutex_;
  // The rest is guarded by mutex_.
  ConditionVariable ready_;
  std::vector<Pending> queue_;
  std::vector<Follower> followers_;
  std::vector<std::shared_ptr<CommitHold>> holds_;
  CommitStatistics statistics_;
  // The committer's thread waits for something to do.
  bool is_idle_ = false;
  // AskNow is due, or under way: until it is done, the store is its own.
  bool is_asking_ = false;
  // What AskNow left.
  Round asked_;
  bool ending_ = false;
  // The thread takes nothing any more.
  bool has_ended_ = false;
  Thread thread_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_COMMIT_COMMITTER_H_
