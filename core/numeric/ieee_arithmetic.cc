#include "core/numeric/ieee_arithmetic.h"

#include <limits>

namespace hulld {

bool HasIeeeArithmetic() {
  // Volatile, so that the processor computes each result.
  const volatile double tiny = 0x1p-60;
  const volatile double least_normal = std::numeric_limits<double>::min();
  const volatile double subnormal = std::numeric_limits<double>::denorm_min();
  const bool rounds_to_nearest = 1 + tiny == 1 && 1 - tiny == 1 && -1 - tiny == -1;
  // The first is false if results are flushed to zero, the second if operands are.
  return rounds_to_nearest && least_normal / 2 != 0 && subnormal != 0;
}

}  // namespace hulld
