#ifndef HULLD_TESTS_FUZZ_HULLS_HULL_CHECK_H_
#define HULLD_TESTS_FUZZ_HULLS_HULL_CHECK_H_

#include <cstddef>
#include <string>

#include "tests/fuzz/hulls/fuzz_cloud.h"

namespace hulld::fuzz {

// Finding and coverage of a check.
struct Verdict {
  // Empty if no fault was found.
  std::string finding;
  int dimension = -1;
  size_t refused = 0;
  size_t vertices = 0;
  bool compared_with_brute_force = false;
};

// Builds the hull point by point, in blocks, and in one block in reverse order. Blocks with NaN or
// infinity must be refused without effect, and are sent again without these values. All snapshots
// must be bitwise equal, pass the exact audit, contain the points (a sample if they are many), and
// equal the oracle's hull for at most kBruteForcePoints points.
Verdict CheckHullOf(const FuzzCloud& cloud);

inline constexpr size_t kBruteForcePoints = 9;

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_HULLS_HULL_CHECK_H_
