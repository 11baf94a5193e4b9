#include "core/query/box_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/vector.h"

namespace hulld {
Box Box::All() { return {Vector::Constant(-kLargestDouble), Vector::Constant(kLargestDouble)}; }

Box Box::Empty() { return {Vector::Constant(kInfinity), Vector::Constant(-kInfinity)}; }

Box GrownBy(const Box& box, double clearance) {
  if (clearance == 0) return box;
  // Rounds outwards by one unit in the last place, the largest error of the sums.
  const auto grown = [&](double x, double toward) {
    return std::nextafter(x + std::copysign(clearance, toward), toward);
  };
  Box result = box;
  for (int axis = 0; axis < 3; ++axis) {
    result.low[axis] = grown(box.low[axis], -kInfinity);
    result.high[axis] = grown(box.high[axis], kInfinity);
  }
  return result;
}

Box BoundingBox(const PlacedHull& placed) {
  if (placed.empty()) return Box::Empty();
  const Vector& t = placed.X_WH().t;
  const double size = placed.query_hull().max_abs_coordinate() + t.cwiseAbs().maxCoeff();
  // The error of a product is relative to its factors, which may be far larger than the hull.
  const double translation_error =
      placed.product() == nullptr ? 0 : placed.product()->translation_error();
  if (!IsFilterSize(size) || !std::isfinite(translation_error)) {
    return Box::All();
  }
  const QueryHull& hull = placed.query_hull();
  const double error = kSupportErrorFactor * size + translation_error;
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    const PlainVector n = Vector(placed.R_WH().row(axis));
    box.high[axis] = t[axis] + hull.Farthest(n).value + error;
    box.low[axis] = t[axis] - hull.Farthest(-n).value - error;
  }
  for (const double radius : placed.radii()) box = GrownBy(box, radius);
  return box;
}

BoxTree::BoxTree(std::span<const Box> boxes, const std::function<bool()>& should_stop,
                 int threads) {
  if (boxes.empty()) return;
  std::vector<Item> items;
  items.reserve(boxes.size());
  for (const Box& box : boxes) {
    const Vector sum = box.low + box.high;
    items.push_back({sum.array().isFinite().all() ? sum : Vector(Vector::Zero()),
                     static_cast<uint32_t>(items.size())});
  }
  nodes_.resize(NodesOf(static_cast<uint32_t>(boxes.size())));
  indices_.resize(boxes.size());
  boxes_.resize(boxes.size());
  if (boxes.size() <= kMaxUnshared) threads = 1;
#pragma omp parallel num_threads(threads) if (threads > 1)
#pragma omp single
  Build(boxes, items, 0, 0, should_stop);
}

// Returns the number of nodes of a tree. At each level, parts have one of two consecutive sizes.
uint32_t BoxTree::NodesOf(uint32_t boxes) {
  uint32_t nodes = 0;
  uint32_t size = boxes;
  for (uint32_t smaller = 1, larger = 0; smaller + larger > 0; size /= 2) {
    nodes += smaller + larger;
    if (size <= kLeafBoxes) smaller = 0;
    if (size < kLeafBoxes) larger = 0;
    if (size % 2 == 0) {
      smaller = 2 * smaller + larger;
    } else {
      larger = smaller + 2 * larger;
    }
  }
  return nodes;
}

// Splits the boxes in half along the axis with the widest spread of centers. Large halves are tasks
// of their own.
void BoxTree::Build(std::span<const Box> boxes, std::span<Item> items, uint32_t begin,
                    uint32_t index, const std::function<bool()>& should_stop) {
  const auto count = static_cast<uint32_t>(items.size());
  Node& node = nodes_[index];
  node = {Box::Empty(), 0, 0, begin, begin + count};
  if (count <= kLeafBoxes) {
    for (uint32_t i = 0; i < count; ++i) {
      const Box& box = boxes[items[i].index];
      node.box = {node.box.low.cwiseMin(box.low), node.box.high.cwiseMax(box.high)};
      node.largest_index = std::max(node.largest_index, items[i].index);
      indices_[begin + i] = items[i].index;
      boxes_[begin + i] = box;
    }
    return;
  }
  if (count > kMaxUnshared && StopPoll(should_stop).Poll()) return;
  Box centers = Box::Empty();
  for (const Item& item : items) {
    centers = {centers.low.cwiseMin(item.center), centers.high.cwiseMax(item.center)};
  }
  int axis = 0;
  (centers.high - centers.low).maxCoeff(&axis);
  const uint32_t half = count / 2;
  std::nth_element(items.begin(), items.begin() + half, items.end(),
                   [axis](const Item& i, const Item& j) {
                     const double x = i.center[axis];
                     const double y = j.center[axis];
                     return x < y || (x == y && i.index < j.index);
                   });
  node.second = index + 1 + NodesOf(half);
  if (count > kMaxUnshared) {
#pragma omp task shared(should_stop)
    Build(boxes, items.first(half), begin, index + 1, should_stop);
    Build(boxes, items.subspan(half), begin + half, node.second, should_stop);
#pragma omp taskwait
  } else {
    Build(boxes, items.first(half), begin, index + 1, should_stop);
    Build(boxes, items.subspan(half), begin + half, node.second, should_stop);
  }
  const Node& left = nodes_[index + 1];
  const Node& right = nodes_[node.second];
  node.box = {left.box.low.cwiseMin(right.box.low), left.box.high.cwiseMax(right.box.high)};
  node.largest_index = std::max(left.largest_index, right.largest_index);
}

void BoxTree::AppendMeeting(const Box& box, uint32_t first, std::vector<uint32_t>& found) const {
  Cursor cursor = Begin();
  AppendMeeting(box, first, std::numeric_limits<uint64_t>::max(), cursor, found);
}

BoxTree::Cursor BoxTree::Begin() const {
  Cursor cursor;
  if (!nodes_.empty()) cursor.waiting_[cursor.height_++] = 0;
  return cursor;
}

bool BoxTree::AppendMeeting(const Box& box, uint32_t first, uint64_t nodes, Cursor& cursor,
                            std::vector<uint32_t>& found) const {
  for (; cursor.height_ > 0 && nodes > 0; --nodes) {
    const uint32_t index = cursor.waiting_[--cursor.height_];
    const Node& node = nodes_[index];
    if (node.largest_index < first || !node.box.Meets(box)) continue;
    if (node.second != 0) {
      HULLD_DCHECK(cursor.height_ + 2 <= Cursor::kMaxWaiting);
      cursor.waiting_[cursor.height_++] = node.second;
      cursor.waiting_[cursor.height_++] = index + 1;
      continue;
    }
    for (uint32_t i = node.begin; i < node.end; ++i) {
      if (indices_[i] >= first && boxes_[i].Meets(box)) found.push_back(indices_[i]);
    }
  }
  return cursor.height_ == 0;
}

}  // namespace hulld
