#ifndef HULLD_CORE_QUERY_PLACED_QUERY_HULL_H_
#define HULLD_CORE_QUERY_PLACED_QUERY_HULL_H_

#include <absl/status/statusor.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/base/check.h"
#include "core/hull/hull.h"
#include "core/query/placed/center_bounds.h"
#include "core/query/placed/hull_base.h"
#include "core/query/placed/support_map.h"

namespace hulld {

class GrowthTail;
struct LiveParts;

// A hull in the form that queries need: a finite point set that generates it, and the search for
// points farthest along a direction. Points are identified by index.
//
// Built from a canonical snapshot, the points are the vertices in canonical order, and every query
// is supported. As a version of a LiveHull, the points are in no particular order and need not all
// be vertices; the supported queries are the relation, with or without a tolerance, and the
// clearance. Immutable and thread-safe.
class QueryHull {
 public:
  // `hull` must outlive the result. Cost: that of a SupportMap and of CenterBounds.
  explicit QueryHull(const Hull& hull) : QueryHull(hull, {}) {}
  explicit QueryHull(const Hull&&) = delete;
  // CANCELLED: should_stop, which may be empty, returned true. It is polled every few milliseconds.
  // Temporary memory: O(V).
  static absl::StatusOr<QueryHull> Prepare(const Hull& hull,
                                           const std::function<bool()>& should_stop);
  static absl::StatusOr<QueryHull> Prepare(const Hull&&, const std::function<bool()>&) = delete;

  // Null for a version of a LiveHull.
  const Hull* canonical() const { return canonical_; }
  // Requires: canonical() is not null.
  const Hull& hull() const {
    HULLD_CHECK(canonical_ != nullptr);
    return *canonical_;
  }

  bool empty() const { return base_ == nullptr; }
  int dimension() const { return dimension_; }
  uint32_t point_count() const { return point_count_; }
  // Requires: i < point_count().
  Vector point(uint32_t i) const {
    HULLD_DCHECK(i < point_count_);
    return i < base_->points().size() ? base_->points()[i] : GrownPoint(i);
  }
  // All points if they are contiguous in memory. Empty for a version that has grown and for an
  // empty hull.
  std::span<const Vector> points_together() const {
    return base_ == nullptr || growth_ != nullptr ? std::span<const Vector>() : base_->points();
  }
  // The blocks of a support map that contains all points; empty for large hulls and if
  // points_together() is empty.
  std::span<const SupportBlock> blocks() const {
    return base_ == nullptr || growth_ != nullptr ? std::span<const SupportBlock>()
                                                  : base_->support().blocks();
  }
  // Largest absolute coordinate; 0 if empty.
  double max_abs_coordinate() const { return max_abs_; }
  // A point in the hull where searches start; zero if empty.
  const Vector& center() const { return center_; }
  // Every point is within this distance of center(); rounded up. 0 if empty.
  double radius() const { return radius_; }
  // Every non-zero coordinate is a multiple of 2^exponent; kAboveAllExponents if all are zero.
  int exponent() const { return exponent_; }
  // Points that span the hull: one more than its dimension, affinely independent. Requires:
  // !empty().
  std::span<const uint32_t> spanning() const {
    HULLD_DCHECK(!empty());
    return base_->spanning();
  }
  // Points, with repetitions. Their mean is in the relative interior of the hull, and not near its
  // boundary unless the hull is flat or a needle. Requires: !empty().
  std::span<const uint32_t> inner_points() const {
    HULLD_DCHECK(!empty());
    return base_->inner();
  }

  // Returns a point farthest along n: its computed value is the maximum, up to the rounding of two
  // values. Requires: !empty(). Cost: SupportMap's, for each of a few maps.
  SupportPoint Farthest(const PlainVector& n) const {
    HULLD_DCHECK(!empty());
    const SupportPoint found = base_->support().Farthest(n);
    return growth_ == nullptr ? found : FartherInGrowth(n, found);
  }
  // Returns all points, ascending, that may be exactly farthest along a direction with components
  // that differ from n's by up to `error`. `slack`: values that differ by more than this compare
  // correctly. Requires: !empty().
  std::vector<uint32_t> Candidates(const PlainVector& n, double error, double slack) const;

  // Bounds about center() for the base alone; BoundsAt covers the whole hull. Both require
  // !empty().
  const CenterBounds& center_bounds() const {
    HULLD_DCHECK(!empty());
    return base_->center_bounds();
  }
  // Returns upper bounds for the whole hull, as defined by CenterBounds, along n at its place.
  CenterBounds::Bounds BoundsAt(const CenterBounds::Place& place, const PlainVector& n) const {
    const CenterBounds::Bounds bounds = center_bounds().At(place);
    return growth_ == nullptr ? bounds : BoundsWithGrowth(bounds, n);
  }

  // Memory owned by this object, without a canonical snapshot and data shared with a LiveHull, in
  // bytes.
  size_t MemoryBytes() const {
    return sizeof(*this) + (canonical_ == nullptr || empty() ? 0 : base_->MemoryBytes());
  }

 private:
  friend class LiveHull;

  // The points appended to the base.
  struct Growth {
    std::shared_ptr<const LiveParts> parts;
    // Number of points of the tail.
    size_t tail_count = 0;
    // Counts the scanned points that preparation would save.
    std::shared_ptr<std::atomic<uint64_t>> scanned;
    // Number of points scanned per direction.
    uint64_t scans = 0;
  };

  QueryHull() = default;
  // The result is not usable if its support map has stopped.
  QueryHull(const Hull& hull, const std::function<bool()>& should_stop);

  Vector GrownPoint(uint32_t i) const;
  SupportPoint FartherInGrowth(const PlainVector& n, SupportPoint found) const;
  CenterBounds::Bounds BoundsWithGrowth(CenterBounds::Bounds bounds, const PlainVector& n) const;

  const Hull* canonical_ = nullptr;
  std::shared_ptr<const HullBase> base_;
  // Null if the whole hull is a prepared base.
  std::unique_ptr<const Growth> growth_;
  int dimension_ = -1;
  uint32_t point_count_ = 0;
  int exponent_ = 0;
  double max_abs_ = 0;
  double radius_ = 0;
  Vector center_ = Vector::Zero();
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_QUERY_HULL_H_
