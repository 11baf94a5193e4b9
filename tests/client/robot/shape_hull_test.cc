#include "client/robot/shape_hull.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace shape_hull_test {

using testing::ElementsAre;
using testing::HasSubstr;

CollisionShape Round(ShapeKind kind, double radius, double length) {
  CollisionShape shape;
  shape.kind = kind;
  shape.radius = radius;
  shape.length = length;
  return shape;
}

// Returns the support of the points along a direction.
double Support(const ShapeHull& hull, double x, double y, double z) {
  double most = -HUGE_VAL;
  for (size_t i = 0; i < hull.xyz.size(); i += 3) {
    most = std::max(most, x * hull.xyz[i] + y * hull.xyz[i + 1] + z * hull.xyz[i + 2]);
  }
  return most;
}

// A convex set contains another if its support is at least as large in each direction.
TEST(ShapeHull, ACylinderIsEnclosedWithinItsExcess) {
  for (const double radius : {1.0, 1e-3, 0.3}) {
    const CollisionShape cylinder = Round(ShapeKind::kCylinder, radius, 0.7);
    const ShapeHull hull = PrimitiveHull(cylinder);
    EXPECT_EQ(hull.radius, 0);
    double most = 0;
    for (int i = 0; i < 20000; ++i) {
      const double z = 2 * (i + 0.5) / 20000 - 1;
      const double angle = 2.399963229728653 * i;
      const double r = std::sqrt(1 - z * z);
      const double reach = radius * r + std::abs(z) * cylinder.length / 2;
      const double support = Support(hull, r * std::cos(angle), r * std::sin(angle), z);
      // The directions themselves are rounded, and so is their product with the points.
      ASSERT_GE(support, reach * (1 - 0x1p-50)) << i;
      most = std::max(most, support - reach);
    }
    EXPECT_LE(most, hull.excess * (1 + 0x1p-40) + cylinder.length * 0x1p-40);
    EXPECT_GT(most, hull.excess / 2);
  }
  EXPECT_LT(PrimitiveHull(Round(ShapeKind::kCylinder, 1, 1)).excess, 0.005);
}

TEST(ShapeHull, SpheresAndCapsulesAreExact) {
  const ShapeHull sphere = PrimitiveHull(Round(ShapeKind::kSphere, 0.3, 0));
  EXPECT_THAT(sphere.xyz, ElementsAre(0, 0, 0));
  EXPECT_EQ(sphere.radius, 0.3);
  EXPECT_EQ(sphere.excess, 0);
  const ShapeHull capsule = PrimitiveHull(Round(ShapeKind::kCapsule, 0.1, 0.7));
  EXPECT_THAT(capsule.xyz, ElementsAre(0, 0, -0.35, 0, 0, 0.35));
  EXPECT_EQ(capsule.radius, 0.1);
  EXPECT_EQ(capsule.excess, 0);
}

TEST(ShapeHull, BoxIsExact) {
  CollisionShape box;
  box.kind = ShapeKind::kBox;
  box.size = {0.1, 2, 3};
  const ShapeHull hull = PrimitiveHull(box);
  EXPECT_EQ(hull.excess, 0);
  EXPECT_EQ(hull.xyz.size(), 24u);
  EXPECT_EQ(Support(hull, 1, 0, 0), 0.05);
  EXPECT_EQ(Support(hull, 0, 0, -1), 1.5);
}

TEST(ShapeHull, MeshIsScaled) {
  const TempFile file("a.obj", "v 1 2 3\nv 4 5 6\n");
  CollisionShape mesh;
  const auto scale = [](const char* text) { return *LengthScale::FromText(text); };
  mesh.scale = {scale("1"), scale("-2"), scale("0.5")};
  const auto hull = MeshHull(mesh, file.path());
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_THAT(hull->xyz, ElementsAre(1, -4, 1.5, 4, -10, 3));
  // Millimeters are divided by 1000, not multiplied by the double 0.001.
  mesh.scale = {scale("0.001"), scale("0.0254"), scale("0.001")};
  const TempFile fine("c.obj", "v 7 3 0.1\n");
  EXPECT_THAT(MeshHull(mesh, fine.path())->xyz, ElementsAre(0.007, 0.0762, 0.0001));
  mesh.scale = {scale("1e308"), scale("1"), scale("1")};
  EXPECT_THAT(MeshHull(mesh, file.path()).status().ToString(), HasSubstr("exceeds the largest"));
  const TempFile empty("b.obj", "# nothing\n");
  EXPECT_THAT(MeshHull(mesh, empty.path()).status().ToString(), HasSubstr("contains no vertices"));
  const TempFile cloud("b.xyz", "# nothing\n");
  EXPECT_THAT(MeshHull(mesh, cloud.path()).status().ToString(), HasSubstr("contains no points"));
  EXPECT_THAT(MeshHull(mesh, "a.3mf").status().ToString(), HasSubstr("convert it"));
}

}  // namespace shape_hull_test
}  // namespace hulld
