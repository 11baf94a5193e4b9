#ifndef HULLD_CORE_HULL_GROWTH_POLYGON_BOUNDARY_H_
#define HULLD_CORE_HULL_GROWTH_POLYGON_BOUNDARY_H_

#include <map>
#include <vector>

#include "core/hull/surface/vertex_table.h"
#include "core/numeric/orientation.h"

namespace hulld {

// The boundary of a growing convex polygon whose points all lie in one plane, exactly.
//
// Idea: a coordinate plane onto which the polygon projects with non-zero area keeps every
// orientation in it, up to one common sign. There the boundary is a lower and an upper chain, each
// sorted lexicographically; a point joins a chain when it lies strictly beyond the chain's edge
// above or below it, and then drives out neighbours that are no longer strictly convex. Source:
// Preparata 1979, An Optimal Real-Time Algorithm for Planar Convex Hulls.
class PolygonBoundary {
 public:
  // Starts from three points, which become the vertices. Requires that they are not collinear in
  // `plane`, which ProjectionOf gives.
  PolygonBoundary(VertexTable& vertices, CoordinatePlane plane, VertexId a, VertexId b, VertexId c);

  // Adds a point of the plane. Unchecked: the caller has just decided that it lies in the plane.
  // Cost: O(log n) amortized.
  void Insert(VertexTable& vertices, const Vector& point);

  // What it holds in memory: each node has three links, a color, a key and an ID. Cost: O(1).
  size_t MemoryBytes() const {
    return (lower_.size() + upper_.size()) * (4 * sizeof(void*) + sizeof(Chain::value_type)) +
           journal_.capacity() * sizeof(Change);
  }

  // Starts a journal of what changes; makes everything as it was then; ends the journal and keeps
  // what changed; tells what the journal holds. The vertices are the table's to undo. Cost: the
  // changes.
  void StartJournal() { has_journal_ = true; }
  void Undo();
  void EndJournal() {
    has_journal_ = false;
    journal_ = {};
  }
  size_t JournalBytes() const { return journal_.size() * sizeof(Change); }

  // The vertices in order, counter-clockwise in the coordinate plane.
  std::vector<VertexId> Loop() const;

 private:
  // Points of the coordinate plane in lexicographic order.
  struct Key {
    double first;
    double second;
    friend auto operator<=>(const Key&, const Key&) = default;
  };
  using Chain = std::map<Key, VertexId>;
  // A vertex that came to a chain, or went from it.
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
  // Left to right; the lower one turns left (+1), the upper one right (-1). Both hold the first and
  // the last point.
  Chain lower_;
  Chain upper_;
  bool has_journal_ = false;
  std::vector<Change> journal_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_POLYGON_BOUNDARY_H_
