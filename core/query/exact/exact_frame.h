#ifndef HULLD_CORE_QUERY_EXACT_EXACT_FRAME_H_
#define HULLD_CORE_QUERY_EXACT_EXACT_FRAME_H_

#include <array>

#include "core/numeric/wide_integer.h"
#include "core/query/floating/float_pair.h"

namespace hulld {

// A rotation over the integers: it maps p to (rows p) / norm. Common factors that are cheap to find
// are removed, so that the identity and rotations by 90, 120 and 180 degrees have entries of 0, 1
// and -1 and the norm 1, for any scale of their quaternions.
struct SmallRotation {
  std::array<std::array<Int128, 3>, 3> rows;
  Int128 norm;
};

// The scale and size of the world coordinates of a pair of hulls in integers of few bits. In units
// of 2^exponent / norm, shifted by -t_A, world coordinates are
//   A: factor * rows_A * 2^(exponent_A - exponent) * own, and
//   B: factor * rows_B * 2^(exponent_B - exponent) * own + norm * (t_B - t_A) / 2^exponent,
// where own are a hull's coordinates over 2^exponent_A or 2^exponent_B, and the factor is the other
// hull's norm, or 1 if the norms are equal.
struct SmallFrame {
  struct Side {
    SmallRotation rotation;
    // True if the other hull's norm is a factor.
    bool times_other_norm;
    int exponent;
    // Every own coordinate is below 2^own_bits in magnitude.
    int own_bits;
  };
  Side a;
  Side b;
  int exponent;
  // Every world coordinate, and every term of its sums, is below 2^bits in magnitude.
  int bits;
};

// Returns the least width, in words of 64 bits, of world coordinates for which a search in
// fixed-width integers is exact; see WidePair.
inline constexpr int WordsFor(int bits) { return (bits + 9 + 63) / 64; }

// Finds the rotation of a quaternion with components that are integers of at most 60 bits over a
// power of two. Returns false for other quaternions, with components of widely different magnitude.
// Requires: q finite and not zero.
bool FindSmallRotation(const std::array<double, 4>& q, SmallRotation& rotation);

// Finds the rotation of a placed hull. The rotation of a piece of a body is a product of two
// rotations. It is small if its norm is below 2^120, for example if one factor is the identity or a
// rotation by quarter turns.
bool FindSmallRotation(const PlacedHull& placed, SmallRotation& rotation);

// Returns the poses that place a hull: its own pose, or both poses of a piece of a body.
std::array<const Pose*, 2> PosesOf(const PlacedHull& placed);
// Returns the least exponent of the lowest bits of the hull's translations, or `otherwise` if that
// is less.
int TranslationExponent(const PlacedHull& placed, int otherwise);

// Returns false if a quaternion has no small rotation. Cost: about 50 ns.
bool FindSmallFrame(const FloatPair& pair, SmallFrame& frame);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_EXACT_EXACT_FRAME_H_
