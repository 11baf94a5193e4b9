#ifndef HULLD_SERVER_REGISTRY_MEMORY_SERVED_HULL_H_
#define HULLD_SERVER_REGISTRY_MEMORY_SERVED_HULL_H_

#include <absl/status/status.h>

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <utility>

#include "core/hull/hull.h"
#include "core/numeric/vector.h"
#include "core/query/box_tree.h"
#include "core/query/placed/query_hull.h"
#include "server/process/synchronization.h"
#include "server/registry/memory/memory_budget.h"
#include "server/store/records.h"

namespace hulld::server {

// The canonical snapshot of a version of a hull and its query structure for queries that name
// vertices. Built by the first reader that needs it, then shared. Thread-safe.
class CanonicalHull {
 public:
  // part: memory part to which it is charged.
  explicit CanonicalHull(std::shared_ptr<MemoryPart> part) : part_(std::move(part)) {}
  // Wraps a hull that is already built; not charged.
  explicit CanonicalHull(Hull hull);

  // Null until built. Cost: O(1).
  const Hull* hull() const { return is_made() ? hull_.get() : nullptr; }

  // Builds the snapshot from a version of the hull; waits if another thread does. DATA_LOSS naming
  // the hull: the version's points contradict `record`. CANCELLED: should_stop, which may be empty,
  // returned true; the next call retries. Cost: building the hull and its snapshot.
  absl::Status Make(const QueryHull& version, const HullRecord& record,
                    const std::function<bool()>& should_stop);

  // Builds the query structure if needed; waits if another thread does. Requires hull() != nullptr.
  // CANCELLED: as for Make. Cost: QueryHull::Prepare.
  absl::Status MakeQueryHull(const std::function<bool()>& should_stop);
  // Returns the query structure, built by the first call. Requires hull() != nullptr.
  const QueryHull& query_hull();
  // True if query_hull() returns without building.
  bool has_query_hull() const { return query_hull_bytes_.load(std::memory_order_acquire) > 0; }

  const std::shared_ptr<MemoryPart>& part() const { return part_; }
  // Bytes held.
  size_t MemoryBytes() const {
    return hull_bytes_.load(std::memory_order_relaxed) +
           query_hull_bytes_.load(std::memory_order_relaxed);
  }

 private:
  // Runs `make` unless is_done() returns true, on one thread at a time.
  absl::Status MakeOnce(const std::function<bool()>& should_stop,
                        const std::function<bool()>& is_done,
                        const std::function<absl::Status()>& make);
  bool is_made() const { return hull_bytes_.load(std::memory_order_acquire) > 0; }
  // Requires: is_made() is false, and no other thread builds it (not checked; making_ ensures it).
  void Keep(Hull hull);
  void Count() const;

  const std::shared_ptr<MemoryPart> part_;
  Mutex mutex_;
  ConditionVariable changed_;
  // True while a thread builds the snapshot or the query structure. Guarded by the mutex.
  bool making_ = false;
  // Written once, before hull_bytes_ becomes positive.
  std::unique_ptr<const Hull> hull_;
  // Likewise before query_hull_bytes_ becomes positive.
  std::unique_ptr<const QueryHull> query_hull_;
  // Positive after each is built.
  std::atomic<size_t> hull_bytes_ = 0;
  std::atomic<size_t> query_hull_bytes_ = 0;
};

// Shared state of the readers of a version of a hull. Immutable except for the canonical
// snapshot, which the first request that needs it builds. Thread-safe.
class ServedHull {
 public:
  // box: the bounding box; empty for the empty hull. canonical: of the same version, shared by all
  // served forms of that version.
  ServedHull(std::shared_ptr<const QueryHull> version, const Box& box,
             std::shared_ptr<CanonicalHull> canonical);

  // Query structure for queries that name no vertices: relation, tolerance, and clearance. It lives
  // as long as this object. Later calls may return a different one.
  const QueryHull& query_hull() const {
    return canonical_->has_query_hull() ? canonical_->query_hull() : *version_;
  }
  bool empty() const { return box_.IsEmpty(); }
  const Box& box() const { return box_; }
  const Vector& low() const { return box_.low; }
  const Vector& high() const { return box_.high; }

  // The canonical snapshot; null until built.
  const Hull* canonical() const { return canonical_->hull(); }
  // Builds the canonical snapshot if needed (CanonicalHull::Make). Not for gRPC threads.
  absl::Status MakeCanonical(const HullRecord& record,
                             const std::function<bool()>& should_stop) const {
    return canonical_->Make(*version_, record, should_stop);
  }
  // Query structure for all queries, built by the first call. Requires canonical() != nullptr.
  const QueryHull& canonical_query_hull() const { return canonical_->query_hull(); }
  // Builds it if needed (CanonicalHull::MakeQueryHull). Not for gRPC threads.
  absl::Status MakeCanonicalQueryHull(const std::function<bool()>& should_stop) const {
    return canonical_->MakeQueryHull(should_stop);
  }
  bool has_canonical_query_hull() const { return canonical_->has_query_hull(); }

 private:
  const std::shared_ptr<const QueryHull> version_;
  const Box box_;
  const std::shared_ptr<CanonicalHull> canonical_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_MEMORY_SERVED_HULL_H_
