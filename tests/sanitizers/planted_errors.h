#ifndef HULLD_TESTS_SANITIZERS_PLANTED_ERRORS_H_
#define HULLD_TESTS_SANITIZERS_PLANTED_ERRORS_H_

#include <cstddef>
#include <vector>

namespace hulld::planted {

// Functions with defects, as a library could have them. Compiled with sanitizers; each is to end
// the process, at once or, for the leak, when it ends.

// Requires that `value` is live; its callers break that.
double Read(const double* value);

// The sum of one value more than there are.
double SumTooMany(const std::vector<double>& values);

// Keeps `count` values, returns the last, and uses them after they are freed.
double LastOfFreed(size_t count);

// Keeps nothing that it allocates.
void Leak(size_t count);

// value + 1, which overflows for the greatest.
int Successor(int value);

}  // namespace hulld::planted

#endif  // HULLD_TESTS_SANITIZERS_PLANTED_ERRORS_H_
