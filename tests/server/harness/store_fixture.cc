#include "tests/server/harness/store_fixture.h"

#include <cmath>
#include <numbers>

#include "core/base/check.h"

namespace hulld::server {

const Hull& CanonicalOf(const HullView& view) {
  const absl::Status made = view.served->MakeCanonical(view.record, {});
  EXPECT_TRUE(made.ok()) << made;
  HULLD_CHECK(made.ok());
  return *view.served->canonical();
}

std::vector<Vector> CubeCorners(double low, double size) {
  std::vector<Vector> points;
  for (int corner = 0; corner < 8; ++corner) {
    points.emplace_back(low + (corner & 1) * size, low + (corner >> 1 & 1) * size,
                        low + (corner >> 2 & 1) * size);
  }
  return points;
}

std::vector<Vector> SpherePoints(int count, double radius) {
  std::vector<Vector> points;
  const double turn = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count;
    const double r = std::sqrt(1 - z * z);
    points.emplace_back(radius * r * std::cos(turn * i), radius * r * std::sin(turn * i),
                        radius * z);
  }
  return points;
}

}  // namespace hulld::server
