#ifndef HULLD_CORE_QUERY_BOX_TREE_H_
#define HULLD_CORE_QUERY_BOX_TREE_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/numeric/vector.h"
#include "core/query/placed/placed_hull.h"

namespace hulld {

// A closed axis-aligned box; empty if low exceeds high.
struct Box {
  Vector low;
  Vector high;

  static Box Empty();
  // Intersects every box except the empty one.
  static Box All();
  bool IsEmpty() const { return (low.array() > high.array()).any(); }
  bool Meets(const Box& other) const {
    return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
  }
};

// Returns a box (world frame) that certainly contains the rounded hull. Covers all of space if
// coordinates are beyond the range of doubles. Empty for an empty hull.
Box BoundingBox(const PlacedHull& placed);

// Returns a box, rounded outwards, that contains all points within `clearance` >= 0 of `box`.
Box GrownBy(const Box& box, double clearance);

// A hierarchy of boxes that finds the boxes intersecting a given one. Immutable.
class BoxTree {
 public:
  // The state of a resumable search: the nodes still to visit.
  class Cursor {
   private:
    friend class BoxTree;
    // Halving leaves at most 32 levels.
    static constexpr int kMaxWaiting = 40;
    uint32_t waiting_[kMaxWaiting];
    int height_ = 0;
  };

  // The tree is the same on any number of threads. Cost: O(n log n). If should_stop interrupts
  // construction, the tree is incomplete and must be discarded.
  explicit BoxTree(std::span<const Box> boxes, const std::function<bool()>& should_stop = {},
                   int threads = 1);

  // Appends the indices, from `first` on, of all boxes that intersect `box`, in no particular
  // order. Cost: O(log n) plus the output, if boxes overlap little.
  void AppendMeeting(const Box& box, uint32_t first, std::vector<uint32_t>& found) const;

  // Resumable variant: call Begin, then AppendMeeting until it returns true. Each call visits at
  // most `nodes` nodes and appends at most kLeafBoxes indices for each.
  Cursor Begin() const;
  bool AppendMeeting(const Box& box, uint32_t first, uint64_t nodes, Cursor& cursor,
                     std::vector<uint32_t>& found) const;

  // Node access for simultaneous searches of two trees. The root is node 0.
  bool empty() const { return nodes_.empty(); }
  const Box& box(uint32_t node) const { return nodes_[node].box; }
  bool is_leaf(uint32_t node) const { return nodes_[node].second == 0; }
  // Requires: `node` is not a leaf.
  std::array<uint32_t, 2> children(uint32_t node) const {
    HULLD_DCHECK(!is_leaf(node));
    return {node + 1, nodes_[node].second};
  }
  // Boxes of a leaf, at most kLeafBoxes, and their indices.
  std::span<const Box> boxes(uint32_t leaf) const { return Part(boxes_, leaf); }
  std::span<const uint32_t> indices(uint32_t leaf) const { return Part(indices_, leaf); }
  // Not tuned.
  static constexpr uint32_t kLeafBoxes = 8;

  size_t MemoryBytes() const {
    return nodes_.capacity() * sizeof(Node) + indices_.capacity() * sizeof(uint32_t) +
           boxes_.capacity() * sizeof(Box);
  }

 private:
  // The children of an inner node are the next node and `second`. The boxes of a leaf are [begin,
  // end).
  struct Node {
    Box box;
    uint32_t largest_index;
    uint32_t second;
    uint32_t begin;
    uint32_t end;
  };

  // A box to be placed in the tree.
  struct Item {
    Vector center;  // twice the center; 0 for a box that covers all of space
    uint32_t index;
  };
  // Maximum number of boxes in a part that is not shared by threads: about 200 us of work.
  static constexpr uint32_t kMaxUnshared = 2048;

  static uint32_t NodesOf(uint32_t boxes);
  // Builds the node `index` and the nodes below it. `begin`: the position of the first item.
  void Build(std::span<const Box> boxes, std::span<Item> items, uint32_t begin, uint32_t index,
             const std::function<bool()>& should_stop);

  template <typename T>
  std::span<const T> Part(const std::vector<T>& all, uint32_t leaf) const {
    const Node& node = nodes_[leaf];
    return std::span(all).subspan(node.begin, node.end - node.begin);
  }

  std::vector<Node> nodes_;
  // In leaf order.
  std::vector<uint32_t> indices_;
  std::vector<Box> boxes_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_BOX_TREE_H_
