#include "core/hull/growth/surface.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/orientation.h"
#include "core/numeric/vector.h"

namespace hulld {
namespace {

// Rounds of aiming at the surface, each at a plane nearer than the last; more is not worth it.
constexpr int kMostRounds = 64;

// A smaller surface is walked across faster than it is measured.
constexpr size_t kWorthMeasuring = 64;

// Corners of a map that one insertion measures: a map is done long before the surface has doubled.
constexpr size_t kCornersPerInsertion = 8;

// Simpler than Eigen's for three components, and as exact.
double LargestComponent(const Vector& v) {
  return std::max(std::abs(v.x()), std::max(std::abs(v.y()), std::abs(v.z())));
}

// Cells of a map for this many triangles: some triangles to a cell, fewer where the map rejects
// many points than where it only tells where to start walking.
int ResolutionFor(size_t triangles, bool rejects) {
  const double cells_a_side = std::sqrt(static_cast<double>(triangles) / (rejects ? 6 : 96));
  return std::clamp(static_cast<int>(cells_a_side), 2, 256);
}

// Times the power of two that brings the largest component into [1/2, 1).
Vector WithUnitSize(const Vector& v) {
  int exponent = 0;
  std::frexp(LargestComponent(v), &exponent);
  return v.unaryExpr([exponent](double component) { return std::ldexp(component, -exponent); });
}

}  // namespace

Surface::Surface(const VertexTable& vertices, std::span<const VertexId> polygon, VertexId apex) {
  std::vector<VertexId> loop(polygon.begin(), polygon.end());
  // Seen from outside, the apex is behind the base.
  if (Orient3d(vertices[loop[0]], vertices[loop[1]], vertices[loop[2]], vertices[apex]) > 0) {
    std::reverse(loop.begin(), loop.end());
  }
  const size_t n = loop.size();
  for (size_t i = 1; i + 1 < n; ++i)
    SetTriangle(vertices, NewId(editor_), loop[0], loop[i], loop[i + 1]);
  for (size_t i = 0; i < n; ++i)
    SetTriangle(vertices, NewId(editor_), loop[(i + 1) % n], loop[i], apex);
  alive_ = triangles_.size();
  LinkAll();
  while (vertex_mark_.size() < vertices.id_bound()) vertex_mark_.push_back(0);
  Update(vertices);
}

void Surface::InsertSurvivor(VertexTable& vertices, const Vector& point, size_t cell) {
  const double size = SizeWith(vertices, point);
  std::optional<Location> location;
  if (directions_) {
    location = Walk(vertices, point, size, Alive(directions_->hint(cell)), 0, work_);
  }
  if (!location) {
    location = Scan(vertices, point, size);
    work_ += triangles_.size();
  }
  editor_.last = location->triangle;
  if (location->side == Side::kInside) {
    // A point equal to a vertex lies in the cones of that vertex's triangles alone.
    const std::optional<VertexId> corner = CornerAt(vertices, location->triangle, point);
    if (corner) vertices.CountDuplicate(*corner);
  } else {
    RemoveVisible(vertices, point, location->triangle);
    JoinToBoundary(vertices, point);
  }
  if (directions_) directions_->SetHint(cell, editor_.last);
  if (measuring_) ContinueMeasuring(vertices, kCornersPerInsertion);
  if (alive_ >= next_update_) Update(vertices);
}

std::span<const TriangleId> Surface::RemoveVisible(VertexTable& vertices, const Vector& point,
                                                   TriangleId seen) {
  CollectRegion(vertices, seen, point, SizeWith(vertices, point), editor_);
  RemoveVertices(vertices, editor_);
  return editor_.region;
}

std::span<const TriangleId> Surface::JoinToBoundary(VertexTable& vertices, const Vector& point) {
  JoinHorizon(vertices, vertices.Add(point), editor_);
  // Here rather than when they are needed, so that no insertion does it for many.
  while (vertex_mark_.size() < vertices.id_bound()) vertex_mark_.push_back(0);
  if (directions_) {
    extent_ = std::max(extent_, LargestComponent(point - directions_->center()));
  }
  return std::span(editor_.region).first(editor_.horizon.size());
}

size_t Surface::MemoryBytes() const {
  size_t bytes = triangles_.MemoryBytes() + free_.MemoryBytes() + vertex_mark_.MemoryBytes();
  if (directions_) bytes += directions_->MemoryBytes();
  if (measuring_) {
    bytes += measuring_->map.MemoryBytes() + measuring_->reach.capacity() * sizeof(double) +
             measuring_->hint.capacity() * sizeof(TriangleId);
  }
  return bytes + editor_.region.capacity() * sizeof(TriangleId) +
         editor_.horizon.capacity() * sizeof(HorizonEdge) +
         editor_.visits.capacity() * sizeof(Visit);
}

void Surface::FinishInsertions(const VertexTable& vertices) {
  // A map that was made fine for a large block takes more memory than it saves time from here on.
  if (directions_ && directions_->cell_count() > 4 * alive_) directions_->Coarsen();
  if (alive_ >= next_update_) Update(vertices);
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

TriangleId Surface::NewId(Editor& editor) {
  if (editor.zone != 0) {
    if (editor.free.empty()) return editor.next++;
    const TriangleId id = editor.free.back();
    editor.free.pop_back();
    return id;
  }
  if (free_.empty()) return static_cast<TriangleId>(triangles_.Extend());
  const TriangleId id = free_.back();
  free_.pop_back();
  return id;
}

void Surface::FreeId(Editor& editor, TriangleId id) {
  if (editor.zone != 0) {
    editor.free.push_back(id);
  } else {
    free_.push_back(id);
  }
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

Surface::Ray Surface::RayTo(const Vector& point) const {
  const Vector y = point - directions_->center();
  const double d = std::max(extent_, LargestComponent(y));
  const bool in_range = d >= kTripleProductMin && d <= kTripleProductMax;
  return {y, in_range ? kTripleProductErrorFactor * d * d * d : INFINITY};
}

// Which side of the plane through the interior point and the edge a, b the point lies on: +1 on the
// side of a triangle to the left of the edge.
int Surface::TurnOf(const VertexTable& vertices, VertexId a, VertexId b, const Vector& point,
                    const Ray& ray) const {
  const Vector& center = directions_->center();
  const double value = Dot(ray.y, Cross(vertices[a] - center, vertices[b] - center));
  if (value > ray.bound) return 1;
  if (value < -ray.bound) return -1;
  return Orient3d(center, vertices[a], vertices[b], point);
}

// Crosses any edge whose plane through the interior point has the point on its far side, starting
// with a random one: among coplanar triangles a fixed order could go in circles. Empty when the
// walk is longer than the surface warrants, or leaves the zone, where one is given.
std::optional<Surface::Location> Surface::Walk(const VertexTable& vertices, const Vector& point,
                                               double size, TriangleId start, uint32_t zone,
                                               uint64_t& steps) const {
  const Ray ray = RayTo(point);
  TriangleId at = start;
  uint32_t random = 1;
  TriangleId from = kDead;
  const size_t longest = 4 * alive_ + 64;
  for (size_t step = 0; step < longest; ++step) {
    ++steps;
    if (zone != 0 && (triangles_[at].mark & kZoneMask) != zone) return std::nullopt;
    if (SideOf(vertices, at, point, size) > 0) return Location{Side::kOutside, at};
    random = random * 1664525u + 1013904223u;
    const uint32_t first = (random >> 16) % 3;
    const SurfaceTriangle& t = triangles_[at];
    TriangleId next = kDead;
    for (uint32_t k = 0; k < 3 && next == kDead; ++k) {
      const uint32_t i = (first + k) % 3;
      // The edge just crossed has the point on this side, as the sign was exact.
      if (t.neighbours[i] == from) continue;
      if (TurnOf(vertices, t.corners[i], t.corners[(i + 1) % 3], point, ray) < 0) {
        next = t.neighbours[i];
      }
    }
    if (next == kDead) return Location{Side::kInside, at};
    from = at;
    at = next;
  }
  return std::nullopt;
}

Surface::Location Surface::Scan(const VertexTable& vertices, const Vector& point,
                                double size) const {
  Location location{Side::kInside, Alive(editor_.last)};
  for (TriangleId id = 0; id < triangles_.size(); ++id) {
    if (!IsAlive(id)) continue;
    const int side = SideOf(vertices, id, point, size);
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

std::optional<VertexId> Surface::CornerAt(const VertexTable& vertices, TriangleId id,
                                          const Vector& point) const {
  for (const VertexId v : triangles_[id].corners) {
    if (vertices[v] == point) return v;
  }
  return std::nullopt;
}

// Looks for an interior point while none is known, and starts to measure the surface for its
// present size. Called when the surface has doubled, so the cost of O(F) for an interior point is
// amortized.
void Surface::Update(const VertexTable& vertices) {
  next_update_ = 2 * alive_;
  if (!directions_) SetCenter(vertices);
  if (IsWorthMeasuring() && !measuring_) {
    StartMeasuring(vertices, ResolutionFor(alive_, IsMapWorthwhile()));
  };
}

// Puts the center strictly inside and forgets what was measured; does nothing where no double is
// inside.
void Surface::SetCenter(const VertexTable& vertices) {
  work_ += 2 * triangles_.size();
  const std::optional<Vector> interior = FindInterior(vertices);
  if (!interior) return;
  directions_.emplace(*interior);
  extent_ = 0;
  ForEachTriangle([&](TriangleId, const SurfaceTriangle& t) {
    for (const VertexId v : t.corners) {
      extent_ = std::max(extent_, (vertices[v] - *interior).cwiseAbs().maxCoeff());
    }
  });
}

std::optional<Vector> Surface::FindInterior(const VertexTable& vertices) const {
  // The mean of the corners; each divided first, so that no sum overflows.
  Vector mean = Vector::Zero();
  const double weight = 1.0 / static_cast<double>(3 * alive_);
  ForEachTriangle([&](TriangleId, const SurfaceTriangle& t) {
    for (const VertexId v : t.corners) mean += vertices[v] * weight;
  });
  if (!mean.allFinite()) return std::nullopt;
  const double size = SizeWith(vertices, mean);
  bool inside = true;
  ForEachTriangle([&](TriangleId id, const SurfaceTriangle&) {
    inside = inside && SideOf(vertices, id, mean, size) < 0;
  });
  return inside ? std::optional<Vector>(mean) : std::nullopt;
}

// At extreme scales every sign is decided by integers, and a map costs more than it saves.
bool Surface::IsWorthMeasuring() const { return alive_ >= kWorthMeasuring && IsMeasurable(); }

void Surface::MeasureBefore(const VertexTable& vertices, size_t points) {
  if (!directions_ || !IsWorthMeasuring() || !IsMapWorthwhile()) return;
  // A tenth as many walks as points, at most.
  const int affordable = static_cast<int>(std::sqrt(static_cast<double>(points) / 60.0));
  const int wanted = std::min(affordable, 3 * ResolutionFor(alive_, true)) & ~1;
  if (wanted < 4) return;
  if (wanted > directions_->resolution() || 4 * alive_ > 5 * measured_at_) {
    StartMeasuring(vertices, wanted);
    ContinueMeasuring(vertices, SIZE_MAX);
  }
}

void Surface::StartMeasuring(const VertexTable& vertices, int resolution) {
  // The first surface, from which the center comes, may have been a corner of what it is now.
  if (directions_->resolution() == 1) SetCenter(vertices);
  measured_at_ = alive_;
  asked_ = 0;
  rejected_ = 0;
  const size_t row = static_cast<size_t>(resolution) + 1;
  work_ += row;
  measuring_ =
      Measurement{DirectionMap(directions_->center(), resolution), std::vector<double>(row),
                  std::vector<TriangleId>(row, Alive(editor_.last))};
}

void Surface::ContinueMeasuring(const VertexTable& vertices, size_t corners) {
  for (; corners > 0 && measuring_->face < 6; --corners) MeasureCorner(vertices);
  if (measuring_->face < 6) return;
  measuring_->map.Finish(measuring_->least, measuring_->largest);
  directions_ = std::move(measuring_->map);
  measuring_.reset();
}

// Measures one corner, and makes the cell whose last corner it is.
void Surface::MeasureCorner(const VertexTable& vertices) {
  Measurement& m = *measuring_;
  const auto j = static_cast<size_t>(m.j);
  const double reach_above = m.reach[j];
  const TriangleId hint_above = m.hint[j];
  // From the corner to the left, or from the one above.
  TriangleId near = Alive(m.hint[j == 0 ? 0 : j - 1]);
  const double reach = Reach(vertices, m.map.CornerDirection(m.face, m.i, m.j), near);
  m.reach[j] = reach;
  m.hint[j] = near;
  m.least = std::min(m.least, reach);
  m.largest = std::max(m.largest, reach);
  if (m.i > 0 && m.j > 0) {
    m.map.AppendCell(
        std::min(std::min(m.reach_before, reach_above), std::min(m.reach[j - 1], reach)),
        m.hint_before);
  }
  m.reach_before = reach_above;
  m.hint_before = hint_above;
  ++work_;
  if (++m.j <= m.map.resolution()) return;
  m.j = 0;
  if (++m.i <= m.map.resolution()) return;
  m.i = 0;
  ++m.face;
}

// A distance m, near the largest, such that the double nearest to center + m * direction is inside;
// 0 when none was found. `near` is where to start walking, and becomes where the direction leaves
// the surface.
double Surface::Reach(const VertexTable& vertices, const Vector& direction, TriangleId& near) {
  const Vector center = directions_->center();
  double m = extent_;
  // A walk to a point outside ends at any triangle that it sees, hence the rounds; where many are
  // nearly coplanar, their rounded planes tell little, hence the growing steps.
  for (int round = 0; round < kMostRounds; ++round) {
    const SurfaceTriangle& t = triangles_[near];
    const double climb = t.normal.dot(direction);
    const double height = t.offset - t.normal.dot(center);
    if (climb > 0 && height > 0 && height / climb < m) m = height / climb;
    m *= 1 - std::ldexp(0x1p-30, round / 2);
    const Vector point = center + m * direction;
    const std::optional<Location> location =
        Walk(vertices, point, SizeWith(vertices, point), near, 0, work_);
    if (!location) return 0;
    near = location->triangle;
    if (location->side == Side::kInside) return m;
  }
  return 0;
}

void Surface::ResetMarks() {
  for (TriangleId id = 0; id < triangles_.size(); ++id) triangles_[id].mark = 0;
  for (VertexId id = 0; id < vertex_mark_.size(); ++id) vertex_mark_[id] = 0;
  editor_.mark = 0;
}

// Fills the editor's region with the connected triangles that the point sees or whose planes hold
// it, and the horizon with their boundary, in order round it: depth first, the edges of each
// triangle counter-clockwise from the one it was entered by. False when that leaves the zone.
bool Surface::CollectRegion(const VertexTable& vertices, TriangleId first, const Vector& point,
                            double size, Editor& editor) {
  if (editor.mark > UINT32_MAX - 2 * (kZoneMask + 1)) ResetMarks();
  const uint32_t mark = editor.mark += kZoneMask + 1;
  editor.region.assign(1, first);
  editor.horizon.clear();
  triangles_[first].mark = mark;
  editor.visits.assign(1, {first, 0, 3});
  while (!editor.visits.empty()) {
    Visit& visit = editor.visits.back();
    if (visit.left == 0) {
      editor.visits.pop_back();
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
    if (editor.zone != 0 && (other.mark & kZoneMask) != editor.zone) return false;
    const uint32_t back = other.neighbours[0] == id ? 0 : other.neighbours[1] == id ? 1 : 2;
    if (SideOf(vertices, next, point, size) >= 0) {
      other.mark = mark;
      editor.region.push_back(next);
      editor.visits.push_back({next, static_cast<uint8_t>((back + 1) % 3), 2});
    } else {
      editor.horizon.push_back({t.corners[i], t.corners[(i + 1) % 3], next, back});
    }
  }
  return true;
}

// Removes the vertices that only triangles of the region have: those not on the horizon. By Euler's
// formula for a disk there are (triangles - edges of the boundary + 2) / 2 of them, mostly none.
void Surface::RemoveVertices(VertexTable& vertices, Editor& editor) {
  if (editor.region.size() + 2 == editor.horizon.size()) return;
  for (const HorizonEdge& edge : editor.horizon) vertex_mark_[edge.tail] = editor.mark;
  for (const TriangleId id : editor.region) {
    for (const VertexId v : triangles_[id].corners) {
      if (vertex_mark_[v] == editor.mark) continue;
      vertex_mark_[v] = editor.mark;
      if (editor.zone != 0) {
        vertices.Remove(v, editor.vertices);
      } else {
        vertices.Remove(v);
      }
    }
  }
}

// Joins the apex to the horizon; the new triangles take the places of the region's first.
void Surface::JoinHorizon(const VertexTable& vertices, VertexId apex, Editor& editor) {
  std::vector<TriangleId>& region = editor.region;
  const size_t old_count = region.size();
  const size_t new_count = editor.horizon.size();
  while (region.size() < new_count) region.push_back(NewId(editor));
  for (size_t k = 0; k < new_count; ++k) {
    const HorizonEdge& edge = editor.horizon[k];
    const TriangleId id = region[k];
    SetTriangle(vertices, id, edge.tail, edge.head, apex);
    triangles_[id].mark = editor.zone;
    triangles_[id].neighbours = {edge.beyond, region[k + 1 == new_count ? 0 : k + 1],
                                 region[k == 0 ? new_count - 1 : k - 1]};
    triangles_[edge.beyond].neighbours[edge.edge_beyond] = id;
  }
  for (size_t k = new_count; k < old_count; ++k) {
    triangles_[region[k]].corners[0] = kDead;
    triangles_[region[k]].neighbours[0] = region[0];
    FreeId(editor, region[k]);
  }
  if (editor.zone == 0) alive_ = alive_ - old_count + new_count;
  editor.alive += static_cast<int64_t>(new_count) - static_cast<int64_t>(old_count);
  editor.last = region[0];
}

}  // namespace hulld
