#include "core/numeric/ieee_arithmetic.h"

#include <gtest/gtest.h>

#include <cfenv>
#include <cstdint>

#include "core/hull/growth/hull_builder.h"

namespace hulld {
namespace ieee_arithmetic_test {

TEST(IeeeArithmetic, IsTheModeOfANewThread) { EXPECT_TRUE(HasIeeeArithmetic()); }

TEST(IeeeArithmetic, OtherRoundingModesAreDetected) {
  for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
    ASSERT_EQ(std::fesetround(mode), 0);
    const bool detected = !HasIeeeArithmetic();
    ASSERT_EQ(std::fesetround(FE_TONEAREST), 0);
    EXPECT_TRUE(detected) << mode;
  }
  EXPECT_TRUE(HasIeeeArithmetic());
}

#ifdef __x86_64__
constexpr uint32_t kFlushResults = 0x8000;
constexpr uint32_t kFlushOperands = 0x0040;

// Linking with -ffast-math sets both flags for the whole program.
TEST(IeeeArithmetic, FlushedSubnormalNumbersAreDetected) {
  const uint32_t before = __builtin_ia32_stmxcsr();
  for (const uint32_t flags : {kFlushResults, kFlushOperands, kFlushResults | kFlushOperands}) {
    __builtin_ia32_ldmxcsr(before | flags);
    const bool detected = !HasIeeeArithmetic();
    __builtin_ia32_ldmxcsr(before);
    EXPECT_TRUE(detected) << flags;
  }
}

TEST(IeeeArithmetic, NoHullIsBuiltIfSubnormalNumbersAreFlushed) {
  EXPECT_DEATH(
      {
        __builtin_ia32_ldmxcsr(__builtin_ia32_stmxcsr() | kFlushResults | kFlushOperands);
        HullBuilder();
      },
      "check failed: HasIeeeArithmetic");
}
#endif

}  // namespace ieee_arithmetic_test
}  // namespace hulld
