#include "core/query/axis_description.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "core/base/check.h"
#include "core/numeric/exponent_limits.h"
#include "core/query/exact/exact_search.h"

namespace hulld {
namespace {

// Returns the facet with exactly these vertices, given in ascending order.
std::optional<uint32_t> FacetOf(const Hull& hull, const std::vector<uint32_t>& vertices) {
  if (vertices.size() < 3) return std::nullopt;
  for (uint32_t f = 0; f < hull.facet_count(); ++f) {
    const std::span<const uint32_t> facet = hull.facet(f);
    if (facet.size() != vertices.size() || facet[0] != vertices[0]) continue;
    std::vector<uint32_t> sorted(facet.begin(), facet.end());
    std::sort(sorted.begin(), sorted.end());
    if (sorted == vertices) return f;
  }
  return std::nullopt;
}

AxisKind KindOf(ExactPair& pair, const SeparatingAxis& axis) {
  if (axis.feature_a.facet) return AxisKind::kFacetA;
  if (axis.feature_b.facet) return AxisKind::kFacetB;
  const std::vector<uint32_t>& a = axis.feature_a.vertices;
  const std::vector<uint32_t>& b = axis.feature_b.vertices;
  if (a.size() == 2 && b.size() == 2) {
    const IntegerVector edge_a = pair.VertexA(a[1]) - pair.VertexA(a[0]);
    const IntegerVector edge_b = pair.VertexB(b[1]) - pair.VertexB(b[0]);
    if (!IsZero(Cross(edge_a, edge_b))) return AxisKind::kEdgeEdge;
  }
  return SpanOf(pair).dimension < 3 ? AxisKind::kFlat : AxisKind::kGeneral;
}

}  // namespace

SeparatingAxis DescribeAxis(ExactPair& pair, const IntegerVector& n) {
  SeparatingAxis axis;
  axis.direction = UnitDirection(n);
  axis.feature_a.vertices = pair.FeatureA(n);
  axis.feature_b.vertices = pair.FeatureB(n);
  axis.feature_a.facet = FacetOf(pair.a().hull(), axis.feature_a.vertices);
  axis.feature_b.facet = FacetOf(pair.b().hull(), axis.feature_b.vertices);
  axis.kind = KindOf(pair, axis);
  return axis;
}

std::optional<IntegerVector> ExactAxis(const ExactDirection& axis) {
  if (const Vector* n = std::get_if<Vector>(&axis)) {
    return ToInteger(*n, LowestBitExponent(*n, kAboveAllExponents));
  }
  if (const IntegerVector* n = std::get_if<IntegerVector>(&axis)) return *n;
  return std::nullopt;
}

Vector UnitDirection(const IntegerVector& n) {
  HULLD_CHECK(!IsZero(n));
  return ToScaledDoubles(n).normalized();
}

}  // namespace hulld
