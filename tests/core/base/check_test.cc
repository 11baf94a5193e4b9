#include "core/base/check.h"

#include <gtest/gtest.h>

namespace hulld {
namespace check_test {

TEST(Check, PassesIfTheConditionHolds) {
  int evaluations = 0;
  HULLD_CHECK(++evaluations == 1);
  EXPECT_EQ(evaluations, 1);
}

TEST(CheckDeathTest, NamesLocationAndCondition) {
  EXPECT_DEATH(HULLD_CHECK(1 + 1 == 3), "check_test.cc:[0-9]+: check failed: 1 \\+ 1 == 3");
  EXPECT_DEATH(HULLD_UNREACHABLE(), "check_test.cc:[0-9]+: check failed: unreachable");
}

#ifdef NDEBUG
TEST(Check, DebugChecksCostNothingInReleaseBuilds) {
  int evaluations = 0;
  HULLD_DCHECK(++evaluations == 0);
  EXPECT_EQ(evaluations, 0);
}
#else
TEST(CheckDeathTest, DebugChecksAreOnWithoutNdebug) {
  EXPECT_DEATH(HULLD_DCHECK(false), "check failed: false");
}
#endif

}  // namespace check_test
}  // namespace hulld
