#ifndef HULLD_CORE_QUERY_MOTION_NEAREST_DIRECTION_H_
#define HULLD_CORE_QUERY_MOTION_NEAREST_DIRECTION_H_

#include <absl/status/statusor.h>

#include <functional>

#include "core/numeric/integer.h"
#include "core/numeric/vector.h"
#include "core/query/floating/float_pair.h"
#include "core/query/terms/separation_bounds.h"

namespace hulld {

// Returns the direction from A to B in which they are nearest, of unit length up to rounding. No
// claim depends on its accuracy: it is that of floating point if pair.usable(), and exact but for
// its rounding otherwise. Zero if the pair meets, or floating point finds no direction. `first`: an
// initial direction, not zero. `nearest`: pairs where the search begins, if any, such as those that
// were nearest shortly before; those that are nearest at the end. CANCELLED: should_stop, which may
// be empty, returned true.
absl::StatusOr<Vector> NearestDirection(const FloatPair& pair, const Vector& first,
                                        FloatCombination& nearest,
                                        const std::function<bool()>& should_stop);

// Returns the same direction, exact but for the rounding to unit length. Errors: as above.
absl::StatusOr<Vector> ExactNearestUnit(const FloatPair& pair,
                                        const std::function<bool()>& should_stop);

// Returns the same direction exactly, of any length; zero if the pair meets. Errors: as above.
absl::StatusOr<IntegerVector> ExactNearestDirection(const FloatPair& pair,
                                                    const std::function<bool()>& should_stop);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_NEAREST_DIRECTION_H_
