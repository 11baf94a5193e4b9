#ifndef HULLD_SERVER_REGISTRY_COMMIT_COMMITTER_H_
#define HULLD_SERVER_REGISTRY_COMMIT_COMMITTER_H_

#include <absl/status/status.h>

#include <cstddef>
#include <cstdint>
#include <functional>
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
  // True if the last batch failed.
  bool failing = false;
};

// Commits changes to the store in the order of submission. One thread repeatedly takes all pending
// changes as one batch, which the store commits or refuses as a whole (group commit).
//
// A change may build on earlier changes that are not committed yet. A refused batch therefore
// refuses everything submitted so far, and the submitters undo it. The store recovers before the
// next batch; at once if a batch of deletions finds a full disk.
//
// Two locks are used. `order` belongs to the submitters. They hold it while they submit, so the
// queue has the order of their records. The completions of a refused batch run without releasing
// it, which makes a refusal safe: between the emptying of the queue and the last completion, no
// change that builds on a refused one can be submitted. The completions of a committed batch
// release it after every kMaxPerHold completions: each completion leaves a consistent state, and a
// submission in between is equivalent to one during the commit. The queue has its own mutex, so
// that the committer's thread takes the next batch without waiting for the records. That mutex is
// acquired after `order`, and no callback runs under it. No lock is held during store calls.
class Committer {
 public:
  // Receives the outcome of a change, OK or the reason for its refusal, and the change with the
  // revisions that the store assigned. Called exactly once, on the committer's thread, with `order`
  // held, in the order of submission. Nothing is submitted between the refusals of a batch. May
  // submit the next change.
  using Completion = std::function<void(Locked& order, const absl::Status&, Change&)>;

  // Returns true if a change was refused because a peer server changed the same ID first (shared
  // store). The change is based on a stale state; its submitter retries it.
  static bool IsSuperseded(const absl::Status& status) { return absl::IsAborted(status); }
  // Called with `order` held, once everything submitted before the barrier is committed or refused,
  // and all changes that peer servers committed before it are applied. Receives the error if these
  // could not be queried.
  using Barrier = std::function<void(Locked& order, const absl::Status&)>;

  // Receives the changes of peer servers. All functions require `order` and run on the committer's
  // thread.
  class Peers {
   public:
    virtual ~Peers() = default;
    // Returns the hulls that only grew and whose growth is to be fetched (PeerChange::growth).
    virtual std::vector<HullGrowth> GrownHulls(const PeerChanges& changes) const = 0;
    // Applies the changes. Called after the superseded local changes were refused, latest first,
    // and before the committed changes of the same batch complete, which have later revisions. No
    // change of these IDs is in flight.
    virtual void Apply(Locked& order, const PeerChanges& changes) = 0;
    // Records that all commits of peer servers before `queried_at` are applied: a query for them
    // was sent at that time, and has been answered.
    virtual void NoteSynced(SteadyClock::time_point queried_at) = 0;
  };

  // Maximum number of completions of committed changes until `order` is released; each takes about
  // a microsecond.
  static constexpr size_t kMaxPerHold = 128;

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

  // Must be called before the first change if the store has a PeerFeed.
  void SetPeers(Peers& peers) { peers_ = &peers; }
  // Queues a barrier. Acquires only the lock of the queue. Cost: with peer servers, one store
  // query, shared by all waiting barriers.
  void AddBarrier(Barrier barrier);
  // Like AddBarrier, for a blocking thread: if the committer is idle, the query is sent on this
  // thread when `order` is released, without waiting for the committer's thread to wake up.
  void StartBarrier(Locked& locked, Barrier barrier);

  CommitStatistics Statistics() const;
  // Sets the metrics of batches. Call before the first change; `metrics` must outlive this.
  void SetMetrics(StoreMetrics& metrics) { metrics_ = &metrics; }

 private:
  struct Pending {
    Change change;
    Completion done;
  };

  // Work of a round. Each member may be empty; all are empty when the thread must end.
  struct Round {
    std::vector<Pending> batch;
    std::vector<Barrier> barriers;
    // Time of a query already sent for the barriers, which are then the only work of the round.
    std::optional<SteadyClock::time_point> queried_at;

    bool IsEmpty() const { return batch.empty() && barriers.empty(); }
  };

  void Run();
  Round WaitForRound();
  void StartFetch();
  void CommitRound(Round round);
  absl::Status Fetch();
  absl::Status Write(std::vector<Pending>& batch);
  PeerChanges TakePeerChanges(const absl::Status& status);
  void Settle(Round& round, const absl::Status& status, const absl::Status& fetched,
              SteadyClock::time_point queried_at);
  void ApplyPeerChanges(Locked& locked, const PeerChanges& changes, std::vector<Pending>& batch);

  Store& store_;
  FairMutex& order_;
  StoreMetrics* metrics_ = nullptr;
  // Null without peer servers.
  PeerFeed* const feed_;
  Peers* peers_ = nullptr;

  mutable Mutex mutex_;
  // mutex_ guards the members below.
  ConditionVariable ready_;
  std::vector<Pending> queue_;
  std::vector<Barrier> barriers_;
  CommitStatistics statistics_;
  // True while the committer's thread waits for work.
  bool is_idle_ = false;
  // True if StartFetch is due or running, with exclusive use of the store.
  bool is_starting_ = false;
  // Result of StartFetch.
  Round started_;
  bool ending_ = false;
  // True if the thread accepts no more work.
  bool has_ended_ = false;
  Thread thread_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_COMMIT_COMMITTER_H_
