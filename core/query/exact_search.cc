#include "core/query/exact_search.h"

#include <absl/status/status.h>

#include <span>
#include <utility>

#include "core/query/portal_search.h"

namespace hulld {
namespace {

// A - B, thickened along one coordinate axis by +-half where `axis` is set.
class ExactSpace {
 public:
  struct Point {
    IntegerVector w;
    VertexPair pair;
  };

  ExactSpace(ExactPair& pair, const std::function<bool()>& should_stop)
      : pair_(pair), should_stop_(should_stop) {}

  void Thicken(int axis, Integer half) {
    axis_ = axis;
    half_ = std::move(half);
  }

  uint64_t directions_tried() const { return directions_tried_; }
  bool MayContinue() const { return !should_stop_ || !should_stop_(); }
  IntegerVector Center() const { return pair_.CenterDifference(); }

  Point Farthest(const IntegerVector& n) {
    ++directions_tried_;
    const VertexPair farthest = {pair_.FarthestA(n), pair_.FarthestB(n)};
    IntegerVector w = pair_.VertexA(farthest.a) - pair_.VertexB(farthest.b);
    if (axis_ >= 0) w[axis_] += n[axis_] < 0 ? Integer(-half_) : half_;
    return {std::move(w), farthest};
  }

 private:
  ExactPair& pair_;
  const std::function<bool()>& should_stop_;
  int axis_ = -1;
  Integer half_;
  uint64_t directions_tried_ = 0;
};

absl::StatusOr<ExactSearchResult> SearchPortal(ExactSpace& space) {
  auto found = PortalSearch<ExactSpace>(space).Run();
  ExactSearchResult result{
      Relation::kOverlapping, std::move(found.axis), space.directions_tried(), {}};
  if (found.portal) {
    for (const ExactSpace::Point& point : *found.portal) result.pairs.push_back(point.pair);
  }
  switch (found.verdict) {
    case PortalVerdict::kSeparated:
      result.relation = Relation::kSeparated;
      break;
    case PortalVerdict::kTouching:
      result.relation = Relation::kTouching;
      break;
    case PortalVerdict::kOverlapping:
      break;
    case PortalVerdict::kStopped:
      return absl::CancelledError("stopped in an exact query");
  }
  return result;
}

// Directions that span the hull: differences of its vertices, one per dimension.
template <typename VertexOf>
void AppendSpan(const Hull& hull, VertexOf vertex, std::vector<IntegerVector>& directions) {
  if (hull.dimension() == 1) directions.push_back(vertex(1) - vertex(0));
  if (hull.dimension() < 2) return;
  const std::span<const uint32_t> facet = hull.facet(0);
  directions.push_back(vertex(facet[1]) - vertex(facet[0]));
  directions.push_back(vertex(facet[2]) - vertex(facet[0]));
}

// A and B in parallel planes, and the origin in the plane of C: thickened, the origin's position is
// that in the plane.
absl::StatusOr<ExactSearchResult> SearchInPlane(ExactPair& pair, const IntegerVector& normal,
                                                const std::function<bool()>& should_stop) {
  int axis = 0;
  while (normal[axis].is_zero()) ++axis;
  ExactSpace space(pair, should_stop);
  // Any thickness will do; one of the size of the hulls keeps the search well shaped.
  const IntegerVector width = pair.VertexA(pair.FarthestA({1, 1, 1})) - pair.VertexB(0);
  space.Thicken(axis, 1 + abs(width.x) + abs(width.y) + abs(width.z));
  absl::StatusOr<ExactSearchResult> result = SearchPortal(space);
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
    const IntegerVector farthest =
        pair.VertexA(pair.FarthestA(n)) - pair.VertexB(pair.FarthestB(n));
    if (Sign(Dot(n, farthest)) < 0) return {Relation::kSeparated, n, 2, {}};
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
    ExactSpace space(pair, should_stop);
    return SearchPortal(space);
  }
  const IntegerVector w = pair.VertexA(0) - pair.VertexB(0);
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
