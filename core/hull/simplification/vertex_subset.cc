#include "core/hull/simplification/vertex_subset.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "core/base/check.h"
#include "core/hull/simplification/triangle_distance.h"
#include "core/numeric/orientation.h"

namespace hulld {
namespace {

// Returns the candidate with the largest `measure`, excluding some.
template <size_t n, typename Measure>
uint32_t Farthest(std::span<const uint32_t> candidates, const std::array<uint32_t, n>& excluded,
                  StopPoll& poll, Measure&& measure) {
  uint32_t best = candidates[0];
  double largest = -1;
  for (const uint32_t i : candidates) {
    if (poll.Step()) break;
    bool is_excluded = false;
    for (const uint32_t other : excluded) is_excluded |= i == other;
    if (is_excluded) continue;
    if (const double value = measure(i); value > largest) {
      largest = value;
      best = i;
    }
  }
  return best;
}

}  // namespace

VertexSubset::VertexSubset(std::span<const Vector> points, std::span<const Vector> unit_points)
    : points_(points),
      unit_points_(unit_points),
      distance_(points.size(), 0),
      triangle_(points.size(), kNone),
      next_(points.size(), kNone) {
  HULLD_CHECK(points.size() >= 4 && points.size() == unit_points.size());
}

VertexSubset::VertexSubset(std::span<const Vector> points, std::span<const Vector> unit_points,
                           StopPoll& poll)
    : VertexSubset(points, unit_points) {
  std::vector<uint32_t> everyone(points.size());
  std::iota(everyone.begin(), everyone.end(), 0u);
  const bool is_solid = StartWithCornersOf(everyone, poll);
  HULLD_CHECK(is_solid || poll.stopped());
}

std::optional<VertexSubset> VertexSubset::StartingWith(std::span<const uint32_t> start,
                                                       std::span<const Vector> points,
                                                       std::span<const Vector> unit_points,
                                                       StopPoll& poll) {
  VertexSubset subset(points, unit_points);
  if (start.size() < 4 || !subset.StartWithCornersOf(start, poll)) return std::nullopt;
  for (const uint32_t i : start) {
    if (subset.distance_[i] != kChosen) subset.Choose(i, poll);
    if (poll.stopped()) return std::nullopt;
  }
  return subset;
}

// Starts with four of the candidates that span them nearly optimally. Three vertices are never on
// one line; the test that the fourth is not in their plane is exact. Returns false if all are in a
// plane, or the poll stopped.
bool VertexSubset::StartWithCornersOf(std::span<const uint32_t> candidates, StopPoll& poll) {
  const std::span<const Vector> u = unit_points_;
  const uint32_t a = candidates[0];
  const uint32_t b =
      Farthest<1>(candidates, {a}, poll, [&](uint32_t i) { return (u[i] - u[a]).stableNorm(); });
  const Vector ab = (u[b] - u[a]).stableNormalized();
  const uint32_t c = Farthest<2>(candidates, {a, b}, poll,
                                 [&](uint32_t i) { return ab.cross(u[i] - u[a]).stableNorm(); });
  const Vector normal = ab.cross((u[c] - u[a]).stableNormalized()).stableNormalized();
  uint32_t d = Farthest<3>(candidates, {a, b, c}, poll,
                           [&](uint32_t i) { return std::abs(normal.dot(u[i] - u[a])); });
  if (poll.stopped()) return false;
  const auto is_apart = [&](uint32_t i) {
    return Orient3d(points_[a], points_[b], points_[c], points_[i]) != 0;
  };
  if (!is_apart(d)) {
    const auto apart = std::find_if(candidates.begin(), candidates.end(), is_apart);
    if (apart == candidates.end()) return false;
    d = *apart;
  }
  chosen_ = {a, b, c, d};
  for (const uint32_t i : chosen_) {
    vertices_.Add(points_[i]);
    distance_[i] = kChosen;
  }
  const std::array<VertexId, 3> base = {0, 1, 2};
  surface_.emplace(vertices_, base, 3);
  std::vector<TriangleId> all;
  surface_->ForEachTriangle([&](TriangleId id, const SurfaceTriangle&) { all.push_back(id); });
  for (const TriangleId id : all) MakeCell(id);
  for (uint32_t i = 0; i < points_.size(); ++i) {
    if (poll.Step()) return false;
    if (distance_[i] != kChosen) Assign(i, all);
  }
  Enqueue(all);
  return true;
}

void VertexSubset::ChooseNext(StopPoll& poll) {
  HULLD_CHECK(!is_complete());
  // Each vertex that is not chosen is in a list.
  const double distance = DistanceBound();
  HULLD_CHECK(distance > 0);
  Choose(queue_.top().point, poll);
}

// Requires: a vertex that is not chosen.
void VertexSubset::Choose(uint32_t point, StopPoll& poll) {
  orphans_.clear();
  for (const TriangleId gone :
       surface_->RemoveVisible(vertices_, points_[point], triangle_[point])) {
    for (uint32_t i = cells_[gone].first; i != kNone; i = next_[i]) {
      if (i != point) orphans_.push_back(i);
    }
    cells_[gone] = {};
  }
  const std::span<const TriangleId> created = surface_->JoinToBoundary(vertices_, points_[point]);
  chosen_.push_back(point);
  distance_[point] = kChosen;
  // A vertex of the whole hull is and remains a vertex of the hull of any subset.
  HULLD_CHECK(vertices_.size() == chosen_.size());
  for (const TriangleId id : created) MakeCell(id);
  for (const uint32_t i : orphans_) {
    if (poll.Step()) return;
    Assign(i, created);
  }
  Enqueue(created);
}

double VertexSubset::DistanceBound() {
  while (!queue_.empty() && distance_[queue_.top().point] != queue_.top().distance) queue_.pop();
  return queue_.empty() ? 0 : queue_.top().distance;
}

void VertexSubset::MakeCell(TriangleId id) {
  if (cells_.size() <= id) cells_.resize(id + 1);
  const auto& [a, b, c] = surface_->triangle(id).corners;
  const Vector& corner = unit_points_[chosen_[a]];
  const Vector e = unit_points_[chosen_[b]] - corner;
  const Vector f = unit_points_[chosen_[c]] - corner;
  cells_[id] = {};
  cells_[id].corner = corner;
  cells_[id].normal = e.stableNormalized().cross(f.stableNormalized()).stableNormalized();
}

double VertexSubset::DistanceTo(TriangleId id, uint32_t point) const {
  const auto& [a, b, c] = surface_->triangle(id).corners;
  return DistanceToTriangleBound(unit_points_[chosen_[a]], unit_points_[chosen_[b]],
                                 unit_points_[chosen_[c]], unit_points_[point]);
}

// Assigns the vertex to the triangle that it is highest above, up to rounding, among the targets
// that it sees strictly. Requires: it sees a target, for the reason given at ConflictLists.
void VertexSubset::Assign(uint32_t point, std::span<const TriangleId> targets) {
  TriangleId best = targets[0];
  double largest = HeightOver(best, point);
  for (const TriangleId id : targets.subspan(1)) {
    if (const double height = HeightOver(id, point); height > largest) {
      largest = height;
      best = id;
    }
  }
  for (size_t k = 0; !Sees(point, best); ++k) {
    HULLD_CHECK(k < targets.size());
    best = targets[k];
  }
  Cell& cell = cells_[best];
  triangle_[point] = best;
  next_[point] = std::exchange(cell.first, point);
  distance_[point] = DistanceTo(best, point);
  if (cell.farthest == kNone || distance_[point] > distance_[cell.farthest]) cell.farthest = point;
}

void VertexSubset::Enqueue(std::span<const TriangleId> ids) {
  for (const TriangleId id : ids) {
    const uint32_t farthest = cells_[id].farthest;
    if (farthest != kNone) queue_.push({distance_[farthest], farthest});
  }
}

}  // namespace hulld
