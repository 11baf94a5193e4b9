#include "core/hull/simplification/vertex_subset.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numeric>
#include <random>
#include <utility>

#include "core/base/check.h"
#include "core/hull/simplification/triangle_distance.h"
#include "core/numeric/orientation.h"

namespace hulld {
namespace {

// The most steps from triangle to triangle toward a nearer one; the next search continues from
// there.
constexpr int kMostSteps = 64;
// Average walk steps per point above which a shape is unsuitable for walks.
constexpr uint64_t kMostWalkPerPoint = 64;

// Returns the candidate with the largest `measure`, excluding some.
template <size_t n, typename Measure>
uint32_t Farthest(std::span<const uint32_t> candidates, const std::array<uint32_t, n>& excluded,
                  StopPoll& poll, Measure&& measure) {
  uint32_t best = candidates[0];
  double most = -1;
  for (const uint32_t i : candidates) {
    if (poll.Step()) break;
    bool is_excluded = false;
    for (const uint32_t other : excluded) is_excluded |= i == other;
    if (is_excluded) continue;
    if (const double value = measure(i); value > most) {
      most = value;
      best = i;
    }
  }
  return best;
}

}  // namespace

VertexSubset::VertexSubset(std::span<const Vector> points, std::span<const Vector> unit_points)
    : points_(points), unit_points_(unit_points) {
  HULLD_CHECK(points.size() >= 4 && points.size() == unit_points.size());
  next_.resize(points.size(), kNone);
  distance_.resize(points.size(), 0);
}

VertexSubset::VertexSubset(std::span<const Vector> points, std::span<const Vector> unit_points,
                           StopPoll& poll)
    : VertexSubset(points, unit_points) {
  std::vector<uint32_t> everyone(points.size());
  std::iota(everyone.begin(), everyone.end(), 0u);
  const bool is_solid = StartWithCornersOf(everyone, poll);
  if (poll.stopped()) return;
  HULLD_CHECK(is_solid);
  const std::vector<TriangleId> all = MakeCells();
  for (const uint32_t i : everyone) {
    if (poll.Step()) return;
    if (std::find(chosen_.begin(), chosen_.end(), i) == chosen_.end()) Assign(i, all);
  }
  EnqueueChanged();
}

std::optional<VertexSubset> VertexSubset::StartingWith(std::span<const uint32_t> start,
                                                       std::span<const Vector> points,
                                                       std::span<const Vector> unit_points,
                                                       StopPoll& poll) {
  VertexSubset subset(points, unit_points);
  if (start.size() < 4 || !subset.StartWithCornersOf(start, poll)) return std::nullopt;
  if (!subset.ChooseRestOf(start, poll) || !subset.AssignRest(poll)) return std::nullopt;
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
  for (const uint32_t i : chosen_) vertices_.Add(points_[i]);
  const std::array<VertexId, 3> base = {0, 1, 2};
  surface_.emplace(vertices_, base, 3);
  return true;
}

// Adds the given vertices to the surface, before any list exists. Uses a pseudorandom order,
// because sorted points may see all earlier ones. Returns false if walks are long, or the poll
// stopped.
bool VertexSubset::ChooseRestOf(std::span<const uint32_t> start, StopPoll& poll) {
  if (surface_->directions() == nullptr) return false;
  std::vector<uint32_t> order;
  std::copy_if(start.begin(), start.end(), std::back_inserter(order), [this](uint32_t i) {
    return std::find(chosen_.begin(), chosen_.end(), i) == chosen_.end();
  });
  // Avoids std::shuffle, which differs between libraries.
  std::mt19937 random;
  for (size_t k = order.size(); k > 1; --k) std::swap(order[k - 1], order[random() % k]);
  for (const uint32_t i : order) {
    if (poll.Step(1 + surface_->TakeSteps())) return false;
    surface_->Insert(vertices_, points_[i]);
    chosen_.push_back(i);
    // A vertex of the whole hull is and remains a vertex of the hull of any subset.
    HULLD_CHECK(vertices_.size() == chosen_.size());
    if (IsSlow()) return false;
  }
  return true;
}

// Assigns each vertex that is not chosen to a triangle. Returns false if walks are long, or the
// poll stopped.
bool VertexSubset::AssignRest(StopPoll& poll) {
  MakeCells();
  std::vector<bool> is_chosen(points_.size(), false);
  for (const uint32_t i : chosen_) is_chosen[i] = true;
  for (uint32_t i = 0; i < points_.size(); ++i) {
    if (poll.Step()) return false;
    if (is_chosen[i]) continue;
    const std::optional<Surface::Location> location = surface_->Locate(vertices_, points_[i]);
    if (!location || IsSlow()) return false;
    HULLD_CHECK(location->side == Surface::Side::kOutside);
    Assign(i, {&location->triangle, 1});
  }
  EnqueueChanged();
  return true;
}

// True if walks on the surface are so long that their total may be quadratic.
bool VertexSubset::IsSlow() const {
  return surface_->work() > kMostWalkPerPoint * (points_.size() + 1024);
}

std::vector<TriangleId> VertexSubset::MakeCells() {
  std::vector<TriangleId> all;
  surface_->ForEachTriangle([&](TriangleId id, const SurfaceTriangle&) { all.push_back(id); });
  for (const TriangleId id : all) MakeCell(id);
  return all;
}

void VertexSubset::ChooseNext(StopPoll& poll) {
  HULLD_CHECK(!is_complete());
  const TriangleId worst = Worst();
  // Each vertex that is not chosen is in a list.
  HULLD_CHECK(worst != kNone);
  const uint32_t next = cells_[worst].farthest;
  orphans_.clear();
  for (const TriangleId gone : surface_->RemoveVisible(vertices_, points_[next], worst)) {
    for (uint32_t i = cells_[gone].first; i != kNone; i = next_[i]) {
      if (i != next) orphans_.push_back(i);
    }
    cells_[gone] = {};
  }
  const std::span<const TriangleId> created = surface_->JoinToBoundary(vertices_, points_[next]);
  chosen_.push_back(next);
  HULLD_CHECK(vertices_.size() == chosen_.size());
  for (const TriangleId id : created) MakeCell(id);
  for (const uint32_t i : orphans_) {
    if (poll.Step()) return;
    Assign(i, created);
  }
  EnqueueChanged();
}

double VertexSubset::DistanceBound() {
  const TriangleId worst = Worst();
  return worst == kNone ? 0 : distance_[cells_[worst].farthest];
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

// Assigns the vertex to a triangle that it sees strictly, the one that it is highest above, up to
// rounding. Requires: it sees a target; ConflictLists explains the reason.
void VertexSubset::Assign(uint32_t point, std::span<const TriangleId> targets) {
  TriangleId best = targets[0];
  double most = HeightOver(best, point);
  for (const TriangleId id : targets.subspan(1)) {
    if (const double height = HeightOver(id, point); height > most) {
      most = height;
      best = id;
    }
  }
  best = ClimbFrom(best, point);
  for (size_t k = 0; !Sees(point, best); ++k) {
    HULLD_CHECK(k < targets.size());
    best = targets[k];
  }
  Link(best, point, DistanceTo(best, point));
}

void VertexSubset::Link(TriangleId id, uint32_t point, double distance) {
  Cell& cell = cells_[id];
  next_[point] = cell.first;
  distance_[point] = distance;
  cell.first = point;
  NoteChange(id);
  if (cell.farthest == kNone || distance > distance_[cell.farthest]) cell.farthest = point;
}

// Moves the vertices of a list to nearer triangles.
void VertexSubset::Redistribute(TriangleId id) {
  uint32_t i = std::exchange(cells_[id].first, kNone);
  cells_[id].farthest = kNone;
  NoteChange(id);
  while (i != kNone) {
    const uint32_t next = next_[i];
    TriangleId target = ClimbFrom(id, i);
    double distance = distance_[i];
    if (target != id) {
      const double nearer = DistanceTo(target, i);
      if (nearer < distance && Sees(i, target)) {
        distance = nearer;
      } else {
        target = id;
      }
    }
    Link(target, i, distance);
    i = next;
  }
}

// Enqueues the changed lists in their current state.
void VertexSubset::EnqueueChanged() {
  for (const TriangleId id : changed_) {
    Cell& cell = cells_[id];
    if (!std::exchange(cell.is_changed, false)) continue;
    cell.entry = ++entries_;
    if (cell.first != kNone) queue_.push({distance_[cell.farthest], id, cell.entry});
  }
  changed_.clear();
}

// Returns the triangle reached by steps that each raise the point's height.
TriangleId VertexSubset::ClimbFrom(TriangleId id, uint32_t point) const {
  double height = HeightOver(id, point);
  for (int step = 0; step < kMostSteps; ++step) {
    TriangleId higher = id;
    for (const TriangleId next : surface_->triangle(id).neighbors) {
      if (const double h = HeightOver(next, point); h > height) {
        height = h;
        higher = next;
      }
    }
    if (higher == id) break;
    id = higher;
  }
  return id;
}

// Returns the triangle of the farthest vertex, which no step brings nearer to the surface; kNone if
// no vertex is pending. Moves vertices to nearer triangles on the way, a whole list together: if
// one vertex gains from a new triangle, most of its list does.
TriangleId VertexSubset::Worst() {
  while (!queue_.empty()) {
    const Entry top = queue_.top();
    if (cells_[top.triangle].entry != top.number) {
      queue_.pop();
      continue;
    }
    const uint32_t point = cells_[top.triangle].farthest;
    const TriangleId nearer = ClimbFrom(top.triangle, point);
    if (nearer == top.triangle || !(DistanceTo(nearer, point) < top.distance) ||
        !Sees(point, nearer)) {
      return top.triangle;
    }
    queue_.pop();
    Redistribute(top.triangle);
    EnqueueChanged();
  }
  return kNone;
}

}  // namespace hulld
