#ifndef HULLD_CLIENT_VERIFY_EXACT_HULL_H_
#define HULLD_CLIENT_VERIFY_EXACT_HULL_H_

#include <absl/status/status.h>

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "client/verify/exact_vector.h"
#include "hulld/v1/geometry.pb.h"

namespace hulld {

// A hull as the check takes it: its vertices, x y z each, and its pose.
struct PlacedVertices {
  std::span<const double> xyz;
  const v1::Pose& pose;
  // For a piece of a body: its pose in the frame of the body, which is at `pose`; otherwise null.
  const v1::Pose* in_body = nullptr;
};

bool AreFinite(std::span<const double> numbers);

// OK, or FAILED_PRECONDITION: a number that is not finite, or a rotation of zero.
absl::Status CheckPlacement(const PlacedVertices& hull);

// Widens the exponent so that it serves the vertices and translations of this hull, too. Requires
// CheckPlacement.
void IncludeLengths(const PlacedVertices& hull, CommonExponent* lengths);

// Vertices in the frame of their hull, for all of its placements.
using BigVertices = std::shared_ptr<const std::vector<BigVector>>;
BigVertices ToIntegers(std::span<const double> xyz, const CommonExponent& lengths);

// A hull in the world, exactly: p_W = (rows p + shift) / scale in integers, all lengths at one
// power of two. That of a quaternion cancels.
struct ExactHull {
  // Requires CheckPlacement, an exponent that serves it (IncludeLengths), and its vertices in that
  // exponent (their number is checked, their values are not: only making them again would tell).
  ExactHull(const PlacedVertices& hull, BigVertices vertices, const CommonExponent& lengths);

  // scale p_W of vertex i.
  BigVector World(size_t i) const;
  // The least and the greatest of n.p_W over the vertices, times scale. Requires a vertex.
  std::pair<BigInteger, BigInteger> Extent(const BigVector& n) const;

  // As given.
  std::span<const double> xyz;
  BigVertices vertices;
  BigVector rows[3];
  // > 0
  BigInteger scale;
  BigVector shift;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_VERIFY_EXACT_HULL_H_
