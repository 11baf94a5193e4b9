#ifndef HULLD_CORE_HULL_SIMPLIFICATION_POLYGON_SUBSET_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_POLYGON_SUBSET_H_

#include <cstdint>
#include <queue>
#include <span>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/numeric/vector.h"

namespace hulld {

// A growing subset of the vertices of a convex polygon, the next one always the vertex farthest
// from the polygon of those chosen, as far as rounding can tell.
//
// Idea: an edge of the chosen ones stands for the arc of vertices beyond it. Its farthest vertex
// splits it. Source: Ramer 1972, An Iterative Procedure for the
// Polygonal Approximation of Plane Curves.
class PolygonSubset {
 public:
  // points: at unit scale. loop: their indices in order round the polygon; both must outlive this.
  // Starts with three. Requires at least three. After the poll said stop, here or in ChooseNext,
  // this may only be destroyed.
  PolygonSubset(std::span<const Vector> points, std::span<const uint32_t> loop, StopPoll& poll);

  // Indices, in the order chosen.
  const std::vector<uint32_t>& chosen() const { return chosen_; }
  bool is_complete() const { return chosen_.size() == loop_.size(); }
  // Chooses the vertex that seems farthest. Requires !is_complete(). Cost: O(vertices of the arc
  // that it splits).
  void ChooseNext(StopPoll& poll);
  // Proven: no vertex is farther than this from the polygon of those chosen. In units. Cost: O(1).
  double DistanceBound() const { return arcs_.top().distance; }

 private:
  // The vertices strictly between two places of the loop, the latter perhaps counted beyond its
  // end.
  struct Arc {
    // Proven bound of the distance of the vertex that is farthest from the edge; 0 when there is
    // none.
    double distance;
    size_t farthest;
    size_t first;
    size_t last;
    bool operator<(const Arc& other) const {
      return distance != other.distance ? distance < other.distance : first > other.first;
    }
  };

  uint32_t At(size_t place) const { return loop_[place % loop_.size()]; }
  Arc ArcBetween(size_t first, size_t last, StopPoll& poll) const;

  std::span<const Vector> points_;
  std::span<const uint32_t> loop_;
  std::vector<uint32_t> chosen_;
  std::priority_queue<Arc> arcs_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_POLYGON_SUBSET_H_
