#include "core/query/exact/exact_frame.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "core/base/check.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/integer.h"

namespace hulld {
namespace {

// Maximum bits of a component: four squares, and sums of products of that size, stay below 2^123.
constexpr int kMaxQuaternionBits = 60;
// Maximum bits of two norms together: their product, and sums of three such products, stay below
// 2^123.
constexpr int kMaxNormBits = 120;

int BitWidth(Int128 magnitude) {
  const auto high = static_cast<uint64_t>(magnitude >> 64);
  return high != 0 ? 64 + std::bit_width(high)
                   : static_cast<int>(std::bit_width(static_cast<uint64_t>(magnitude)));
}

// Returns an exponent with |x| < 2^exponent. Requires: x finite.
int ExponentAbove(double x) {
  HULLD_DCHECK(std::isfinite(x));
  const BinaryDouble d = Decompose(x);
  return d.exponent + static_cast<int>(std::bit_width(d.magnitude));
}

// Returns the signs of the components if all that are not zero have the same magnitude, as in
// quarter and third turns.
bool FindSigns(const std::array<double, 4>& q, std::array<int64_t, 4>& signs) {
  double largest = 0;
  for (const double c : q) largest = std::max(largest, std::abs(c));
  bool alike = true;
  for (int i = 0; i < 4; ++i) {
    alike &= q[i] == 0 || std::abs(q[i]) == largest;
    signs[i] = (q[i] > 0) - (q[i] < 0);
  }
  return alike;
}

// Divides by the least non-zero component if it divides all of them. A greatest common divisor
// would find more factors but costs many divisions. Leaves common powers of two to the caller.
void DivideByLeast(std::array<int64_t, 4>& q) {
  int64_t least = INT64_MAX;
  for (const int64_t c : q) {
    if (c != 0) least = std::min(least, std::abs(c));
  }
  if (least == 1) return;
  for (const int64_t c : q) {
    // If a division succeeds, the magnitudes are usually equal.
    if (c != 0 && std::abs(c) != least && c % least != 0) return;
  }
  for (int64_t& c : q) c /= least;
}

// Computes the matrix and norm of a quaternion in integers wide enough for them.
template <typename Number>
void SetRotation(const std::array<int64_t, 4>& q, SmallRotation& rotation) {
  const Number w = q[0];
  const Number x = q[1];
  const Number y = q[2];
  const Number z = q[3];
  const Number ww = w * w;
  const Number xx = x * x;
  const Number yy = y * y;
  const Number zz = z * z;
  Number norm = ww + xx + yy + zz;
  Number rows[3][3] = {{ww + xx - yy - zz, 2 * (x * y - w * z), 2 * (x * z + w * y)},
                       {2 * (x * y + w * z), ww - xx + yy - zz, 2 * (y * z - w * x)},
                       {2 * (x * z - w * y), 2 * (y * z + w * x), ww - xx - yy + zz}};
  // If |q|^2 is 2 or 4 modulo 8, all entries may be even.
  Number any = norm;
  for (const auto& row : rows) any |= row[0] | row[1] | row[2];
  const int even = std::countr_zero(static_cast<uint64_t>(any) | uint64_t{4});
  rotation.norm = norm >> even;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) rotation.rows[i][j] = rows[i][j] >> even;
  }
}

// Returns the number of bits of a hull's own coordinates after rotation, in the pair's unit.
int RotatedBits(const SmallFrame::Side& side, int norm_bits, int exponent) {
  // |R p| = N |p| <= N sqrt(3) times the largest component.
  return norm_bits + (side.exponent - exponent) + side.own_bits + 1;
}

}  // namespace

bool FindSmallRotation(const std::array<double, 4>& q, SmallRotation& rotation) {
  HULLD_DCHECK(IsValidPose({q, Vector::Zero()}));
  std::array<int64_t, 4> integers;
  if (FindSigns(q, integers)) {
    SetRotation<int64_t>(integers, rotation);
    return true;
  }
  int exponent = kAboveAllExponents;
  int above = -kAboveAllExponents - 60;
  for (const double component : q) {
    if (component == 0) continue;
    exponent = std::min(exponent, LowestBitExponent(component));
    above = std::max(above, ExponentAbove(component));
  }
  if (above - exponent > kMaxQuaternionBits) return false;
  for (int i = 0; i < 4; ++i) {
    integers[i] = static_cast<int64_t>(WideIntegerOf<1>(q[i], exponent).word(0));
  }
  DivideByLeast(integers);
  SetRotation<Int128>(integers, rotation);
  return true;
}

