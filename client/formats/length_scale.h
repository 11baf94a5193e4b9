#ifndef HULLD_CLIENT_FORMATS_LENGTH_SCALE_H_
#define HULLD_CLIENT_FORMATS_LENGTH_SCALE_H_

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "client/formats/text_number.h"

namespace hulld {

// An exact decimal factor of coordinates, such as 0.0254 from inches to meters. Default: 1.
//
// Scaling has a single rounding: the result is the double nearest to the real product, ties to
// even, or infinity if the product exceeds the largest double.
class LengthScale {
 public:
  // Parses a decimal number. Returns nullopt unless its nearest double is finite and nonzero. A
  // number with more than 18 significant digits is replaced by the shortest decimal number with the
  // same nearest double.
  static std::optional<LengthScale> FromText(std::string_view decimal);

  // Returns the product of both factors, replaced as in FromText if it has too many digits.
  std::optional<LengthScale> Times(const LengthScale& other) const;

  bool is_one() const { return mantissa_ == 1 && exponent_ == 0 && !negative_; }

  // Returns x times the scale.
  double Apply(double x) const;

  // Parses `text` as ParseCoordinate does and sets `value` to the exact decimal number times the
  // scale. Only the product is rounded: 0.1 inches are 0.00254 meters.
  NumberText Parse(std::string_view text, double* value) const;

 private:
  // Returns the exact product with `text`, a finite decimal number that ParseCoordinate
  // accepts.
  std::string Product(std::string_view text) const;

  // mantissa_ * 10^exponent_; the mantissa does not end in 0.
  uint64_t mantissa_ = 1;
  int exponent_ = 0;
  bool negative_ = false;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_LENGTH_SCALE_H_
