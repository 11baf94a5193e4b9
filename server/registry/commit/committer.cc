#include "server/registry/commit/committer.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "core/base/check.h"

namespace hulld::server {

Committer::Committer(Store& store, FairMutex& order)
    : store_(store), order_(order), feed_(store.peers()), thread_([this] { Run(); }) {}

void Committer::End() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ready_.notify_all();
  thread_.join();
}

void Committer::Submit(const Locked& locked, Change change, Completion done) {
  HULLD_CHECK(locked.Holds(order_));
  {
    const std::lock_guard lock(mutex_);
    HULLD_CHECK(!has_ended_);
    queue_.push_back({std::move(change), std::move(done)});
  }
  ready_.notify_one();
}

CommitStatistics Committer::Statistics() const {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

void Committer::AddBarrier(Barrier barrier) {
  {
    const std::lock_guard lock(mutex_);
    barriers_.push_back(std::move(barrier));
  }
  ready_.notify_one();
}

void Committer::StartBarrier(Locked& locked, Barrier barrier) {
  HULLD_CHECK(locked.Holds(order_));
  bool may_start = false;
  {
    const std::lock_guard lock(mutex_);
    may_start = feed_ != nullptr && is_idle_ && !is_starting_ && !started_.queried_at.has_value() &&
                queue_.empty() && barriers_.empty();
    barriers_.push_back(std::move(barrier));
    if (may_start) is_starting_ = true;
  }
  if (may_start) {
    locked.Defer([this] { StartFetch(); });
  } else {
    ready_.notify_one();
  }
}

// Barriers that arrive during the query wait for the next one.
void Committer::StartFetch() {
  {
    const std::lock_guard lock(mutex_);
    started_.queried_at = SteadyClock::now();
    started_.barriers = std::exchange(barriers_, {});
  }
  feed_->StartFetch();
  {
    const std::lock_guard lock(mutex_);
    is_starting_ = false;
  }
  ready_.notify_one();
}

void Committer::Run() {
  while (true) {
    Round round = WaitForRound();
    if (round.IsEmpty()) return;
    CommitRound(std::move(round));
  }
}

void Committer::CommitRound(Round round) {
  // Measured before anything is sent, because a commit queries peer changes as well.
  const SteadyClock::time_point queried_at =
      round.queried_at.has_value() ? *round.queried_at : SteadyClock::now();
  absl::Status status;
  if (!round.batch.empty()) status = Write(round.batch);
  if (!status.ok()) {
    // Refused before the query for peer changes: if the outcome is unknown, the store may already
    // contain this batch at that point.
    Round barriers;
    barriers.barriers = std::exchange(round.barriers, {});
    Settle(round, status, absl::OkStatus(), queried_at);
    if (barriers.IsEmpty()) return;
    round = std::move(barriers);
    status = absl::OkStatus();
  }
  // A commit has already queried the peer changes.
  Settle(round, status, round.batch.empty() ? Fetch() : absl::OkStatus(), queried_at);
}

// Fetches the commits of peer servers for a round of barriers. Without peer servers, resolves the
// outcome of a failed batch, which a barrier must not leave to the next change.
absl::Status Committer::Fetch() {
  if (feed_ != nullptr) return feed_->Fetch();
  if (!Statistics().failing) return absl::OkStatus();
  absl::Status status = store_.Recover();
  const std::lock_guard lock(mutex_);
  statistics_.failing = !status.ok();
  return status;
}

// Returns an empty round when the thread must end.
Committer::Round Committer::WaitForRound() {
  std::unique_lock lock(mutex_);
  is_idle_ = true;
  ready_.wait(lock, [this] {
    if (is_starting_) return false;
    return ending_ || started_.queried_at.has_value() || !queue_.empty() || !barriers_.empty();
  });
  is_idle_ = false;
  if (started_.queried_at.has_value()) return std::exchange(started_, {});
  Round round = {std::exchange(queue_, {}), std::exchange(barriers_, {}), {}};
  has_ended_ = round.IsEmpty();
  return round;
}

absl::Status Committer::Write(std::vector<Pending>& batch) {
  std::vector<Change*> changes;
  changes.reserve(batch.size());
  for (Pending& pending : batch) changes.push_back(&pending.change);
  const bool was_failing = Statistics().failing;
  absl::Status status;
  if (was_failing) status = store_.Recover();
  const auto start = std::chrono::steady_clock::now();
  if (status.ok()) status = store_.Commit(changes);
  // The disk may have been full before, for example because of a backup. Deletions succeed once the
  // store has recovered, because that releases its reserve.
  if (absl::IsResourceExhausted(status) && !was_failing &&
      std::ranges::all_of(changes, &Change::deleted)) {
    status = store_.Recover();
    if (status.ok()) status = store_.Commit(changes);
  }
  if (metrics_ != nullptr) {
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    metrics_->commit_seconds.Observe(taken.count());
    metrics_->commit_changes.Observe(static_cast<double>(changes.size()));
  }
  return status;
}

// Returns the peer changes, with the growth of hulls in memory. status: the result of the query;
// after an error the store is not queried again.
PeerChanges Committer::TakePeerChanges(const absl::Status& status) {
  PeerChanges changes = feed_->TakeChanges();
  if (!status.ok() || changes.revision == 0) return changes;
  std::vector<HullGrowth> grown;
  {
    const std::lock_guard lock(order_);
    grown = peers_->GrownHulls(changes);
  }
  if (grown.empty()) return changes;
  std::vector<std::optional<std::vector<Vector>>> growth = feed_->LoadGrowth(grown);
  for (size_t i = 0; i < grown.size(); ++i) {
    changes.by_id.at(grown[i].after.record.hull_id).growth = std::move(growth[i]);
  }
  return changes;
}

// Completes a committed batch; or refuses a failed batch and everything pending. queried_at: the
// earliest time of the store query.
void Committer::Settle(Round& round, const absl::Status& status, const absl::Status& fetched,
                       SteadyClock::time_point queried_at) {
  std::vector<Pending>& batch = round.batch;
  // Evaluated before superseded changes are removed from the batch.
  const bool was_written = !batch.empty();
  PeerChanges changes;
  if (feed_ != nullptr) changes = TakePeerChanges(was_written ? status : fetched);
  Locked locked(order_);
  if (changes.revision != 0) ApplyPeerChanges(locked, changes, batch);
  if (feed_ != nullptr && status.ok() && fetched.ok()) peers_->NoteSynced(queried_at);
  if (was_written) {
    const std::lock_guard lock(mutex_);
    if (!status.ok() && !statistics_.failing) {
      spdlog::error("a batch of changes could not be committed: {}", std::string(status.message()));
    }
    statistics_.failing = !status.ok();
    if (status.ok()) {
      ++statistics_.batches;
      statistics_.changes += batch.size();
    } else {
      ++statistics_.failed_batches;
      std::ranges::move(queue_, std::back_inserter(batch));
      queue_.clear();
    }
  }
  size_t completed = 0;
  for (Pending& pending : batch) {
    if (status.ok() && completed > 0 && completed % kMaxPerHold == 0) locked.Yield();
    pending.done(locked, status, pending.change);
    ++completed;
  }
  for (const Barrier& barrier : round.barriers) barrier(locked, fetched);
  // Sends the replies here; the changes, which may be large, are destroyed without a lock.
  locked.Unlock();
}

// Refuses the changes superseded by peer servers, in the batch and in the queue, then passes the
// peer changes to `peers_`.
void Committer::ApplyPeerChanges(Locked& locked, const PeerChanges& changes,
                                 std::vector<Pending>& batch) {
  std::vector<Pending> superseded;
  const auto take_from = [&](std::vector<Pending>& pending) {
    const auto first = std::stable_partition(
        pending.begin(), pending.end(),
        [&](const Pending& each) { return !changes.by_id.contains(each.change.id()); });
    std::move(first, pending.end(), std::back_inserter(superseded));
    pending.erase(first, pending.end());
  };
  take_from(batch);
  {
    const std::lock_guard lock(mutex_);
    take_from(queue_);
  }
  const absl::Status status = absl::AbortedError("a peer server changed it first");
  for (auto it = superseded.rbegin(); it != superseded.rend(); ++it) {
    it->done(locked, status, it->change);
  }
  peers_->Apply(locked, changes);
  // Destroys large changes without a lock.
  locked.Defer([ended = std::make_shared<std::vector<Pending>>(std::move(superseded))] {});
}

}  // namespace hulld::server
