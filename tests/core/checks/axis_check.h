#ifndef HULLD_TESTS_CORE_CHECKS_AXIS_CHECK_H_
#define HULLD_TESTS_CORE_CHECKS_AXIS_CHECK_H_

#include <gtest/gtest.h>

#include "core/query/collision.h"

namespace hulld {

// Whether the axis of an answer is what collision.h promises, in exact arithmetic that shares
// nothing with core: there is one iff the hulls do not overlap and neither is empty; its direction
// is of unit length; its kind names directions (facet normals, cross products of edges) of which
// one agrees with the direction, separates the hulls (strictly when SEPARATED) and is extreme at
// exactly the features given. GENERAL and FLAT axes are checked to the rounding of the direction.
testing::AssertionResult AxisIsValid(const Hull& a, const Pose& X_WA, const Hull& b,
                                     const Pose& X_WB, const Answer& answer);

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_CHECKS_AXIS_CHECK_H_
