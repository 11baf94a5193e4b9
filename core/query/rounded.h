#ifndef HULLD_CORE_QUERY_ROUNDED_H_
#define HULLD_CORE_QUERY_ROUNDED_H_

#include <absl/status/status.h>

#include <functional>

#include "core/query/floating/float_pair.h"
#include "core/query/ladder.h"
#include "core/query/terms/pair_cache.h"

namespace hulld {

// Decides the relation of two rounded hulls, at least one of which has a radius: the sign of the
// separation of their cores minus the sum of the radii. The rungs are as in Decide: bounding
// spheres, including inscribed ones; the suggestion of the cache; the cores in floating point;
// exact arithmetic. Fills the relation, the rung, and directions_tried of `decision`, which must be
// newly constructed. Requires: tolerance >= 0. Updates the cache, which may be null and otherwise
// must belong to these rounded hulls. CANCELLED: should_stop, which may be empty, returned true;
// only the exact rung polls it.
absl::Status DecideRounded(const FloatPair& pair, double tolerance, PairCache* cache,
                           const std::function<bool()>& should_stop, Decision& decision);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_ROUNDED_H_
