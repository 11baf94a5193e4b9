// Prints the compiled bounds and ranges of core/numeric, one name and hexadecimal double per line,
// for the proofs about them.

#include <cstdio>

#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"

int main() {
#define HULLD_CONSTANT(name) std::printf("%s %a\n", #name, hulld::name);
#include "constants.inc"
  return 0;
}
