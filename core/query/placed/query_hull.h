#ifndef HULLD_CORE_QUERY_PLACED_QUERY_HULL_H_
#define HULLD_CORE_QUERY_PLACED_QUERY_HULL_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/hull/hull.h"
#include "core/query/placed/center_bounds.h"
#include "core/query/placed/support_map.h"

namespace hulld {

// A canonical snapshot of a hull and what queries need beyond it. It is made once, when the first
// query asks, and kept beside the snapshot. Immutable; readable by any thread.
class QueryHull {
 public:
  // `hull` must outlive the result. Cost: that of a SupportMap and of CenterBounds.
  explicit QueryHull(const Hull& hull);

  const Hull& hull() const { return *hull_; }
  const SupportMap& support() const { return support_; }
  // About hull().center().
  const CenterBounds& center_bounds() const { return center_bounds_; }
  // Every vertex is within this distance of hull().center(); rounded up. 0 when empty.
  double radius() const { return radius_; }
  // Every non-zero coordinate is a multiple of 2^exponent; kAboveAllExponents when there is none.
  int exponent() const { return exponent_; }
  // Vertices, with repetitions, whose mean is in the relative interior of the hull and not near its
  // boundary unless the hull is flat or a needle: the axis extremes, and some that span the hull.
  std::span<const uint32_t> inner_vertices() const {
    return std::span(inner_vertices_).first(inner_count_);
  }
  // Bytes beyond the snapshot's own.
  size_t MemoryBytes() const {
    return sizeof(*this) + support_.MemoryBytes() + center_bounds_.MemoryBytes();
  }

 private:
  void AddInnerVertex(size_t vertex);

  const Hull* hull_;
  SupportMap support_;
  CenterBounds center_bounds_;
  double radius_ = 0;
  int exponent_ = 0;
  std::array<uint32_t, 10> inner_vertices_ = {};
  size_t inner_count_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_QUERY_HULL_H_
