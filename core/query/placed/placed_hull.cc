#include "core/query/placed/placed_hull.h"

#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "core/numeric/exponent_limits.h"
#include "core/query/placed/rotation.h"

namespace hulld {
namespace {

// Returns R(q) / |q|^2, each entry within kRotationEntryError.
Eigen::Matrix3d RotationOf(const std::array<double, 4>& q) {
  auto [w, x, y, z] = q;
  const double largest =
      std::max(std::max(std::abs(w), std::abs(x)), std::max(std::abs(y), std::abs(z)));
  if (!(largest >= kQuaternionMin && largest <= kQuaternionMax)) {
    int exponent = 0;
    std::frexp(largest, &exponent);
    for (double* component : {&w, &x, &y, &z}) *component = std::ldexp(*component, -exponent);
  }
  const double ww = w * w;
  const double xx = x * x;
  const double yy = y * y;
  const double zz = z * z;
  // One division instead of nine.
  const double scale = 1 / ((ww + xx) + (yy + zz));
  const double twice = 2 * scale;
  Eigen::Matrix3d R;
  R << scale * ((ww + xx) - (yy + zz)), twice * (x * y - w * z), twice * (x * z + w * y),
      twice * (x * y + w * z), scale * ((ww + yy) - (xx + zz)), twice * (y * z - w * x),
      twice * (x * z - w * y), twice * (y * z + w * x), scale * ((ww + zz) - (xx + yy));
  return R;
}

}  // namespace

PlacedHull::PlacedHull(const QueryHull& hull, const Pose& X_WH, double radius)
    : hull_(&hull),
      X_WH_(X_WH),
      R_WH_(RotationOf(X_WH.q)),
      rotated_center_(Product(R_WH_, hull.center())),
      radii_{radius, 0} {
  HULLD_DCHECK(ValidatePose(X_WH).ok());
  HULLD_DCHECK(radius >= 0 && std::isfinite(radius));
}

PlacedHull::PlacedHull(const QueryHull& hull, const PoseProduct& X_WH, double radius,
                       double piece_radius)
    : PlacedHull(hull, X_WH.rounded(), radius) {
  HULLD_DCHECK(piece_radius >= 0 && std::isfinite(piece_radius));
  product_ = &X_WH;
  radii_[1] = piece_radius;
}

absl::StatusOr<PlacedHull> PlacedHull::Make(const QueryHull& hull, const Pose& X_WH) {
  // Both returns name this variable, so that the hull is constructed in the caller's storage.
  absl::StatusOr<PlacedHull> placed;
  if (IsValidPose(X_WH)) {
    placed.emplace(hull, X_WH);
  } else {
    placed = ValidatePose(X_WH);
  }
  return placed;
}

}  // namespace hulld
