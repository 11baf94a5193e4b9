#include "core/hull/growth/surface.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/base/check.h"
#include "core/hull/growth/surface_check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/orientation.h"
#include "core/numeric/vector.h"

namespace hulld {
namespace {

// Times the power of two that brings the largest component into [1/2, 1).
Vector WithUnitSize(const Vector& v) {
  int exponent = 0;
  std::frexp(LargestComponent(v), &exponent);
  return v.unaryExpr([exponent](double component) { return std::ldexp(component, -exponent); });
}

}  // namespace

Surface::Surface(const VertexTable& vertices, std::span<const VertexId> polygon, VertexId apex) {
  HULLD_CHECK(polygon.size() >= 3);
  std::vector<VertexId> loop(polygon.begin(), polygon.end());
  const int side =
      Orient3d(vertices[loop[0]], vertices[loop[1]], vertices[loop[2]], vertices[apex]);
  HULLD_CHECK(side != 0);
  // Seen from outside, the apex is behind the base.
  if (side > 0) std::reverse(loop.begin(), loop.end());
  const size_t n = loop.size();
  for (size_t i = 1; i + 1 < n; ++i) {
    SetTriangle(vertices, NewId(), loop[i], loop[i + 1], loop[0]);
  }
  for (size_t i = 0; i < n; ++i) {
    SetTriangle(vertices, NewId(), loop[(i + 1) % n], loop[i], apex);
  }
  alive_ = triangles_.size();
  LinkAll();
  while (vertex_mark_.size() < vertices.id_bound()) vertex_mark_.push_back(0);
  Update(vertices);
  DcheckSurface(*this, vertices);
}

void Surface::InsertSurvivor(VertexTable& vertices, const Vector& point, size_t cell) {
  const double size = SizeWith(vertices, point);
  std::optional<Location> location;
  if (directions_) {
    location = Walk(vertices, point, size, Alive(directions_->hint(cell)), work_);
  }
  if (!location) {
    location = Scan(vertices, point, size);
    work_ += triangles_.size();
  }
  last_ = location->triangle;
  if (location->side == Side::kInside) {
    // A point equal to a vertex lies in the cones of that vertex's triangles alone.
    const std::optional<VertexId> corner = CornerAt(vertices, location->triangle, point);
    if (corner) vertices.CountDuplicate(*corner);
  } else {
    RemoveVisible(vertices, point, location->triangle);
    JoinToBoundary(vertices, point);
  }
  if (directions_) directions_->SetHint(cell, last_);
  if (measuring_ || alive_ >= next_update_) Measure(vertices);
}

std::span<const TriangleId> Surface::RemoveVisible(VertexTable& vertices, const Vector& point,
                                                   TriangleId seen) {
  HULLD_DCHECK(IsAlive(seen) && IsSeenFrom(vertices, seen, point));
  CollectRegion(vertices, seen, point, SizeWith(vertices, point));
  RemoveVertices(vertices);
  return region_;
}

std::span<const TriangleId> Surface::JoinToBoundary(VertexTable& vertices, const Vector& point) {
  // Empty unless RemoveVisible has come before.
  HULLD_CHECK(horizon_.size() >= 3);
  const VertexId apex = vertices.Add(point);
  JoinHorizon(vertices, apex);
  // Here rather than when they are needed, so that no insertion does it for many.
  while (vertex_mark_.size() < vertices.id_bound()) vertex_mark_.push_back(0);
  if (directions_) {
    extent_ = std::max(extent_, LargestComponent(point - directions_->center()));
  }
  const std::span<const TriangleId> created = std::span(region_).first(horizon_.size());
  DcheckStar(*this, vertices, created, apex);
  return created;
}

size_t Surface::MemoryBytes() const {
  size_t bytes = triangles_.MemoryBytes() + free_.MemoryBytes() + vertex_mark_.MemoryBytes();
  if (directions_) bytes += directions_->MemoryBytes();
  if (measuring_) {
    bytes += measuring_->map.MemoryBytes() + measuring_->hint.capacity() * sizeof(TriangleId);
  }
  return bytes + region_.capacity() * sizeof(TriangleId) +
         horizon_.capacity() * sizeof(HorizonEdge) + visits_.capacity() * sizeof(Visit);
}

double Surface::SizeWith(const VertexTable& vertices, const Vector& point) const {
  const double size = vertices.max_abs_coordinate() + LargestComponent(point);
  return size >= kPlaneMinCoordinate && size <= kPlaneMaxCoordinate ? size : INFINITY;
}

int Surface::ExactSideOf(const VertexTable& vertices, const SurfaceTriangle& t,
                         const Vector& point) const {
  const auto& [a, b, c] = t.corners;
  return Orient3d(vertices[a], vertices[b], vertices[c], point);
}

void Surface::SetTriangle(const VertexTable& vertices, TriangleId id, VertexId a, VertexId b,
                          VertexId c) {
  SurfaceTriangle& t = triangles_[id];
  Vector e = vertices[b] - vertices[a];
  Vector f = vertices[c] - vertices[a];
  double slope = kPlaneErrorFactor * LargestComponent(e) * LargestComponent(f);
  if (!(slope >= kPlaneMinSlope && slope <= kPlaneMaxSlope)) {
    e = WithUnitSize(e);
    f = WithUnitSize(f);
    slope = kPlaneErrorFactor * LargestComponent(e) * LargestComponent(f);
  }
  t.corners = {a, b, c};
  t.normal = Cross(e, f);
  t.offset = t.normal.dot(vertices[a]);
  t.slope = static_cast<float>(slope * (1 + 0x1p-20));
  t.mark = 0;
}

TriangleId Surface::NewId() {
  if (free_.empty()) {
    HULLD_CHECK(triangles_.size() < kDead);
    return static_cast<TriangleId>(triangles_.Extend());
  }
  const TriangleId id = free_.back();
  free_.pop_back();
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
    const auto twin = by_edge.find({edge.second, edge.first});
    HULLD_CHECK(twin != by_edge.end());
    triangles_[place.first].neighbours[place.second] = twin->second.first;
  }
}

