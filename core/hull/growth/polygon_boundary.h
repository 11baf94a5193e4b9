#ifndef HULLD_CORE_HULL_GROWTH_POLYGON_BOUNDARY_H_
#define HULLD_CORE_HULL_GROWTH_POLYGON_BOUNDARY_H_

#include <map>
#include <vector>

#include "core/hull/surface/vertex_table.h"
#include "core/numeric/orientation.h"

namespace hulld {

// The exact boundary of a growing convex polygon, with all points in one plane.
//
// A coordinate plane onto which the polygon projects with non-zero area preserves every orientation
// in it, up to one common sign. There the boundary is a lower and an upper chain, each sorted
// lexicographically. A point joins a chain if it lies strictly beyond the chain's edge above or
// below it, and then removes neighbors that are no longer strictly convex. Source: Preparata 1979,
// An Optimal Real-Time Algorithm for Planar Convex Hulls.
class PolygonBoundary {
 public:
  // Starts from three points, which become the vertices. Requires: the points are not collinear in
  // `plane`, as returned by ProjectionOf.
  PolygonBoundary(VertexTable& vertices, CoordinatePlane plane, VertexId a, VertexId b, VertexId c);

  // Adds a point. Requires: the point lies in the polygon's plane (unchecked: the caller has just
  // decided this). Cost: O(log n) amortized.
  void Insert(VertexTable& vertices, const Vector& point);

  // Memory: each node has three links, a color, a key and an ID. Cost: O(1).
  size_t MemoryBytes() const {
    return (lower_.size() + upper_.size()) * (4 * sizeof(void*) + sizeof(Chain::value_type)) +
           journal_.capacity() * sizeof(Change);
  }

  // Journal of changes: StartJournal starts it, Undo restores the state at its start, EndJournal
  // keeps the changes. The vertex table has its own journal. Cost: O(changes).
  void StartJournal() { has_journal_ = true; }
  void Undo();
  void EndJournal() {
    has_journal_ = false;
    journal_ = {};
  }
  size_t JournalBytes() const { return journal_.size() * sizeof(Change); }

  // Returns the vertices in order, counter-clockwise in the coordinate plane.
  std::vector<VertexId> Loop() const;

 private:
  // Points of the coordinate plane in lexicographic order.
  struct Key {
    double first;
    double second;
    friend auto operator<=>(const Key&, const Key&) = default;
  };
  using Chain = std::map<Key, VertexId>;
  // A vertex added to or removed from a chain.
  struct Change {
    bool is_lower;
    bool came;
    Key key;
    VertexId id;
  };

  Key KeyOf(const Vector& point) const { return {point[plane_.first], point[plane_.second]}; }
  void InsertVertex(VertexTable& vertices, VertexId id);
  bool IsBeyond(const VertexTable& vertices, const Chain& chain, int turn,
                const Vector& point) const;
  void Extend(VertexTable& vertices, Chain& chain, int turn, VertexId id);
  void Erase(VertexTable& vertices, Chain& chain, Chain::iterator it);
  void Note(const Chain& chain, bool came, const Key& key, VertexId id) {
    if (has_journal_) journal_.push_back({&chain == &lower_, came, key, id});
  }

  CoordinatePlane plane_;
  // Left to right; the lower chain turns left (+1), the upper one right (-1). Both contain the
  // first and the last point.
  Chain lower_;
  Chain upper_;
  bool has_journal_ = false;
  std::vector<Change> journal_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_POLYGON_BOUNDARY_H_
