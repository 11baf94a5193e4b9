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

// A closed axis-aligned box; empty when low exceeds high.
struct Box {
  Vector low;
  Vector high;

  static Box Empty();
  bool IsEmpty() const { return (low.array() > high.array()).any(); }
  bool Meets(const Box& other) const {
    return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
  }
};

// A box, world frame, that is certain to hold the hull: all of space where doubles do not reach.
// Empty for an empty hull.
Box BoundingBox(const PlacedHull& placed);

// A box that holds all points within `clearance` >= 0 of this one: rounded outwards.
Box GrownBy(const Box& box, double clearance);

// A hierarchy of boxes that finds those which meet a given one. Immutable once built.
class BoxTree {
 public:
  // A search that can be left and taken up again: the nodes that it has still to look at.
  class Cursor {
   private:
    friend class BoxTree;
    // Halves leave at most 32 levels.
    static constexpr int kMostWaiting = 40;
    uint32_t waiting_[kMostWaiting];
    int height_ = 0;
  };

  // Cost: O(n log n). A tree that was stopped by should_stop lacks boxes: drop it.
  explicit BoxTree(std::span<const Box> boxes, const std::function<bool()>& should_stop = {});

  // Appends the indices of all boxes that meet `box`, from index `first` on, in no particular
  // order. Cost: O(log n) beyond what it finds, where boxes overlap little.
  void AppendMeeting(const Box& box, uint32_t first, std::vector<uint32_t>& found) const;

  // The same piece by piece: Begin, then AppendMeeting until it returns true. Each piece looks at
  // `nodes` nodes at most, and so appends at most kLeafBoxes indices for each.
  Cursor Begin() const;
  bool AppendMeeting(const Box& box, uint32_t first, uint64_t nodes, Cursor& cursor,
                     std::vector<uint32_t>& found) const;

  // For searches of two trees at once. Nodes are known by number; that of the root is 0.
  bool empty() const { return nodes_.empty(); }
  const Box& box(uint32_t node) const { return nodes_[node].box; }
  bool is_leaf(uint32_t node) const { return nodes_[node].second == 0; }
  // Requires a node that is no leaf.
  std::array<uint32_t, 2> children(uint32_t node) const {
    HULLD_DCHECK(!is_leaf(node));
    return {node + 1, nodes_[node].second};
  }
  // The boxes of a leaf, at most kLeafBoxes, and their indices.
  std::span<const Box> boxes(uint32_t leaf) const { return Part(boxes_, leaf); }
  std::span<const uint32_t> indices(uint32_t leaf) const { return Part(indices_, leaf); }
  // A choice, not tuned.
  static constexpr uint32_t kLeafBoxes = 8;

  size_t MemoryBytes() const {
    return nodes_.capacity() * sizeof(Node) + indices_.capacity() * sizeof(uint32_t) +
           boxes_.capacity() * sizeof(Box);
  }

 private:
  // An inner node's children are the node after it and `second`; a leaf's boxes are those from
  // `begin` to `end`.
  struct Node {
    Box box;
    uint32_t largest_index;
    uint32_t second;
    uint32_t begin;
    uint32_t end;
  };

  uint32_t Build(std::span<const Box> boxes, uint32_t begin, uint32_t end, StopPoll& poll);

  template <typename T>
  std::span<const T> Part(const std::vector<T>& all, uint32_t leaf) const {
    const Node& node = nodes_[leaf];
    return std::span(all).subspan(node.begin, node.end - node.begin);
  }

  std::vector<Node> nodes_;
  // In the order of the leaves.
  std::vector<uint32_t> indices_;
  std::vector<Box> boxes_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_BOX_TREE_H_
