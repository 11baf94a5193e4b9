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
    : store_(store), order_(order), thread_([this] { Run(); }) {}

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

void Committer::Follow(const Locked& locked, Follower follower) {
  HULLD_CHECK(locked.Holds(order_));
  {
    const std::lock_guard lock(mutex_);
    followers_.push_back(std::move(follower));
  }
  ready_.notify_one();
}

void Committer::FollowNow(Locked& locked, Follower follower) {
  HULLD_CHECK(locked.Holds(order_));
  bool may_ask = false;
  {
    const std::lock_guard lock(mutex_);
    may_ask = store_.is_shared() && is_idle_ && !is_asking_ && !asked_.asked.has_value() &&
              queue_.empty() && followers_.empty();
    followers_.push_back(std::move(follower));
    if (may_ask) is_asking_ = true;
  }
  if (may_ask) {
    locked.Afterwards([this] { AskNow(); });
  } else {
    ready_.notify_one();
  }
}

// Followers that arrive during the query wait for the next one.
void Committer::AskNow() {
  {
    const std::lock_guard lock(mutex_);
    asked_.asked = SteadyClock::now();
    asked_.followers = std::exchange(followers_, {});
  }
  store_.StartFollow();
  {
    const std::lock_guard lock(mutex_);
    is_asking_ = false;
  }
  ready_.notify_one();
}

void Committer::FollowSoon() {
  {
    const std::lock_guard lock(mutex_);
    followers_.push_back([](Locked&, const absl::Status&) {});
  }
  ready_.notify_one();
}

std::optional<SteadyClock::time_point> Committer::caught_up(const Locked& locked) const {
  HULLD_CHECK(locked.Holds(order_));
  return caught_up_;
}

void Committer::NoteCaughtUp(const Locked& locked, SteadyClock::time_point asked) {
  HULLD_CHECK(locked.Holds(order_));
  caught_up_ = asked;
}

void Committer::Run() {
  while (true) {
    Round round = WaitForRound();
    if (round.IsEmpty()) return;
    CommitAndFollow(std::move(round));
  }
}

void Committer::CommitAndFollow(Round round) {
  // Taken before anything is sent, because a commit queries peer changes as well.
  const SteadyClock::time_point asked = round.asked.has_value() ? *round.asked : SteadyClock::now();
  absl::Status status;
  if (!round.batch.empty()) status = Write(round.batch);
  if (!status.ok()) {
    // Refused before the query for peer changes: if the outcome is unknown, the store may contain
    // this very batch at that point.
    Round looking;
    looking.followers = std::exchange(round.followers, {});
    Settle(round, status, absl::OkStatus(), asked);
    if (looking.followers.empty()) return;
    round = std::move(looking);
    status = absl::OkStatus();
  }
  // A commit has already queried the peer changes.
  absl::Status followed;
  if (round.batch.empty()) {
    // A follower needs the outcome of the last batch now, not at the next change.
    if (!store_.is_shared()) followed = RecoverIfFailing();
    if (followed.ok()) followed = store_.Follow();
  }
  Settle(round, status, followed, asked);
}

// Recovers before a query without a commit; a commit reports its own failure.
absl::Status Committer::RecoverIfFailing() {
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
    if (is_asking_) return false;
    return ending_ || asked_.asked.has_value() || !queue_.empty() || !followers_.empty();
  });
  is_idle_ = false;
  if (asked_.asked.has_value()) return std::exchange(asked_, {});
  Round round = {std::exchange(queue_, {}), std::exchange(followers_, {}), {}};
  has_ended_ = round.IsEmpty();
  return round;
}

absl::Status Committer::Write(std::vector<Pending>& batch) {
  std::vector<Change*> changes;
  changes.reserve(batch.size());
  for (Pending& pending : batch) changes.push_back(&pending.change);
  absl::Status status;
  if (Statistics().failing) status = store_.Recover();
  const auto start = std::chrono::steady_clock::now();
  if (status.ok()) status = store_.Commit(changes);
  if (metrics_ != nullptr) {
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    metrics_->commit_seconds.Observe(taken.count());
    metrics_->commit_changes.Observe(static_cast<double>(changes.size()));
  }
  return status;
}

// Returns the peer changes, with the growth of hulls in memory. status: the result of the query;
// after an error the store is not queried again.
OtherChanges Committer::TakeOthers(const absl::Status& status) {
  OtherChanges others = store_.TakeOthers();
  if (!status.ok() || others.revision == 0 || grown_ == nullptr) return others;
  std::vector<HullGrowth> grown;
  {
    Locked locked(order_);
    grown = grown_(locked, others);
  }
  if (grown.empty()) return others;
  std::vector<std::optional<std::vector<Vector>>> growth = store_.LoadGrowth(grown);
  for (size_t i = 0; i < grown.size(); ++i) {
    others.by_id.at(grown[i].after.record.hull_id).growth = std::move(growth[i]);
  }
  return others;
}

// Completes a committed batch; or refuses a failed batch and everything pending. asked: the
// earliest time of the store query.
void Committer::Settle(Round& round, const absl::Status& status, const absl::Status& followed,
                       SteadyClock::time_point asked) {
  std::vector<Pending>& batch = round.batch;
  // Evaluated before superseded changes are removed from the batch.
  const bool was_written = !batch.empty();
  OtherChanges others;
  if (store_.is_shared()) others = TakeOthers(was_written ? status : followed);
  Locked locked(order_);
  if (others.revision != 0) TellOthers(locked, others, batch);
  if (store_.is_shared() && status.ok() && followed.ok()) caught_up_ = asked;
  if (was_written) {
    const std::lock_guard lock(mutex_);
    if (!status.ok() && !statistics_.failing) {
      spdlog::error("changes refused: {}", std::string(status.message()));
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
    if (status.ok() && completed > 0 && completed % kMostPerHold == 0) {
      locked.Unlock();
      locked.Lock();
    }
    pending.done(locked, status, pending.change);
    ++completed;
  }
  for (const Follower& follower : round.followers) follower(locked, followed);
  // Sends the replies here; the changes, which may be large, are destroyed without a lock.
  locked.Unlock();
}

// Refuses the changes superseded by peer servers, in the batch and in the queue, then passes the
// peer changes to the callback.
void Committer::TellOthers(Locked& locked, const OtherChanges& others,
                           std::vector<Pending>& batch) {
  std::vector<Pending> superseded;
  const auto take_from = [&](std::vector<Pending>& pending) {
    const auto first = std::stable_partition(
        pending.begin(), pending.end(),
        [&](const Pending& each) { return !others.by_id.contains(each.change.id()); });
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
  others_(locked, others);
  // Destroys large changes without a lock.
  locked.Afterwards([ended = std::make_shared<std::vector<Pending>>(std::move(superseded))] {});
}

}  // namespace hulld::server
