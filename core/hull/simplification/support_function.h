#ifndef HULLD_CORE_HULL_SIMPLIFICATION_SUPPORT_FUNCTION_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_SUPPORT_FUNCTION_H_

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/hull/hull.h"
#include "core/numeric/vector.h"

namespace hulld {

// The support function of a hull at unit scale, and with it distances from the hull, up to
// rounding.
//
// Idea: from any vertex, edges that lead farther along the direction lead to the farthest vertex of
// all. A vertex of many edges, such as the tip of a cone, is not climbed from; a tree of boxes over
// the vertices answers then: a box is looked into while it reaches farther than the best vertex so
// far.
class SupportFunction {
 public:
  // points: the hull's vertices at unit scale, which must outlive this. Requires a vertex. After
  // the poll said stop, this may only be destroyed. Cost: O(V log V).
  SupportFunction(const Hull& hull, std::span<const Vector> points, StopPoll& poll);

  // The index of the vertex farthest along the direction. Any start is right; a near one is fast.
  uint32_t FarthestAlong(const Vector& direction, uint32_t start) const;

  // Proven: p is not farther than this from the hull; mostly within one in 10^9, unless less than
  // `enough`, which then did. Idea: a triangle of vertices, one of which gives way to the support
  // point towards p while that brings the triangle nearer. Source: Gilbert, Johnson and Keerthi
  // 1988. Cost: some 5 support points.
  double DistanceBound(const Vector& p, uint32_t start, double enough) const;

 private:
  // A box of order_[first, end), and where its second half is; the first is the next node. 0: a
  // leaf.
  struct Node {
    Vector low;
    Vector high;
    uint32_t first;
    uint32_t end;
    uint32_t second_half;
  };

  std::span<const uint32_t> NeighboursOf(uint32_t vertex) const {
    return std::span(neighbours_).subspan(starts_[vertex], starts_[vertex + 1] - starts_[vertex]);
  }
  void Link(const Hull& hull, StopPoll& poll);
  void Build(uint32_t first, uint32_t end, StopPoll& poll);
  void Search(uint32_t at, const Vector& direction, uint32_t& best, double& most) const;

  std::span<const Vector> points_;
  // By vertex, those at the other ends of its edges.
  std::vector<uint32_t> starts_;
  std::vector<uint32_t> neighbours_;
  // The vertices as the tree has them.
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_SUPPORT_FUNCTION_H_
