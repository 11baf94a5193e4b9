// Compiled without sanitizers, like the tests that call the service, and linked with an
// instrumented library: defects in the library are still detected.

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <memory>
#include <vector>

#include "tests/sanitizers/planted_errors.h"

namespace hulld {
namespace sanitizer_test {

#ifdef __SANITIZE_ADDRESS__
#error "this file is to be compiled as the tests of the service are, without sanitizers"
#endif

bool Failed(int status) { return !testing::ExitedWithCode(0)(status); }

TEST(SanitizerDeathTest, ALibraryThatUsesItsFreedMemoryIsFound) {
  EXPECT_DEATH(planted::LastOfFreed(5), "heap-use-after-free");
}

TEST(SanitizerDeathTest, ALibraryThatUsesTheTestsFreedMemoryIsFound) {
  auto value = std::make_unique<double>(3);
  // The compiler would warn.
  const double* volatile freed = value.get();
  EXPECT_EQ(planted::Read(freed), 3);
  value.reset();
  EXPECT_DEATH(planted::Read(freed), "heap-use-after-free");
}

TEST(SanitizerDeathTest, ALibraryThatReadsPastTheTestsAllocationIsFound) {
  const std::vector<double> values = {1, 2, 3, 4, 5};
  EXPECT_DEATH(planted::SumTooMany(values), "heap-buffer-overflow");
}

TEST(SanitizerDeathTest, ALibraryThatLeaksIsFound) {
  EXPECT_EXIT(
      {
        // On some processors the last pointer may remain on the dead stack and does not count as
        // lost then. Each call overwrites the pointer of the previous one.
        for (int i = 0; i < 3; ++i) planted::Leak(1000);
        std::exit(0);
      },
      Failed, "LeakSanitizer: detected memory leaks");
}

TEST(SanitizerDeathTest, ALibraryThatOverflowsAnIntegerIsFound) {
  EXPECT_EQ(planted::Successor(1), 2);
  EXPECT_DEATH(planted::Successor(std::numeric_limits<int>::max()), "signed integer overflow");
}

}  // namespace sanitizer_test
}  // namespace hulld
