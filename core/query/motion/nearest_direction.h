#ifndef HULLD_CORE_QUERY_MOTION_NEAREST_DIRECTION_H_
#define HULLD_CORE_QUERY_MOTION_NEAREST_DIRECTION_H_

#include <absl/status/statusor.h>

#include <functional>

#include "core/numeric/integer.h"
#include "core/numeric/vector.h"
#include "core/query/floating/float_pair.h"
#include "core/query/terms/separation_bounds.h"

namespace hulld {

// Returns the direction from A to B along which the hulls are nearest, with unit length up to
// rounding; zero if the pair meets, or if floating point finds no direction. If pair.usable(), it
// is computed in floating point; otherwise it is exact except for the final rounding. Proofs do not
// depend on its accuracy. `first`: an initial direction, not zero. `nearest`, in and out: the
// vertex pairs of the nearest points; the search begins with them, so pass the result of a similar
// pose, or none.
// CANCELLED: should_stop, which may be empty, returned true.
absl::StatusOr<Vector> NearestDirection(const FloatPair& pair, const Vector& first,
                                        FloatCombination& nearest,
                                        const std::function<bool()>& should_stop);

// Returns the same direction, exact except for the rounding to unit length. `nearest`, errors: as
// above.
absl::StatusOr<Vector> ExactNearestUnit(const FloatPair& pair, FloatCombination& nearest,
                                        const std::function<bool()>& should_stop);

// Returns the same direction exactly, of any length; zero if the pair meets. `nearest`, errors: as
// above.
absl::StatusOr<IntegerVector> ExactNearestDirection(const FloatPair& pair,
                                                    FloatCombination& nearest,
                                                    const std::function<bool()>& should_stop);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_NEAREST_DIRECTION_H_
