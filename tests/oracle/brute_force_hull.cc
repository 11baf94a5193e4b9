#include "tests/oracle/brute_force_hull.h"

#include <algorithm>
#include <map>
#include <set>

#include "tests/oracle/origin_position.h"

namespace hulld::oracle {
namespace {

std::vector<Point> SortedDistinct(std::span<const Point> points) {
  std::vector<Point> result(points.begin(), points.end());
  for (Point& p : result) {
    for (double& x : p) x += 0.0;  // -0 becomes +0
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

bool IsExtreme(std::span<const IntegerVector> points, size_t i) {
  std::vector<IntegerVector> others;
  for (size_t j = 0; j < points.size(); ++j) {
    if (j != i) others.push_back(Subtract(points[j], points[i]));
  }
  return others.empty() || LocateByPolarCone(others) == OriginPosition::kOutside;
}

int AffineDimension(std::span<const IntegerVector> points) {
  if (points.size() < 3) return static_cast<int>(points.size()) - 1;
  // Distinct extreme points: no three are on one line.
  const IntegerVector normal =
      Cross(Subtract(points[1], points[0]), Subtract(points[2], points[0]));
  for (const IntegerVector& p : points) {
    if (Dot(normal, Subtract(p, points[0])) != 0) return 3;
  }
  return 2;
}

// Returns the vertices of a plane polygon, starting at the lowest, counter-clockwise about
// `normal`.
std::vector<uint32_t> OrderPolygon(std::span<const IntegerVector> points,
                                   const std::vector<uint32_t>& members,
                                   const IntegerVector& normal) {
  std::vector<uint32_t> polygon = {members.front()};
  while (polygon.size() < members.size()) {
    const IntegerVector& here = points[polygon.back()];
    // The successor has all other members on its left.
    for (uint32_t candidate : members) {
      const IntegerVector step = Subtract(points[candidate], here);
      const bool is_next = std::all_of(members.begin(), members.end(), [&](uint32_t other) {
        return Sign(Dot(normal, Cross(step, Subtract(points[other], here)))) >= 0;
      });
      if (candidate != polygon.back() && is_next) {
        polygon.push_back(candidate);
        break;
      }
    }
  }
  return polygon;
}

// Returns the facet on the plane through three vertices, as an ordered polygon; empty if the plane
// does not support the hull.
std::vector<uint32_t> FacetThrough(std::span<const IntegerVector> points, size_t i, size_t j,
                                   size_t k) {
  IntegerVector normal = Cross(Subtract(points[j], points[i]), Subtract(points[k], points[i]));
  std::vector<uint32_t> members;
  int side = 0;
  for (size_t m = 0; m < points.size(); ++m) {
    const int sign = Sign(Dot(normal, Subtract(points[m], points[i])));
    if (sign == 0) members.push_back(static_cast<uint32_t>(m));
    if (sign * side < 0) return {};
    if (sign != 0) side = sign;
  }
  if (side > 0) normal = Negate(normal);
  return OrderPolygon(points, members, normal);
}

std::vector<std::vector<uint32_t>> SpatialFacets(std::span<const IntegerVector> points) {
  std::set<std::vector<uint32_t>> facets;
  for (size_t i = 0; i < points.size(); ++i) {
    for (size_t j = i + 1; j < points.size(); ++j) {
      for (size_t k = j + 1; k < points.size(); ++k) {
        std::vector<uint32_t> facet = FacetThrough(points, i, j, k);
        if (!facet.empty()) facets.insert(std::move(facet));
      }
    }
  }
  return {facets.begin(), facets.end()};
}

std::vector<std::vector<uint32_t>> PlanarFacets(std::span<const IntegerVector> points) {
  std::vector<uint32_t> all(points.size());
  for (size_t i = 0; i < all.size(); ++i) all[i] = static_cast<uint32_t>(i);
  const IntegerVector normal =
      Cross(Subtract(points[1], points[0]), Subtract(points[2], points[0]));
  std::vector<uint32_t> polygon = OrderPolygon(points, all, normal);
  if (polygon[1] > polygon.back()) std::reverse(polygon.begin() + 1, polygon.end());
  return {polygon};
}

std::vector<std::pair<uint32_t, uint32_t>> EdgesOf(const ConvexHull& hull) {
  std::set<std::pair<uint32_t, uint32_t>> edges;
  if (hull.dimension == 1) edges.insert({0, 1});
  for (const std::vector<uint32_t>& facet : hull.facets) {
    for (size_t i = 0; i < facet.size(); ++i) {
      edges.insert(std::minmax(facet[i], facet[(i + 1) % facet.size()]));
    }
  }
  return {edges.begin(), edges.end()};
}

}  // namespace

ConvexHull BruteForceHull(std::span<const Point> points) {
  const std::vector<Point> distinct = SortedDistinct(points);
  const std::vector<IntegerVector> integers = ToIntegerVectors(distinct);
  ConvexHull hull;
  std::vector<IntegerVector> extreme;
  for (size_t i = 0; i < distinct.size(); ++i) {
    if (!IsExtreme(integers, i)) continue;
    hull.vertices.push_back(distinct[i]);
    extreme.push_back(integers[i]);
  }
  hull.dimension = AffineDimension(extreme);
  if (hull.dimension == 2) hull.facets = PlanarFacets(extreme);
  if (hull.dimension == 3) hull.facets = SpatialFacets(extreme);
  hull.edges = EdgesOf(hull);
  return hull;
}

}  // namespace hulld::oracle
