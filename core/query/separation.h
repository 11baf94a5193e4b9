#ifndef HULLD_CORE_QUERY_SEPARATION_H_
#define HULLD_CORE_QUERY_SEPARATION_H_

#include <absl/status/status.h>

#include <functional>
#include <optional>

#include "core/query/floating/float_pair.h"
#include "core/query/ladder.h"
#include "core/query/terms/separation.h"

namespace hulld {

// What is wanted of the signed separation beyond the relation.
struct SeparationRequest {
  bool separation = false;
  bool witness = false;
  std::optional<double> max_error;
  std::optional<double> clearance;
};

struct SeparationAnswer {
  std::optional<Separation> separation;
  std::optional<Witness> witness;
  std::optional<bool> within_clearance;
};

// Fills `answer`: from floating point with a proven bound where that is close enough, otherwise
// from exact arithmetic, whose result is rounded. The values depend on the pair alone, not on how
// the relation was found. Requires a relation other than kWithinTolerance. `cold`: whether no cache
// helped to find the decision, so that its pairs may be used. CANCELLED when should_stop, which may
// be empty, said so.
absl::Status FindSeparation(const FloatPair& pair, const Decision& decision, bool cold,
                            const SeparationRequest& request,
                            const std::function<bool()>& should_stop, SeparationAnswer& answer);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_SEPARATION_H_