std::optional<VertexId> Surface::CornerAt(const VertexTable& vertices, TriangleId id,
                                          const Vector& point) const {
  for (const VertexId v : triangles_[id].corners) {
    if (vertices[v] == point) return v;
  }
  return std::nullopt;
}

void Surface::ResetMarks() {
  for (TriangleId id = 0; id < triangles_.size(); ++id) triangles_[id].mark = 0;
  for (VertexId id = 0; id < vertex_mark_.size(); ++id) vertex_mark_[id] = 0;
  mark_ = 0;
}

// Fills the region with the connected triangles that the point sees or whose planes hold it, and
// the horizon with their boundary, in order round it: depth first, the edges of each triangle
// counter-clockwise from the one it was entered by.
void Surface::CollectRegion(const VertexTable& vertices, TriangleId first, const Vector& point,
                            double size) {
  if (mark_ == UINT32_MAX) ResetMarks();
  const uint32_t mark = ++mark_;
  region_.assign(1, first);
  horizon_.clear();
  triangles_[first].mark = mark;
  visits_.assign(1, {first, 0, 3});
  while (!visits_.empty()) {
    Visit& visit = visits_.back();
    if (visit.left == 0) {
      visits_.pop_back();
      continue;
    }
    const SurfaceTriangle& t = triangles_[visit.triangle];
    const TriangleId id = visit.triangle;
    const uint32_t i = visit.edge;
    visit.edge = static_cast<uint8_t>((i + 1) % 3);
    --visit.left;
    const TriangleId next = t.neighbours[i];
    SurfaceTriangle& other = triangles_[next];
    if (other.mark == mark) continue;
    const uint32_t back = other.neighbours[0] == id ? 0 : other.neighbours[1] == id ? 1 : 2;
    HULLD_DCHECK(other.neighbours[back] == id);
    if (SideOf(vertices, next, point, size) >= 0) {
      other.mark = mark;
      region_.push_back(next);
      visits_.push_back({next, static_cast<uint8_t>((back + 1) % 3), 2});
    } else {
      horizon_.push_back({t.corners[i], t.corners[(i + 1) % 3], next, back});
    }
  }
}

// Removes the vertices that only triangles of the region have: those not on the horizon. By Euler's
// formula for a disk there are (triangles - edges of the boundary + 2) / 2 of them, mostly none.
void Surface::RemoveVertices(VertexTable& vertices) {
  if (region_.size() + 2 == horizon_.size()) return;
  for (const HorizonEdge& edge : horizon_) vertex_mark_[edge.tail] = mark_;
  for (const TriangleId id : region_) {
    for (const VertexId v : triangles_[id].corners) {
      if (vertex_mark_[v] == mark_) continue;
      vertex_mark_[v] = mark_;
      vertices.Remove(v);
    }
  }
}

// Joins the apex to the horizon; the new triangles take the places of the region's first.
void Surface::JoinHorizon(const VertexTable& vertices, VertexId apex) {
  const size_t old_count = region_.size();
  const size_t new_count = horizon_.size();
  while (region_.size() < new_count) region_.push_back(NewId());
  for (size_t k = 0; k < new_count; ++k) {
    const HorizonEdge& edge = horizon_[k];
    const TriangleId id = region_[k];
    SetTriangle(vertices, id, edge.tail, edge.head, apex);
    triangles_[id].neighbours = {edge.beyond, region_[k + 1 == new_count ? 0 : k + 1],
                                 region_[k == 0 ? new_count - 1 : k - 1]};
    triangles_[edge.beyond].neighbours[edge.edge_beyond] = id;
  }
  for (size_t k = new_count; k < old_count; ++k) {
    triangles_[region_[k]].corners[0] = kDead;
    triangles_[region_[k]].neighbours[0] = region_[0];
    free_.push_back(region_[k]);
  }
  alive_ = alive_ - old_count + new_count;
  last_ = region_[0];
}

}  // namespace hulld
