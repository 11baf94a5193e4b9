#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/query/collision.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {
namespace clearance_test {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Pose At(double x, double y, double z) {
  Pose pose;
  pose.t = Vector(x, y, z);
  return pose;
}

bool IsWithin(const Hull& a, const Hull& b, const Pose& X_WB, double clearance) {
  QueryOptions options;
  options.clearance = clearance;
  return CheckCollision(a, Pose(), b, X_WB, options).value().within_clearance.value();
}

// Expects that the answer changes at clearance `separation`, to the unit in the last place.
void ExpectLeast(const Hull& a, const Hull& b, const Pose& X_WB, double separation) {
  EXPECT_TRUE(IsWithin(a, b, X_WB, separation)) << separation;
  EXPECT_FALSE(IsWithin(a, b, X_WB, std::nextafter(separation, -kInfinity))) << separation;
  EXPECT_TRUE(IsWithin(a, b, X_WB, kInfinity));
  EXPECT_FALSE(IsWithin(a, b, X_WB, -kInfinity));
}

TEST(Clearance, IsDecidedToTheLastBit) {
  const Hull cube = BuildHull(LatticeCube(2, 1));
  ExpectLeast(cube, cube, At(1.5, 0, 0), 0.5);
  ExpectLeast(cube, cube, At(4, 5, 0), 5);
  ExpectLeast(cube, cube, At(1, 0, 0), 0);
  ExpectLeast(cube, cube, At(0.75, 0, 0), -0.25);
  ExpectLeast(cube, cube, At(0, 0, 0), -1);
}

// sqrt(2) is between two doubles.
TEST(Clearance, IrrationalSeparationsLieBetweenDoubles) {
  const Hull cube = BuildHull(LatticeCube(2, 1));
  double above = std::sqrt(2.0);
  if (std::fma(above, above, -2.0) < 0) above = std::nextafter(above, 2);
  ExpectLeast(cube, cube, At(2, 2, 0), above);
  const Hull tetrahedron =
      BuildHull(std::vector<Vector>{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}});
  const Hull origin = BuildHull(std::vector<Vector>{{0, 0, 0}});
  // The depth is 1 / sqrt(3): a clearance c is met iff 3 c^2 <= 1.
  const double third = 1 / std::sqrt(3.0);
  double below = third;
  while (3 * static_cast<long double>(below) * below > 1) below = std::nextafter(below, 0);
  while (3 * static_cast<long double>(std::nextafter(below, 1)) * std::nextafter(below, 1) < 1) {
    below = std::nextafter(below, 1);
  }
  ExpectLeast(tetrahedron, origin, At(0, 0, 0), -below);
}

TEST(Clearance, ExtremeScalesAreDecidedToo) {
  const double least = std::numeric_limits<double>::denorm_min();
  const Hull point = BuildHull(std::vector<Vector>{{0, 0, 0}});
  ExpectLeast(point, point, At(least, 0, 0), least);
  ExpectLeast(point, point, At(3 * 0x1p-1000, 0, 4 * 0x1p-1000), 5 * 0x1p-1000);
  ExpectLeast(point, point, At(0x1.8p1023, 0, 0), 0x1.8p1023);
}

}  // namespace clearance_test
}  // namespace hulld
