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

// The arithmetic without which a hull of about 1000 such points cannot be told.
enum class Arithmetic {
  // Rounded arithmetic with a bound may do.
  kAny,
  // Some signs are beyond doubles: zero, or too small to tell.
  kExact,
  // Some coordinates are so far apart, or so near the ends of the range of doubles, that no
  // rescaling by one power of two brings all of them into the range of expansions.
  kIntegers,
};

// One way in which a cloud of points is hard to build a hull of. The rows of the table of extremes
// in tests/bench/README.md, and the parameters of the suite that checks them.
struct Extreme {
  std::string name;
  // About n points in an order that is part of the difficulty; the same on every call. n >= 16.
  std::function<std::vector<Vector>(int n)> make;
  Arithmetic needs = Arithmetic::kAny;
  // How many triangles adding n points one by one in their order creates, where the order forces
  // quadratically many; otherwise null.
  int64_t (*facets_one_by_one)(int n) = nullptr;
};

std::span<const Extreme> Extremes();
void PrintTo(const Extreme& extreme, std::ostream* out);

// A cloud without difficulty: `vertices` points on the unit sphere, n - vertices well inside, in
// random order.
std::vector<Vector> GenericCloud(int n, int vertices);

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_CHECKS_EXTREME_CLOUDS_H_
