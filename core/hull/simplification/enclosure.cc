#include "core/hull/simplification/enclosure.h"

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/base/check.h"
#include "core/hull/simplification/subset_hull.h"
#include "core/numeric/exponent_limits.h"

namespace hulld {
namespace {

// The first attempt is as computed. Then corners go outwards by this much of their distance from
// the centre, eight times as much each time that does not enclose. What pushing adds is twice as
// much each time from the third on.
constexpr double kFirstInflation = 0x1p-50;
constexpr double kFirstGrowth = 0x1p-6;
constexpr int kMostAttempts = 18;
// A vertex is pushed along the mean of the normals round it; where that is farther than this from a
// normal, as at the tip of a needle, no farther than this lets.
constexpr double kLeastCosine = 0.05;
// Corners farther from the centre, in units of the hull's size, enclose nothing tightly. A choice.
constexpr double kFarthestCorner = 0x1p20;
// Vertices of the full hull that are checked at once. As many, spread over all of them, are checked
// first: most hulls that fail, fail early.
constexpr size_t kVerticesPerCheck = 1024;

Vector MeanOf(std::span<const Vector> points) {
  Vector mean = Vector::Zero();
  for (const Vector& p : points) mean += p / static_cast<double>(points.size());
  return mean;
}

double InflationOf(int attempt) {
  return attempt == 0 ? 0 : std::ldexp(kFirstInflation, 3 * (attempt - 1));
}

}  // namespace

Enclosure::Enclosure(const Hull& full, const UnitScale& scale,
                     const std::function<bool()>& should_stop, StopPoll& poll)
    : full_(full),
      scale_(scale),
      should_stop_(should_stop),
      poll_(poll),
      vertices_(scale.ToUnit(full.vertices())),
      support_(full, vertices_, poll) {}

// Where the inside hull's vertices are among those of the full hull; both are sorted.
std::vector<uint32_t> Enclosure::PlacesOf(const Hull& inside) const {
  std::vector<uint32_t> places;
  uint32_t place = 0;
  for (const Vector& v : inside.vertices()) {
    while (full_.vertices()[place] != v) ++place;
    places.push_back(place);
  }
  return places;
}

Enclosure::Plane Enclosure::MakePlane(const Vector& normal, const Vector& on_plane,
                                      uint32_t start) const {
  const double offset = normal.dot(on_plane);
  const uint32_t farthest = support_.FarthestAlong(normal, start);
  return {normal, offset, std::max(0.0, vertices_[farthest].dot(normal) - offset), farthest};
}

std::optional<SimplifiedHull> Enclosure::ByPushing(const Hull& inside) {
  HULLD_CHECK(inside.dimension() == full_.dimension() && inside.dimension() >= 2);
  const bool is_flat = inside.dimension() == 2;
  const std::vector<Vector> points = scale_.ToUnit(inside.vertices());
  const std::vector<uint32_t> places = PlacesOf(inside);
  // By facet, or by edge of a polygon, its vertices.
  std::vector<std::span<const uint32_t>> sides;
  for (size_t f = 0; f < inside.facet_count() && !is_flat; ++f) sides.push_back(inside.facet(f));
  std::vector<std::array<uint32_t, 2>> edges;
  for (const Edge& edge : inside.edges()) {
    if (is_flat) edges.push_back({edge.tail, edge.head});
  }
  for (const auto& edge : edges) sides.emplace_back(edge);

  const Vector center = MeanOf(points);
  const Vector flat_normal =
      is_flat ? AreaNormal(points, inside.facet(0)).stableNormalized() : Vector::Zero();
  std::vector<Plane> planes;
  std::vector<Vector> along(points.size(), Vector::Zero());
  for (const auto& side : sides) {
    if (poll_.Step()) return std::nullopt;
    const Vector& corner = points[side[0]];
    Vector normal = is_flat ? (points[side[1]] - corner).cross(flat_normal).stableNormalized()
                            : AreaNormal(points, side).stableNormalized();
    // An edge is written from its lower vertex, whichever way round that is.
    if (is_flat && normal.dot(corner - center) < 0) normal = -normal;
    planes.push_back(MakePlane(normal, corner, places[side[0]]));
    for (const uint32_t v : side) along[v] += normal;
  }
  for (Vector& direction : along) direction.stableNormalize();
  std::vector<double> push(points.size(), 0);
  for (size_t k = 0; k < planes.size(); ++k) {
    for (const uint32_t v : sides[k]) {
      const double cosine = std::max(kLeastCosine, planes[k].normal.dot(along[v]));
      push[v] = std::max(push[v], planes[k].gap / cosine);
    }
  }

  for (int attempt = 0; attempt < kMostAttempts && !poll_.stopped(); ++attempt) {
    const double inflation = InflationOf(attempt);
    const double growth = attempt < 2 ? 1 : 1 + std::ldexp(kFirstGrowth, attempt - 2);
    std::vector<Corner> pushed;
    for (size_t v = 0; v < points.size(); ++v) {
      const Vector p = points[v] + (growth * push[v]) * along[v];
      const Vector outwards = p + inflation * (p - center);
      pushed.push_back(CornerAt(outwards + inflation * flat_normal, places[v]));
      if (is_flat) pushed.push_back(CornerAt(outwards - inflation * flat_normal, places[v]));
    }
    if (std::optional<SimplifiedHull> hull = HullAround(pushed)) return hull;
  }
  return std::nullopt;
}

std::optional<SimplifiedHull> Enclosure::ByPlanes(const Hull& inside) {
  HULLD_CHECK(inside.dimension() == 3);
  const std::vector<Vector> points = scale_.ToUnit(inside.vertices());
  const std::vector<uint32_t> places = PlacesOf(inside);
  const Vector center = MeanOf(points);
  std::vector<Plane> planes;
  for (size_t f = 0; f < inside.facet_count(); ++f) {
    if (poll_.Step()) return std::nullopt;
    const auto facet = inside.facet(f);
    const Vector normal = AreaNormal(points, facet).stableNormalized();
    planes.push_back(MakePlane(normal, points[facet[0]], places[facet[0]]));
  }
  const std::vector<Corner> corners = CornersOf(planes, center);
  for (int attempt = 0; attempt < kMostAttempts && !poll_.stopped(); ++attempt) {
    std::vector<Corner> inflated;
    for (const Corner& corner : corners) {
      const Vector p = center + (1 + InflationOf(attempt)) * corner.point;
      inflated.push_back(CornerAt(p, corner.near));
    }
    if (std::optional<SimplifiedHull> hull = HullAround(inflated)) return hull;
  }
  return std::nullopt;
}

// The corners, from the centre and at unit scale, of the intersection of the half-spaces, by
// duality: a facet of the hull of the points normal / reach is a corner. Rounded; none where that
// fails.
std::vector<Enclosure::Corner> Enclosure::CornersOf(std::span<const Plane> planes,
                                                    const Vector& center) const {
  // In the order of a hull's vertices, so that these lead back to the planes.
  std::vector<Corner> dual;
  for (const Plane& plane : planes) {
    const double reach = plane.offset + plane.gap - plane.normal.dot(center);
    // Where the centre is so near to a plane, dual points are too far away to reckon with.
    if (!(reach > kDualMinReach)) return {};
    dual.push_back({plane.normal / reach, plane.farthest});
  }
  const auto less = [](const Vector& a, const Vector& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  };
  std::sort(dual.begin(), dual.end(),
            [&](const Corner& a, const Corner& b) { return less(a.point, b.point); });
  std::vector<Vector> points;
  points.reserve(dual.size());
  for (const Corner& d : dual) points.push_back(d.point);
  HullBuilder builder;
  if (!builder.Add(points, {.should_stop = should_stop_}).ok()) return {};
  const absl::StatusOr<Hull> hull = builder.Snapshot(should_stop_);
  if (!hull.ok() || hull->dimension() < 3) return {};
  std::vector<Corner> corners;
  for (size_t f = 0; f < hull->facet_count(); ++f) {
    const auto facet = hull->facet(f);
    const Vector& on_facet = hull->vertices()[facet[0]];
    const Vector normal = AreaNormal(hull->vertices(), facet).stableNormalized();
    const Vector corner = normal / normal.dot(on_facet);
    // The corner of a facet of the dual that passes through the origin is at infinity.
    if (!(LargestComponent(corner) < kFarthestCorner)) return {};
    const size_t place =
        std::lower_bound(points.begin(), points.end(), on_facet, less) - points.begin();
    corners.push_back({corner, dual[place].near});
  }
  return corners;
}

std::optional<SimplifiedHull> Enclosure::ByBox() {
  Vector low = full_.vertices()[0];
  Vector high = low;
  for (const Vector& p : full_.vertices()) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  std::vector<Corner> corners;
  for (const double x : {low.x(), high.x()}) {
    for (const double y : {low.y(), high.y()}) {
      for (const double z : {low.z(), high.z()}) corners.push_back({Vector(x, y, z), 0});
    }
  }
  return HullAround(corners);
}

// The hull of the corners, if it holds the full hull.
std::optional<SimplifiedHull> Enclosure::HullAround(std::span<const Corner> corners) {
  std::vector<Vector> points;
  for (const Corner& corner : corners) {
    if (!corner.point.allFinite()) return std::nullopt;
    points.push_back(corner.point);
  }
  HullBuilder builder;
  if (!builder.Add(points, {.should_stop = should_stop_}).ok()) return std::nullopt;
  if (!HoldsAll(builder)) return std::nullopt;
  absl::StatusOr<Hull> hull = builder.Snapshot(should_stop_);
  if (!hull.ok()) return std::nullopt;
  // The distance from a convex set is largest at a vertex, and each is one of these.
  double error = 0;
  for (const Corner& corner : corners) {
    if (poll_.Step()) return std::nullopt;
    const Vector p = scale_.ToUnit(corner.point);
    error = std::max(error, support_.DistanceBound(p, corner.near, error));
  }
  return SimplifiedHull{*std::move(hull), scale_.LengthFromUnit(error)};
}

// Exact: a point that is not in the hull would become a vertex.
bool Enclosure::HoldsAll(HullBuilder hull) {
  const std::span<const Vector> all = full_.vertices();
  const auto holds = [&](std::span<const Vector> points) {
    const absl::StatusOr<PointCounts> counts = hull.Add(points);
    HULLD_CHECK(counts.ok());
    return counts->outside == 0;
  };
  std::vector<Vector> sample;
  const size_t stride = all.size() / kVerticesPerCheck + 1;
  for (size_t i = 0; i < all.size(); i += stride) sample.push_back(all[i]);
  if (!holds(sample)) return false;
  for (size_t first = 0; first < all.size(); first += kVerticesPerCheck) {
    if (poll_.Poll()) return false;
    if (!holds(all.subspan(first, std::min(kVerticesPerCheck, all.size() - first)))) return false;
  }
  return true;
}

}  // namespace hulld
