#ifndef HULLD_CLIENT_VERIFY_EXACT_HULL_H_
#define HULLD_CLIENT_VERIFY_EXACT_HULL_H_

#include <absl/status/status.h>

#include <array>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "client/verify/exact_vector.h"
#include "hulld/v1/geometry.pb.h"

namespace hulld {

// Input of a check: the vertices of a hull, n x 3, its pose, and its radius.
struct PlacedVertices {
  std::span<const double> xyz;
  const v1::Pose& pose;
  // For a piece of a body: its pose in the body's frame; `pose` is then the pose of the body.
  // Otherwise null.
  const v1::Pose* in_body = nullptr;
  // True: points with this hull, in any order, as of an inline shape. A certificate then names its
  // vertices by their coordinates.
  bool in_any_order = false;
  // Radii of the placement and of the piece of a body; the radius of the rounded hull is their sum.
  std::array<double, 2> radii = {};
};

bool AreFinite(std::span<const double> numbers);

// OK, or FAILED_PRECONDITION: a number that is not finite, a rotation of zero, or a negative
// radius.
absl::Status CheckPlacement(const PlacedVertices& hull);

// Widens the exponent to cover the vertices, translations, and radii of this hull. Requires
// CheckPlacement.
void IncludeLengths(const PlacedVertices& hull, CommonExponent* lengths);

// Vertices in the frame of their hull, shared by all of its placements.
using BigVertices = std::shared_ptr<const std::vector<BigVector>>;
BigVertices ToIntegers(std::span<const double> xyz, const CommonExponent& lengths);

using BigQuaternion = std::array<BigInteger, 4>;

// R(q) and |q|^2, or both as symmetric bilinear forms of two quaternions.
struct BigRotation {
  BigVector rows[3];
  BigInteger scale;
};
// The forms of a and b; R(q) and |q|^2 if both are q.
BigRotation RotationForm(const BigQuaternion& a, const BigQuaternion& b);

BigQuaternion RotationIn(const v1::Pose& pose, const CommonExponent& quaternions);
BigVector TranslationIn(const v1::Pose& pose, const CommonExponent& lengths);

// Widens the exponent to cover the rotation of a pose. Requires a finite one.
void IncludeRotation(const v1::Pose& pose, CommonExponent* quaternions);

// n^T M.
BigVector Combination(const BigVector& n, const BigVector (&rows)[3]);

// An exact hull in the world: p_W = (rows p + shift) / scale in integers, all lengths at one power
// of two. The power of two of a quaternion cancels.
struct ExactHull {
  // Requires CheckPlacement, an exponent that covers the hull (IncludeLengths), and its vertices at
  // that exponent. (The number of vertices is checked. Their values are not, because that would
  // repeat the conversion.)
  ExactHull(const PlacedVertices& hull, BigVertices exact_vertices, const CommonExponent& lengths);

  // p_W = rotation(p) + translation / divisor. Requires divisor > 0. The vertices of a piece are
  // those in its body's frame.
  ExactHull(const PlacedVertices& hull, BigVertices exact_vertices, const CommonExponent& lengths,
            const BigRotation& rotation, const BigVector& translation, const BigInteger& divisor);

  // Returns scale p_W of vertex i.
  BigVector World(size_t i) const;
  // Returns the minimum and maximum of n.p_W over the vertices, times scale. Requires a vertex.
  std::pair<BigInteger, BigInteger> Extent(const BigVector& n) const;

  // The original coordinates.
  std::span<const double> xyz;
  bool in_any_order;
  BigVertices vertices;
  BigVector rows[3];
  // > 0
  BigInteger scale;
  BigVector shift;
  // The exact sum of the radii, at the exponent of the lengths; not times scale.
  BigInteger radius;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_VERIFY_EXACT_HULL_H_
