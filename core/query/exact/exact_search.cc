#include "core/query/exact/exact_search.h"

#include <absl/status/status.h>

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "core/base/check.h"
#include "core/query/exact/exact_frame.h"
#include "core/query/exact/portal_search.h"
#include "core/query/exact/wide_pair.h"

namespace hulld {
namespace {

// The span of A - B.
template <typename Pair>
struct ExactSpan {
  int dimension = 0;
  // Dimension 1: along the line. Otherwise zero.
  typename Pair::Coordinates direction = {0, 0, 0};
  // Dimension 2: normal of the plane. Otherwise zero, or not requested.
  typename Pair::Direction normal = {0, 0, 0};
};

// Directions that span a hull: differences of its points, one per dimension up to two.
template <typename Coordinates>
struct SpanningDirections {
  // Capacity for two flat hulls.
  std::array<Coordinates, 4> directions;
  size_t count = 0;

  template <typename VertexOf>
  void Append(const QueryHull& hull, VertexOf vertex) {
    const std::span<const uint32_t> spanning = hull.spanning();
    for (size_t i = 1; i < spanning.size(); ++i) {
      directions[count++] = vertex(spanning[i]) - vertex(spanning[0]);
    }
  }
};

template <typename Pair>
ExactSpan<Pair> FindSpan(Pair& pair) {
  ExactSpan<Pair> span;
  if (pair.a().dimension() == 3 || pair.b().dimension() == 3) {
    span.dimension = 3;
    return span;
  }
  SpanningDirections<typename Pair::Coordinates> spanning;
  spanning.Append(pair.a(), [&](uint32_t i) { return pair.VertexA(i); });
  spanning.Append(pair.b(), [&](uint32_t i) { return pair.VertexB(i); });
  if (spanning.count == 0) return span;
  const auto& directions = spanning.directions;
  for (size_t i = 1; i < spanning.count; ++i) {
    if (IsZero(span.normal)) {
      span.normal = Cross(directions[0], directions[i]);
    } else if (Sign(Dot(span.normal, directions[i])) != 0) {
      span.dimension = 3;
      return span;
    }
  }
  span.dimension = IsZero(span.normal) ? 1 : 2;
  if (span.dimension == 1) span.direction = directions[0];
  return span;
}

// The search for one pair.
template <typename Pair>
class Search {
 public:
  Search(Pair& pair, bool with_axis, const std::function<bool()>& should_stop)
      : pair_(pair), with_axis_(with_axis), should_stop_(should_stop) {}

  absl::StatusOr<ExactSearchResult> Run(const FloatSearchResult* end) {
    if (end != nullptr) {
      PortalSearch<Pair> search(pair_, should_stop_);
      if (std::optional<PortalResult> found = search.TryEnd(*end)) {
        return Report(*found, search.directions_tried());
      }
    }
    const ExactSpan<Pair> span = FindSpan(pair_);
    if (span.dimension == 3) {
      PortalSearch<Pair> search(pair_, should_stop_);
      return RunAndReport(search);
    }
    const Coordinates w = pair_.Difference({0, 0});
    if (span.dimension == 0) {
      if (IsZero(w)) return Found(Relation::kTouching, Coordinates{1, 0, 0}, 1);
      return Found(Relation::kSeparated, Coordinates(-w), 1);
    }
    if (span.dimension == 1) return SearchOnLine(span.direction, w);
    const int side = Sign(Dot(span.normal, w));
    if (side == 0) return SearchInPlane(span.normal);
    return Found(Relation::kSeparated, side < 0 ? span.normal : Direction(-span.normal), 1);
  }

 private:
  using Coordinates = typename Pair::Coordinates;
  using Direction = typename Pair::Direction;
  using Number = typename Pair::Number;
  using PortalResult = typename PortalSearch<Pair>::Result;

  static absl::Status Stopped() { return absl::CancelledError("the exact query was cancelled"); }

  template <typename Axis>
  ExactSearchResult Found(Relation relation, const Axis& axis, uint64_t directions_tried) const {
    ExactSearchResult result;
    result.relation = relation;
    if (with_axis_) result.axis = ToInteger(axis);
    result.directions_tried = directions_tried;
    return result;
  }

  absl::StatusOr<ExactSearchResult> Report(const PortalResult& found,
                                           uint64_t directions_tried) const {
    // All returns name this variable, so that the compiler constructs it in the caller's storage.
    absl::StatusOr<ExactSearchResult> result(absl::in_place);
    result->directions_tried = directions_tried;
    if (with_axis_ && found.axis) result->axis = ToInteger(*found.axis);
    if (found.portal) {
      result->pair_count = 3;
      result->pairs = *found.portal;
    }
    switch (found.verdict) {
      case PortalSearch<Pair>::Verdict::kSeparated:
        result->relation = Relation::kSeparated;
        break;
      case PortalSearch<Pair>::Verdict::kTouching:
        result->relation = Relation::kTouching;
        break;
      case PortalSearch<Pair>::Verdict::kOverlapping:
        break;
      case PortalSearch<Pair>::Verdict::kStopped:
        result = Stopped();
        break;
    }
    return result;
  }

  absl::StatusOr<ExactSearchResult> RunAndReport(PortalSearch<Pair>& search) {
    const PortalResult found = search.Run();
    return Report(found, search.directions_tried());
  }

