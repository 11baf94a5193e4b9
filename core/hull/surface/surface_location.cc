// Point location of Surface: the walk, the interior point from which walks aim, and the map of
// directions around it, measured as the surface grows.

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/hull/surface/surface.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/orientation.h"
#include "core/numeric/vector.h"

namespace hulld {
namespace {

// Maximum number of rounds of aiming at the surface, each at a plane nearer than the previous one;
// more do not pay off.
constexpr int kMaxRounds = 64;

// A smaller surface is faster to walk across than to measure.
constexpr size_t kWorthMeasuring = 64;

// Number of walk steps after which the walk is partly random instead of straight.
constexpr size_t kStepsBeforeChance = 16;

// Corners of a map measured per insertion: a map is complete long before the surface has doubled.
constexpr size_t kCornersPerInsertion = 8;

// Returns the cells per side of a map for this many triangles: a few triangles per cell, fewer if
// the map rejects many points than if it only supplies starts of walks.
int ResolutionFor(size_t triangles, bool rejects) {
  const double cells_a_side = std::sqrt(static_cast<double>(triangles) / (rejects ? 12 : 96));
  return std::clamp(static_cast<int>(cells_a_side), 2, 256);
}

}  // namespace

Surface::Ray Surface::RayTo(const Vector& point) const {
  HULLD_DCHECK(directions_.has_value());
  const Vector y = point - directions_->center();
  const double d = std::max(extent_, LargestComponent(y));
  const bool in_range = d >= kTripleProductMin && d <= kTripleProductMax;
  return {y, in_range ? kTripleProductErrorFactor * d * d * d : INFINITY};
}

// Returns the edge of a triangle to cross on the way to the point: one with the point strictly and
// exactly on the far side of its plane through the interior point. Returns 3 if there is none: the
// triangle's cone contains the point. If there are several: the one for which this holds most
// clearly or, from `first` on around the triangle, the next one. Computing all three without a
// branch is faster than guessing the first.
size_t Surface::EdgeToward(const VertexTable& vertices, const SurfaceTriangle& t,
                           const Vector& point, const Ray& ray,
                           std::optional<uint32_t> first) const {
  const Vector& center = directions_->center();
  const Vector a = vertices[t.corners[0]] - center;
  const Vector b = vertices[t.corners[1]] - center;
  const Vector c = vertices[t.corners[2]] - center;
  const double turns[3] = {Dot(ray.y, Cross(a, b)), Dot(ray.y, Cross(b, c)),
                           Dot(ray.y, Cross(c, a))};
  const double least = std::min(turns[0], std::min(turns[1], turns[2]));
  if (least > ray.bound) return 3;
  if (least < -ray.bound && !first) return least == turns[0] ? 0 : least == turns[1] ? 1 : 2;
  for (uint32_t k = 0; k < 3; ++k) {
    const uint32_t i = (first.value_or(0) + k) % 3;
    if (turns[i] > ray.bound) continue;
    // The center comes last: seen from a corner, the other corner and the point may be near.
    if (turns[i] < -ray.bound ||
        Orient3d(vertices[t.corners[i]], vertices[t.corners[(i + 1) % 3]], point, center) > 0) {
      return i;
    }
  }
  return 3;
}

// Returns the depth of the direction within the triangle's cone, negative outside, in no particular
// unit: the least of the values that EdgeToward compares.
double Surface::MinTurn(const VertexTable& vertices, TriangleId id, const Vector& direction) const {
  const Vector& center = directions_->center();
  const SurfaceTriangle& t = triangles_[id];
  const Vector a = vertices[t.corners[0]] - center;
  const Vector b = vertices[t.corners[1]] - center;
  const Vector c = vertices[t.corners[2]] - center;
  return std::min(direction.dot(a.cross(b)),
                  std::min(direction.dot(b.cross(c)), direction.dot(c.cross(a))));
}

TriangleCones::Cone Surface::ConeOf(const VertexTable& vertices, TriangleId id) const {
  const SurfaceTriangle& t = triangles_[id];
  const Vector& center = directions_->center();
  const Vector a = vertices[t.corners[0]] - center;
  const Vector b = vertices[t.corners[1]] - center;
  const Vector c = vertices[t.corners[2]] - center;
  return {t.normal, t.offset, t.slope, t.neighbors, {Cross(a, b), Cross(b, c), Cross(c, a)}};
}

// Walk with values from cones. They are computed like those of SideOf and EdgeToward, so they have
// the same error bounds. A triangle's plane is tested exactly only if the cone contains the point.
Surface::Location Surface::WalkByCones(const VertexTable& vertices, const Vector& point,
                                       double size, TriangleId start, TriangleCones& cones) {
  const Ray ray = RayTo(point);
  TriangleId at = start;
  for (size_t step = 0; step < kStepsBeforeChance; ++step) {
    ++work_;
    const TriangleCones::Cone& cone =
        cones.Get(at, [&](TriangleId id) { return ConeOf(vertices, id); });
    const double height = Dot(cone.normal, point) - cone.offset;
    const double bound = static_cast<double>(cone.slope) * size;
    if (height > bound) return SeenNear(at, point, size);
    const std::array<double, 3> turns = cone.TurnsTo(ray.y);
    const double least = std::min(turns[0], std::min(turns[1], turns[2]));
    if (least > ray.bound) {
      if (height < -bound) return {Side::kBelow, at};
      const bool is_outside = ExactSideOf(vertices, triangles_[at], point) > 0;
      return {is_outside ? Side::kOutside : Side::kInside, at};
    }
    if (!(least < -ray.bound)) break;
    at = cone.neighbors[least == turns[0] ? 0 : least == turns[1] ? 1 : 2];
  }
  return Walk(vertices, point, size, at, work_);
}

Surface::Location Surface::LocateByCones(const VertexTable& vertices, const Vector& point,
                                         TriangleCones& cones) {
  const double size = SizeWith(vertices, point);
  // Consecutive points are often close to each other.
  const TriangleCones::Cone* const near = cones.near();
  if (near != nullptr) {
    const Ray ray = RayTo(point);
    const std::array<double, 3> turns = near->TurnsTo(ray.y);
    const double least = std::min(turns[0], std::min(turns[1], turns[2]));
    const double height = Dot(near->normal, point) - near->offset;
    const bool is_below = height < -static_cast<double>(near->slope) * size;
    if (is_below & (least > ray.bound)) return {Side::kBelow, cones.near_triangle()};
  }
  const size_t cell = directions_->PlaceOf(point).cell;
  const TriangleId start = Alive(directions_->hint(cell));
  ++work_;
  Location location = {Side::kUnknown, start};
  if (near == nullptr) location = SeenNear(start, point, size);
  if (location.side == Side::kUnknown) location = WalkByCones(vertices, point, size, start, cones);
  if (location.side != Side::kUnknown) directions_->SetHint(cell, location.triangle);
  cones.SetNear(location.side == Side::kBelow ? location.triangle : TriangleCones::kNone);
  return location;
}

// Crosses edges that have the point on their far side. The ray from the interior point through the
// point meets the plane of the next triangle no later, and sooner unless both are coplanar. A walk
// can therefore cycle only among coplanar triangles, and leaves the cycle when it starts to choose
// at random. Unknown if the walk exceeds the length expected for the surface.
Surface::Location Surface::Walk(const VertexTable& vertices, const Vector& point, double size,
                                TriangleId start, uint64_t& steps) const {
  ++steps;
  if (SideOf(vertices, start, point, size) > 0) return {Side::kOutside, start};
  const Ray ray = RayTo(point);
  TriangleId at = start;
  uint32_t random = 1;
  const size_t longest = 4 * alive_ + 64;
  for (size_t step = 0; step < longest; ++step) {
    std::optional<uint32_t> first;
    if (step >= kStepsBeforeChance) {
      random = random * 1664525u + 1013904223u;
      first = (random >> 16) % 3;
    }
    const SurfaceTriangle& t = triangles_[at];
    const size_t edge = EdgeToward(vertices, t, point, ray, first);
    if (edge == 3) return {Side::kInside, at};
    at = t.neighbors[edge];
    ++steps;
    if (SideOf(vertices, at, point, size) > 0) return {Side::kOutside, at};
  }
  return {Side::kUnknown, at};
}

Surface::Location Surface::Scan(const VertexTable& vertices, const Vector& point,
                                double size) const {
  Location location{Side::kInside, Alive(last_)};
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

void Surface::Measure(const VertexTable& vertices) {
  if (measuring_) ContinueMeasuring(vertices, kCornersPerInsertion, nullptr);
  if (alive_ >= next_update_) Update(vertices);
}

// Searches for an interior point if none is known, and starts to measure the surface for its
// present size. Called when the surface has doubled, so the O(F) cost of an interior point is
// amortized.
void Surface::Update(const VertexTable& vertices) {
  next_update_ = 2 * alive_;
  if (!directions_) SetCenter(vertices);
  if (IsWorthMeasuring() && !measuring_) {
    // The center comes from the first surface, which may have been a corner of the present one.
    if (directions_->resolution() == 1) SetCenter(vertices);
    StartMeasuring(ResolutionFor(alive_, IsMapWorthwhile()));
  }
}

// Moves the center strictly inside, fits the frame of the map to the shape, and discards
// measurements; does nothing if no double is inside.
void Surface::SetCenter(const VertexTable& vertices) {
  work_ += 2 * triangles_.size();
  const std::optional<Vector> interior = FindInterior(vertices);
  if (!interior) return;
  KeepDirections();
  extent_ = 0;
  for (VertexId v = 0; v < vertices.id_bound(); ++v) {
    if (vertices.IsAlive(v)) extent_ = std::max(extent_, LargestComponent(vertices[v] - *interior));
  }
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (VertexId v = 0; v < vertices.id_bound(); ++v) {
    if (!vertices.IsAlive(v)) continue;
    const Vector unit = (vertices[v] - *interior) / extent_;
    moments += unit * unit.transpose();
  }
  directions_.emplace(MapFrame(*interior, extent_, moments));
}

std::optional<Vector> Surface::FindInterior(const VertexTable& vertices) const {
  // The mean of the vertices, in memory order. Divides each first, so that no sum overflows.
  Vector mean = Vector::Zero();
  const double weight = 1.0 / static_cast<double>(vertices.size());
  for (VertexId v = 0; v < vertices.id_bound(); ++v) {
    if (vertices.IsAlive(v)) mean += vertices[v] * weight;
  }
  if (!mean.allFinite()) return std::nullopt;
  const double size = SizeWith(vertices, mean);
  bool inside = true;
  ForEachTriangle([&](TriangleId id, const SurfaceTriangle&) {
    inside = inside && SideOf(vertices, id, mean, size) < 0;
  });
  return inside ? std::optional<Vector>(mean) : std::nullopt;
}

// At extreme magnitudes, integers decide every sign, and a map costs more than it saves.
bool Surface::IsWorthMeasuring() const { return alive_ >= kWorthMeasuring && IsMeasurable(); }

bool Surface::MeasureBefore(const VertexTable& vertices, size_t points, double fineness,
                            double walks_per_point, StopPoll& poll, TriangleCones* cones) {
  if (!directions_ || !IsWorthMeasuring()) return false;
  // Six faces, and about two walks to measure a corner.
  const double affordable = std::sqrt(static_cast<double>(points) * walks_per_point / 12);
  const double useful = fineness * ResolutionFor(alive_, true);
  const int wanted = static_cast<int>(std::min({affordable, useful, 256.0})) & ~1;
  if (wanted < 4) return false;
  // The rejections of the last map say little about a surface that is largely new, and the center
  // of a surface that grew to one side is far from its middle.
  const bool is_new = 8 * joined_ > measured_at_ &&
                      wanted >= std::min(directions_->resolution(), ResolutionFor(alive_, true));
  if (!is_new) {
    if (!IsMapWorthwhile()) return false;
    if (wanted <= directions_->resolution() && 4 * alive_ <= 5 * measured_at_) return false;
  }
  const bool is_cheap =
      2 * static_cast<double>(triangles_.size()) <= walks_per_point * static_cast<double>(points);
  if (directions_->resolution() == 1 || (is_new && is_cheap)) {
    SetCenter(vertices);
    if (cones != nullptr) cones->Clear();
  }
  StartMeasuring(wanted);
  while (measuring_ && !poll.Step(kCornersPerInsertion)) {
    ContinueMeasuring(vertices, kCornersPerInsertion, cones);
  }
  return !measuring_;
}

void Surface::StartMeasuring(int resolution) {
  measured_at_ = alive_;
  joined_ = 0;
  tested_ = 0;
  rejected_ = 0;
  const size_t row = static_cast<size_t>(resolution) + 1;
  work_ += row;
  measuring_ = Measurement{DirectionMap(directions_->frame(), resolution),
                           std::vector<TriangleId>(row, Alive(last_))};
}

void Surface::ContinueMeasuring(const VertexTable& vertices, size_t corners, TriangleCones* cones) {
  for (; corners > 0 && measuring_->face < 6; --corners) MeasureCorner(vertices, cones);
  if (measuring_->face < 6) return;
  measuring_->map.Finish(measuring_->least, measuring_->largest, extent_);
  KeepDirections();
  directions_ = std::move(measuring_->map);
  measuring_.reset();
}

// Measures one corner, and creates the cell that it completes.
void Surface::MeasureCorner(const VertexTable& vertices, TriangleCones* cones) {
  Measurement& m = *measuring_;
  const auto j = static_cast<size_t>(m.j);
  const TriangleId hint_above = m.hint[j];
  const Vector direction = m.map.CornerDirection(m.face, m.i, m.j);
  // Starts from the corner to the left or the one above. If triangles are long and thin, as on the
  // side of a prism, walks across them are long, and walks along them short.
  TriangleId near = Alive(m.hint[j == 0 ? 0 : j - 1]);
  if (m.i > 0 && j > 0) {
    const TriangleId above = Alive(hint_above);
    if (MinTurn(vertices, above, direction) > MinTurn(vertices, near, direction)) near = above;
  }
  const double reach = Reach(vertices, direction, near, cones);
  m.map.AppendCorner(reach);
  m.hint[j] = near;
  m.least = std::min(m.least, reach);
  m.largest = std::max(m.largest, reach);
  if (m.i > 0 && m.j > 0) m.map.AppendCell(m.hint_before);
  m.hint_before = hint_above;
  ++work_;
  if (++m.j <= m.map.resolution()) return;
  m.j = 0;
  if (++m.i <= m.map.resolution()) return;
  m.i = 0;
  ++m.face;
}

// Returns a distance m, nearly maximal, such that the double nearest to center + m * direction is
// inside; 0 if none was found. `near`: the start of the walk; receives the triangle at which the
// direction leaves the surface.
double Surface::Reach(const VertexTable& vertices, const Vector& direction, TriangleId& near,
                      TriangleCones* cones) {
  const Vector center = directions_->center();
  double m = extent_ / LargestComponent(direction);
  // A walk to a point outside may end at any triangle that the point sees, so several rounds are
  // needed. If many triangles are nearly coplanar, their rounded planes are inaccurate, so the
  // steps grow.
  double step_back = 0x1p-30;
  for (int round = 0; round < kMaxRounds; ++round) {
    const SurfaceTriangle& t = triangles_[near];
    const double climb = t.normal.dot(direction);
    const double height = t.offset - t.normal.dot(center);
    if (climb > 0 && height > 0 && height / climb < m) m = height / climb;
    m *= 1 - step_back;
    if (round % 2 == 1) step_back *= 2;
    const Vector point = center + m * direction;
    const double size = SizeWith(vertices, point);
    const Location location = cones == nullptr ? Walk(vertices, point, size, near, work_)
                                               : WalkByCones(vertices, point, size, near, *cones);
    if (location.side == Side::kUnknown) return 0;
    near = location.triangle;
    if (location.side != Side::kOutside) return m;
  }
  return 0;
}

void Surface::BeginInsertions(const VertexTable& vertices) {
  if (alive_ >= next_update_) Update(vertices);
}

void Surface::FinishInsertions(const VertexTable& vertices) {
  // Beyond this point, a map refined for a large block is not worth its memory.
  while (directions_ && 2 * directions_->cell_count() > alive_ && directions_->Coarsen()) {
  }
  // Sets a center now. Measuring waits for further insertions, because a hull at rest would keep an
  // unfinished map without using it.
  if (!directions_ && alive_ >= next_update_) Update(vertices);
}

}  // namespace hulld
