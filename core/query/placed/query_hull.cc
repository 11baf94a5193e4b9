#include "core/query/placed/query_hull.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/integer.h"

namespace hulld {
namespace {

double RadiusOf(const Hull& hull) {
  double largest = 0;
  for (const Vector& v : hull.vertices()) {
    largest = std::max(largest, (v - hull.center()).stableNorm());
  }
  return hull.empty() ? 0 : largest * kRadiusRoundUp + kLeastPositive;
}

int ExponentOf(const Hull& hull) {
  int exponent = kAboveAllExponents;
  for (const Vector& v : hull.vertices()) exponent = LowestBitExponent(v, exponent);
  return exponent;
}

// A vertex off the plane of facet 0: the farthest in floating point of those that are not its
// corners, since facets are maximal.
uint32_t VertexOffFirstFacet(const Hull& hull) {
  const std::span<const uint32_t> facet = hull.facet(0);
  const auto v = hull.vertices();
  const Vector e = v[facet[1]] - v[facet[0]];
  const Vector f = v[facet[2]] - v[facet[0]];
  const Vector n = e.cross(f);
  std::optional<uint32_t> farthest;
  double largest = 0;
  for (uint32_t i = 0; i < v.size(); ++i) {
    if (std::find(facet.begin(), facet.end(), i) != facet.end()) continue;
    const double distance = std::abs(n.dot(v[i] - v[facet[0]]));
    if (farthest.has_value() && !(distance > largest)) continue;
    farthest = i;
    largest = distance;
  }
  HULLD_CHECK(farthest.has_value());
  return *farthest;
}

}  // namespace

QueryHull::QueryHull(const Hull& hull)
    : hull_(&hull),
      support_(*hull_),
      center_bounds_(*hull_, support_),
      radius_(RadiusOf(*hull_)),
      exponent_(ExponentOf(*hull_)) {
  if (hull_->empty()) return;
  const auto v = hull_->vertices();
  for (int axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax_element(
        v.begin(), v.end(), [axis](const Vector& a, const Vector& b) { return a[axis] < b[axis]; });
    AddInnerVertex(low - v.begin());
    AddInnerVertex(high - v.begin());
  }
  if (hull_->dimension() < 2) return;
  for (int i = 0; i < 3; ++i) AddInnerVertex(hull_->facet(0)[i]);
  if (hull_->dimension() == 3) AddInnerVertex(VertexOffFirstFacet(*hull_));
}

void QueryHull::AddInnerVertex(size_t vertex) {
  HULLD_DCHECK(inner_count_ < inner_vertices_.size());
  inner_vertices_[inner_count_++] = static_cast<uint32_t>(vertex);
}

}  // namespace hulld
