#include "core/hull/simplification/enclosure.h"

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/hull/simplification/subset_hull.h"

namespace hulld {
namespace {

// The first attempt uses the computed corners. Then corners move outwards by this fraction of their
// distance from the center, eight times as much in each failed attempt. From the third attempt on,
// the amount added by pushing doubles each time.
constexpr double kFirstInflation = 0x1p-50;
constexpr double kFirstGrowth = 0x1p-6;
constexpr int kMaxAttempts = 18;
// A vertex is pushed along the mean of its facets' normals. This is the least cosine used for the
// angle between the mean and a normal. It limits the distance if they differ widely, as at the tip
// of a needle.
constexpr double kMinCosine = 0.05;
// Vertices of the full hull per check. The same number, spread over all vertices, is checked first
// because most failing hulls fail early.
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

Enclosure::Enclosure(const Hull& full, std::span<const Vector> unit_points, const UnitScale& scale,
                     const std::function<bool()>& should_stop, StopPoll& poll)
    : full_(full),
      unit_points_(unit_points),
      scale_(scale),
      should_stop_(should_stop),
      poll_(poll),
      support_(full, unit_points, poll) {}

std::optional<SimplifiedHull> Enclosure::ByPushing(const Hull& inside, double max_error) {
  HULLD_CHECK(inside.dimension() == full_.dimension() && inside.dimension() >= 2);
  const bool is_flat = inside.dimension() == 2;
  const std::vector<Vector> points = scale_.ToUnit(inside.vertices());
  const std::vector<uint32_t> places = PlacesOf(inside, full_);
  // Vertices of each facet, or of each edge of a polygon.
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
  // The normal of each side, and the largest extent of the full hull beyond it.
  std::vector<Vector> normals;
  std::vector<double> gaps;
  std::vector<Vector> along(points.size(), Vector::Zero());
  for (const auto& side : sides) {
    if (poll_.Step()) return std::nullopt;
    const Vector& corner = points[side[0]];
    Vector normal = is_flat ? (points[side[1]] - corner).cross(flat_normal).stableNormalized()
                            : AreaNormal(points, side).stableNormalized();
    // An edge starts at its lower vertex, in either orientation.
    if (is_flat && normal.dot(corner - center) < 0) normal = -normal;
    const uint32_t farthest = support_.FarthestAlong(normal, places[side[0]]);
    normals.push_back(normal);
    gaps.push_back(std::max(0.0, normal.dot(unit_points_[farthest] - corner)));
    for (const uint32_t v : side) along[v] += normal;
  }
  for (Vector& direction : along) direction.stableNormalize();
  std::vector<double> push(points.size(), 0);
  for (size_t k = 0; k < sides.size(); ++k) {
    for (const uint32_t v : sides[k]) {
      const double cosine = std::max(kMinCosine, normals[k].dot(along[v]));
      push[v] = std::max(push[v], gaps[k] / cosine);
    }
  }
  // Without this check, most of the time would be spent on enclosures with too large an error.
  const double enough = scale_.LengthToUnit(max_error);
  for (size_t v = 0; v < points.size(); ++v) {
    if (poll_.Step()) return std::nullopt;
    const Vector p = points[v] + push[v] * along[v];
    if (support_.DistanceBound(p, places[v], enough) > enough) return std::nullopt;
  }

  for (int attempt = 0; attempt < kMaxAttempts && !poll_.stopped(); ++attempt) {
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

// Returns the hull of the corners if it contains the full hull.
std::optional<SimplifiedHull> Enclosure::HullAround(std::span<const Corner> corners) {
  std::vector<Vector> points;
  for (const Corner& corner : corners) {
    if (!corner.point.allFinite()) return std::nullopt;
    points.push_back(corner.point);
  }
  HullBuilder builder;
  if (!builder.Add(points, {.should_stop = should_stop_}).ok()) return std::nullopt;
  if (!ContainsAll(builder)) return std::nullopt;
  absl::StatusOr<Hull> hull = builder.Snapshot(should_stop_);
  if (!hull.ok()) return std::nullopt;
  // The distance from a convex set is largest at a vertex, and every vertex is a corner.
  double error = 0;
  for (const Corner& corner : corners) {
    if (poll_.Step()) return std::nullopt;
    const Vector p = scale_.ToUnit(corner.point);
    error = std::max(error, support_.DistanceBound(p, corner.near, error));
  }
  return SimplifiedHull{*std::move(hull), scale_.LengthFromUnit(error)};
}

// Exact: a point outside the hull would become a vertex.
bool Enclosure::ContainsAll(HullBuilder hull) {
  const std::span<const Vector> all = full_.vertices();
  const auto contains = [&](std::span<const Vector> points) {
    const absl::StatusOr<PointCounts> counts = hull.Add(points);
    HULLD_CHECK(counts.ok());
    return counts->outside == 0;
  };
  std::vector<Vector> sample;
  const size_t stride = all.size() / kVerticesPerCheck + 1;
  for (size_t i = 0; i < all.size(); i += stride) sample.push_back(all[i]);
  if (!contains(sample)) return false;
  for (size_t first = 0; first < all.size(); first += kVerticesPerCheck) {
    if (poll_.Poll()) return false;
    if (!contains(all.subspan(first, std::min(kVerticesPerCheck, all.size() - first))))
      return false;
  }
  return true;
}

}  // namespace hulld
