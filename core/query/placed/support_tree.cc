#include "core/query/placed/support_tree.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "core/base/check.h"

namespace hulld {

SupportTree::SupportTree(std::span<const Vector> points, StopPoll& poll) : order_(points.size()) {
  HULLD_CHECK(!points.empty());
  std::iota(order_.begin(), order_.end(), 0u);
  nodes_.reserve(points.size() / (kLeafPoints / 2) + 1);
  Build(points, 0, static_cast<uint32_t>(points.size()), poll);
  nodes_.shrink_to_fit();
}

void SupportTree::Build(std::span<const Vector> points, uint32_t first, uint32_t end,
                        StopPoll& poll) {
  // Dividing this many points takes about 10 us.
  constexpr uint32_t kPointsPerStep = 1024;
  if (poll.Step(1 + (end - first) / kPointsPerStep)) return;
  const size_t node = nodes_.size();
  Vector low = points[order_[first]];
  Vector high = low;
  for (uint32_t i = first + 1; i < end; ++i) {
    low = low.cwiseMin(points[order_[i]]);
    high = high.cwiseMax(points[order_[i]]);
  }
  nodes_.push_back({low, high, first, end, 0});
  if (!nodes_[node].is_leaf()) {
    int axis = 0;
    (high - low).maxCoeff(&axis);
    const uint32_t middle = first + (end - first) / 2;
    // A total order, so that every standard library divides the points in the same way.
    std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + end,
                     [&](uint32_t a, uint32_t b) {
                       return std::pair(points[a][axis], a) < std::pair(points[b][axis], b);
                     });
    Build(points, first, middle, poll);
    Build(points, middle, end, poll);
  } else {
    std::sort(order_.begin() + first, order_.begin() + end);
  }
  nodes_[node].after = static_cast<uint32_t>(nodes_.size());
}

SupportPoint SupportTree::Farthest(std::span<const Vector> points, const PlainVector& n) const {
  HULLD_DCHECK(!empty());
  const Vector& v = points[order_[0]];
  SupportPoint best{order_[0], SupportValue(n, v.x(), v.y(), v.z())};
  Search(points, 0, n, best);
  return best;
}

void SupportTree::Search(std::span<const Vector> points, uint32_t at, const PlainVector& n,
                         SupportPoint& best) const {
  const Node& node = nodes_[at];
  if (node.is_leaf()) {
    for (uint32_t i = node.first; i < node.end; ++i) {
      const Vector& v = points[order_[i]];
      const double value = SupportValue(n, v.x(), v.y(), v.z());
      if (value > best.value) best = {order_[i], value};
    }
    return;
  }
  // Visits the half with the larger upper bound first.
  std::array<uint32_t, 2> halves = {at + 1, nodes_[at + 1].after};
  std::array<double, 2> reaches = {nodes_[halves[0]].ReachAlong(n),
                                   nodes_[halves[1]].ReachAlong(n)};
  if (reaches[1] > reaches[0]) {
    std::swap(halves[0], halves[1]);
    std::swap(reaches[0], reaches[1]);
  }
  for (size_t k = 0; k < 2; ++k) {
    if (reaches[k] > best.value) Search(points, halves[k], n, best);
  }
}

}  // namespace hulld
