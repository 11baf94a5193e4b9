#ifndef HULLD_CORE_HULL_GROWTH_HULL_BUILDER_H_
#define HULLD_CORE_HULL_GROWTH_HULL_BUILDER_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "core/hull/hull.h"

namespace hulld {

// What became of the points of one block. received = outside + duplicate + inside.
struct PointCounts {
  uint64_t received = 0;
  // Points that became vertices and are vertices of the hull after the block.
  uint64_t outside = 0;
  // Points equal to a vertex of the hull after the block, beyond the first.
  uint64_t duplicate = 0;
  // Points in the hull after the block that are no vertex of it.
  uint64_t inside = 0;

  PointCounts& operator+=(const PointCounts& other) {
    received += other.received;
    outside += other.outside;
    duplicate += other.duplicate;
    inside += other.inside;
    return *this;
  }
  friend bool operator==(const PointCounts&, const PointCounts&) = default;
};

// What bounds one call of HullBuilder::Add.
struct AddLimits {
  // The hull after the block may have at most this many vertices.
  size_t max_vertices = std::numeric_limits<size_t>::max();
  // Polled within each block of more than one point, about every millisecond; true ends the call
  // with CANCELLED. May be empty. A single insertion is not interrupted: it takes some 50 ns for
  // each triangle that goes or comes.
  std::function<bool()> should_stop;
};

// Builds the convex hull of a growing point set, exactly.
//
// Every decision is the exact sign of a determinant of the input doubles, subnormals and 1e308
// included, so the vertex set is minimal (no duplicate, no point inside an edge or a facet) and
// depends on the point set alone. Dimensions -1, 0, 1, 2 and 3 grow into each other as points
// arrive. Not thread-safe; copyable.
class HullBuilder {
 public:
  HullBuilder();
  HullBuilder(const HullBuilder&);
  HullBuilder& operator=(const HullBuilder&);
  HullBuilder(HullBuilder&&) noexcept;
  HullBuilder& operator=(HullBuilder&&) noexcept;
  ~HullBuilder();

  // Adds a block: all of it, or nothing when the result is an error. points: n x 3, the caller's
  // length unit. -0 is stored as +0. Where the limits may end it, a journal of what changes is kept
  // to undo it: what each triangle and vertex that changes was before. Errors: INVALID_ARGUMENT
  // "points[17].y is NaN" (or "is infinite"); RESOURCE_EXHAUSTED when the hull would exceed
  // limits.max_vertices; CANCELLED when limits.should_stop said so.
  absl::StatusOr<PointCounts> Add(std::span<const Vector> points, const AddLimits& limits = {});

  int dimension() const;
  size_t vertex_count() const;

  // The vertices, in no particular order: adding them to an empty builder gives the same hull.
  // Cost: O(V).
  std::vector<Vector> Vertices() const;
  // Those that the last successful Add brought, as many as its counts call outside: adding them to
  // the builder's former state gives the same hull. Cost: O(points of that block).
  std::vector<Vector> NewVertices() const;

  // What the builder holds in memory, by capacities, in bytes. Below 230 a vertex from 1000
  // vertices on; inside points are not kept. Cost: O(1) from dimension 3 on.
  size_t MemoryBytes() const;
  // What the last Add held in its journal when it ended, in bytes, beyond MemoryBytes(): at most in
  // proportion to what it changed, whatever the size of the hull; 0 when its limits could not end
  // it.
  size_t undo_bytes() const { return undo_bytes_; }
  // Steps of work that insertions did so far beyond the triangles that they removed and created:
  // for tests that no single point stalls.
  uint64_t housekeeping_steps() const;

  // The canonical snapshot of all points added so far. Cost: O(V log V), most often O(V): a quarter
  // to four tenths of what adding points that all are vertices costs.
  Hull Snapshot() const;
  // The same, but CANCELLED when should_stop, which may be empty, said so. It is polled every 1024
  // vertices and triangles, several times over.
  absl::StatusOr<Hull> Snapshot(const std::function<bool()>& should_stop) const;

 private:
  class State;
  std::unique_ptr<State> state_;
  size_t undo_bytes_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_HULL_BUILDER_H_
