#include "core/hull/surface/surface.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/hull/surface/surface_check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/orientation.h"
#include "core/numeric/vector.h"

namespace hulld {
namespace {

// Triangles removed and created in about the time of a poll step.
constexpr size_t kTrianglesPerStep = 64;

// Returns the next edge, counter-clockwise.
uint16_t NextEdge(uint32_t edge) { return static_cast<uint16_t>(edge == 2 ? 0 : edge + 1); }

// Returns v times the power of two that brings its largest component into [1/2, 1).
Vector WithUnitSize(const Vector& v) {
  int exponent = 0;
  std::frexp(LargestComponent(v), &exponent);
  return v.unaryExpr([exponent](double component) { return std::ldexp(component, -exponent); });
}

// Makes the plane exact if it is perpendicular to an axis and the sign of its normal is certain.
// With a normal of length 1, so are the signs of all heights: x - a[k] is rounded once. Not
// inlined, because SetPlane is then too long to be inlined. Many facets of CAD models are
// perpendicular to an axis.
[[gnu::noinline]] void SetExactPlane(SurfaceTriangle& t, const Vector& a, const Vector& b,
                                     const Vector& c, double slope) {
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (a[k] != b[k] || a[k] != c[k] || !(std::abs(t.normal[k]) > slope)) continue;
    const double sign = t.normal[k] > 0 ? 1 : -1;
    t.normal = sign * Vector::Unit(k);
    t.offset = sign * a[k];
    t.slope = 0;
  }
}

// Sets the normal, the offset and the slope.
inline void SetPlane(SurfaceTriangle& t, const Vector& a, const Vector& b, const Vector& c) {
  Vector e = b - a;
  Vector f = c - a;
  double slope = kPlaneErrorFactor * LargestComponent(e) * LargestComponent(f);
  if (!(slope >= kPlaneMinSlope && slope <= kPlaneMaxSlope)) {
    e = WithUnitSize(e);
    f = WithUnitSize(f);
    slope = kPlaneErrorFactor * LargestComponent(e) * LargestComponent(f);
  }
  t.normal = Cross(e, f);
  t.offset = t.normal.dot(a);
  t.slope = static_cast<float>(slope * kPlaneSlopeRoundUp);
  // The normal of a plane perpendicular to an axis has two zero components.
  if (t.normal.x() * t.normal.y() == 0) SetExactPlane(t, a, b, c, slope);
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
  // The sides have the IDs 0 to n - 1.
  for (size_t i = 0; i < n; ++i) {
    SetTriangle(vertices, NewId(), loop[(i + 1) % n], loop[i], apex);
  }
  for (TriangleId i = 0; i < n; ++i) Link(i, 2, i + 1 == n ? 0 : i + 1, 1, false);
  const TriangleId base = MakeBase(vertices, loop, 0, n - 1);
  Link(base, 2, static_cast<TriangleId>(n - 1), 0, false);
  alive_ = triangles_.size();
  while (place_of_vertex_.size() < vertices.id_bound()) place_of_vertex_.push_back(0);
  Update(vertices);
  DcheckSurface(*this, vertices);
}

void Surface::InsertSurvivor(VertexTable& vertices, const Vector& point, size_t cell) {
  const double size = SizeWith(vertices, point);
  const uint64_t work_before = work_;
  Location location = {Side::kUnknown, last_};
  if (directions_) {
    location = Walk(vertices, point, size, Alive(directions_->hint(cell)), work_);
  }
  if (location.side == Side::kUnknown) {
    location = Scan(vertices, point, size);
    work_ += triangles_.size();
  }
  steps_ += (work_ - work_before) / kTrianglesPerStep;
  last_ = location.triangle;
  if (location.side == Side::kInside) {
    // A point equal to a vertex lies only in the cones of that vertex's triangles.
    const std::optional<VertexId> corner = CornerAt(vertices, location.triangle, point);
    if (corner) vertices.CountDuplicate(*corner);
  } else {
    RemoveVisible(vertices, point, location.triangle);
    JoinToBoundary(vertices, point);
  }
  if (directions_) directions_->SetHint(cell, last_);
  if (measuring_ || alive_ >= next_update_) Measure(vertices);
}

std::span<const TriangleId> Surface::RemoveVisible(VertexTable& vertices, const Vector& point,
                                                   TriangleId seen) {
  HULLD_DCHECK(IsAlive(seen) && IsSeenFrom(vertices, seen, point));
  const double size = SizeWith(vertices, point);
  if (!CollectCertainRegion(seen, point, size)) CollectRegion(vertices, seen, point, size);
  for (uint32_t k = 0; k < horizon_.size(); ++k) place_of_vertex_.Mutable(horizon_[k].tail) = k;
  RemoveVertices(vertices);
  return {region_.data(), region_.size()};
}

std::span<const TriangleId> Surface::JoinToBoundary(VertexTable& vertices, const Vector& point) {
  // Empty if RemoveVisible was not called before.
  HULLD_CHECK(horizon_.size() >= 3);
  const VertexId apex = vertices.Add(point);
  JoinHorizon(vertices, apex);
  ++joined_;
  // Grown here rather than on demand, so that no single insertion pays the cost of many.
  while (place_of_vertex_.size() < vertices.id_bound()) place_of_vertex_.push_back(0);
  if (directions_) {
    extent_ = std::max(extent_, LargestComponent(point - directions_->center()));
  }
  const std::span<const TriangleId> created(region_.data(), horizon_.size());
  DcheckStar(*this, vertices, created, apex);
  return created;
}

size_t Surface::MemoryBytes() const {
  size_t bytes = triangles_.MemoryBytes() + free_.MemoryBytes() + place_of_vertex_.MemoryBytes();
  if (directions_) bytes += directions_->MemoryBytes();
  if (before_ && before_->directions) bytes += before_->directions->MemoryBytes();
  if (measuring_) {
    bytes += measuring_->map.MemoryBytes() + measuring_->hint.capacity() * sizeof(TriangleId);
  }
  return bytes + region_.capacity() * sizeof(TriangleId) +
         horizon_.capacity() * sizeof(HorizonEdge) + visits_.capacity() * sizeof(Visit) +
         flat_stars_.capacity() * sizeof(TriangleId);
}

void Surface::StartJournal() {
  HULLD_CHECK(!before_);
  triangles_.StartJournal();
  free_.StartJournal();
  before_.Start({.alive = alive_,
                 .extent = extent_,
                 .next_update = next_update_,
                 .tested = tested_,
                 .rejected = rejected_,
                 .measured_at = measured_at_,
                 .joined = joined_,
                 .mark = mark_,
                 .last = last_,
                 .was_measuring = measuring_.has_value(),
                 .has_new_directions = false,
                 .directions = std::nullopt});
}

// Marks and hints are not restored: a mark matters only during its traversal, and a hint may have
// any value.
void Surface::Undo() {
  HULLD_CHECK(before_);
  triangles_.Undo();
  free_.Undo();
  alive_ = before_->alive;
  extent_ = before_->extent;
  next_update_ = before_->next_update;
  tested_ = before_->tested;
  rejected_ = before_->rejected;
  measured_at_ = before_->measured_at;
  joined_ = before_->joined;
  last_ = before_->last;
  if (before_->has_new_directions) directions_ = std::move(before_->directions);
  // A measurement of a larger surface is not valid for this one; measuring restarts soon.
  measuring_.reset();
  if (before_->was_measuring) next_update_ = alive_;
  if (mark_ < before_->mark) ResetMarks();
  before_.End();
}

void Surface::EndJournal() {
  triangles_.EndJournal();
  free_.EndJournal();
  before_.End();
}

size_t Surface::JournalBytes() const {
  size_t bytes = triangles_.JournalBytes() + free_.JournalBytes();
  if (before_ && before_->directions) bytes += before_->directions->MemoryBytes();
  return bytes;
}

// Saves the map of directions. Call before replacing it.
void Surface::KeepDirections() {
  if (!before_ || std::exchange(before_->has_new_directions, true)) return;
  before_->directions = std::move(directions_);
}

int Surface::ExactSideOf(const VertexTable& vertices, const SurfaceTriangle& t,
                         const Vector& point) const {
  const auto& [a, b, c] = t.corners;
  return Orient3d(vertices[a], vertices[b], vertices[c], point);
}

void Surface::SetTriangle(const VertexTable& vertices, TriangleId id, VertexId a, VertexId b,
                          VertexId c) {
  SurfaceTriangle& t = triangles_.Mutable(id);
  SetPlane(t, vertices[a], vertices[b], vertices[c]);
  t.corners = {a, b, c};
  t.mark = 0;
  t.flat = 0;
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

void Surface::Link(TriangleId a, uint32_t edge_a, TriangleId b, uint32_t edge_b, bool is_flat) {
  const auto link = [this, is_flat](TriangleId from, uint32_t edge, TriangleId to) {
    SurfaceTriangle& t = triangles_.Mutable(from);
    t.neighbors[edge] = to;
    t.flat = (t.flat & ~(1u << edge)) | static_cast<uint32_t>(is_flat) << edge;
  };
  link(a, edge_a, b);
  link(b, edge_b, a);
}

// Creates the triangles of the part of a cone's base from the loop's place `first` to `last`,
// linked to each other and to the sides, which have the places' IDs. Returns the triangle at the
// chord between the two, which is its edge 2. Splits into halves recursively, so that a line
// crosses few triangles.
TriangleId Surface::MakeBase(const VertexTable& vertices, std::span<const VertexId> loop,
                             size_t first, size_t last) {
  const size_t middle = first + (last - first) / 2;
  const TriangleId id = NewId();
  SetTriangle(vertices, id, loop[first], loop[middle], loop[last]);
  const auto link_part = [&](uint32_t edge, size_t from, size_t to) {
    if (to - from == 1) return Link(id, edge, static_cast<TriangleId>(from), 0, false);
    Link(id, edge, MakeBase(vertices, loop, from, to), 2, true);
  };
  link_part(0, first, middle);
  link_part(1, middle, last);
  return id;
}

std::optional<VertexId> Surface::CornerAt(const VertexTable& vertices, TriangleId id,
                                          const Vector& point) const {
  for (const VertexId v : triangles_[id].corners) {
    if (vertices[v] == point) return v;
  }
  return std::nullopt;
}

void Surface::ResetMarks() {
  for (TriangleId id = 0; id < triangles_.size(); ++id) triangles_.Mutable(id).mark = 0;
  mark_ = 0;
}

uint32_t Surface::NextMark() {
  if (mark_ == kLastMark) ResetMarks();
  return ++mark_;
}

// Fills the region with the connected triangles for which classify(id) > 0, and the horizon with
// their boundary, in order around it: depth first, the edges of each triangle counter-clockwise
// from the edge by which it was entered. If classify returns 0, the horizon's edge is flat.
template <typename Classify>
void Surface::Traverse(TriangleId first, Classify&& classify) {
  const uint32_t mark = NextMark();
  region_.clear();
  region_.push_back(first);
  horizon_.clear();
  triangles_.Mutable(first).mark = mark;
  visits_.clear();
  Visit visit = {first, 0, 3};
  for (;;) {
    if (visit.left == 0) {
      if (visits_.empty()) return;
      visit = visits_.back();
      visits_.pop_back();
    }
    const TriangleId id = visit.triangle;
    const SurfaceTriangle& t = triangles_[id];
    const uint32_t i = visit.edge;
    visit.edge = NextEdge(i);
    --visit.left;
    const TriangleId next = t.neighbors[i];
    const SurfaceTriangle& other = triangles_[next];
    if (other.mark == mark) continue;
    const uint16_t back = other.neighbors[0] == id ? 0 : other.neighbors[1] == id ? 1 : 2;
    HULLD_DCHECK(other.neighbors[back] == id);
    const int side = classify(next);
    if (side > 0) {
      triangles_.Mutable(next).mark = mark;
      region_.push_back(next);
      if (visit.left > 0) visits_.push_back(visit);
      visit = {next, NextEdge(back), 2};
    } else {
      horizon_.push_back({t.corners[i], t.corners[visit.edge], next, back, side == 0});
    }
  }
}

// CollectRegion for points whose signs are all certain in doubles; the horizon is unordered.
// Returns false if a sign is uncertain. Branch-free, because visibility is unpredictable: each
// neighbor is written to both lists, and then one list counts it.
bool Surface::CollectCertainRegion(TriangleId first, const Vector& point, double size) {
  const uint32_t mark = NextMark();
  // Local copies: for the compiler, the stores below might alias the originals.
  const double x = point.x();
  const double y = point.y();
  const double z = point.z();
  size_t seen = 1;
  size_t edges = 0;
  region_.MakeRoom(4, 0);
  region_[0] = first;
  triangles_.Mutable(first).mark = mark;
  for (size_t k = 0; k < seen; ++k) {
    // Capacity for the additions of a single triangle.
    region_.MakeRoom(seen + 3, seen);
    horizon_.MakeRoom(edges + 3, edges);
    TriangleId* const region = region_.data();
    HorizonEdge* const horizon = horizon_.data();
    const TriangleId id = region[k];
    const SurfaceTriangle& t = triangles_[id];
    uint32_t is_certain = 1;
    for (uint32_t i = 0; i < 3; ++i) {
      const TriangleId next = t.neighbors[i];
      // All of them are modified eventually.
      SurfaceTriangle& other = triangles_.Mutable(next);
      const double* const normal = other.normal.data();
      const double value = ((normal[0] * x + normal[1] * y) + normal[2] * z) - other.offset;
      const double bound = static_cast<double>(other.slope) * size;
      const uint32_t is_seen = value > bound;
      is_certain &= is_seen | static_cast<uint32_t>(value < -bound);
      const uint32_t mark_before = other.mark;
      region[seen] = next;
      seen += is_seen & static_cast<uint32_t>(mark_before != mark);
      other.mark = is_seen != 0 ? mark : mark_before;
      const auto back = static_cast<uint16_t>(static_cast<uint32_t>(other.neighbors[1] == id) +
                                              2 * static_cast<uint32_t>(other.neighbors[2] == id));
      horizon[edges] = {t.corners[i], t.corners[NextEdge(i)], next, back, false};
      edges += is_seen ^ 1;
    }
    if (is_certain == 0) return false;
  }
  region_.SetSize(seen);
  horizon_.SetSize(edges);
  return true;
}

// Fills the region with the triangles that the point sees, and the triangles around vertices that
// it makes redundant; fills the horizon with their boundary.
void Surface::CollectRegion(const VertexTable& vertices, TriangleId first, const Vector& point,
                            double size) {
  Traverse(first, [&](TriangleId id) { return SideOf(vertices, id, point, size); });
  if (!CollectFlatStars(vertices, point, size)) return;
  const uint32_t seen = mark_;
  for (const TriangleId id : flat_stars_) triangles_.Mutable(id).mark = seen;
  // Marks rarely wrap around. Resets them early, so that this mark differs from the next.
  if (mark_ == kLastMark) {
    ResetMarks();
    return CollectRegion(vertices, first, point, size);
  }
  Traverse(first, [&](TriangleId id) {
    return triangles_[id].mark == seen ? 1 : SideOf(vertices, id, point, size);
  });
}

// Collects the triangles outside the region around each vertex of the horizon, if all of them lie
// in planes with the point. Returns true if there are some.
bool Surface::CollectFlatStars(const VertexTable& vertices, const Vector& point, double size) {
  flat_stars_.clear();
  const HorizonEdge* before = &horizon_.back();
  for (const HorizonEdge& edge : horizon_) {
    if (before->is_flat && edge.is_flat) {
      const size_t count = flat_stars_.size();
      if (!IsFlatAround(vertices, *before, point, size)) flat_stars_.resize(count);
    }
    before = &edge;
  }
  return !flat_stars_.empty();
}

// Returns true if all triangles around the head of a horizon edge that are not in the region lie in
// planes with the point. Appends them to the flat stars until one does not.
bool Surface::IsFlatAround(const VertexTable& vertices, const HorizonEdge& before,
                           const Vector& point, double size) {
  TriangleId id = before.beyond;
  // The edge of the triangle that leads away from the vertex.
  uint32_t edge = before.edge_beyond;
  for (;;) {
    flat_stars_.push_back(id);
    const TriangleId next = triangles_[id].neighbors[(edge + 2) % 3];
    if (triangles_[next].mark == mark_) return true;
    if (SideOf(vertices, next, point, size) != 0) return false;
    const auto& back = triangles_[next].neighbors;
    edge = back[0] == id ? 0 : back[1] == id ? 1 : 2;
    id = next;
  }
}

// Removes the vertices that only triangles of the region have: the vertices not on the horizon. By
// Euler's formula for a disk there are (triangles - edges of the boundary + 2) / 2 of them, usually
// none.
void Surface::RemoveVertices(VertexTable& vertices) {
  size_t left = (region_.size() + 2 - horizon_.size()) / 2;
  for (const TriangleId id : region_) {
    if (left == 0) return;
    for (const VertexId v : triangles_[id].corners) {
      const uint32_t place = place_of_vertex_[v];
      if (place < horizon_.size() && horizon_[place].tail == v) continue;
      if (!vertices.IsAlive(v)) continue;
      vertices.Remove(v);
      --left;
    }
  }
}

// Joins the apex to the horizon. The new triangles reuse the first IDs of the region.
void Surface::JoinHorizon(const VertexTable& vertices, VertexId apex) {
  const size_t old_count = region_.size();
  const size_t new_count = horizon_.size();
  while (region_.size() < new_count) region_.push_back(NewId());
  const TriangleId* const region = region_.data();
  const Vector& top = vertices[apex];
  for (size_t k = 0; k < new_count; ++k) {
    const HorizonEdge edge = horizon_[k];
    const TriangleId id = region[k];
    const TriangleId after = region[place_of_vertex_[edge.head]];
    SurfaceTriangle& t = triangles_.Mutable(id);
    SetPlane(t, vertices[edge.tail], vertices[edge.head], top);
    t.corners = {edge.tail, edge.head, apex};
    t.neighbors[0] = edge.beyond;
    t.neighbors[1] = after;
    t.mark = 0;
    t.flat = edge.is_flat;
    triangles_.Mutable(after).neighbors[2] = id;
    SurfaceTriangle& beyond = triangles_.Mutable(edge.beyond);
    beyond.neighbors[edge.edge_beyond] = id;
    beyond.flat = (beyond.flat & ~(1u << edge.edge_beyond)) | static_cast<uint32_t>(edge.is_flat)
                                                                  << edge.edge_beyond;
  }
  for (size_t k = new_count; k < old_count; ++k) {
    SurfaceTriangle& t = triangles_.Mutable(region[k]);
    t.corners[0] = kDead;
    t.neighbors[0] = region[0];
    free_.push_back(region[k]);
  }
  steps_ += 1 + (old_count + new_count) / kTrianglesPerStep;
  alive_ = alive_ - old_count + new_count;
  last_ = region[0];
}

}  // namespace hulld
