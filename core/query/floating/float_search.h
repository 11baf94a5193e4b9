#ifndef HULLD_CORE_QUERY_FLOATING_FLOAT_SEARCH_H_
#define HULLD_CORE_QUERY_FLOATING_FLOAT_SEARCH_H_

#include <array>
#include <cstdint>

#include "core/query/floating/float_pair.h"
#include "core/query/terms/pair_cache.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

enum class FloatVerdict { kSeparated, kOverlapping, kWithinTolerance, kUndecided };

// What the search in floating point claims, certified by proven bounds. Touching is never claimed.
struct FloatSearchResult {
  FloatVerdict verdict = FloatVerdict::kUndecided;
  // Separated: n.(a - b) < 0 throughout, as it stands. Otherwise the last direction tried: a hint.
  Vector axis = Vector::Zero();
  // Overlapping: four pairs whose differences hold the origin strictly inside their hull.
  // Otherwise where the search ended: a hint.
  uint32_t pair_count = 0;
  std::array<VertexPair, 4> pairs = {};
  uint64_t directions_tried = 0;
};

// Walks towards the point of A - B that is nearest to the origin (Gilbert, Johnson and Keerthi
// 1988), but only until the sign of the separation shows. The walk may err; what is claimed is
// certified: SEPARATED when the support value is below -SupportError, OVERLAPPING when the origin
// is inside a tetrahedron of vertices of A - B by more than the error of its volumes,
// WITHIN_TOLERANCE when a point of A - B is within the tolerance of the origin and a plane, beyond
// which A - B does not reach, too. `first` is where to look first, as from A's centre to B's.
// Requires pair.usable().
FloatSearchResult SearchInFloatingPoint(const FloatPair& pair, double tolerance,
                                        const PlainVector& first);

// Proves anew what the cache of an earlier query suggests; undecided where it cannot. Requires
// pair.usable(), and that the pairs of the cache are vertices of these hulls.
FloatSearchResult TryCached(const FloatPair& pair, const PairCache& cache);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_FLOAT_SEARCH_H_
