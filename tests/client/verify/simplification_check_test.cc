#include "client/verify/simplification_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/hull/simplification/simplify.h"
#include "tests/client/enclosure/box_mesh.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/oracle/brute_force_hausdorff.h"
#include "tests/test_size.h"

namespace hulld {
namespace simplification_check_test {

using ::testing::HasSubstr;

constexpr auto kInside = v1::SIMPLIFICATION_SIDE_INSIDE;
constexpr auto kOutside = v1::SIMPLIFICATION_SIDE_OUTSIDE;
constexpr double kLeast = std::numeric_limits<double>::denorm_min();

constexpr int kManyPoints = TestSize(20'000, 1000);
constexpr int kRounds = TestSize(60, 10);

v1::Simplification Requested(v1::SimplificationSide side, uint64_t max_vertices,
                             double max_error = 0) {
  v1::Simplification requested;
  requested.set_side(side);
  requested.set_max_vertices(max_vertices);
  requested.set_max_error(max_error);
  return requested;
}

// Returns the mesh as the server would send it.
HullMesh MeshOf(const Hull& hull) {
  HullMesh mesh;
  for (const Vector& v : hull.vertices()) mesh.xyz.insert(mesh.xyz.end(), v.begin(), v.end());
  for (size_t i = 0; i < hull.facet_count(); ++i) {
    const auto facet = hull.facet(i);
    mesh.facet_sizes.push_back(static_cast<uint32_t>(facet.size()));
    mesh.facet_indices.insert(mesh.facet_indices.end(), facet.begin(), facet.end());
  }
  return mesh;
}

HullMesh Claiming(double error, HullMesh mesh) {
  mesh.header.set_error(error);
  return mesh;
}

void ExpectValid(const v1::Simplification& requested, const HullMesh& hull,
                 const HullMesh& simplified) {
  const absl::Status status = CheckSimplification(requested, hull, simplified);
  EXPECT_TRUE(status.ok()) << status;
}

void ExpectInvalid(const v1::Simplification& requested, const HullMesh& hull,
                   const HullMesh& simplified, const std::string& why) {
  const absl::Status status = CheckSimplification(requested, hull, simplified);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr(why));
}

// Four corners of the cube of side 2; the other corners are 2 / sqrt(3) away.
HullMesh TetrahedronInCube() {
  HullMesh mesh;
  mesh.xyz = {0, 0, 0, 2, 2, 0, 2, 0, 2, 0, 2, 2};
  mesh.facet_sizes = {3, 3, 3, 3};
  mesh.facet_indices = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  return mesh;
}

TEST(SimplificationCheck, DecidesADistanceToTheLastBit) {
  const HullMesh cube = BoxHull({0, 0, 0}, {2, 2, 2});
  const double distance = 2 / std::sqrt(3.0);
  const v1::Simplification inside = Requested(kInside, 4);
  ExpectValid(inside, cube, Claiming(std::nextafter(distance, 2), TetrahedronInCube()));
  ExpectInvalid(inside, cube, Claiming(std::nextafter(distance, 1), TetrahedronInCube()),
                "of the hull is farther than 1.15470053837925");
  // Corners of the larger box are sqrt(3) away from those of the cube.
  const v1::Simplification outside = Requested(kOutside, 8);
  const HullMesh box = BoxHull({-1, -1, -1}, {3, 3, 3});
  ExpectValid(outside, cube, Claiming(std::nextafter(std::sqrt(3.0), 2), box));
  ExpectInvalid(outside, cube, Claiming(std::nextafter(std::sqrt(3.0), 1), box),
                "of the simplification is farther than 1.73205080756887");
}

TEST(SimplificationCheck, DistinguishesInsideFromOutsideToTheLastBit) {
  const v1::Simplification outside = Requested(kOutside, 8);
  const HullMesh box = Claiming(2, BoxHull({0, 0, 0}, {2, 2, 2}));
  ExpectValid(outside, BoxHull({0, 0, kLeast}, {2, 1.5, 2}), box);
  ExpectInvalid(outside, BoxHull({0, 0, -kLeast}, {2, 1.5, 2}), box,
                "vertex 0 of the hull is not in the simplification");
  ExpectInvalid(outside, BoxHull({0, 0, 0}, {2, 1.5, std::nextafter(2.0, 3.0)}), box,
                "is not in the simplification");
  HullMesh moved = TetrahedronInCube();
  moved.xyz[3] = std::nextafter(2.0, 0.0);
  ExpectInvalid(Requested(kInside, 4), BoxHull({0, 0, 0}, {2, 2, 2}), Claiming(2, moved),
                "vertex 1 of the simplification is not a vertex of the hull");
}

TEST(SimplificationCheck, ChecksTheRequestedLimits) {
  const HullMesh cube = BoxHull({0, 0, 0}, {2, 2, 2});
  const HullMesh simple = Claiming(1.5, TetrahedronInCube());
  ExpectInvalid(Requested(kInside, 3), cube, simple, "has 4 vertices; at most 3 were requested");
  ExpectInvalid(Requested(kInside, 0, 1.25), cube, simple,
                "the error is 1.5; at most 1.25 was requested");
  ExpectValid(Requested(kInside, 0, 1.5), cube, simple);
  // With both limits, the nearest that the server finds is accepted.
  ExpectValid(Requested(kInside, 4, 1.25), cube, simple);
  ExpectInvalid(Requested(kInside, 4), cube, TetrahedronInCube(), "contains no error");
  ExpectInvalid(Requested(kInside, 4), cube, Claiming(NAN, TetrahedronInCube()),
                "is not a distance");
  ExpectInvalid(Requested(kInside, 4), cube, Claiming(-1, TetrahedronInCube()),
                "is not a distance");
}

TEST(SimplificationCheck, SurvivesNonsensicalMeshes) {
  const HullMesh cube = BoxHull({0, 0, 0}, {2, 2, 2});
  const v1::Simplification inside = Requested(kInside, 8);
  ExpectValid(inside, {}, Claiming(0, {}));
  ExpectInvalid(inside, cube, Claiming(9, {}), "empty");
  ExpectInvalid(inside, {}, Claiming(9, cube), "empty");
  HullMesh beyond = Claiming(9, TetrahedronInCube());
  beyond.facet_indices[5] = 4;
  ExpectInvalid(inside, cube, beyond, "a facet has a vertex 4, of 4");
  HullMesh cut = Claiming(9, TetrahedronInCube());
  cut.facet_indices.pop_back();
  ExpectInvalid(inside, cube, cut, "a facet ends beyond");
  HullMesh infinite = Claiming(9, TetrahedronInCube());
  infinite.xyz[2] = INFINITY;
  ExpectInvalid(inside, cube, infinite, "not finite");
  // Without its facets it cannot be proven, and must be rejected.
  HullMesh bare = Claiming(0.5, TetrahedronInCube());
  bare.facet_sizes.clear();
  bare.facet_indices.clear();
  EXPECT_FALSE(CheckSimplification(inside, cube, bare).ok());
}

// The server's own simplifications of clouds of every size, position, and dimension.
TEST(SimplificationCheck, AgreesWithTheServer) {
  Random random(TestSeed(91));
  std::vector<std::vector<Vector>> clouds = {
      RandomOnSphere(random, 200, 1),
      RandomInBall(random, 400, 1e-3),
      Shifted(RandomInCube(random, 100, 1), Vector(1e9, -3e8, 0.1)),
      Scaled(RandomOnSphere(random, 60, 1), 0x1p-1060),
      Scaled(RandomOnSphere(random, 60, 1), 0x1p1022),
      RandomFlatPoints(random, 40, 2),
      RandomFlatPoints(random, 40, 1),
      RandomFlatPoints(random, 1, 0),
      IntegerParaboloid(6),
      LatticeCube(4, 0.1)};
  std::vector<Vector> thin = RandomOnSphere(random, 100, 1);
  for (Vector& p : thin) p = p.cwiseProduct(Vector(1e6, 1, 1e-6));
  clouds.push_back(thin);
  for (const std::vector<Vector>& cloud : clouds) {
    const Hull hull = BuildHull(cloud);
    const HullMesh mesh = MeshOf(hull);
    const double size = hull.max_abs_coordinate();
    for (const auto& [most, error] : std::vector<std::pair<size_t, double>>{
             {8, 0}, {30, 0}, {0, 0.3 * size}, {0, 1e-3 * size}, {20, 0.1 * size}}) {
      const auto inside = SimplifyInside(hull, {most, error, {}});
      ASSERT_TRUE(inside.ok()) << inside.status();
      ExpectValid(Requested(kInside, most, error), mesh,
                  Claiming(inside->error, MeshOf(inside->hull)));
      const auto outside = SimplifyOutside(hull, {most, error, {}});
      ASSERT_TRUE(outside.ok()) << outside.status();
      ExpectValid(Requested(kOutside, most, error), mesh,
                  Claiming(outside->error, MeshOf(outside->hull)));
    }
  }
}

// True and nearly true claims, against brute force.
TEST(SimplificationCheck, AgreesWithTheOracle) {
  Random random(TestSeed(92));
  int valid = 0;
  int invalid = 0;
  for (int round = 0; round < kRounds; ++round) {
    const Hull hull = BuildHull(round % 3 == 0   ? RandomLatticePoints(random, 12, 4)
                                : round % 3 == 1 ? RandomOnSphere(random, 11, 1)
                                                 : RandomFlatPoints(random, 12, 2));
    const bool is_inside = round % 2 == 0;
    const SimplifyTarget target = {size_t{is_inside ? 5u : 8u}, 0, {}};
    const auto simple = is_inside ? SimplifyInside(hull, target) : SimplifyOutside(hull, target);
    ASSERT_TRUE(simple.ok()) << simple.status();
    // The simplification itself, and a copy with a slightly moved vertex.
    std::vector<Vector> pulled(simple->hull.vertices().begin(), simple->hull.vertices().end());
    pulled[0] *= 1 + 0x1p-40 * random.Between(-1, 1);
    const double error = simple->error;
    for (const Hull& claimed : {simple->hull, BuildHull(pulled)}) {
      for (const double bound :
           {error, std::nextafter(error, 0), error * (1 - 0x1p-30), error * 0.9, 2 * error}) {
        const auto of_hull = ToOracle(hull.vertices());
        const auto of_claimed = ToOracle(claimed.vertices());
        bool truth = is_inside ? oracle::IsNestedWithin(of_claimed, of_hull, bound)
                               : oracle::IsNestedWithin(of_hull, of_claimed, bound);
        for (const auto& v : of_claimed) {
          truth = truth && (!is_inside || testing::Value(of_hull, testing::Contains(v)));
        }
        const absl::Status status =
            CheckSimplification(Requested(is_inside ? kInside : kOutside, 100), MeshOf(hull),
                                Claiming(bound, MeshOf(claimed)));
        EXPECT_EQ(status.ok(), truth) << status << " round " << round << " bound " << bound;
        ++(truth ? valid : invalid);
      }
    }
  }
  EXPECT_GT(valid, 2 * kRounds);
  EXPECT_GT(invalid, 2 * kRounds);
}

TEST(SimplificationCheck, HandlesManyVertices) {
  Random random(93);
  const Hull hull = BuildHull(RandomOnSphere(random, kManyPoints, 1));
  const HullMesh mesh = MeshOf(hull);
  const auto inside = SimplifyInside(hull, {kManyPoints / 20, 0, {}});
  const auto outside = SimplifyOutside(hull, {kManyPoints / 20, 0, {}});
  ASSERT_TRUE(inside.ok() && outside.ok());
  const v1::Simplification requested_inside = Requested(kInside, kManyPoints / 20);
  const v1::Simplification requested_outside = Requested(kOutside, kManyPoints / 20);
  HullMesh within = Claiming(inside->error, MeshOf(inside->hull));
  HullMesh around = Claiming(outside->error, MeshOf(outside->hull));
  ExpectValid(requested_inside, mesh, within);
  ExpectValid(requested_outside, mesh, around);
  within.header.set_error(inside->error * (1 - 1e-6));
  around.header.set_error(outside->error * (1 - 1e-6));
  ExpectInvalid(requested_inside, mesh, within, "of the hull is farther than");
  ExpectInvalid(requested_outside, mesh, around, "of the simplification is farther than");
  around = Claiming(outside->error, MeshOf(outside->hull));
  for (size_t axis = 0; axis < 3; ++axis) around.xyz[30 + axis] *= 0.9;
  ExpectInvalid(requested_outside, mesh, around, "is not in the simplification");
}

}  // namespace simplification_check_test
}  // namespace hulld
