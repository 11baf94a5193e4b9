#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/hull/audit.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/oracle/cgal_hull.h"

namespace hulld {
namespace large_hull_test {

// Large inputs against CGAL's exact hull. Skipped without CGAL.
class LargeHull : public testing::Test {
 protected:
  void SetUp() override {
    if (!oracle::CgalIsAvailable()) GTEST_SKIP() << "skipped: built without CGAL";
  }

  static void ExpectSameVertices(const std::vector<Vector>& points, const char* name) {
    const Hull hull = BuildHull(points);
    const std::vector<oracle::Point> expected = oracle::CgalExtremePoints(ToOracle(points));
    EXPECT_EQ(hull.vertices().size(), expected.size()) << name;
    EXPECT_TRUE(ToOracle(hull.vertices()) == expected) << name;
    if (hull.vertices().size() > 5000) return;
    const absl::Status audit = AuditHull(hull);
    EXPECT_TRUE(audit.ok()) << name << ": " << audit;
  }
};

std::vector<Vector> TurnedByOneRadian(std::vector<Vector> points) {
  const double c = std::cos(1.0);
  const double s = std::sin(1.0);
  for (Vector& p : points) {
    p = Vector(c * p.x() - s * p.y(), s * p.x() + c * p.y(), p.z());
    p = Vector(p.x(), c * p.y() - s * p.z(), s * p.y() + c * p.z());
  }
  return points;
}

TEST_F(LargeHull, RotatedLatticeMatchesCgal) {
  ExpectSameVertices(TurnedByOneRadian(LatticeCube(50, 0.1)), "lattice");
}

TEST_F(LargeHull, RotatedCubeSurfaceMatchesCgal) {
  std::vector<Vector> surface = TurnedByOneRadian(LatticeCubeSurface(40));
  ExpectSameVertices(surface, "surface");
  Random random(301);
  Shuffle(random, surface);
  ExpectSameVertices(surface, "shuffled surface");
}

TEST_F(LargeHull, RandomSetsMatchCgal) {
  Random random(302);
  ExpectSameVertices(RandomInBall(random, 100000, 1), "ball");
  ExpectSameVertices(RandomOnSphere(random, 4000, 1), "sphere");
  ExpectSameVertices(RandomInCube(random, 100000, 1), "cube");
  ExpectSameVertices(RandomLatticePoints(random, 20000, 30), "lattice");
}

TEST_F(LargeHull, NearlyFlatSetsMatchCgal) {
  Random random(303);
  std::vector<Vector> pancake = RandomInBall(random, 20000, 1);
  for (Vector& p : pancake) p.z() *= 1e-14;
  ExpectSameVertices(pancake, "pancake");
  ExpectSameVertices(TurnedByOneRadian(pancake), "rotated pancake");
  std::vector<Vector> needle = RandomInBall(random, 20000, 1);
  for (Vector& p : needle) p = Vector(p.x(), p.y() * 1e-8, p.z() * 1e-8);
  ExpectSameVertices(TurnedByOneRadian(needle), "rotated needle");
  std::vector<Vector> faces;
  for (int i = 0; i < 20000; ++i) {
    Vector p(random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1));
    p[i % 3] = (i % 2 ? 1 : -1) * (1 + random.Between(-4, 4) * 0x1p-52);
    faces.push_back(p);
  }
  ExpectSameVertices(faces, "cube faces with jitter");
  ExpectSameVertices(Shifted(RandomInBall(random, 20000, 1e-9), Vector::Constant(1e6)),
                     "a few ulps of room");
}

// Points just outside and just inside facets that many other points hide.
TEST_F(LargeHull, ShellsOneLastPlaceApartMatchCgal) {
  const uint64_t seed = TestSeed(304);
  Random random(seed);
  for (double tilt : {0.0, 1.0}) {
    std::vector<Vector> box = RandomInCube(random, 3000, 1);
    for (const Vector& p : RandomInCube(random, 3000, 1)) {
      Vector on_face = p;
      int k = 0;
      p.cwiseAbs().maxCoeff(&k);
      on_face[k] = std::copysign(1 + random.Between(-2, 2) * 0x1p-52, p[k]);
      box.push_back(on_face);
    }
    box = Concatenated(box, Shifted(LatticeCube(2, 2), Vector::Constant(-1)));
    for (Vector& p : box) p = Vector(p.x(), p.y() + tilt * 0.3 * p.x(), p.z() - tilt * 0.7 * p.y());
    ExpectSameVertices(box, "box");
    ExpectSameVertices(Shifted(box, Vector(1e4, -3, 0.1)), "box far off");
    Shuffle(random, box);
    ExpectSameVertices(box, "shuffled box");
  }
}

TEST_F(LargeHull, MeshesMatchCgal) {
  for (const char* name : {"stanford-bunny.obj", "rocker-arm.obj", "spot.obj"}) {
    const std::optional<std::vector<Vector>> mesh = MeshVertices(name);
    if (!mesh) GTEST_SKIP() << "skipped: no data";
    ExpectSameVertices(*mesh, name);
    ExpectSameVertices(Shifted(*mesh, Vector::Constant(1e6)), name);
    ExpectSameVertices(Scaled(*mesh, 1e-12), name);
    ExpectSameVertices(Scaled(*mesh, 1e12), name);
  }
}

}  // namespace large_hull_test
}  // namespace hulld
