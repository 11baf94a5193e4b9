#include "core/query/motion/sweep.h"

#include <absl/status/status.h>

#include <utility>

#include "core/base/check.h"
#include "core/query/exact/exact_search.h"
#include "core/query/exact/portal_search.h"

namespace hulld {
namespace {

// Returns the span extended by a direction.
MinkowskiSpan Extended(MinkowskiSpan span, const IntegerVector& u) {
  switch (span.dimension) {
    case 0:
      return {1, u};
    case 1: {
      IntegerVector normal = Cross(span.direction, u);
      return IsZero(normal) ? std::move(span) : MinkowskiSpan{2, std::move(normal)};
    }
    case 2:
      return Sign(Dot(span.direction, u)) == 0 ? std::move(span) : MinkowskiSpan{3, {0, 0, 0}};
    default:
      return span;
  }
}

// Returns a direction n with n.w < 0 that is constant on the span, if w is not in it.
std::optional<IntegerVector> AcrossSpan(const MinkowskiSpan& span, const IntegerVector& w) {
  IntegerVector n = {0, 0, 0};
  if (span.dimension == 1) {
    n = Cross(span.direction, Cross(span.direction, w));
  } else if (span.dimension == 2) {
    n = Sign(Dot(span.direction, w)) < 0 ? span.direction : -span.direction;
  }
  if (Sign(Dot(n, w)) == 0) return std::nullopt;
  return n;
}

// Thickens a flat set along coordinate axes outside its span. Any thickness is valid.
void ThickenAcross(const MinkowskiSpan& span, const Integer& size,
                   PortalSearch<ExactPair>& search) {
  if (span.dimension == 3) return;
  int axis = 0;
  while (span.direction[axis].is_zero()) ++axis;
  for (int i = 0; i < 3; ++i) {
    // For a plane, `axis` is outside the span, because the normal has a component along it. For a
    // line, the other two axes are.
    if ((i == axis) != (span.dimension == 2)) continue;
    IntegerVector half = {0, 0, 0};
    half[i] = size;
    search.Thicken(half);
  }
}

Integer SizeOf(const IntegerVector& v) { return abs(v.x) + abs(v.y) + abs(v.z); }

}  // namespace

absl::StatusOr<SweptRelation> FindSweptRelation(ExactPair& middle, const IntegerVector& half,
                                                const std::function<bool()>& should_stop) {
  HULLD_CHECK(!IsZero(half));
  const MinkowskiSpan at_rest = SpanOf(middle);
  const MinkowskiSpan span = Extended(at_rest, half);
  const IntegerVector w = middle.Difference({0, 0});
  if (std::optional<IntegerVector> n = AcrossSpan(span, w)) {
    return SweptRelation{Relation::kSeparated, std::move(n)};
  }
  PortalSearch<ExactPair> search(middle, should_stop);
  search.Thicken(half);
  ThickenAcross(span, SizeOf(half) + SizeOf(w), search);
  const PortalSearch<ExactPair>::Result found = search.Run();
  switch (found.verdict) {
    case PortalSearch<ExactPair>::Verdict::kSeparated:
      return SweptRelation{Relation::kSeparated, found.axis};
    case PortalSearch<ExactPair>::Verdict::kTouching:
      return SweptRelation{Relation::kTouching, std::nullopt};
    case PortalSearch<ExactPair>::Verdict::kOverlapping:
      return SweptRelation{at_rest.dimension == 3 ? Relation::kOverlapping : Relation::kTouching,
                           std::nullopt};
    case PortalSearch<ExactPair>::Verdict::kStopped:
      break;
  }
  return absl::CancelledError("the exact query was cancelled");
}

}  // namespace hulld
