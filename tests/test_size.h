#ifndef HULLD_TESTS_TEST_SIZE_H_
#define HULLD_TESTS_TEST_SIZE_H_

namespace hulld {

// Returns the size of a test, or a number that depends on it: `full`, or `sanitized` in sanitized
// builds. These are about ten times slower and look for invalid accesses and arithmetic on each
// path, for which fewer inputs suffice.
#ifdef HULLD_SANITIZED
constexpr int TestSize(int /*full*/, int sanitized) { return sanitized; }
#else
constexpr int TestSize(int full, int /*sanitized*/) { return full; }
#endif

}  // namespace hulld

#endif  // HULLD_TESTS_TEST_SIZE_H_
