#ifndef HULLD_TESTS_CORE_CHECKS_AXIS_CHECK_H_
#define HULLD_TESTS_CORE_CHECKS_AXIS_CHECK_H_

#include <gtest/gtest.h>

#include "core/query/collision.h"

namespace hulld {

// True if an answer's axis satisfies collision.h, in exact arithmetic independent of core. It
// exists iff the hulls do not overlap and neither is empty. Its direction has unit length. It
// agrees with one of the directions that its kind names (facet normals, cross products of edges),
// and this direction separates the hulls (strictly if SEPARATED) and is extreme at exactly the
// given features. GENERAL and FLAT axes are checked to the rounding of the direction.
testing::AssertionResult AxisIsValid(const Hull& a, const Pose& X_WA, const Hull& b,
                                     const Pose& X_WB, const Answer& answer);

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_CHECKS_AXIS_CHECK_H_
