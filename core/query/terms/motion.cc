#include "core/query/terms/motion.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>

#include "core/base/check.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/integer.h"

namespace hulld {
namespace {

using Quaternion = std::array<double, 4>;

// Returns the least exponent of the lowest bits of the components, or `otherwise` if that is less.
int LowestBitExponentOf(const Quaternion& q, int otherwise = kAboveAllExponents) {
  for (const double component : q) {
    if (component != 0) otherwise = std::min(otherwise, LowestBitExponent(component));
  }
  return otherwise;
}

std::array<Integer, 4> ToIntegers(const Quaternion& q, int exponent) {
  return {ToInteger(q[0], exponent), ToInteger(q[1], exponent), ToInteger(q[2], exponent),
          ToInteger(q[3], exponent)};
}

// A time in [0, 1] as a fraction, numerator / 2^bits.
class BinaryTime {
 public:
  explicit BinaryTime(double time)
      : bits_(time == 0 ? 0 : std::max(0, -LowestBitExponent(time))),
        numerator_(ToInteger(time, -bits_)) {
    HULLD_DCHECK(time >= 0 && time <= 1);
  }

  int bits() const { return bits_; }
  // Returns 2^bits ((1 - time) start + time end).
  Integer Between(const Integer& start, const Integer& end) const {
    return (start << bits_) + numerator_ * (end - start);
  }

 private:
  int bits_;
  Integer numerator_;
};

// Returns the sign of s if q1 = s q0 for some s, and otherwise 0. Requires: neither is zero.
int SignOfFactor(const Quaternion& q0, const Quaternion& q1) {
  if (q0 == q1) return 1;
  // The product of each pair of components has the sign of s, or is 0 because both are.
  int sign = 0;
  for (int i = 0; i < 4; ++i) {
    if ((q0[i] == 0) != (q1[i] == 0)) return 0;
    if (q0[i] == 0) continue;
    const int of_pair = (q0[i] < 0) == (q1[i] < 0) ? 1 : -1;
    if (sign != 0 && of_pair != sign) return 0;
    sign = of_pair;
  }
  const auto pivot = std::find_if(q0.begin(), q0.end(), [](double x) { return x != 0; });
  const size_t k = pivot - q0.begin();
  // Products that round differently differ.
  for (size_t i = 0; i < 4; ++i) {
    if (q0[i] * q1[k] != q0[k] * q1[i]) return 0;
  }
  const std::array<Integer, 4> m = ToIntegers(q0, LowestBitExponentOf(q0));
  const std::array<Integer, 4> n = ToIntegers(q1, LowestBitExponentOf(q1));
  for (size_t i = 0; i < 4; ++i) {
    if (m[i] * n[k] != m[k] * n[i]) return 0;
  }
  return sign;
}

}  // namespace

bool IsTranslation(const Motion& motion) { return SignOfFactor(motion.start.q, motion.end.q) > 0; }

absl::Status ValidateMotion(const Motion& motion) {
  if (absl::Status s = ValidatePose(motion.start); !s.ok()) return s;
  if (absl::Status s = ValidatePose(motion.end); !s.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("end.", s.message()));
  }
  if (SignOfFactor(motion.start.q, motion.end.q) < 0) {
    return absl::InvalidArgumentError(
        "the rotations at the start and the end are opposite quaternions, so the rotation between "
        "them vanishes; negate one of them to keep the rotation, or add a pose between them");
  }
  return absl::OkStatus();
}

std::array<Integer, 4> QuaternionAt(const Motion& motion, double time) {
  const int exponent = LowestBitExponentOf(motion.start.q, LowestBitExponentOf(motion.end.q));
  const std::array<Integer, 4> start = ToIntegers(motion.start.q, exponent);
  const std::array<Integer, 4> end = ToIntegers(motion.end.q, exponent);
  const BinaryTime t(time);
  return {t.Between(start[0], end[0]), t.Between(start[1], end[1]), t.Between(start[2], end[2]),
          t.Between(start[3], end[3])};
}

int TranslationExponentAt(const Motion& motion, double time) {
  const int of_ends =
      LowestBitExponent(motion.start.t, LowestBitExponent(motion.end.t, kAboveAllExponents));
  return of_ends - BinaryTime(time).bits();
}

IntegerVector TranslationAt(const Motion& motion, double time, int exponent) {
  const BinaryTime t(time);
  const IntegerVector start = ToInteger(motion.start.t, exponent + t.bits());
  const IntegerVector end = ToInteger(motion.end.t, exponent + t.bits());
  return {t.Between(start.x, end.x), t.Between(start.y, end.y), t.Between(start.z, end.z)};
}

}  // namespace hulld
