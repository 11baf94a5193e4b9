#include "core/query/exact/exact_search.h"

#include <absl/status/status.h>

#include <span>
#include <utility>

#include "core/base/check.h"
#include "core/query/exact/portal_search.h"

namespace hulld {
namespace {

absl::StatusOr<ExactSearchResult> SearchPortal(PortalSearch& search) {
  PortalSearch::Result found = search.Run();
  ExactSearchResult result{
      Relation::kOverlapping, std::move(found.axis), search.directions_tried(), {}};
  if (found.portal) result.pairs.assign(found.portal->begin(), found.portal->end());
  switch (found.verdict) {
    case PortalSearch::Verdict::kSeparated:
      result.relation = Relation::kSeparated;
      break;
    case PortalSearch::Verdict::kTouching:
      result.relation = Relation::kTouching;
      break;
    case PortalSearch::Verdict::kOverlapping:
      break;
    case PortalSearch::Verdict::kStopped:
      return absl::CancelledError("stopped in an exact query");
  }
  return result;
}

// Directions that span the hull: differences of its points, one per dimension.
template <typename VertexOf>
void AppendSpan(const QueryHull& hull, VertexOf vertex, std::vector<IntegerVector>& directions) {
  const std::span<const uint32_t> spanning = hull.spanning();
  for (size_t i = 1; i < spanning.size(); ++i) {
    directions.push_back(vertex(spanning[i]) - vertex(spanning[0]));
  }
}

// A and B in parallel planes, and the origin in the plane of C: thickened, the origin's position is
// that in the plane.
absl::StatusOr<ExactSearchResult> SearchInPlane(ExactPair& pair, const IntegerVector& normal,
                                                const std::function<bool()>& should_stop) {
  HULLD_CHECK(!IsZero(normal));
  int axis = 0;
  while (normal[axis].is_zero()) ++axis;
  PortalSearch search(pair, should_stop);
  // Any thickness will do; one of the size of the hulls keeps the search well shaped.
  const IntegerVector width = pair.VertexA(pair.FarthestA({1, 1, 1})) - pair.VertexB(0);
  search.Thicken(axis, 1 + abs(width.x) + abs(width.y) + abs(width.z));
  absl::StatusOr<ExactSearchResult> result = SearchPortal(search);
  if (result.ok() && result->relation == Relation::kOverlapping) {
    result->relation = Relation::kTouching;
    result->axis = normal;
  }
  return result;
}

// A and B on parallel lines along u, or points; w is a point of C.
ExactSearchResult SearchOnLine(ExactPair& pair, const IntegerVector& u, const IntegerVector& w) {
  const IntegerVector across = Cross(u, w);
  if (!IsZero(across)) return {Relation::kSeparated, Cross(u, across), 1, {}};
  for (const IntegerVector& n : {u, -u}) {
    if (Sign(Dot(n, pair.Farthest(n).w)) < 0) return {Relation::kSeparated, n, 2, {}};
  }
  return {Relation::kTouching, AnyPerpendicular(u), 3, {}};
}

}  // namespace

MinkowskiSpan SpanOf(ExactPair& pair) {
  if (pair.a().dimension() == 3 || pair.b().dimension() == 3) return {3, {0, 0, 0}};
  std::vector<IntegerVector> directions;
  AppendSpan(
      pair.a(), [&](uint32_t i) { return pair.VertexA(i); }, directions);
  AppendSpan(
      pair.b(), [&](uint32_t i) { return pair.VertexB(i); }, directions);
  if (directions.empty()) return {0, {0, 0, 0}};
  IntegerVector normal = {0, 0, 0};
  for (const IntegerVector& direction : directions) {
    if (IsZero(normal)) {
      normal = Cross(directions[0], direction);
    } else if (Sign(Dot(normal, direction)) != 0) {
      return {3, {0, 0, 0}};
    }
  }
  if (IsZero(normal)) return {1, directions[0]};
  return {2, normal};
}

absl::StatusOr<ExactSearchResult> SearchExactly(ExactPair& pair,
                                                const std::function<bool()>& should_stop) {
  const MinkowskiSpan span = SpanOf(pair);
  if (span.dimension == 3) {
    PortalSearch search(pair, should_stop);
    return SearchPortal(search);
  }
  const IntegerVector w = pair.Corner({0, 0}).w;
  if (span.dimension == 0) {
    if (IsZero(w)) return ExactSearchResult{Relation::kTouching, IntegerVector{1, 0, 0}, 1, {}};
    return ExactSearchResult{Relation::kSeparated, -w, 1, {}};
  }
  if (span.dimension == 1) return SearchOnLine(pair, span.direction, w);
  const int side = Sign(Dot(span.direction, w));
  if (side == 0) return SearchInPlane(pair, span.direction, should_stop);
  const IntegerVector axis = side < 0 ? span.direction : -span.direction;
  return ExactSearchResult{Relation::kSeparated, axis, 1, {}};
}

}  // namespace hulld
