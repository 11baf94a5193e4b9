#include "server/registry/committer.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <mutex>
#include <string>
#include <utility>

#include "core/base/check.h"

namespace hulld::server {

Committer::Committer(Store& store, FairMutex& order)
    : store_(store), order_(order), thread_([this] { Run(); }) {}

Committer::~Committer() {
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
    queue_.push_back({std::move(change), std::move(done)});
  }
  ready_.notify_one();
}

CommitStatistics Committer::Statistics() const {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

void Committer::Run() {
  while (true) {
    std::vector<Pending> batch = WaitForBatch();
    if (batch.empty()) return;
    Settle(batch, Write(batch));
  }
}

// Empty: this is to end.
std::vector<Committer::Pending> Committer::WaitForBatch() {
  std::unique_lock lock(mutex_);
  ready_.wait(lock, [this] { return ending_ || !queue_.empty(); });
  return std::exchange(queue_, {});
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

// Completes a batch that the store kept; or, if it refused the batch, that and all that waits.
void Committer::Settle(std::vector<Pending>& batch, const absl::Status& status) {
  Locked locked(order_);
  {
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
  for (const Pending& pending : batch) {
    if (status.ok() && completed > 0 && completed % kMostPerHold == 0) {
      locked.Unlock();
      locked.Lock();
    }
    pending.done(locked, status, pending.change);
    ++completed;
  }
  // Replies go out now; the changes themselves, which may be large, end without a lock.
  locked.Unlock();
}

}  // namespace hulld::server
