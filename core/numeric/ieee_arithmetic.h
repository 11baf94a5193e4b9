#ifndef HULLD_CORE_NUMERIC_IEEE_ARITHMETIC_H_
#define HULLD_CORE_NUMERIC_IEEE_ARITHMETIC_H_

// Some of core's headers contain exact predicates, which these options break.
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || \
    (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "core needs IEEE arithmetic: compile files that include it without -ffast-math and -Ofast"
#endif

namespace hulld {

// Returns true if the calling thread rounds to nearest and keeps subnormal numbers, as all bounds
// of error_bounds.h assume. Linking with -ffast-math, or loading such a library, may change this
// for the whole process. Cost: up to 0.2 us.
bool HasIeeeArithmetic();

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_IEEE_ARITHMETIC_H_
