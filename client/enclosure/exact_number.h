#ifndef HULLD_CLIENT_ENCLOSURE_EXACT_NUMBER_H_
#define HULLD_CLIENT_ENCLOSURE_EXACT_NUMBER_H_

#include "client/verify/exact_vector.h"

namespace hulld {

// number * 2^exponent as a double within two units in the last place; infinite, or 0, where no
// double is near.
double Approximate(const BigInteger& number, int exponent = 0);

// The same of a quotient. Requires a denominator that is not 0; unchecked, as callers divide by
// what they compared with 0 before.
double ApproximateQuotient(const BigInteger& numerator, const BigInteger& denominator);

}  // namespace hulld

#endif  // HULLD_CLIENT_ENCLOSURE_EXACT_NUMBER_H_
