#ifndef HULLD_SERVER_REGISTRY_MEMORY_SERVED_HULL_H_
#define HULLD_SERVER_REGISTRY_MEMORY_SERVED_HULL_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "core/hull/hull.h"
#include "core/numeric/vector.h"
#include "core/query/placed/query_hull.h"
#include "server/process/synchronization.h"
#include "server/registry/memory/memory_budget.h"
#include "server/store/hull_record.h"

namespace hulld::server {

// The canonical snapshot of one version of a hull and what queries that name its vertices need of
// it: made by the first reader that needs it, and shared with those after it. Thread-safe.
class CanonicalHull {
 public:
  // part: where it counts what it holds.
  explicit CanonicalHull(std::shared_ptr<MemoryPart> part) : part_(std::move(part)) {}
  // One that is made already, and not counted.
  explicit CanonicalHull(Hull hull);

  // Null until it is made. Cost: O(1).
  const Hull* hull() const { return is_made() ? &*hull_ : nullptr; }

  // Makes it of a version of the hull; waits while another thread does. DATA_LOSS naming the hull:
  // the version's points do not make what `record` says. CANCELLED: should_stop, which may be
  // empty, said so; the next call tries again. Cost: that of building the hull and of its snapshot.
  absl::Status Make(const QueryHull& version, const HullRecord& record,
                    const std::function<bool()>& should_stop);

  // What queries need of it. The first call makes it. Requires hull() != nullptr.
  const QueryHull& query_hull();
  // Whether query_hull() would only return.
  bool has_query_hull() const { return query_hull_bytes_.load(std::memory_order_acquire) > 0; }

  const std::shared_ptr<MemoryPart>& part() const { return part_; }
  // What it holds by now. Bytes.
  size_t MemoryBytes() const {
    return hull_bytes_.load(std::memory_order_relaxed) +
           query_hull_bytes_.load(std::memory_order_relaxed);
  }

 private:
  bool is_made() const { return hull_bytes_.load(std::memory_order_acquire) > 0; }
  // Requires that is_made() is false, and that no other thread makes it (unchecked: that is what
  // making_ ensures).
  void Keep(Hull hull);
  void Count() const;

  const std::shared_ptr<MemoryPart> part_;
  Mutex mutex_;
  ConditionVariable changed_;
  // Guarded by the mutex: a thread makes it.
  bool making_ = false;
  // Written once, before hull_bytes_ says so.
  std::optional<Hull> hull_;
  std::once_flag query_hull_once_;
  std::optional<QueryHull> query_hull_;
  // Above 0 once they are made.
  std::atomic<size_t> hull_bytes_ = 0;
  std::atomic<size_t> query_hull_bytes_ = 0;
};

// What readers of one version of a hull share. Immutable but for the canonical snapshot, which is
// made when the first request needs it. Thread-safe.
class ServedHull {
 public:
  // low, high: the corners of its bounding box; low exceeds high for the empty hull. canonical: of
  // the same version of the hull, shared with whatever else is served of that.
  ServedHull(std::shared_ptr<const QueryHull> version, const Vector& low, const Vector& high,
             std::shared_ptr<CanonicalHull> canonical);

  // For questions that name no vertex: relation, tolerance and clearance. The result lives as long
  // as this. Later calls may return another.
  const QueryHull& query_hull() const {
    return canonical_->has_query_hull() ? canonical_->query_hull() : *version_;
  }
  bool empty() const { return low_[0] > high_[0]; }
  const Vector& low() const { return low_; }
  const Vector& high() const { return high_; }

  // The canonical snapshot; null until it is made.
  const Hull* canonical() const { return canonical_->hull(); }
  // Makes that, unless it is there (CanonicalHull::Make). Not for gRPC's threads.
  absl::Status MakeCanonical(const HullRecord& record,
                             const std::function<bool()>& should_stop) const {
    return canonical_->Make(*version_, record, should_stop);
  }
  // For every question. The first call makes it. Requires canonical() != nullptr.
  const QueryHull& canonical_query_hull() const { return canonical_->query_hull(); }
  bool has_canonical_query_hull() const { return canonical_->has_query_hull(); }

 private:
  const std::shared_ptr<const QueryHull> version_;
  const Vector low_;
  const Vector high_;
  const std::shared_ptr<CanonicalHull> canonical_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_MEMORY_SERVED_HULL_H_
