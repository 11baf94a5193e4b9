// Compiled without sanitizers, as the tests that call the service are, and linked with a library
// that has them: what the library does wrong is found all the same.

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
        // The last pointer may still stand where the stack was, on some processors: then it does
        // not count as lost. Each call writes over that of the one before.
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
