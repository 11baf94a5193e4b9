#include "client/enclosure/exact_number.h"

#include <cmath>
#include <cstdint>

namespace hulld {
namespace {

constexpr int kDigits = 63;

int BitsOf(const BigInteger& number) {
  return number == 0 ? 0 : static_cast<int>(boost::multiprecision::msb(abs(number))) + 1;
}

}  // namespace

double Approximate(const BigInteger& number, int exponent) {
  const int excess = BitsOf(number) - kDigits;
  if (excess <= 0) return std::ldexp(static_cast<double>(static_cast<int64_t>(number)), exponent);
  const BigInteger leading = abs(number) >> excess;
  const double size = std::ldexp(static_cast<double>(static_cast<int64_t>(leading)), 0);
  return std::ldexp(number < 0 ? -size : size, excess + exponent);
}

double ApproximateQuotient(const BigInteger& numerator, const BigInteger& denominator) {
  // Shifts so that the quotient has a few digits more than a double.
  const int shift = kDigits + BitsOf(denominator) - BitsOf(numerator);
  const BigInteger quotient = shift >= 0 ? BigInteger((numerator << shift) / denominator)
                                         : BigInteger(numerator / (denominator << -shift));
  return Approximate(quotient, -shift);
}

}  // namespace hulld
