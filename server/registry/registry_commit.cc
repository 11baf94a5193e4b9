// How changes reach the store: the second half of each change that the registry makes.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "server/contract/status_map.h"
#include "server/registry/registered_hull.h"
#include "server/registry/registry.h"

namespace hulld::server {
namespace {

// Chunks of one hull on their way at once: enough to keep a builder busy through the slowest sync.
constexpr int kMaxInFlight = 64;

bool IsRepeatedOrConditional(const RegisteredHull& hull, const AppendSession& session,
                             const Chunk& chunk) {
  const auto writer = hull.writers.find(session.writer_id);
  const uint64_t head = writer == hull.writers.end() ? 0 : writer->second.head;
  return chunk.if_revision.has_value() || chunk.sequence <= head;
}

}  // namespace

// Queues a change that follows all changes of its hull submitted before.
void Registry::Submit(const HullPointer& hull, Change change, Finish finish) {
  ++hull->in_flight;
  const uint64_t bytes = change.vertices.capacity() * sizeof(Vector);
  cache_.bytes += bytes;
  queue_.push_back({std::move(change), hull, std::move(finish), bytes});
  commit_ready_.notify_one();
}

// Lets whatever waits for the hull go on. Called after each change of `busy`, `in_flight` or
// `pins`.
void Registry::Advance(Locked& locked, const HullPointer& hull) {
  hull->released.notify_all();
  while (hull->quiet() && !hull->exclusive.empty()) {
    const auto next = std::move(hull->exclusive.front());
    hull->exclusive.pop_front();
    next(locked);
  }
  if (hull->busy || hull->pins > 0 || !hull->exclusive.empty() || hull->ending) return;
  if (hull->chunks.empty() || hull->in_flight >= kMaxInFlight) return;
  const PendingChunk& next = hull->chunks.front();
  // What such a chunk finds must be committed.
  if (hull->in_flight > 0 && IsRepeatedOrConditional(*hull, next.session, next.chunk)) return;
  hull->busy = true;
  writers_.Submit([this, hull] { RunNextChunk(hull); });
}

// The committer thread: takes all that waits as one batch, again and again.
void Registry::CommitQueued() {
  Locked locked(mutex_);
  while (true) {
    commit_ready_.wait(locked.lock(), [this] { return ending_ || !queue_.empty(); });
    if (queue_.empty()) return;
    std::vector<PendingCommit> batch = std::move(queue_);
    queue_.clear();
    const absl::Status status = CommitBatch(locked, batch);
    if (!status.ok()) {
      RefuseQueued(locked, batch, status);
    } else {
      ++commits_.batches;
      commits_.changes += batch.size();
      for (PendingCommit& pending : batch) {
        --pending.hull->in_flight;
        cache_.bytes -= pending.charged_bytes;
        pending.finish(locked, absl::OkStatus());
      }
      Evict(locked);
      for (const PendingCommit& pending : batch) Advance(locked, pending.hull);
    }
    locked.Unlock();
    batch.clear();
    locked.Lock();
  }
}

// Entered and left with the mutex held.
absl::Status Registry::CommitBatch(Locked& locked, const std::vector<PendingCommit>& batch) {
  std::vector<const Change*> changes;
  changes.reserve(batch.size());
  for (const PendingCommit& pending : batch) changes.push_back(&pending.change);
  const bool recover = store_failed_;
  locked.Unlock();
  absl::Status status;
  if (recover) status = store_.Recover();
  const auto start = std::chrono::steady_clock::now();
  if (status.ok()) status = store_.Commit(changes);
  if (metrics_ != nullptr) {
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    metrics_->commit_seconds.Observe(taken.count());
    metrics_->commit_changes.Observe(static_cast<double>(changes.size()));
  }
  locked.Lock();
  if (status.ok()) store_failed_ = false;
  return status;
}

// What waits may be built upon what failed, so that all is refused and the hulls go back to their
// last committed state.
void Registry::RefuseQueued(Locked& locked, std::vector<PendingCommit>& batch,
                            const absl::Status& cause) {
  if (!store_failed_) spdlog::error("changes refused: {}", std::string(cause.message()));
  store_failed_ = true;
  ++commits_.failed_batches;
  std::move(queue_.begin(), queue_.end(), std::back_inserter(batch));
  queue_.clear();
  for (PendingCommit& pending : batch) {
    --pending.hull->in_flight;
    cache_.bytes -= pending.charged_bytes;
    Revert(locked, *pending.hull);
  }
  for (PendingCommit& pending : batch) pending.finish(locked, cause);
  for (const PendingCommit& pending : batch) Advance(locked, pending.hull);
}

void Registry::Revert(Locked& locked, RegisteredHull& hull) {
  ++hull.reverts;
  hull.head = hull.committed;
  for (auto& [writer_id, sequences] : hull.writers) sequences.head = sequences.committed;
  if (!hull.busy) {
    locked.Discard(std::move(hull.builder));
    hull.builder_bytes = 0;
    Charge(locked, hull);
  }
}

}  // namespace hulld::server
