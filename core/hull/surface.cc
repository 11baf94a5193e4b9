#include "core/hull/surface.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/numeric/orientation.h"

namespace hulld {

Surface::Surface(const VertexTable& vertices, std::span<const VertexId> polygon, VertexId apex) {
  std::vector<VertexId> loop(polygon.begin(), polygon.end());
  // Seen from outside, the apex is behind the base.
  if (Orient3d(vertices[loop[0]], vertices[loop[1]], vertices[loop[2]], vertices[apex]) > 0) {
    std::reverse(loop.begin(), loop.end());
  }
  const size_t n = loop.size();
  for (size_t i = 1; i + 1 < n; ++i) AddTriangle(loop[0], loop[i], loop[i + 1]);
  for (size_t i = 0; i < n; ++i) AddTriangle(loop[(i + 1) % n], loop[i], apex);
  LinkAll();
  UpdateInterior(vertices);
}

void Surface::Insert(VertexTable& vertices, const Vector& point) {
  const Location location = Locate(vertices, point);
  last_ = location.triangle;
  if (location.side == Side::kInside) {
    CountIfDuplicate(vertices, location, point);
    return;
  }
  CollectRegion(vertices, location.triangle, point);
  RemoveRegion(vertices);
  JoinHorizon(vertices.Add(point));
  if (interior_) hints_[HintCell(point)] = last_;
  if (alive_ >= next_update_) UpdateInterior(vertices);
}

// +1 when the point sees the triangle from outside, 0 when it lies in its plane.
int Surface::SideOf(const VertexTable& vertices, TriangleId id, const Vector& point) const {
  const auto& [a, b, c] = triangles_[id].corners;
  return Orient3d(vertices[a], vertices[b], vertices[c], point);
}

TriangleId Surface::AddTriangle(VertexId a, VertexId b, VertexId c) {
  TriangleId id;
  if (free_.empty()) {
    id = static_cast<TriangleId>(triangles_.size());
    triangles_.push_back({});
    region_mark_.push_back(0);
  } else {
    id = free_.back();
    free_.pop_back();
  }
  triangles_[id].corners = {a, b, c};
  ++alive_;
  return id;
}

// Links neighbours by their common edges, for a surface whose triangles are all new.
void Surface::LinkAll() {
  std::map<std::pair<VertexId, VertexId>, std::pair<TriangleId, int>> by_edge;
  for (TriangleId id = 0; id < triangles_.size(); ++id) {
    for (int i = 0; i < 3; ++i) {
      const auto& corners = triangles_[id].corners;
      by_edge[{corners[i], corners[(i + 1) % 3]}] = {id, i};
    }
  }
  for (const auto& [edge, place] : by_edge) {
    triangles_[place.first].neighbours[place.second] = by_edge.at({edge.second, edge.first}).first;
  }
}

Surface::Location Surface::Locate(const VertexTable& vertices, const Vector& point) {
  if (!interior_) return Scan(vertices, point);
  const std::optional<Location> found = Walk(vertices, point);
  return found ? *found : Scan(vertices, point);
}

// Crosses any edge whose plane through the interior point has the point on its far side, starting
// with a random one: among coplanar triangles a fixed order could go in circles. Empty when the
// walk is longer than the surface warrants.
std::optional<Surface::Location> Surface::Walk(const VertexTable& vertices, const Vector& point) {
  const size_t cell = HintCell(point);
  TriangleId at = hints_[cell];
  if (at >= triangles_.size() || !IsAlive(at)) at = last_;
  if (at >= triangles_.size() || !IsAlive(at)) return std::nullopt;
  const size_t longest = 4 * alive_ + 64;
  for (size_t steps = 0; steps < longest; ++steps) {
    if (SideOf(vertices, at, point) > 0) {
      hints_[cell] = at;
      return Location{Side::kOutside, at};
    }
    random_ = random_ * 1664525u + 1013904223u;
    const int first = static_cast<int>((random_ >> 16) % 3);
    bool crossed = false;
    for (int k = 0; k < 3 && !crossed; ++k) {
      const int i = (first + k) % 3;
      const SurfaceTriangle& t = triangles_[at];
      if (Orient3d(*interior_, vertices[t.corners[i]], vertices[t.corners[(i + 1) % 3]], point) <
          0) {
        at = t.neighbours[i];
        crossed = true;
      }
    }
    if (!crossed) {
      hints_[cell] = at;
      return Location{Side::kInside, at};
    }
  }
  return std::nullopt;
}

Surface::Location Surface::Scan(const VertexTable& vertices, const Vector& point) const {
  Location location{Side::kInside, last_};
  for (TriangleId id = 0; id < triangles_.size(); ++id) {
    if (!IsAlive(id)) continue;
    const int side = SideOf(vertices, id, point);
    if (side > 0) return {Side::kOutside, id};
    if (side < 0) continue;
    const auto& corners = triangles_[id].corners;
    if (std::any_of(corners.begin(), corners.end(),
                    [&](VertexId v) { return vertices[v] == point; })) {
      location.triangle = id;
    }
  }
  return location;
}

// A point equal to a vertex lies in the cones of that vertex's triangles alone.
void Surface::CountIfDuplicate(VertexTable& vertices, const Location& location,
                               const Vector& point) const {
  for (const VertexId v : triangles_[location.triangle].corners) {
    if (vertices[v] == point) {
      vertices.CountDuplicate(v);
      return;
    }
  }
}

// The cell of the cube map, round the interior point, that holds the direction to the point: a
// guess, so rounding is harmless.
size_t Surface::HintCell(const Vector& point) const {
  const Vector direction = point * 0.25 - *interior_ * 0.25;
  int axis = 0;
  const double largest = direction.cwiseAbs().maxCoeff(&axis);
  if (!(largest > 0)) return 0;
  const double half = 0.5 * hint_resolution_;
  const auto index = [&](double component) {
    const int i = static_cast<int>((component / largest + 1) * half);
    return static_cast<size_t>(std::clamp(i, 0, hint_resolution_ - 1));
  };
  const size_t face = static_cast<size_t>(2 * axis + (direction[axis] < 0 ? 1 : 0));
  const size_t n = static_cast<size_t>(hint_resolution_);
  return (face * n + index(direction[(axis + 1) % 3])) * n + index(direction[(axis + 2) % 3]);
}

// Looks for an interior point while none is known, and lays out the hints for the present size.
// Called when the surface has doubled, so the cost of O(F) is amortized.
void Surface::UpdateInterior(const VertexTable& vertices) {
  next_update_ = 2 * alive_;
  if (!interior_) {
    // The mean of the corners; each divided first, so that no sum overflows.
    Vector mean = Vector::Zero();
    const double weight = 1.0 / static_cast<double>(3 * alive_);
    ForEachTriangle([&](TriangleId, const SurfaceTriangle& t) {
      for (const VertexId v : t.corners) mean += vertices[v] * weight;
    });
    if (IsStrictlyInside(vertices, mean)) interior_ = mean;
  }
  hint_resolution_ = 1 + static_cast<int>(std::sqrt(static_cast<double>(alive_) / 6.0));
  hints_.assign(static_cast<size_t>(6 * hint_resolution_) * hint_resolution_, kDead);
}

bool Surface::IsStrictlyInside(const VertexTable& vertices, const Vector& point) const {
  if (!point.allFinite()) return false;
  bool inside = true;
  ForEachTriangle([&](TriangleId id, const SurfaceTriangle&) {
    inside = inside && SideOf(vertices, id, point) < 0;
  });
  return inside;
}

// Fills region_ with the connected triangles that the point sees or whose planes hold it, and
// horizon_ with their boundary.
void Surface::CollectRegion(const VertexTable& vertices, TriangleId first, const Vector& point) {
  ++mark_;
  region_.assign(1, first);
  horizon_.clear();
  region_mark_[first] = mark_;
  for (size_t k = 0; k < region_.size(); ++k) {
    for (int i = 0; i < 3; ++i) {
      const SurfaceTriangle& t = triangles_[region_[k]];
      const TriangleId next = t.neighbours[i];
      if (region_mark_[next] == mark_) continue;
      if (SideOf(vertices, next, point) >= 0) {
        region_mark_[next] = mark_;
        region_.push_back(next);
      } else {
        horizon_.push_back({t.corners[i], t.corners[(i + 1) % 3], next});
      }
    }
  }
}

// Removes the triangles of region_ and the vertices that are left without any: those not on the
// horizon.
void Surface::RemoveRegion(VertexTable& vertices) {
  horizon_mark_.resize(vertices.id_bound(), 0);
  for (const HorizonEdge& edge : horizon_) horizon_mark_[edge.tail] = mark_;
  for (const TriangleId id : region_) {
    for (const VertexId v : triangles_[id].corners) {
      if (horizon_mark_[v] == mark_) continue;
      horizon_mark_[v] = mark_;
      vertices.Remove(v);
    }
    triangles_[id].corners[0] = kDead;
    free_.push_back(id);
  }
  alive_ -= region_.size();
}

void Surface::JoinHorizon(VertexId apex) {
  triangle_from_.resize(std::max<size_t>(horizon_mark_.size(), apex + size_t{1}));
  for (const HorizonEdge& edge : horizon_) {
    const TriangleId id = AddTriangle(edge.tail, edge.head, apex);
    triangles_[id].neighbours[0] = edge.beyond;
    SurfaceTriangle& beyond = triangles_[edge.beyond];
    for (int i = 0; i < 3; ++i) {
      if (beyond.corners[i] == edge.head && beyond.corners[(i + 1) % 3] == edge.tail) {
        beyond.neighbours[i] = id;
      }
    }
    triangle_from_[edge.tail] = id;
    last_ = id;
  }
  for (const HorizonEdge& edge : horizon_) {
    const TriangleId id = triangle_from_[edge.tail];
    const TriangleId next = triangle_from_[edge.head];
    triangles_[id].neighbours[1] = next;
    triangles_[next].neighbours[2] = id;
  }
}

}  // namespace hulld