  // A and B lie in parallel planes, and the origin in the plane of C. The origin has the same
  // position relative to the thickened C as relative to C in the plane.
  absl::StatusOr<ExactSearchResult> SearchInPlane(const Direction& normal) {
    HULLD_CHECK(!IsZero(normal));
    int axis = 0;
    while (normal[axis].is_zero()) ++axis;
    PortalSearch<Pair> search(pair_, should_stop_);
    // Any thickness is valid; one of the size of the hulls keeps the search well shaped.
    const Coordinates width = pair_.Difference({pair_.FarthestA(Direction{1, 1, 1}), 0});
    if (pair_.stopped()) return Stopped();
    Coordinates half = {0, 0, 0};
    half[axis] = 1;
    for (int i = 0; i < 3; ++i) {
      half[axis] += Sign(width[i]) < 0 ? Number(-width[i]) : width[i];
    }
    search.Thicken(half);
    absl::StatusOr<ExactSearchResult> result = RunAndReport(search);
    if (result.ok() && result->relation == Relation::kOverlapping) {
      result->relation = Relation::kTouching;
      if (with_axis_) result->axis = ToInteger(normal);
    }
    return result;
  }

  // A and B lie on parallel lines along u, or are points; w is a point of C.
  absl::StatusOr<ExactSearchResult> SearchOnLine(const Coordinates& u, const Coordinates& w) {
    const Direction across = Cross(u, w);
    if (!IsZero(across)) return Found(Relation::kSeparated, Cross(u, across), 1);
    for (const Coordinates& n : {u, Coordinates(-u)}) {
      const Direction along = Pair::ToDirection(n);
      const VertexPair farthest = {pair_.FarthestA(along), pair_.FarthestB(along)};
      if (pair_.stopped()) return Stopped();
      if (Sign(Dot(n, pair_.Difference(farthest))) < 0) return Found(Relation::kSeparated, n, 2);
    }
    return Found(Relation::kTouching, AnyPerpendicular(u), 3);
  }

  Pair& pair_;
  const bool with_axis_;
  const std::function<bool()>& should_stop_;
};

// Not inlined, so that only the selected width takes stack space.
template <int kWords>
[[gnu::noinline]] absl::StatusOr<ExactSearchResult> SearchWide(
    const FloatPair& pair, const SmallFrame& frame, const FloatSearchResult* end, bool with_axis,
    const std::function<bool()>& should_stop) {
  if (!WidePair<kWords>::Fits(frame)) {
    return absl::FailedPreconditionError("the numbers of this pair may not fit this width");
  }
  WidePair<kWords> wide(pair, frame, should_stop);
  return Search<WidePair<kWords>>(wide, with_axis, should_stop).Run(end);
}

[[gnu::noinline]] absl::StatusOr<ExactSearchResult> SearchAny(
    const FloatPair& pair, const FloatSearchResult* end, bool with_axis,
    const std::function<bool()>& should_stop) {
  // If a fixed width holds the pair's numbers, the search runs in that width.
  ExactPair exact(pair, should_stop, /*with_narrow=*/false);
  return Search<ExactPair>(exact, with_axis, should_stop).Run(end);
}

ExactWidth NarrowestFor(const SmallFrame& frame) {
  if (WidePair<1>::Fits(frame)) return ExactWidth::k1Word;
  if (WidePair<2>::Fits(frame)) return ExactWidth::k2Words;
  if (WidePair<3>::Fits(frame)) return ExactWidth::k3Words;
  if (WidePair<5>::Fits(frame)) return ExactWidth::k5Words;
  return ExactWidth::kAny;
}

}  // namespace

MinkowskiSpan SpanOf(ExactPair& pair) {
  ExactSpan<ExactPair> span = FindSpan(pair);
  return {span.dimension, std::move(span.dimension == 2 ? span.normal : span.direction)};
}

absl::StatusOr<ExactSearchResult> SearchExactly(const FloatPair& pair, const FloatSearchResult* end,
                                                bool with_axis,
                                                const std::function<bool()>& should_stop,
                                                ExactWidth width) {
  if (width == ExactWidth::kAny) return SearchAny(pair, end, with_axis, should_stop);
  SmallFrame frame;
  if (!FindSmallFrame(pair, frame)) {
    if (width == ExactWidth::kNarrowest) return SearchAny(pair, end, with_axis, should_stop);
    return absl::FailedPreconditionError("a rotation has too many bits");
  }
  if (width == ExactWidth::kNarrowest) width = NarrowestFor(frame);
  switch (width) {
    case ExactWidth::k1Word:
      return SearchWide<1>(pair, frame, end, with_axis, should_stop);
    case ExactWidth::k2Words:
      return SearchWide<2>(pair, frame, end, with_axis, should_stop);
    case ExactWidth::k3Words:
      return SearchWide<3>(pair, frame, end, with_axis, should_stop);
    case ExactWidth::k5Words:
      return SearchWide<5>(pair, frame, end, with_axis, should_stop);
    case ExactWidth::kNarrowest:
    case ExactWidth::kAny:
      break;
  }
  return SearchAny(pair, end, with_axis, should_stop);
}

}  // namespace hulld
