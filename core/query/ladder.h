#ifndef HULLD_CORE_QUERY_LADDER_H_
#define HULLD_CORE_QUERY_LADDER_H_

#include <absl/status/status.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>

#include "core/query/floating/float_pair.h"
#include "core/query/terms/certificate.h"
#include "core/query/terms/pair_cache.h"
#include "core/query/terms/relation.h"
#include "core/query/terms/rung.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// A relation and, for Purpose::kEvidence, its evidence.
struct Decision {
  // A defaulted constructor would clear the storage for every kind of axis, half a kilobyte.
  Decision() {}  // NOLINT

  Relation relation = Relation::kSeparated;
  Rung rung = Rung::kBounds;
  // Separated: n.(a - b) < 0 throughout; touching: <= 0. Exact as given.
  ExactDirection axis;
  // Separated: up to three pairs, whose differences are near the nearest point of A - B; a hint.
  // Overlapping: none, or four pairs; the hull of their differences contains 0 strictly inside.
  // Touching: none, or three pairs, repetitions included; the hull of their differences contains 0.
  uint32_t pair_count = 0;
  std::array<VertexPair, 4> pairs = {};
  uint64_t directions_tried = 0;
  // FloatSearchResult::reach if the search in floating point found the axis; otherwise infinite.
  double reach = INFINITY;
};

// The use of a decision.
enum class Purpose {
  kRelation,
  kEvidence,  // also the axis and the pairs that the search found
};

// Decides the relation by a ladder of rungs, each of which answers only if its own error bound
// proves it: bounding spheres; the cache; for the relation alone, bounds of the hulls along the
// line of their centers; the hulls in floating point; exact arithmetic. Fills `decision`, which
// must be newly constructed. Requires: tolerance >= 0. Updates the cache, which may be null and
// otherwise must belong to these two hulls. `max_error`: as for SearchInFloatingPoint. CANCELLED:
// should_stop, which may be empty, returned true; only the exact rung polls it.
absl::Status Decide(const FloatPair& pair, double tolerance, PairCache* cache, Purpose purpose,
                    double max_error, const std::function<bool()>& should_stop, Decision& decision);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_LADDER_H_
