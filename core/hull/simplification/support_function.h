#ifndef HULLD_CORE_HULL_SIMPLIFICATION_SUPPORT_FUNCTION_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_SUPPORT_FUNCTION_H_

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/hull/hull.h"
#include "core/numeric/vector.h"

namespace hulld {

// The support function of a hull at unit scale, and distances from the hull computed with it, up to
// rounding.
//
// From any vertex, edges that lead farther along the direction lead to the farthest vertex of all.
// At a vertex with many edges, such as the tip of a cone, the climb stops, and a tree of boxes over
// the vertices is searched instead: each box that reaches farther than the best vertex so far is
// visited.
class SupportFunction {
 public:
  // points: the hull's vertices at unit scale, which must outlive this object. If the poll stopped,
  // this object may only be destroyed. Requires: at least one vertex. Cost: O(V log V).
  SupportFunction(const Hull& hull, std::span<const Vector> points, StopPoll& poll);

  // Returns the index of the vertex farthest along the direction. Any start is correct; a near one
  // is fast.
  uint32_t FarthestAlong(const Vector& direction, uint32_t start) const;

  // Returns a **proven** bound on the distance of p from the hull, usually with a relative error
  // below 1e-9; but a bound below `enough` is returned at once. Maintains a triangle of vertices,
  // and replaces one of them with the support point toward p while that brings the triangle nearer.
  // Source: Gilbert, Johnson and Keerthi 1988. Cost: about 5 support points.
  double DistanceBound(const Vector& p, uint32_t start, double enough) const;

 private:
  // The box of the vertices order_[first, end). The first half is the next node; `second_half` is
  // the index of the second half, 0 for a leaf.
  struct Node {
    Vector low;
    Vector high;
    uint32_t first;
    uint32_t end;
    uint32_t second_half;
  };

  std::span<const uint32_t> NeighborsOf(uint32_t vertex) const {
    return std::span(neighbors_).subspan(starts_[vertex], starts_[vertex + 1] - starts_[vertex]);
  }
  void Link(const Hull& hull, StopPoll& poll);
  void Build(uint32_t first, uint32_t end, StopPoll& poll);
  void Search(uint32_t at, const Vector& direction, uint32_t& best, double& max_reach) const;

  std::span<const Vector> points_;
  // Adjacent vertices, by vertex.
  std::vector<uint32_t> starts_;
  std::vector<uint32_t> neighbors_;
  // The vertices in the order of the tree.
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_SUPPORT_FUNCTION_H_
