#ifndef HULLD_CORE_QUERY_PLACED_PLACED_HULL_H_
#define HULLD_CORE_QUERY_PLACED_PLACED_HULL_H_

#include <absl/status/statusor.h>

#include "core/query/placed/query_hull.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/pose_product.h"

namespace hulld {

// A hull at a pose, and what every query of it needs of the pose: made once, used for many pairs.
class PlacedHull {
 public:
  // `hull` must outlive the result. INVALID_ARGUMENT: ValidatePose.
  static absl::StatusOr<PlacedHull> Make(const QueryHull& hull, const Pose& X_WH);
  // The same for a pose that was validated before. Requires a valid pose (ValidatePose).
  PlacedHull(const QueryHull& hull, const Pose& X_WH);
  // A piece of a body. Both must outlive the result. Exact questions are answered for the product
  // as it is, not for a rounding of it.
  PlacedHull(const QueryHull& hull, const PoseProduct& X_WH);

  const QueryHull& query_hull() const { return *hull_; }
  // Requires a canonical one.
  const Hull& hull() const { return hull_->hull(); }
  bool empty() const { return hull_->empty(); }
  // Rounded for a piece of a body (PoseProduct::rounded).
  const Pose& X_WH() const { return X_WH_; }
  // Null but for a piece of a body.
  const PoseProduct* product() const { return product_; }
  // The rotation R(q) / |q|^2, each entry within kRotationEntryError.
  const Eigen::Matrix3d& R_WH() const { return R_WH_; }
  // The hull's centre rotated, R_WH * center, before the translation.
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
