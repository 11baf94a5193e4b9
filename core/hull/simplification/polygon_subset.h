#ifndef HULLD_CORE_HULL_SIMPLIFICATION_POLYGON_SUBSET_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_POLYGON_SUBSET_H_

#include <cstdint>
#include <queue>
#include <span>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/numeric/vector.h"

namespace hulld {

// A growing subset of the vertices of a convex polygon. The next one is always the vertex farthest
// from the polygon of the chosen ones, as far as rounding permits.
//
// An edge between chosen vertices represents the arc of vertices beyond it, and its farthest vertex
// splits it. Source: Ramer 1972, An Iterative Procedure for the Polygonal Approximation of Plane
// Curves.
class PolygonSubset {
 public:
  // points: at unit scale. loop: their indices in order around the polygon. Both must outlive this
  // object. Starts with three vertices. If the poll stopped, here or in ChooseNext, this object may
  // only be destroyed. Requires: at least three vertices.
  PolygonSubset(std::span<const Vector> points, std::span<const uint32_t> loop, StopPoll& poll);

  // Indices, in the order chosen.
  const std::vector<uint32_t>& chosen() const { return chosen_; }
  bool is_complete() const { return chosen_.size() == loop_.size(); }
  // Chooses the apparently farthest vertex. Requires: !is_complete(). Cost: O(vertices of the arc
  // that it splits).
  void ChooseNext(StopPoll& poll);
  // Returns a **proven** bound, in units, on the distance of any vertex from the polygon of the
  // chosen vertices. Cost: O(1).
  double DistanceBound() const { return arcs_.top().distance; }

 private:
  // The vertices strictly between two places of the loop; the second place may be counted beyond
  // the loop's end.
  struct Arc {
    // Proven bound on the distance of the vertex farthest from the edge; 0 if the arc is empty.
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
