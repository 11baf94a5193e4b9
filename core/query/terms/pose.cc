#include "core/query/terms/pose.h"

#include <absl/strings/str_cat.h>

#include <cmath>

namespace hulld {
namespace {

absl::Status CheckFinite(const char* field, const char* coordinate, double value) {
  if (std::isfinite(value)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, ".", coordinate, " is ", std::isnan(value) ? "NaN" : "infinite"));
}

}  // namespace

absl::Status ValidatePose(const Pose& pose) {
  if (IsValidPose(pose)) return absl::OkStatus();
  constexpr const char* kRotation[] = {"w", "x", "y", "z"};
  constexpr const char* kTranslation[] = {"x", "y", "z"};
  for (int i = 0; i < 4; ++i) {
    if (absl::Status s = CheckFinite("rotation", kRotation[i], pose.q[i]); !s.ok()) return s;
  }
  for (int i = 0; i < 3; ++i) {
    if (absl::Status s = CheckFinite("translation", kTranslation[i], pose.t[i]); !s.ok()) return s;
  }
  return absl::InvalidArgumentError("rotation is zero; use w = 1, x = y = z = 0 for no rotation");
}

}  // namespace hulld
