#ifndef HULLD_CORE_QUERY_EXACT_EXACT_FRAME_H_
#define HULLD_CORE_QUERY_EXACT_EXACT_FRAME_H_

#include <array>

#include "core/numeric/wide_integer.h"
#include "core/query/floating/float_pair.h"

namespace hulld {

// A rotation over the integers: it takes p to rows p / norm. Common factors that are found without
// much work are left out, so that turns by no angle, by 90, 120 and 180 degrees have entries of 0,
// 1 and -1 and the norm 1, however their quaternions are scaled.
struct SmallRotation {
  std::array<std::array<Int128, 3>, 3> rows;
  Int128 norm;
};

// A pair of hulls in integers of few bits: what world coordinates are made of, and how large they
// get. In units of 2^exponent / norm, shifted by -t_A, world coordinates are
//   A: factor * rows_A * 2^(exponent_A - exponent) * own, and
//   B: factor * rows_B * 2^(exponent_B - exponent) * own + norm * (t_B - t_A) / 2^exponent,
// where own are a hull's coordinates over 2^exponent_A or 2^exponent_B, and the factor is the other
// hull's norm, or 1 when the norms are the same.
struct SmallFrame {
  struct Side {
    SmallRotation rotation;
    // Whether the other's norm is a factor.
    bool times_other_norm;
    int exponent;
    // Every own coordinate is below 2^own_bits in magnitude.
    int own_bits;
  };
  Side a;
  Side b;
  int exponent;
  // Every world coordinate, and every term of the sums that make it, is below 2^bits in magnitude.
  int bits;
};

// The least width, in words of 64 bits, of the world coordinates with which a search in
// fixed-width integers is exact; see WidePair.
inline constexpr int WordsFor(int bits) { return (bits + 9 + 63) / 64; }

// The rotation of a quaternion whose components are integers of at most 60 bits over a power of
// two. False for others, whose components differ widely in magnitude. Requires q finite and not
// zero.
bool FindSmallRotation(const std::array<double, 4>& q, SmallRotation& rotation);

// The rotation of a placed hull. That of a piece of a body is the product of two, which is small
// where its norm is below 2^120, as it is when one of them turns by no angle or by quarter turns.
bool FindSmallRotation(const PlacedHull& placed, SmallRotation& rotation);

// The poses that place a hull: its own, or both of a piece of a body.
std::array<const Pose*, 2> PosesOf(const PlacedHull& placed);
// The least exponent of the lowest bits of the translations that place it, or `otherwise` when that
// is less.
int TranslationExponent(const PlacedHull& placed, int otherwise);

// False where a quaternion has no small rotation. Cost: about 50 ns.
bool FindSmallFrame(const FloatPair& pair, SmallFrame& frame);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_EXACT_EXACT_FRAME_H_
