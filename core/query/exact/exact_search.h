#ifndef HULLD_CORE_QUERY_EXACT_EXACT_SEARCH_H_
#define HULLD_CORE_QUERY_EXACT_EXACT_SEARCH_H_

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <functional>
#include <optional>

#include "core/numeric/integer.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/floating/float_pair.h"
#include "core/query/floating/float_search.h"
#include "core/query/terms/relation.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

struct ExactSearchResult {
  Relation relation = Relation::kOverlapping;
  // Separated and touching, if requested: n, world frame, with n.(a - b) <= 0 for all a and b, < 0
  // if separated.
  std::optional<IntegerVector> axis;
  uint64_t directions_tried = 0;
  // Touching, if known: pairs, with repetitions; the hull of their differences contains 0.
  uint32_t pair_count = 0;
  std::array<VertexPair, 3> pairs = {};
};

// The integers of an exact search. The answer is the same for all widths, axis and pairs included.
enum class ExactWidth {
  kNarrowest,  // the narrowest width that certainly fits every number of the search
  k1Word,      // coordinates of 55 bits
  k2Words,     // of 119
  k3Words,     // of 183
  k5Words,     // of 311: two rotations by any doubles of about one magnitude
  kAny,        // integers of any size
};

// Decides the relation of two non-empty hulls exactly. `end`: the final state of a floating-point
// search without a verdict, which usually shows the relation at once; may be null. `with_axis`:
// requests the axis, at the cost of its conversion to integers of any size. `width`, for tests:
// FAILED_PRECONDITION if the pair's numbers may not fit it. CANCELLED: should_stop, which may be
// empty, returned true.
//
// A flat Minkowski difference C, of dimension below 3, has no interior. Either its plane or line
// misses the origin, or C is thickened along coordinate axes outside its span. Thickening preserves
// the position of the origin in the span, and the portal search, which needs an interior, applies.
absl::StatusOr<ExactSearchResult> SearchExactly(const FloatPair& pair, const FloatSearchResult* end,
                                                bool with_axis,
                                                const std::function<bool()>& should_stop,
                                                ExactWidth width = ExactWidth::kNarrowest);

// The span of A - B.
struct MinkowskiSpan {
  int dimension;
  // Dimension 1: a direction along the line. Dimension 2: the plane's normal. Otherwise zero.
  IntegerVector direction;
};
MinkowskiSpan SpanOf(ExactPair& pair);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_EXACT_EXACT_SEARCH_H_
