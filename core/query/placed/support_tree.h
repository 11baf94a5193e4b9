#ifndef HULLD_CORE_QUERY_PLACED_SUPPORT_TREE_H_
#define HULLD_CORE_QUERY_PLACED_SUPPORT_TREE_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/numeric/vector.h"
#include "core/query/placed/plain_vector.h"
#include "core/query/placed/support_blocks.h"

namespace hulld {

// A tree of boxes around points that finds the points farthest along a direction by branch and
// bound. Uses O(V) memory for every set, including sets that defeat a division of the directions
// (see SupportMap).
//
// The bound of a box is computed like the values of points. Rounding is monotonic, so no computed
// value of a point in the box exceeds it.
class SupportTree {
 public:
  SupportTree() = default;
  // Requires: at least one point. The tree is not usable if stopped. Cost: O(V log V).
  SupportTree(std::span<const Vector> points, StopPoll& poll);

  bool empty() const { return nodes_.empty(); }

  // Returns a point with the largest computed value. Requires: !empty(), and the points of the
  // constructor. Cost: O(log V) for points on a curve or surface that bends, O(V) if many points
  // have about the largest value.
  SupportPoint Farthest(std::span<const Vector> points, const PlainVector& n) const;
  // Calls visit(i) for each point with a computed value of at least `least`, in no particular
  // order, until `visit` returns false. Returns false if `visit` did. Requires: see Farthest.
  template <typename Visit>
  bool ForEachAtLeast(std::span<const Vector> points, const PlainVector& n, double least,
                      Visit&& visit) const;

  size_t MemoryBytes() const {
    return nodes_.capacity() * sizeof(Node) + order_.capacity() * sizeof(uint32_t);
  }

 private:
  static constexpr uint32_t kLeafPoints = 8;

  // Nodes are in depth-first order: a node is followed by its first half, and `after` is the first
  // node outside its subtree.
  struct Node {
    PlainVector low;
    PlainVector high;
    // The node's points, in order_.
    uint32_t first;
    uint32_t end;
    uint32_t after;

    bool is_leaf() const { return end - first <= kLeafPoints; }
    // Returns an upper bound on the computed values of its points.
    double ReachAlong(const PlainVector& n) const {
      return SupportValue(n, n.x > 0 ? high.x : low.x, n.y > 0 ? high.y : low.y,
                          n.z > 0 ? high.z : low.z);
    }
  };

  void Build(std::span<const Vector> points, uint32_t first, uint32_t end, StopPoll& poll);
  void Search(std::span<const Vector> points, uint32_t at, const PlainVector& n,
              SupportPoint& best) const;

  std::vector<Node> nodes_;
  std::vector<uint32_t> order_;
};

template <typename Visit>
bool SupportTree::ForEachAtLeast(std::span<const Vector> points, const PlainVector& n, double least,
                                 Visit&& visit) const {
  for (uint32_t at = 0; at < nodes_.size();) {
    const Node& node = nodes_[at];
    if (node.ReachAlong(n) < least) {
      at = node.after;
      continue;
    }
    ++at;
    if (!node.is_leaf()) continue;
    for (uint32_t i = node.first; i < node.end; ++i) {
      const Vector& v = points[order_[i]];
      if (SupportValue(n, v.x(), v.y(), v.z()) >= least && !visit(order_[i])) return false;
    }
  }
  return true;
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_SUPPORT_TREE_H_
