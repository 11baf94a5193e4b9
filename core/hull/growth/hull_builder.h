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

// Classification of a block's points. received = outside + duplicate + inside.
struct PointCounts {
  uint64_t received = 0;
  // Points that became vertices and are still vertices after the block.
  uint64_t outside = 0;
  // Points equal to a vertex that is already counted for another point, after the block.
  uint64_t duplicate = 0;
  // All other points: in the hull after the block, but not vertices.
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

// Limits on a call of HullBuilder::Add.
struct AddLimits {
  // Maximum number of vertices of the hull after the block.
  size_t max_vertices = std::numeric_limits<size_t>::max();
  // Polled within each block of more than one point, about every millisecond; true ends the call
  // with CANCELLED. May be empty. A single insertion is not interrupted: it takes about 50 ns per
  // triangle removed or created.
  std::function<bool()> should_stop;
};

// Builds the convex hull of a growing point set, exactly.
//
// Every decision is the exact sign of a determinant of the input doubles, subnormals and 1e308
// included. The vertex set is therefore minimal (no duplicate, no point inside an edge or a facet)
// and depends on the point set alone. The dimension grows from -1 through 0, 1 and 2 to 3 as points
// arrive. Copyable; a moved-from builder may only be destroyed or assigned to. Not thread-safe.
class HullBuilder {
 public:
  HullBuilder();
  HullBuilder(const HullBuilder&);
  HullBuilder& operator=(const HullBuilder&);
  HullBuilder(HullBuilder&&) noexcept;
  HullBuilder& operator=(HullBuilder&&) noexcept;
  ~HullBuilder();

  // Adds a block of points, or changes nothing if it returns an error. points: n x 3, the caller's
  // length unit. -0 is stored as +0. If the limits may end the call, a journal records the previous
  // state of each changed triangle and vertex, so that the call can be undone. Errors:
  // INVALID_ARGUMENT "points[17].y is NaN" (or "is infinite"); RESOURCE_EXHAUSTED if the hull would
  // exceed limits.max_vertices; CANCELLED if limits.should_stop returned true.
  absl::StatusOr<PointCounts> Add(std::span<const Vector> points, const AddLimits& limits = {});

  int dimension() const;
  size_t vertex_count() const;

  // Returns the vertices, in no particular order. Adding them to an empty builder yields the same
  // hull. Cost: O(V).
  std::vector<Vector> Vertices() const;
  // Returns the vertices created by the last successful Add, as many as it counted as `outside`.
  // Adding them to the builder's previous state yields the same hull. Cost: O(points of that
  // block).
  std::vector<Vector> NewVertices() const;

  // Memory in bytes, including spare capacity: below 230 bytes per vertex for 1000 vertices or
  // more, because inside points are not kept. Cost: O(1) in dimension 3.
  size_t MemoryBytes() const;
  // Size of the journal at the end of the last Add, in bytes, beyond MemoryBytes(). At most
  // proportional to the changes of that call, regardless of the size of the hull; 0 if the limits
  // could not have ended the call.
  size_t undo_bytes() const { return undo_bytes_; }
  // Number of work steps of all insertions, beyond the triangles removed and created. Tests use it
  // to check that no single point stalls.
  uint64_t housekeeping_steps() const;

  // Returns the canonical snapshot of all points added so far. Cost: O(V log V), usually O(V): 25
  // to 40 % of the cost of adding the points if all are vertices.
  Hull Snapshot() const;
  // Cancellable Snapshot. CANCELLED: should_stop, which may be empty, returned true. It is polled
  // every 1024 vertices and triangles, in several passes.
  absl::StatusOr<Hull> Snapshot(const std::function<bool()>& should_stop) const;

 private:
  class State;
  std::unique_ptr<State> state_;
  size_t undo_bytes_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_HULL_BUILDER_H_
