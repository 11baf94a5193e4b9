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

BoxTree::BoxTree(std::span<const Box> boxes, const std::function<bool()>& should_stop)
    : indices_(boxes.size()) {
  std::iota(indices_.begin(), indices_.end(), 0u);
  if (boxes.empty()) return;
  nodes_.reserve(2 * (boxes.size() / (kLeafBoxes / 2) + 1));
  StopPoll poll(should_stop);
  Build(boxes, 0, static_cast<uint32_t>(boxes.size()), poll);
  boxes_.reserve(boxes.size());
  for (const uint32_t index : indices_) boxes_.push_back(boxes[index]);
}

// Splits the boxes in half along the axis with the widest spread of centers.
uint32_t BoxTree::Build(std::span<const Box> boxes, uint32_t begin, uint32_t end, StopPoll& poll) {
  const auto node = static_cast<uint32_t>(nodes_.size());
  Box bounds = Box::Empty();
  Box centers = bounds;
  // Twice the center; 0 for a box that covers all of space.
  const auto center = [&](uint32_t index) {
    const Vector sum = boxes[index].low + boxes[index].high;
    return sum.array().isFinite().all() ? sum : Vector(Vector::Zero());
  };
  uint32_t largest_index = 0;
  for (uint32_t i = begin; i < end; ++i) {
    const Box& box = boxes[indices_[i]];
    bounds = {bounds.low.cwiseMin(box.low), bounds.high.cwiseMax(box.high)};
    const Vector c = center(indices_[i]);
    centers = {centers.low.cwiseMin(c), centers.high.cwiseMax(c)};
    largest_index = std::max(largest_index, indices_[i]);
  }
  nodes_.push_back({bounds, largest_index, 0, begin, end});
  if (end - begin <= kLeafBoxes || poll.Step(end - begin)) return node;
  int axis = 0;
  (centers.high - centers.low).maxCoeff(&axis);
  const uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(indices_.begin() + begin, indices_.begin() + middle, indices_.begin() + end,
                   [&](uint32_t i, uint32_t j) {
                     const double x = center(i)[axis];
                     const double y = center(j)[axis];
                     return x < y || (x == y && i < j);
                   });
  Build(boxes, begin, middle, poll);
  nodes_[node].second = Build(boxes, middle, end, poll);
  return node;
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
      HULLD_DCHECK(cursor.height_ + 2 <= Cursor::kMostWaiting);
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
