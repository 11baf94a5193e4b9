#include "client/formats/length_scale.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace hulld {
namespace {

// A decimal number: digits * 10^exponent.
struct Decimal {
  bool negative = false;
  std::string digits;
  int64_t exponent = 0;
};

constexpr size_t kMaxDigits = 18;
// Beyond this, the exponent alone decides between 0 and infinity, because no text has that many
// digits.
constexpr int64_t kMaxExponent = int64_t{1} << 40;

// Requires a finite number that ParseCoordinate accepts.
Decimal Split(std::string_view text) {
  Decimal decimal;
  decimal.negative = text[0] == '-';
  if (text[0] == '-' || text[0] == '+') text.remove_prefix(1);
  const size_t letter = text.find_first_of("eEdD");
  bool in_fraction = false;
  for (const char c : text.substr(0, letter)) {
    if (c == '.') {
      in_fraction = true;
      continue;
    }
    decimal.digits += c;
    decimal.exponent -= in_fraction ? 1 : 0;
  }
  if (letter == std::string_view::npos) return decimal;
  text.remove_prefix(letter + 1);
  if (text[0] == '+') text.remove_prefix(1);
  int64_t written = 0;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), written);
  if (parsed.ec != std::errc()) written = text[0] == '-' ? -kMaxExponent : kMaxExponent;
  decimal.exponent += std::clamp(written, -kMaxExponent, kMaxExponent);
  return decimal;
}

// Multiplies the digits in place by long multiplication. A carry and nine mantissas fit into 64
// bits because the mantissa is below 10^18.
void Multiply(uint64_t mantissa, std::string* digits) {
  uint64_t carry = 0;
  for (auto digit = digits->rbegin(); digit != digits->rend(); ++digit) {
    carry += static_cast<uint64_t>(*digit - '0') * mantissa;
    *digit = static_cast<char>('0' + carry % 10);
    carry /= 10;
  }
  if (carry > 0) digits->insert(0, absl::StrCat(carry));
}

}  // namespace

std::optional<LengthScale> LengthScale::FromText(std::string_view decimal) {
  double value = 0;
  if (ParseDouble(decimal, &value) != NumberText::kNumber) return {};
  if (!std::isfinite(value) || value == 0) return {};
  Decimal parsed = Split(decimal);
  std::string& digits = parsed.digits;
  digits.erase(0, digits.find_first_not_of('0'));
  while (!digits.empty() && digits.back() == '0') {
    digits.pop_back();
    ++parsed.exponent;
  }
  if (digits.size() > kMaxDigits) {
    // At most 17 digits. Without an exponent, 2^64 would have all of its 20 digits.
    char text[32];
    const char* const end =
        std::to_chars(text, text + sizeof(text), value, std::chars_format::scientific).ptr;
    return FromText({text, static_cast<size_t>(end - text)});
  }
  LengthScale scale;
  std::from_chars(digits.data(), digits.data() + digits.size(), scale.mantissa_);
  scale.exponent_ = static_cast<int>(parsed.exponent);
  scale.negative_ = parsed.negative;
  return scale;
}

std::optional<LengthScale> LengthScale::Times(const LengthScale& other) const {
  return FromText(
      Product(absl::StrCat(other.negative_ ? "-" : "", other.mantissa_, "e", other.exponent_)));
}

std::string LengthScale::Product(std::string_view text) const {
  Decimal product = Split(text);
  Multiply(mantissa_, &product.digits);
  return absl::StrCat(product.negative != negative_ ? "-" : "", product.digits, "e",
                      product.exponent + exponent_);
}

NumberText LengthScale::Parse(std::string_view text, double* value) const {
  const NumberText kind = ParseCoordinate(text, value);
  const bool is_decimal =
      kind == NumberText::kTooLarge || (kind == NumberText::kNumber && std::isfinite(*value));
  if (is_one() || !is_decimal) return kind;
  return ParseDouble(Product(text), value);
}

double LengthScale::Apply(double x) const {
  if (is_one() || x == 0 || !std::isfinite(x)) return negative_ ? -x : x;
  // Powers of ten up to 10^22 and integers up to 2^53 are exact doubles.
  static constexpr double kPowers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                       1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                       1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  const double magnitude = std::abs(x);
  if (exponent_ <= 0 && exponent_ >= -22 && mantissa_ <= uint64_t{1} << 53 &&
      magnitude > 0x1p-800 && magnitude < 0x1p800) {
    const double n = static_cast<double>(mantissa_);
    const double d = kPowers[-exponent_];
    // x n = high + low and high = q d + rest, both exact: nothing overflows, and all are multiples
    // of 2^-1074. So x n / d = q + (rest + low) / d, and `correction`, rounded twice, is that
    // quotient up to a factor of 1 +- 2^-51.
    const double high = magnitude * n;
    const double low = std::fma(magnitude, n, -high);
    const double q = high / d;
    const double correction = (std::fma(-q, d, high) + low) / d;
    // Rounding is monotonic: if both bounds of the product round alike, so does the product.
    const double one = q + correction * (1 - 0x1p-50);
    if (one == q + correction * (1 + 0x1p-50)) return (x < 0) != negative_ ? -one : one;
  }
  // Every double has a decimal expansion of at most 767 digits.
  char text[800];
  const char* const end =
      std::to_chars(text, text + sizeof(text), x, std::chars_format::scientific, 766).ptr;
  double product = 0;
  if (ParseDouble(Product({text, static_cast<size_t>(end - text)}), &product) ==
      NumberText::kTooLarge) {
    return (x < 0) != negative_ ? -HUGE_VAL : HUGE_VAL;
  }
  return product;
}

}  // namespace hulld
