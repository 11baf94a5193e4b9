#include "core/query/body/box_gap.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/query/placed/rotation.h"

namespace hulld {
namespace {

// Returns the rotation of a pose, as computed by PlacedHull.
Eigen::Matrix3d RotationOf(const Pose& pose) {
  static const Hull kNothing;
  static const QueryHull kNoHull(kNothing);
  return PlacedHull(kNoHull, pose).R_WH();
}

}  // namespace

BoxGap::BoxGap(const PlacedBody& x, const PlacedBody& y) {
  const Eigen::Matrix3d R_WX = RotationOf(x.X_WB());
  const Eigen::Matrix3d R_WY = RotationOf(y.X_WB());
  const Vector offset = y.X_WB().t - x.X_WB().t;
  const double size =
      x.body().boxes().size() + y.body().boxes().size() + offset.cwiseAbs().maxCoeff();
  usable_ = IsFilterSize(size);
  error_ = kBoxGapErrorFactor * size;
  if (const double radii = x.radius() + y.radius(); radii > 0) {
    // Rounding: u of the sum of the radii, and u of each of two sums with it.
    error_ += radii * (1 + 8 * kUnitRoundoff);
  }
  for (int i = 0; i < 3; ++i) R_XY_.col(i) = TransposedProduct(R_WX, Vector(R_WY.col(i)));
  abs_R_XY_ = R_XY_.cwiseAbs();
  p_XY_ = TransposedProduct(R_WX, offset);
}

double BoxGap::AtLeast(const Box& of_x, const Box& of_y) const {
  if (of_x.IsEmpty() || of_y.IsEmpty()) return kInfinity;
  if (!usable_) return -kInfinity;
  const Vector center_x = 0.5 * (of_x.low + of_x.high);
  const Vector half_x = 0.5 * (of_x.high - of_x.low);
  const Vector center_y = 0.5 * (of_y.low + of_y.high);
  const Vector half_y = 0.5 * (of_y.high - of_y.low);
  // Vector from X's center to Y's, in the frame of X.
  const Vector step = Product(R_XY_, center_y) + p_XY_ - center_x;
  const Vector along_x = step.cwiseAbs() - half_x - Product(abs_R_XY_, half_y);
  const Vector along_y =
      TransposedProduct(R_XY_, step).cwiseAbs() - half_y - TransposedProduct(abs_R_XY_, half_x);
  return std::max(along_x.maxCoeff(), along_y.maxCoeff()) - error_;
}

Box BoundingBox(const PlacedBody& placed) {
  if (placed.body().is_hull()) {
    return BoundingBox(PlacedHull(*placed.body().pieces()[0].hull, placed.X_WB(), placed.radius()));
  }
  const Box box = placed.body().boxes().all();
  if (box.IsEmpty()) return Box::Empty();
  const Vector& t = placed.X_WB().t;
  const double size = placed.body().boxes().size() + t.cwiseAbs().maxCoeff();
  if (!IsFilterSize(size)) return {Vector::Constant(-kInfinity), Vector::Constant(kInfinity)};
  const Eigen::Matrix3d R = RotationOf(placed.X_WB());
  const Vector center = Product(R, Vector(0.5 * (box.low + box.high))) + t;
  const Vector error = Vector::Constant(kBoxGapErrorFactor * size);
  const Vector half = Product(R.cwiseAbs(), Vector(0.5 * (box.high - box.low))) + error;
  return GrownBy({center - half, center + half}, placed.radius());
}

}  // namespace hulld
