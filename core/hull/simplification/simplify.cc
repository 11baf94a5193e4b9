#include "core/hull/simplification/simplify.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/hull/audit.h"
#include "core/hull/growth/hull_builder.h"
#include "core/hull/simplification/triangle_distance.h"
#include "core/hull/simplification/vertex_subset.h"

namespace hulld {
namespace {

constexpr size_t kBoxVertices = 8;
// Outwards by this much of the distance from the centre, at first; eight times as much each time
// that does not enclose.
constexpr double kFirstInflation = 0x1p-46;
constexpr int kMostInflations = 16;

// Distances from a corner to a triangle, some 30 ns each, that one error may cost: measuring
// against the full hull is tighter, against the inside one cheaper.
constexpr size_t kMostDistances = 2'000'000;

absl::Status CheckTarget(const SimplifyTarget& target, size_t least_vertices) {
  if (!(target.max_error >= 0) || std::isinf(target.max_error)) {
    return absl::InvalidArgumentError("max_error must be finite and at least 0");
  }
  if (target.max_vertices == 0 && target.max_error == 0) {
    return absl::InvalidArgumentError("give max_vertices, max_error or both");
  }
  if (target.max_vertices != 0 && target.max_vertices < least_vertices) {
    return absl::InvalidArgumentError(absl::StrCat("max_vertices is ", target.max_vertices,
                                                   "; this needs at least ", least_vertices));
  }
  return absl::OkStatus();
}

Hull HullOf(std::span<const Vector> points) {
  HullBuilder builder;
  // Finite points without limits are never refused.
  HULLD_CHECK(builder.Add(points).ok());
  return builder.Snapshot();
}

// What was chosen, and how far the rest is from it at most.
struct Choice {
  std::vector<Vector> points;
  double error = 0;
};

absl::StatusOr<Choice> ChooseVertices(const Hull& hull, const SimplifyTarget& target) {
  VertexSubset subset(hull.vertices());
  const size_t most = target.max_vertices == 0
                          ? hull.vertices().size()
                          : std::min(target.max_vertices, hull.vertices().size());
  StopPoll poll(target.should_stop, 1);
  while (subset.chosen().size() < most) {
    if (target.max_error > 0 && subset.DistanceBound() <= target.max_error) break;
    if (poll.Step()) return absl::CancelledError("stopped while simplifying");
    subset.ChooseNext();
  }
  Choice choice;
  for (const uint32_t i : subset.chosen()) choice.points.push_back(hull.vertices()[i]);
  if (!subset.is_complete()) choice.error = subset.DistanceBound();
  return choice;
}

// A half-space n . (x - centre) <= reach, n of unit length as far as rounding goes.
struct HalfSpace {
  Vector normal;
  double reach;
};

std::vector<HalfSpace> SupportingHalfSpaces(const Hull& full, const Hull& inside,
                                            const Vector& center) {
  std::vector<HalfSpace> result;
  const auto add = [&](const Vector& normal) {
    double reach = 0;
    for (const Vector& v : full.vertices()) reach = std::max(reach, normal.dot(v - center));
    if (reach > 0) result.push_back({normal, reach});
  };
  for (size_t f = 0; f < inside.facet_count(); ++f) {
    const auto facet = inside.facet(f);
    const Vector& a = inside.vertices()[facet[0]];
    const Vector normal =
        (inside.vertices()[facet[1]] - a).cross(inside.vertices()[facet[2]] - a).stableNormalized();
    if (normal.allFinite() && normal.norm() > 0.5) add(normal);
  }
  return result;
}

// The corners of the intersection of half-spaces round the centre, by duality: a facet of the hull
// of the points normal / reach is a corner. Rounded.
std::vector<Vector> CornersOf(const std::vector<HalfSpace>& half_spaces) {
  std::vector<Vector> dual;
  for (const HalfSpace& h : half_spaces) dual.push_back(h.normal / h.reach);
  const Hull dual_hull = HullOf(dual);
  std::vector<Vector> corners;
  if (dual_hull.dimension() < 3) return corners;
  for (size_t f = 0; f < dual_hull.facet_count(); ++f) {
    const auto facet = dual_hull.facet(f);
    const Vector& a = dual_hull.vertices()[facet[0]];
    const Vector& b = dual_hull.vertices()[facet[1]];
    const Vector& c = dual_hull.vertices()[facet[2]];
    const Vector normal = (b - a).cross(c - a);
    const Vector corner = normal / normal.dot(a);
    if (!corner.allFinite()) return {};
    corners.push_back(corner);
  }
  return corners;
}

// Requires a point.
std::vector<Vector> BoxOf(std::span<const Vector> points) {
  HULLD_CHECK(!points.empty());
  Vector low = points[0];
  Vector high = points[0];
  for (const Vector& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  std::vector<Vector> corners;
  for (const double x : {low.x(), high.x()}) {
    for (const double y : {low.y(), high.y()}) {
      for (const double z : {low.z(), high.z()}) corners.emplace_back(x, y, z);
    }
  }
  return corners;
}

// Proven: no corner is farther than this from the hull that a part of it, or all of it, stands for.
double DistanceFrom(const Hull& part, std::span<const Vector> corners) {
  double bound = 0;
  for (const Vector& corner : corners) {
    double nearest = INFINITY;
    for (size_t f = 0; f < part.facet_count(); ++f) {
      const auto facet = part.facet(f);
      for (size_t i = 1; i + 1 < facet.size(); ++i) {
        nearest = std::min(
            nearest, DistanceToTriangleBound(part.vertices()[facet[0]], part.vertices()[facet[i]],
                                             part.vertices()[facet[i + 1]], corner));
      }
    }
    bound = std::max(bound, nearest);
  }
  return bound;
}

// Flat hulls may have no triangle; a vertex stands for a triangle then.
SimplifiedHull EncloseInBox(const Hull& hull) {
  const std::vector<Vector> corners = BoxOf(hull.vertices());
  double error = 0;
  for (const Vector& corner : corners) {
    double nearest = INFINITY;
    for (const Vector& v : hull.vertices()) {
      nearest = std::min(nearest, DistanceToTriangleBound(v, v, v, corner));
    }
    error = std::max(error, nearest);
  }
  return {HullOf(corners), error};
}

// Encloses `full` along the facets of `inside`; nothing when rounding gets in the way.
std::optional<SimplifiedHull> EncloseAlong(const Hull& full, const Hull& inside) {
  const Vector center = inside.center();
  const std::vector<Vector> corners = CornersOf(SupportingHalfSpaces(full, inside, center));
  if (corners.empty()) return std::nullopt;
  double inflation = kFirstInflation;
  for (int attempt = 0; attempt < kMostInflations; ++attempt, inflation *= 8) {
    std::vector<Vector> points;
    for (const Vector& corner : corners) points.push_back(center + (1 + inflation) * corner);
    if (!std::all_of(points.begin(), points.end(), [](const Vector& p) { return p.allFinite(); })) {
      return std::nullopt;
    }
    const Hull outside = HullOf(points);
    if (!AuditContainment(outside, full.vertices()).ok()) continue;
    const bool affordable = points.size() * full.facet_count() <= kMostDistances;
    return SimplifiedHull{outside, DistanceFrom(affordable ? full : inside, outside.vertices())};
  }
  return std::nullopt;
}

// Vertices of an inside hull whose facets, at most 2 n - 4, meet in at most `corners` corners: k
// planes have at most 2 k - 4.
size_t InsideVerticesFor(size_t corners) { return (corners + 12) / 4; }

}  // namespace

absl::StatusOr<SimplifiedHull> SimplifyInside(const Hull& hull, const SimplifyTarget& target) {
  const auto least = static_cast<size_t>(hull.dimension() + 1);
  if (absl::Status s = CheckTarget(target, least); !s.ok()) return s;
  if (hull.vertices().size() <= std::max(least, target.max_vertices)) {
    return SimplifiedHull{hull, 0};
  }
  const absl::StatusOr<Choice> choice = ChooseVertices(hull, target);
  if (!choice.ok()) return choice.status();
  return SimplifiedHull{HullOf(choice->points), choice->error};
}

absl::StatusOr<SimplifiedHull> SimplifyOutside(const Hull& hull, const SimplifyTarget& target) {
  if (absl::Status s = CheckTarget(target, kBoxVertices); !s.ok()) return s;
  const size_t all = hull.vertices().size();
  if (all <= std::max(kBoxVertices, target.max_vertices)) return SimplifiedHull{hull, 0};
  const size_t most_inside =
      target.max_vertices == 0 ? all : std::min(all, InsideVerticesFor(target.max_vertices));
  std::optional<SimplifiedHull> best;
  size_t inside_vertices = target.max_error > 0 ? InsideVerticesFor(kBoxVertices) : most_inside;
  while (hull.dimension() == 3) {
    const absl::StatusOr<SimplifiedHull> inside =
        SimplifyInside(hull, {inside_vertices, 0, target.should_stop});
    if (!inside.ok()) return inside.status();
    std::optional<SimplifiedHull> outside = EncloseAlong(hull, inside->hull);
    if (outside && (!best || outside->error < best->error)) best = std::move(outside);
    const bool enough = best && target.max_error > 0 && best->error <= target.max_error;
    if (enough || inside_vertices >= most_inside) break;
    inside_vertices = std::min(most_inside, inside_vertices * 3 / 2 + 1);
  }
  SimplifiedHull box = EncloseInBox(hull);
  if (!best || box.error < best->error) best = std::move(box);
  const bool missed = target.max_error > 0 && best->error > target.max_error;
  if (missed && target.max_vertices == 0) return SimplifiedHull{hull, 0};
  return *std::move(best);
}

}  // namespace hulld
