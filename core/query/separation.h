#ifndef HULLD_CORE_QUERY_SEPARATION_H_
#define HULLD_CORE_QUERY_SEPARATION_H_

#include <absl/status/status.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>

#include "core/query/floating/float_pair.h"
#include "core/query/floating/float_search.h"
#include "core/query/ladder.h"
#include "core/query/terms/separation.h"

namespace hulld {

// The details of the separation to compute.
struct SeparationRequest {
  bool separation = false;
  bool witness = false;
  bool normal = false;
  std::optional<double> max_error;
  std::optional<double> clearance;
  // QueryOptions::max_depth_bytes.
  uint64_t max_depth_bytes = std::numeric_limits<uint64_t>::max();
};

// Returns the `max_error` of SearchInFloatingPoint that suits the request.
inline double SearchErrorFor(const SeparationRequest& request) {
  if (!request.separation && !request.witness) return kEndsAtSign;
  return request.max_error.value_or(0);
}

struct SeparationAnswer {
  OptionalSeparation separation;
  std::optional<Witness> witness;
  std::optional<Normal> normal;
  std::optional<bool> within_clearance;
};

// Fills `answer` from floating point with a proven bound if that is close enough, and otherwise
// from exact arithmetic, rounded. The values depend on the pair alone, not on the path to the
// relation. `decision`: for the cores. `relation`: of the rounded hulls, which equals the
// decision's relation if there are no radii. Requires: relations other than kWithinTolerance.
// `cold`: true if no cache helped the decision and its search had SearchErrorFor, so that its pairs
// may be used.
// CANCELLED: should_stop, which may be empty, returned true. RESOURCE_EXHAUSTED: DepthTooLarge.
absl::Status FindSeparation(const FloatPair& pair, const Decision& decision, Relation relation,
                            bool cold, const SeparationRequest& request,
                            const std::function<bool()>& should_stop, SeparationAnswer& answer);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_SEPARATION_H_
