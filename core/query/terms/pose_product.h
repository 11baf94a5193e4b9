#ifndef HULLD_CORE_QUERY_TERMS_POSE_PRODUCT_H_
#define HULLD_CORE_QUERY_TERMS_POSE_PRODUCT_H_

#include "core/numeric/vector.h"
#include "core/query/terms/motion.h"
#include "core/query/terms/pose.h"

namespace hulld {

// X_WP = X_WB X_BP, the pose of a piece P of a body B in the world: p_W = R(q_B) (R(q_P) p_P /
// |q_P|^2 + t_P) / |q_B|^2 + t_B over the reals for the given doubles. The product is rational, and
// in general no pose of doubles represents it. Exact arithmetic uses the two factors; floating
// point uses a rounding with a known error. A factor X_WB(t), a motion at a time, is not a pose of
// doubles either, and is treated in the same way.
class PoseProduct {
 public:
  // Requires: both poses valid (ValidatePose). Cost: about 100 ns, less if one has no rotation.
  PoseProduct(const Pose& X_WB, const Pose& X_BP);
  // X_WB(time) X_BP. `motion` must outlive the result. Requires: a valid motion (ValidateMotion), a
  // time in [0, 1], and a valid pose (ValidatePose). Cost: about 100 ns, 500 ns unless X_BP is the
  // identity.
  PoseProduct(const Motion& motion, double time, const Pose& X_BP = {});

  // Null if X_WB is a pose; otherwise it is this motion at time().
  const Motion* motion() const { return motion_; }
  double time() const { return time_; }
  // Rounded if motion() is not null.
  const Pose& X_WB() const { return X_WB_; }
  const Pose& X_BP() const { return X_BP_; }

  // The rounded product. Its translation is finite. If translation_error() is finite, the
  // translation is within that error of the nearest doubles. The entries of the rotation computed
  // from it are within kRotationEntryError of the true ones.
  const Pose& rounded() const { return rounded_; }
  // The remainder that the rounded translation omits.
  const Vector& translation_rest() const { return translation_rest_; }
  // Error bound of rounded translation plus remainder, per component. Infinite if translations are
  // near the largest doubles.
  double translation_error() const { return translation_error_; }

 private:
  const Motion* motion_ = nullptr;
  double time_ = 0;
  Pose X_WB_;
  Pose X_BP_;
  Pose rounded_;
  Vector translation_rest_ = Vector::Zero();
  double translation_error_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_POSE_PRODUCT_H_
