#include "core/query/placed/placed_hull.h"

#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "core/numeric/exponent_limits.h"

namespace hulld {
namespace {

// R(q) / |q|^2, within kRotationEntryError.
Eigen::Matrix3d RotationOf(const std::array<double, 4>& q) {
  auto [w, x, y, z] = q;
  const double largest =
      std::max(std::max(std::abs(w), std::abs(x)), std::max(std::abs(y), std::abs(z)));
  if (!(largest >= kQuaternionMin && largest <= kQuaternionMax)) {
    int exponent = 0;
    std::frexp(largest, &exponent);
    for (double* component : {&w, &x, &y, &z}) *component = std::ldexp(*component, -exponent);
  }
  const double norm = w * w + x * x + y * y + z * z;
  Eigen::Matrix3d R;
  R << w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z),
      w * w - x * x + y * y - z * z, 2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x),
      w * w - x * x - y * y + z * z;
  return R / norm;
}

}  // namespace

PlacedHull::PlacedHull(const QueryHull& hull, const Pose& X_WH)
    : hull_(&hull), X_WH_(X_WH), R_WH_(RotationOf(X_WH.q)), rotated_center_(R_WH_ * hull.center()) {
  HULLD_DCHECK(ValidatePose(X_WH).ok());
}

absl::StatusOr<PlacedHull> PlacedHull::Make(const QueryHull& hull, const Pose& X_WH) {
  if (absl::Status status = ValidatePose(X_WH); !status.ok()) return status;
  return PlacedHull(hull, X_WH);
}

}  // namespace hulld
