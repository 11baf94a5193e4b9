#ifndef HULLD_TESTS_CORE_CHECKS_EXTREME_CLOUDS_H_
#define HULLD_TESTS_CORE_CHECKS_EXTREME_CLOUDS_H_

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <span>
#include <string>
#include <vector>

#include "core/numeric/vector.h"

namespace hulld {

// The arithmetic required to build a hull of about 1000 such points.
enum class Arithmetic {
  // Rounded arithmetic with an error bound may suffice.
  kAny,
  // Doubles cannot decide some signs: zero or too small.
  kExact,
  // Some coordinates are so far apart, or so near the limits of doubles, that no common power of
  // two brings all of them into the range of expansions.
  kIntegers,
};

// A cloud of points with a hull that is hard to build. A row of the table of extremes in
// tests/bench/README.md, and a parameter of the tests that check it.
struct Extreme {
  std::string name;
  // Returns about n points in an order that contributes to the difficulty; equal on every call.
  // Requires: n >= 16.
  std::function<std::vector<Vector>(int n)> make;
  Arithmetic needs = Arithmetic::kAny;
  // Number of triangles created by adding n points one by one in order, if the order forces a
  // quadratic number; otherwise null.
  int64_t (*facets_one_by_one)(int n) = nullptr;
};

std::span<const Extreme> Extremes();
void PrintTo(const Extreme& extreme, std::ostream* out);

// Returns an easy cloud: `vertices` points on the unit sphere, and n - vertices well inside, in
// random order.
std::vector<Vector> GenericCloud(int n, int vertices);

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_CHECKS_EXTREME_CLOUDS_H_