bool FindSmallRotation(const PlacedHull& placed, SmallRotation& rotation) {
  if (placed.product() == nullptr) return FindSmallRotation(placed.X_WH().q, rotation);
  // At a time inside a motion, numbers have more bits than a fixed width usually holds.
  if (placed.product()->motion() != nullptr) return false;
  SmallRotation outer, inner;
  if (!FindSmallRotation(placed.product()->X_WB().q, outer)) return false;
  if (!FindSmallRotation(placed.product()->X_BP().q, inner)) return false;
  // Rows have the length of the norm, so each of the three products below is at most the product of
  // the norms.
  if (BitWidth(outer.norm) + BitWidth(inner.norm) > kMaxNormBits) return false;
  rotation.norm = outer.norm * inner.norm;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      rotation.rows[i][j] = outer.rows[i][0] * inner.rows[0][j] +
                            outer.rows[i][1] * inner.rows[1][j] +
                            outer.rows[i][2] * inner.rows[2][j];
    }
  }
  return true;
}

std::array<const Pose*, 2> PosesOf(const PlacedHull& placed) {
  const PoseProduct* const product = placed.product();
  if (product == nullptr) return {&placed.X_WH(), &placed.X_WH()};
  return {&product->X_WB(), &product->X_BP()};
}

int TranslationExponent(const PlacedHull& placed, int otherwise) {
  if (placed.product() != nullptr && placed.product()->motion() != nullptr) {
    const PoseProduct& product = *placed.product();
    return LowestBitExponent(
        product.X_BP().t,
        std::min(otherwise, TranslationExponentAt(*product.motion(), product.time())));
  }
  for (const Pose* pose : PosesOf(placed)) otherwise = LowestBitExponent(pose->t, otherwise);
  return otherwise;
}

bool FindSmallFrame(const FloatPair& pair, SmallFrame& frame) {
  if (!FindSmallRotation(pair.a(), frame.a.rotation)) return false;
  if (!FindSmallRotation(pair.b(), frame.b.rotation)) return false;
  const Int128 norm_a = frame.a.rotation.norm;
  const Int128 norm_b = frame.b.rotation.norm;
  const bool same_norm = norm_a == norm_b;
  frame.a.times_other_norm = frame.b.times_other_norm = !same_norm;
  const int norm_bits = same_norm ? BitWidth(norm_a) : BitWidth(norm_a) + BitWidth(norm_b);

  frame.a.exponent = pair.a().query_hull().exponent();
  frame.b.exponent = pair.b().query_hull().exponent();
  frame.exponent =
      std::min({frame.a.exponent, frame.b.exponent,
                TranslationExponent(pair.a(), TranslationExponent(pair.b(), kAboveAllExponents))});
  int translation_bits = 0;
  for (const PlacedHull* placed : {&pair.a(), &pair.b()}) {
    // |R(q) t_P / |q|^2 + t_B| is at most 1 + sqrt(3) times the larger of the largest components.
    const int of_sum = placed->product() == nullptr ? 0 : 2;
    double largest = 0;
    for (const Pose* pose : PosesOf(*placed)) {
      largest = std::max(largest, pose->t.cwiseAbs().maxCoeff());
    }
    if (largest == 0) continue;
    translation_bits = std::max(translation_bits, ExponentAbove(largest) - frame.exponent + of_sum);
  }
  const auto add_side = [&](const PlacedHull& placed, SmallFrame::Side& side) {
    const double largest = placed.query_hull().max_abs_coordinate();
    if (largest == 0) {
      // The hull's only vertex is its origin, a multiple of every power of two.
      side.exponent = frame.exponent;
      side.own_bits = 0;
    } else {
      side.own_bits = ExponentAbove(largest) - side.exponent;
    }
    return RotatedBits(side, norm_bits, frame.exponent);
  };
  const int bits_a = add_side(pair.a(), frame.a);
  const int bits_b = add_side(pair.b(), frame.b);
  // The difference of two translations, then its sum with the rotated coordinates.
  frame.bits = std::max({bits_a, bits_b, norm_bits + translation_bits + 1}) + 1;
  return true;
}

}  // namespace hulld
