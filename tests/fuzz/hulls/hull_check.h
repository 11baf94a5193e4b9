#ifndef HULLD_TESTS_FUZZ_HULLS_HULL_CHECK_H_
#define HULLD_TESTS_FUZZ_HULLS_HULL_CHECK_H_

#include <cstddef>
#include <string>

#include "tests/fuzz/hulls/fuzz_cloud.h"

namespace hulld::fuzz {

// What was found and how hard it was tried.
struct Verdict {
  // Empty when all is well.
  std::string finding;
  int dimension = -1;
  size_t refused = 0;
  size_t vertices = 0;
  bool compared_with_brute_force = false;
};

// Builds the hull one point at a time, in blocks, and in one block from the last point to the
// first; blocks that hold NaN or an infinity must be refused and change nothing, and are sent again
// without these. All snapshots must have the same bits, pass the exact audit, hold the points (a
// sample of them where they are many), and equal the oracle's hull where there are at most
// kBruteForcePoints points.
Verdict CheckHullOf(const FuzzCloud& cloud);

inline constexpr size_t kBruteForcePoints = 9;

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_HULLS_HULL_CHECK_H_
