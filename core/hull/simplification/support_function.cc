#include "core/hull/simplification/support_function.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <utility>

#include "core/base/check.h"
#include "core/hull/simplification/triangle_distance.h"

namespace hulld {
namespace {

constexpr uint32_t kLeafVertices = 8;
// Number of vertices partitioned in the time of about one poll step.
constexpr uint32_t kVerticesPerStep = 256;
// Maximum degree of a vertex to climb from.
constexpr size_t kMaxNeighbors = 64;
// Maximum number of vertices to climb to, so that a path around a long edge of small facets is not
// walked to its end.
constexpr int kMaxClimbs = 256;
// Maximum number of support points for one distance. Each lowers the bound, which is valid after
// any number of them.
constexpr int kMaxSupportPoints = 32;
// Relative gap between bound and distance below which another support point is not worth its cost.
constexpr double kRelativeEnough = 1e-9;

double ReachOf(const Vector& low, const Vector& high, const Vector& direction) {
  double reach = 0;
  for (int k = 0; k < 3; ++k) reach += direction[k] * (direction[k] > 0 ? high[k] : low[k]);
  return reach;
}

}  // namespace

SupportFunction::SupportFunction(const Hull& hull, std::span<const Vector> points, StopPoll& poll)
    : points_(points), order_(points.size()) {
  HULLD_CHECK(!points.empty() && points.size() == hull.vertices().size());
  Link(hull, poll);
  std::iota(order_.begin(), order_.end(), 0u);
  Build(0, static_cast<uint32_t>(order_.size()), poll);
}

void SupportFunction::Link(const Hull& hull, StopPoll& poll) {
  starts_.assign(points_.size() + 1, 0);
  for (const Edge& edge : hull.edges()) {
    if (poll.Step()) return;
    ++starts_[edge.tail];
    ++starts_[edge.head];
  }
  uint32_t end = 0;
  for (uint32_t& start : starts_) start = end += start;
  neighbors_.resize(2 * hull.edges().size());
  for (const Edge& edge : hull.edges()) {
    if (poll.Step()) return;
    neighbors_[--starts_[edge.tail]] = edge.head;
    neighbors_[--starts_[edge.head]] = edge.tail;
  }
}

void SupportFunction::Build(uint32_t first, uint32_t end, StopPoll& poll) {
  if (poll.Step(1 + (end - first) / kVerticesPerStep)) return;
  const size_t node = nodes_.size();
  Vector low = points_[order_[first]];
  Vector high = low;
  for (uint32_t i = first + 1; i < end; ++i) {
    low = low.cwiseMin(points_[order_[i]]);
    high = high.cwiseMax(points_[order_[i]]);
  }
  nodes_.push_back({low, high, first, end, 0});
  if (end - first <= kLeafVertices) return;
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const uint32_t middle = first + (end - first) / 2;
  std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + end,
                   [&](uint32_t a, uint32_t b) { return points_[a][axis] < points_[b][axis]; });
  Build(first, middle, poll);
  nodes_[node].second_half = static_cast<uint32_t>(nodes_.size());
  Build(middle, end, poll);
}

uint32_t SupportFunction::FarthestAlong(const Vector& direction, uint32_t start) const {
  uint32_t best = start;
  double max_reach = points_[best].dot(direction);
  for (int climbs = 0; climbs < kMaxClimbs; ++climbs) {
    const uint32_t at = best;
    const std::span<const uint32_t> neighbors = NeighborsOf(at);
    if (neighbors.size() > kMaxNeighbors) break;
    for (const uint32_t next : neighbors) {
      if (const double reach = points_[next].dot(direction); reach > max_reach) {
        max_reach = reach;
        best = next;
      }
    }
    if (best == at) return best;
  }
  Search(0, direction, best, max_reach);
  return best;
}

void SupportFunction::Search(uint32_t at, const Vector& direction, uint32_t& best,
                             double& max_reach) const {
  const Node& node = nodes_[at];
  if (node.second_half == 0) {
    for (uint32_t i = node.first; i < node.end; ++i) {
      if (const double reach = points_[order_[i]].dot(direction); reach > max_reach) {
        max_reach = reach;
        best = order_[i];
      }
    }
    return;
  }
  // Visits the half that reaches farther first.
  std::array<uint32_t, 2> halves = {at + 1, node.second_half};
  std::array<double, 2> reaches{};
  for (size_t k = 0; k < 2; ++k) {
    reaches[k] = ReachOf(nodes_[halves[k]].low, nodes_[halves[k]].high, direction);
  }
  if (reaches[1] > reaches[0]) {
    std::swap(halves[0], halves[1]);
    std::swap(reaches[0], reaches[1]);
  }
  for (size_t k = 0; k < 2; ++k) {
    if (reaches[k] > max_reach) Search(halves[k], direction, best, max_reach);
  }
}

double SupportFunction::DistanceBound(const Vector& p, uint32_t start, double enough) const {
  std::array<Vector, 3> corners = {points_[start], points_[start], points_[start]};
  TriangleDistance best = DistanceToTriangle(corners[0], corners[1], corners[2], p);
  uint32_t at = start;
  for (int k = 0; k < kMaxSupportPoints && best.bound > enough; ++k) {
    const Vector toward = (p - best.nearest).stableNormalized();
    at = FarthestAlong(toward, at);
    const Vector& support = points_[at];
    // The whole hull is behind the plane through the support point.
    if (toward.dot(p - support) >= (1 - kRelativeEnough) * best.bound) break;
    TriangleDistance least = best;
    size_t goes = 3;
    for (size_t out = 0; out < 3; ++out) {
      std::array<Vector, 3> candidate = corners;
      candidate[out] = support;
      const TriangleDistance distance =
          DistanceToTriangle(candidate[0], candidate[1], candidate[2], p);
      if (distance.bound < least.bound) {
        least = distance;
        goes = out;
      }
    }
    if (goes == 3) break;
    best = least;
    corners[goes] = support;
  }
  return best.bound;
}

}  // namespace hulld
