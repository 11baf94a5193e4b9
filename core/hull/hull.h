#ifndef HULLD_CORE_HULL_HULL_H_
#define HULLD_CORE_HULL_HULL_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/check.h"
#include "core/numeric/vector.h"

namespace hulld {

// A segment of a hull's boundary between two facets, by vertex indices; tail < head.
struct Edge {
  uint32_t tail;
  uint32_t head;
  friend bool operator==(const Edge&, const Edge&) = default;
  friend auto operator<=>(const Edge&, const Edge&) = default;
};

// The canonical snapshot of a convex hull. Immutable, thread-safe, and bit-identical for the same
// point set in any order of insertion.
//
// Vertices are the extreme points, in lexicographic order (x, then y, then z); -0 is stored as +0.
// Facets are maximal coplanar polygons, each from its lowest vertex, counter-clockwise seen from
// outside, sorted by their vertex sequences. A hull of dimension 2 has one facet, which represents
// both its sides (its second vertex is lower than its last); dimension 1 has no facet and one edge,
// dimension 0 one vertex, dimension -1 nothing. Edges are sorted. A moved-from hull may only be
// destroyed or assigned to.
class Hull {
 public:
  Hull() = default;

  // Assembles a snapshot from canonical parts. `facet_starts` has one entry per facet plus one.
  // Requires: the invariants of the class comment. Checks only the ones that cost O(1); AuditHull
  // checks all of them.
  Hull(int dimension, std::vector<Vector> vertices, std::vector<uint32_t> facet_starts,
       std::vector<uint32_t> facet_vertices, std::vector<Edge> edges);

  int dimension() const { return dimension_; }
  bool empty() const { return dimension_ < 0; }
  std::span<const Vector> vertices() const { return vertices_; }
  std::span<const Edge> edges() const { return edges_; }
  size_t facet_count() const { return facet_starts_.empty() ? 0 : facet_starts_.size() - 1; }
  // Returns the vertex indices of facet i. Requires: i < facet_count().
  std::span<const uint32_t> facet(size_t i) const {
    HULLD_DCHECK(i < facet_count());
    return std::span(facet_vertices_)
        .subspan(facet_starts_[i], facet_starts_[i + 1] - facet_starts_[i]);
  }
  // Largest absolute coordinate; 0 if empty.
  double max_abs_coordinate() const { return max_abs_coordinate_; }
  // The mean of the six vertices that are extreme along the coordinate axes, rounded: a point in
  // the hull where searches start. Zero if empty.
  const Vector& center() const { return center_; }
  // Memory, by capacities, in bytes: below 100 per vertex for hulls with many vertices and
  // triangular facets.
  size_t MemoryBytes() const {
    return sizeof(*this) + vertices_.capacity() * sizeof(Vector) +
           (facet_starts_.capacity() + facet_vertices_.capacity()) * sizeof(uint32_t) +
           edges_.capacity() * sizeof(Edge);
  }

 private:
  int dimension_ = -1;
  double max_abs_coordinate_ = 0;
  Vector center_ = Vector::Zero();
  std::vector<Vector> vertices_;
  std::vector<uint32_t> facet_starts_;
  std::vector<uint32_t> facet_vertices_;
  std::vector<Edge> edges_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_HULL_H_
