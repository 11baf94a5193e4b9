#ifndef HULLD_TESTS_SANITIZERS_PLANTED_ERRORS_H_
#define HULLD_TESTS_SANITIZERS_PLANTED_ERRORS_H_

#include <cstddef>
#include <vector>

namespace hulld::planted {

// Functions with defects typical of libraries. Compiled with sanitizers, each must end the process:
// immediately or, for the leak, at exit.

// Requires that `value` is live; its callers violate that.
double Read(const double* value);

// Sums the values and one beyond their end.
double SumTooMany(const std::vector<double>& values);

// Fills `count` values, frees them, and returns the last.
double LastOfFreed(size_t count);

// Loses all the memory that it allocates.
void Leak(size_t count);

// Returns value + 1; overflows for the greatest int.
int Successor(int value);

}  // namespace hulld::planted

#endif  // HULLD_TESTS_SANITIZERS_PLANTED_ERRORS_H_
