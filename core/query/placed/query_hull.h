#ifndef HULLD_CORE_QUERY_PLACED_QUERY_HULL_H_
#define HULLD_CORE_QUERY_PLACED_QUERY_HULL_H_

#include <atomic>
#include <cstddef>
#include <cstdint>
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

// A hull as questions need it: a finite point set whose hull it is, and what finds the points that
// lie farthest along a direction. Points are known by their index.
//
// It is made of a canonical snapshot: then the points are the vertices, in canonical order, and
// every question may be asked. Or it is a version of a LiveHull: then the points are in no
// particular order, some may not be vertices, and what may be asked is the relation, with or
// without a tolerance, and the clearance. Immutable; readable by any thread.
class QueryHull {
 public:
  // `hull` must outlive the result. Cost: that of a SupportMap and of CenterBounds.
  explicit QueryHull(const Hull& hull);

  // Null for a version of a LiveHull.
  const Hull* canonical() const { return canonical_; }
  // Requires canonical().
  const Hull& hull() const {
    HULLD_CHECK(canonical_ != nullptr);
    return *canonical_;
  }

  bool empty() const { return base_ == nullptr; }
  int dimension() const { return dimension_; }
  uint32_t point_count() const { return point_count_; }
  // Requires i < point_count().
  Vector point(uint32_t i) const {
    HULLD_DCHECK(i < point_count_);
    return i < base_->points().size() ? base_->points()[i] : GrownPoint(i);
  }
  // All points, where they lie together in memory: not so in a version that has grown, nor when
  // empty.
  std::span<const Vector> points_together() const {
    return base_ == nullptr || growth_ != nullptr ? std::span<const Vector>() : base_->points();
  }
  // Largest absolute coordinate; 0 when empty.
  double max_abs_coordinate() const { return max_abs_; }
  // A place in the hull to search from; zero when empty.
  const Vector& center() const { return center_; }
  // Every point is within this distance of center(); rounded up. 0 when empty.
  double radius() const { return radius_; }
  // Every non-zero coordinate is a multiple of 2^exponent; kAboveAllExponents when there is none.
  int exponent() const { return exponent_; }
  // Points that span the hull: one more than its dimension, affinely independent. Requires a hull
  // that is not empty.
  std::span<const uint32_t> spanning() const {
    HULLD_DCHECK(!empty());
    return base_->spanning();
  }
  // Points, with repetitions, whose mean is in the relative interior of the hull and not near its
  // boundary unless the hull is flat or a needle. Requires a hull that is not empty.
  std::span<const uint32_t> inner_points() const {
    HULLD_DCHECK(!empty());
    return base_->inner();
  }

  // A point farthest along n: its computed value is the largest of all but for the rounding of two
  // values. Requires a hull that is not empty. Cost: SupportMap's, for each of a few maps.
  SupportPoint Farthest(const PlainVector& n) const {
    HULLD_DCHECK(!empty());
    const SupportPoint found = base_->support().Farthest(n);
    return growth_ == nullptr ? found : FartherInGrowth(n, found);
  }
  // All points, ascending, that may be exactly farthest along a direction whose components differ
  // from those of n by up to `error`, when two values are ordered rightly if they differ by more
  // than `slack`. Requires a hull that is not empty.
  std::vector<uint32_t> Candidates(const PlainVector& n, double error, double slack) const;

  // About center(), of the base alone; BoundsAt tells of the whole hull. Both require a hull that
  // is not empty.
  const CenterBounds& center_bounds() const {
    HULLD_DCHECK(!empty());
    return base_->center_bounds();
  }
  // Upper bounds as CenterBounds gives them, of the whole hull, along n at its place.
  CenterBounds::Bounds BoundsAt(const CenterBounds::Place& place, const PlainVector& n) const {
    const CenterBounds::Bounds bounds = center_bounds().At(place);
    return growth_ == nullptr ? bounds : BoundsWithGrowth(bounds, n);
  }

  // What it holds alone, beyond a canonical snapshot and what it shares with its LiveHull. Bytes.
  size_t MemoryBytes() const {
    return sizeof(*this) + (canonical_ == nullptr || empty() ? 0 : base_->MemoryBytes());
  }

 private:
  friend class LiveHull;

  // What was appended to the base.
  struct Growth {
    std::shared_ptr<const LiveParts> parts;
    // Points of the tail.
    size_t tail_count = 0;
    // Counts the points that are scanned where preparing would save it.
    std::shared_ptr<std::atomic<uint64_t>> scanned;
    // How many a question along one direction scans.
    uint64_t scans = 0;
  };

  QueryHull() = default;

  Vector GrownPoint(uint32_t i) const;
  SupportPoint FartherInGrowth(const PlainVector& n, SupportPoint found) const;
  CenterBounds::Bounds BoundsWithGrowth(CenterBounds::Bounds bounds, const PlainVector& n) const;

  const Hull* canonical_ = nullptr;
  std::shared_ptr<const HullBase> base_;
  // Null where the base is all there is, and prepared.
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
