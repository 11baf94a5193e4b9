#include "core/hull/simplification/vertex_subset.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/base/check.h"
#include "core/hull/simplification/triangle_distance.h"
#include "core/numeric/orientation.h"

namespace hulld {
namespace {

// Steps from triangle to triangle in search of a nearer one; the next search goes on from there.
constexpr int kMostSteps = 64;

// The number below `count`, other than `excluded`, for which `measure` is largest.
template <size_t n, typename Measure>
uint32_t Farthest(size_t count, const std::array<uint32_t, n>& excluded, StopPoll& poll,
                  Measure&& measure) {
  uint32_t best = 0;
  double most = -1;
  for (uint32_t i = 0; i < count && !poll.Step(); ++i) {
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

VertexSubset::VertexSubset(std::span<const Vector> points, std::span<const Vector> unit_points,
                           StopPoll& poll)
    : points_(points), unit_points_(unit_points) {
  HULLD_CHECK(points.size() >= 4 && points.size() == unit_points.size());
  next_.resize(points.size(), kNone);
  distance_.resize(points.size(), 0);
  Start(poll);
}

// Four points that span the set about as well as any. Three vertices are never on one line; that
// the fourth is not in their plane is decided exactly.
void VertexSubset::Start(StopPoll& poll) {
  const std::span<const Vector> u = unit_points_;
  const size_t n = points_.size();
  const uint32_t a = 0;
  const uint32_t b =
      Farthest<1>(n, {a}, poll, [&](uint32_t i) { return (u[i] - u[a]).stableNorm(); });
  const Vector ab = (u[b] - u[a]).stableNormalized();
  const uint32_t c =
      Farthest<2>(n, {a, b}, poll, [&](uint32_t i) { return ab.cross(u[i] - u[a]).stableNorm(); });
  const Vector normal = ab.cross((u[c] - u[a]).stableNormalized()).stableNormalized();
  uint32_t d = Farthest<3>(n, {a, b, c}, poll,
                           [&](uint32_t i) { return std::abs(normal.dot(u[i] - u[a])); });
  if (poll.stopped()) return;
  const auto is_apart = [&](uint32_t i) {
    return Orient3d(points_[a], points_[b], points_[c], points_[i]) != 0;
  };
  for (uint32_t i = 0; !is_apart(d) && i < n; ++i) d = i;
  HULLD_CHECK(is_apart(d));

  chosen_ = {a, b, c, d};
  for (const uint32_t i : chosen_) vertices_.Add(points_[i]);
  const std::array<VertexId, 3> base = {0, 1, 2};
  surface_.emplace(vertices_, base, 3);
  std::vector<TriangleId> all;
  surface_->ForEachTriangle([&](TriangleId id, const SurfaceTriangle&) { all.push_back(id); });
  for (const TriangleId id : all) MakeCell(id);
  for (uint32_t i = 0; i < n && !poll.Step(); ++i) {
    if (i != a && i != b && i != c && i != d) Assign(i, all);
  }
  EnqueueChanged();
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

// Gives the vertex to a triangle that it sees strictly, the one that it is highest above unless
// rounding deceives. Requires that it sees a target: see ConflictLists for why it does.
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

// Moves the vertices of a list to triangles that came nearer.
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

// Puts the lists that changed into the queue as they are now.
void VertexSubset::EnqueueChanged() {
  for (const TriangleId id : changed_) {
    Cell& cell = cells_[id];
    if (!std::exchange(cell.is_changed, false)) continue;
    cell.entry = ++entries_;
    if (cell.first != kNone) queue_.push({distance_[cell.farthest], id, cell.entry});
  }
  changed_.clear();
}

// The triangle to which steps lead that each raise the point's height.
TriangleId VertexSubset::ClimbFrom(TriangleId id, uint32_t point) const {
  double height = HeightOver(id, point);
  for (int step = 0; step < kMostSteps; ++step) {
    TriangleId higher = id;
    for (const TriangleId next : surface_->triangle(id).neighbours) {
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

// The triangle of the farthest vertex, which no step brings nearer to the surface; kNone when no
// vertex waits. Moves vertices to nearer triangles on the way, all of a list at once: what one
// gains from a new triangle others mostly do, too.
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
