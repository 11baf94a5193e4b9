#ifndef HULLD_CORE_QUERY_PLACED_PLACED_HULL_H_
#define HULLD_CORE_QUERY_PLACED_PLACED_HULL_H_

#include <absl/status/statusor.h>

#include <array>

#include "core/query/placed/query_hull.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/pose_product.h"

namespace hulld {

// A hull at a pose, with the pose's derived data: built once, used for many pairs. With a radius it
// is a rounded hull: the Minkowski sum of the hull, its core, and a closed ball. Queries refer to
// rounded hulls, whereas the members of this class describe the core.
class PlacedHull {
 public:
  // `hull` must outlive the result. INVALID_ARGUMENT: see ValidatePose.
  static absl::StatusOr<PlacedHull> Make(const QueryHull& hull, const Pose& X_WH);
  static absl::StatusOr<PlacedHull> Make(const QueryHull&&, const Pose&) = delete;
  // Requires: a valid pose (ValidatePose), and a radius that is finite and not negative.
  PlacedHull(const QueryHull& hull, const Pose& X_WH, double radius = 0);
  PlacedHull(const QueryHull&&, const Pose&, double = 0) = delete;
  // Places a piece of a body. Both arguments must outlive the result. Exact queries use the exact
  // product, not its rounding, and the exact sum of both radii.
  PlacedHull(const QueryHull& hull, const PoseProduct& X_WH, double radius = 0,
             double piece_radius = 0);

  const QueryHull& query_hull() const { return *hull_; }
  // Requires: a canonical hull.
  const Hull& hull() const { return hull_->hull(); }
  bool empty() const { return hull_->empty(); }
  // Rounded for a piece of a body (PoseProduct::rounded).
  const Pose& X_WH() const { return X_WH_; }
  // Null except for a piece of a body.
  const PoseProduct* product() const { return product_; }
  // Radii of the placement and of the piece; the radius is their exact sum.
  const std::array<double, 2>& radii() const { return radii_; }
  bool is_rounded() const { return radii_[0] > 0 || radii_[1] > 0; }
  // The rotation R(q) / |q|^2, each entry within kRotationEntryError.
  const Eigen::Matrix3d& R_WH() const { return R_WH_; }
  // The hull's center rotated, R_WH * center, before the translation.
  const Vector& rotated_center() const { return rotated_center_; }

 private:
  const QueryHull* hull_;
  Pose X_WH_;
  Eigen::Matrix3d R_WH_;
  Vector rotated_center_;
  const PoseProduct* product_ = nullptr;
  std::array<double, 2> radii_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_PLACED_HULL_H_
