#ifndef HULLD_CLIENT_ENCLOSURE_CONVEX_REGION_H_
#define HULLD_CLIENT_ENCLOSURE_CONVEX_REGION_H_

#include <absl/status/statusor.h>

#include <array>
#include <vector>

#include "client/client.h"
#include "client/pose/rigid_pose.h"
#include "client/verify/exact_vector.h"

namespace hulld {

// A closed half space: the points p with normal . P <= offset, where P is p in integers of the
// common exponent. With it, the same in floating point, for a quick answer where that is certain.
class HalfSpace {
 public:
  // `grid` is what made the integers.
  HalfSpace(BigVector normal, BigInteger offset, const CommonExponent& grid);

  const BigVector& normal() const { return normal_; }
  const BigInteger& offset() const { return offset_; }

  // The sign of normal . P - offset, exact: -1 inside, 0 on the boundary, 1 outside. `P` is p on
  // the grid. Cost: three products, and exact ones where the filter cannot tell.
  int Side(const std::array<double, 3>& p, const BigVector& P) const;

 private:
  BigVector normal_;
  BigInteger offset_;
  // The normal and the offset, divided by a power of two so that the normal's largest number is
  // about 1 and p can stay in its own unit; each is off by at most 2^-51 of itself.
  std::array<double, 3> unit_normal_;
  double unit_offset_;
};

// The points of a convex hull, as an intersection of half spaces: those of its facets where it has
// volume; a plane and the sides of its polygon, a line and its ends, or a point, where it is flat.
// The hull of no points holds none.
class ConvexRegion {
 public:
  // From the vertices and facets of a hull of the server. All numbers of the mesh must have been
  // included in the grid. INTERNAL: facets that do not fit the vertices.
  static absl::StatusOr<ConvexRegion> Make(const HullMesh& mesh, const CommonExponent& grid);
  // The same of a hull at a pose, exact: nothing is rounded, as half spaces turn by the
  // quaternion's products alone, without a quotient. The translation must have been included in the
  // grid, too. Requires a quaternion that is not zero; unchecked, as the server takes no other.
  static absl::StatusOr<ConvexRegion> Make(const HullMesh& mesh, const RigidPose& X_WH,
                                           const CommonExponent& grid);

  bool empty() const { return empty_; }
  const std::vector<HalfSpace>& half_spaces() const { return half_spaces_; }

  // Whether it holds the point, its boundary included; exact. Cost: as many tests as half spaces.
  bool Holds(const std::array<double, 3>& p, const BigVector& P) const;

 private:
  ConvexRegion() = default;

  bool empty_ = false;
  std::vector<HalfSpace> half_spaces_;
};

// The point on the grid.
BigVector OnGrid(const std::array<double, 3>& p, const CommonExponent& grid);

// Whether the hull is that of exactly these points (x y z each): each is in the hull, and each
// vertex of the hull is one of them. Exact. Cost: a test for each point and facet.
absl::StatusOr<bool> IsHullOf(const HullMesh& mesh, const std::vector<double>& xyz);

}  // namespace hulld

#endif  // HULLD_CLIENT_ENCLOSURE_CONVEX_REGION_H_
