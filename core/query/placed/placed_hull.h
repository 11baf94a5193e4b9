#ifndef HULLD_CORE_QUERY_PLACED_PLACED_HULL_H_
#define HULLD_CORE_QUERY_PLACED_PLACED_HULL_H_

#include <absl/status/statusor.h>

#include "core/query/placed/query_hull.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/pose_product.h"

namespace hulld {

// A hull at a pose, with the pose's derived data: built once, used for many pairs.
class PlacedHull {
 public:
  // `hull` must outlive the result. INVALID_ARGUMENT: see ValidatePose.
  static absl::StatusOr<PlacedHull> Make(const QueryHull& hull, const Pose& X_WH);
  // Takes a pose that has been validated. Requires: a valid pose (ValidatePose).
  PlacedHull(const QueryHull& hull, const Pose& X_WH);
  // Places a piece of a body. Both arguments must outlive the result. Exact queries use the exact
  // product, not its rounding.
  PlacedHull(const QueryHull& hull, const PoseProduct& X_WH);

  const QueryHull& query_hull() const { return *hull_; }
  // Requires: a canonical hull.
  const Hull& hull() const { return hull_->hull(); }
  bool empty() const { return hull_->empty(); }
  // Rounded for a piece of a body (PoseProduct::rounded).
  const Pose& X_WH() const { return X_WH_; }
  // Null except for a piece of a body.
  const PoseProduct* product() const { return product_; }
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
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_PLACED_HULL_H_
