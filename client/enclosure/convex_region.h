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
// common exponent. Also stores a floating-point filter that answers clear cases quickly.
class HalfSpace {
 public:
  // `grid` is the exponent of the integers.
  HalfSpace(BigVector normal, BigInteger offset, const CommonExponent& grid);

  const BigVector& normal() const { return normal_; }
  const BigInteger& offset() const { return offset_; }

  // Returns the exact sign of normal . P - offset: -1 inside, 0 on the boundary, 1 outside. `P` is
  // p on the grid. Cost: three products; exact ones if the filter cannot decide.
  int Side(const std::array<double, 3>& p, const BigVector& P) const;

 private:
  BigVector normal_;
  BigInteger offset_;
  // Normal and offset, divided by a power of two so that the largest number of the normal is about
  // 1 and p keeps its own unit; each has a relative error of at most 2^-51.
  std::array<double, 3> unit_normal_;
  double unit_offset_;
};

// A convex hull as an intersection of half spaces. A solid hull has the half spaces of its facets.
// A flat hull is a plane and the sides of its polygon, a line and its ends, or a point. The hull of
// no points contains no point.
class ConvexRegion {
 public:
  // Returns the region of a hull from the server. Requires that all numbers of the mesh were
  // included in the grid. INTERNAL: facets that do not match the vertices.
  static absl::StatusOr<ConvexRegion> Make(const HullMesh& mesh, const CommonExponent& grid);
  // Returns the region of a hull at a pose, exactly: half spaces are rotated by products of
  // quaternion components, without division. The grid must also include the translation. Requires a
  // nonzero quaternion (unchecked because the server rejects zero).
  static absl::StatusOr<ConvexRegion> Make(const HullMesh& mesh, const RigidPose& X_WH,
                                           const CommonExponent& grid);

  bool empty() const { return empty_; }
  const std::vector<HalfSpace>& half_spaces() const { return half_spaces_; }

  // Returns true if the region contains the point, boundary included; exact. Cost: one test per
  // half space.
  bool Contains(const std::array<double, 3>& p, const BigVector& P) const;

 private:
  ConvexRegion() = default;

  bool empty_ = false;
  std::vector<HalfSpace> half_spaces_;
};

// Returns the point on the grid.
BigVector OnGrid(const std::array<double, 3>& p, const CommonExponent& grid);

// Returns true if the hull is the convex hull of these points, n x 3: each point is in the hull,
// and each vertex of the hull is one of them. Exact. Cost: one test per point and facet.
absl::StatusOr<bool> IsHullOf(const HullMesh& mesh, const std::vector<double>& xyz);

}  // namespace hulld

#endif  // HULLD_CLIENT_ENCLOSURE_CONVEX_REGION_H_
