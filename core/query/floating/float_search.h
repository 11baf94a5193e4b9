#ifndef HULLD_CORE_QUERY_FLOATING_FLOAT_SEARCH_H_
#define HULLD_CORE_QUERY_FLOATING_FLOAT_SEARCH_H_

#include <array>
#include <cmath>
#include <cstdint>

#include "core/query/floating/float_pair.h"
#include "core/query/terms/pair_cache.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

enum class FloatVerdict { kSeparated, kOverlapping, kWithinTolerance, kUndecided };

// The result of the floating-point search, certified by proven bounds. Never claims touching.
struct FloatSearchResult {
  FloatVerdict verdict = FloatVerdict::kUndecided;
  // Separated: n.(a - b) < 0 throughout, exactly as given. Otherwise the last direction tried, a
  // hint.
  Vector axis = Vector::Zero();
  // Overlapping: four pairs; the hull of their differences contains the origin strictly inside.
  // Otherwise the end of the search, a hint; separated: at most three.
  uint32_t pair_count = 0;
  std::array<VertexPair, 4> pairs = {};
  uint64_t directions_tried = 0;
  // Separated: the greatest n.(a - b) for the axis n, within FloatPair::SupportError.
  double reach = INFINITY;
};

// A `max_error` that ends a search at the sign of the separation.
inline constexpr double kEndsAtSign = -1;

// Walks toward the point of A - B that is nearest to the origin (Gilbert, Johnson and Keerthi
// 1988), until the sign of the separation shows. If it is positive and `max_error` is not
// kEndsAtSign, the walk continues, as a start for distances, until half the width of its bounds on
// the separation is at most `max_error`, up to rounding. The walk may err; every claim is
// certified.
// SEPARATED: the support value is below -SupportError. OVERLAPPING: the origin is inside a
// tetrahedron of points of A - B by more than the error of its volumes. WITHIN_TOLERANCE: a point
// of A - B and a supporting plane of A - B are both within the tolerance of the origin. `first`:
// the initial direction, for example from A's center to B's. `inner`: null, or a point of A - B,
// computed within kMinkowskiErrorFactor, as the first corner of the simplex. If it is well inside,
// it saves directions (observed: half of one on average). A decided result then has no pairs.
// Fills `result`, which must be newly constructed. Requires: pair.usable().
void SearchInFloatingPoint(const FloatPair& pair, double tolerance, const PlainVector& first,
                           double max_error, const PlainVector* inner, FloatSearchResult& result);
inline FloatSearchResult SearchInFloatingPoint(const FloatPair& pair, double tolerance,
                                               const PlainVector& first,
                                               double max_error = kEndsAtSign) {
  FloatSearchResult result;
  SearchInFloatingPoint(pair, tolerance, first, max_error, nullptr, result);
  return result;
}

// Tries to prove the cached suggestion of an earlier query at the current poses; the result is
// undecided if this fails. In that case, if hulls that touched before may touch along the same axis
// again, the result contains that axis and the cached pairs; otherwise it contains no pairs.
// Requires: pair.usable(), and that the pairs of the cache are vertices of these hulls.
FloatSearchResult TryCached(const FloatPair& pair, const PairCache& cache);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_FLOAT_SEARCH_H_
