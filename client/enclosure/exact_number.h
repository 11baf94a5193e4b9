#ifndef HULLD_CLIENT_ENCLOSURE_EXACT_NUMBER_H_
#define HULLD_CLIENT_ENCLOSURE_EXACT_NUMBER_H_

#include "client/verify/exact_vector.h"

namespace hulld {

// Returns number * 2^exponent as a double within two units in the last place; infinity or 0 beyond
// the range of doubles.
double Approximate(const BigInteger& number, int exponent = 0);

// Returns a quotient with the same accuracy. Requires a nonzero denominator (unchecked because
// callers test for 0).
double ApproximateQuotient(const BigInteger& numerator, const BigInteger& denominator);

}  // namespace hulld

#endif  // HULLD_CLIENT_ENCLOSURE_EXACT_NUMBER_H_
