#ifndef HULLD_CORE_QUERY_TERMS_POSE_PRODUCT_H_
#define HULLD_CORE_QUERY_TERMS_POSE_PRODUCT_H_

#include "core/numeric/vector.h"
#include "core/query/terms/pose.h"

namespace hulld {

// X_WP = X_WB X_BP, the pose of a piece P of a body B in the world: p_W = R(q_B) (R(q_P) p_P /
// |q_P|^2 + t_P) / |q_B|^2 + t_B over the reals for the doubles given. The product itself is
// rational and mostly no pose of doubles; exact arithmetic takes it as it is, from the two factors,
// and floating point takes a rounding of it whose error is known.
class PoseProduct {
 public:
  // Requires both valid (ValidatePose). Cost: about 100 ns, less where one turns by no angle.
  PoseProduct(const Pose& X_WB, const Pose& X_BP);

  const Pose& X_WB() const { return X_WB_; }
  const Pose& X_BP() const { return X_BP_; }

  // The product, rounded: its translation is finite and, where translation_error() is, the nearest
  // doubles but for the error; the entries of the rotation computed from it are within
  // kRotationEntryError of the true ones.
  const Pose& rounded() const { return rounded_; }
  // What the rounded translation lacks.
  const Vector& translation_rest() const { return translation_rest_; }
  // How far the sum of both may be from the true translation, per component. Infinite where
  // translations are near the largest doubles.
  double translation_error() const { return translation_error_; }

 private:
  Pose X_WB_;
  Pose X_BP_;
  Pose rounded_;
  Vector translation_rest_ = Vector::Zero();
  double translation_error_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_POSE_PRODUCT_H_
