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
#include "server/registry/memory/locked.h"
#include "server/store/store.h"

namespace hulld::server {

// Statistics of commits so far.
struct CommitStatistics {
  uint64_t batches = 0;
  uint64_t changes = 0;
  uint64_t failed_batches = 0;
  // The last batch failed.
  bool failing = false;
};

// Commits changes to the store in the order of submission. One thread repeatedly takes all pending
// changes as one batch, which the store commits or refuses as a whole (group commit).
//
// A change may build on earlier changes that are not committed yet. A refused batch therefore
// refuses everything submitted so far, and the submitters undo it. The store recovers before the
// next batch.
//
// Two locks. `order` belongs to the submitters. They hold it while they submit, so the queue has
// the order of their records. The completions of a refused batch run within one hold of it, which
// makes a refusal safe: between the emptying of the queue and the last completion, no change that
// builds on a refused one can be submitted. The completions of a committed batch release it after
// every kMostPerHold: each change stands alone, and later submissions follow as they do during a
// commit. The queue has its own mutex, so that the committer's thread takes the next batch without
// waiting for the records. That mutex is taken after `order`, and no callback runs under it. No
// lock is held during store calls.
class Committer {
 public:
  // Completion of a change: OK if it is committed, else the reason for the refusal; and the change,
  // with the revisions that the store assigned. Called exactly once, on the committer's thread,
  // with `order` held, in the order of submission. No submission occurs between the refusals of one
  // batch. May submit the next change.
  using Completion = std::function<void(Locked& order, const absl::Status&, Change&)>;

  // True if a change is refused because a peer server changed the same ID first (shared store). Its
  // base is stale; the submitter retries it.
  static bool IsSuperseded(const absl::Status& status) { return absl::IsAborted(status); }
  // Receives the changes of peer servers, with `order` held: after the superseded changes were
  // refused, latest first, and before the committed changes of the same batch, which follow them,
  // complete. No change of these IDs is in flight then.
  using Others = std::function<void(Locked& order, const OtherChanges& others)>;
  // Returns, with `order` held, the hulls changed by peer servers that only grew and are wanted as
  // increments. OtherChanges then includes their points, if available.
  using Grown = std::function<std::vector<HullGrowth>(Locked& order, const OtherChanges& others)>;
  // Called, with `order` held, after the callback received everything that peer servers had
  // committed when the follower was submitted, or with the error of the query.
  using Follower = std::function<void(Locked& order, const absl::Status&)>;

  // Completions of committed changes within one hold of `order`; each takes about a microsecond.
  static constexpr size_t kMostPerHold = 128;

  // Both must outlive this.
  Committer(Store& store, FairMutex& order);
  Committer(const Committer&) = delete;
  Committer& operator=(const Committer&) = delete;
  ~Committer() { End(); }

  // Commits the queue and everything submitted by its completions, then ends the thread. No
  // callback runs afterwards, and Submit must not be called.
  void End();

  // Queues a change that follows all earlier ones. Requires: `locked` holds `order`, and the thread
  // has not ended. Cost: O(1).
  void Submit(const Locked& locked, Change change, Completion done);

  // Sets the callbacks for a shared store. Call before the first change and the first follower.
  // grown: may be empty.
  void SetOthers(Others others, Grown grown = nullptr) {
    others_ = std::move(others);
    grown_ = std::move(grown);
  }
  // Queues a follower. Requires that `locked` holds `order`. Cost: one store query, shared by all
  // waiting followers.
  void Follow(const Locked& locked, Follower follower);
  // As Follow for a blocking thread: if the committer is idle, the query is sent on this thread
  // when `order` is released, without waiting for the committer's thread to wake up.
  void FollowNow(Locked& locked, Follower follower);
  // Schedules a query for peer changes without a follower. Takes only the queue's lock.
  void FollowSoon();
  // Time up to which Others has received all commits of peer servers: when the last answered query
  // was sent. nullopt before the first one. Requires that `locked` holds `order`.
  std::optional<SteadyClock::time_point> caught_up(const Locked& locked) const;
  // Records a query that the caller sent itself at this time and reported. Requires the
  // same.
  void NoteCaughtUp(const Locked& locked, SteadyClock::time_point asked);

  CommitStatistics Statistics() const;
  // Sets the metrics of batches. Call before the first change; `metrics` must outlive this.
  void SetMetrics(StoreMetrics& metrics) { metrics_ = &metrics; }

 private:
  struct Pending {
    Change change;
    Completion done;
  };

  // Work of a round: each member may be empty; all are empty at the end.
  struct Round {
    std::vector<Pending> batch;
    std::vector<Follower> followers;
    // Time of a query already sent for the followers, which is then the only work of the round.
    std::optional<SteadyClock::time_point> asked;

    bool IsEmpty() const { return batch.empty() && followers.empty(); }
  };

  void Run();
  Round WaitForRound();
  void AskNow();
  void CommitAndFollow(Round round);
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
  // mutex_ guards the members below.
  ConditionVariable ready_;
  std::vector<Pending> queue_;
  std::vector<Follower> followers_;
  CommitStatistics statistics_;
  // The committer's thread waits for work.
  bool is_idle_ = false;
  // AskNow is due or running, with exclusive use of the store.
  bool is_asking_ = false;
  // Result of AskNow.
  Round asked_;
  bool ending_ = false;
  // The thread takes no more work.
  bool has_ended_ = false;
  Thread thread_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_COMMIT_COMMITTER_H_
