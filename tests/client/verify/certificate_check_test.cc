#include "client/verify/certificate_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "client/verify/exact_vector.h"
#include "tests/oracle/brute_force_relation.h"
#include "tests/test_size.h"

namespace hulld {
namespace certificate_check_test {

using ::testing::HasSubstr;

constexpr v1::Relation kSeparated = v1::RELATION_SEPARATED;
constexpr v1::Relation kTouching = v1::RELATION_TOUCHING;
constexpr v1::Relation kOverlapping = v1::RELATION_OVERLAPPING;
constexpr double kMin = std::numeric_limits<double>::denorm_min();

struct Hull {
  std::vector<double> xyz;
  v1::Pose pose;
  double radius = 0;
};

Hull At(std::vector<double> xyz, double x = 0, double y = 0, double z = 0) {
  Hull hull{std::move(xyz), {}};
  hull.pose.mutable_translation()->set_x(x);
  hull.pose.mutable_translation()->set_y(y);
  hull.pose.mutable_translation()->set_z(z);
  return hull;
}

Hull Turned(Hull hull, double w, double x, double y, double z) {
  v1::Quaternion* const q = hull.pose.mutable_rotation();
  q->set_w(w);
  q->set_x(x);
  q->set_y(y);
  q->set_z(z);
  return hull;
}

// Vertex 4 x + 2 y + z is (x, y, z).
std::vector<double> Cube() {
  std::vector<double> xyz;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 2; axis >= 0; --axis) xyz.push_back((corner >> axis) & 1);
  }
  return xyz;
}

std::vector<double> Tetrahedron() { return {0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0, 4}; }

using Pairs = std::vector<std::pair<uint32_t, uint32_t>>;

v1::Certificate PairsOnly(const Pairs& pairs) {
  v1::Certificate certificate;
  for (const auto& [a, b] : pairs) {
    certificate.add_pairs()->set_index_a(a);
    certificate.mutable_pairs(certificate.pairs_size() - 1)->set_index_b(b);
  }
  return certificate;
}

v1::Certificate Direction(double x, double y, double z, const Pairs& pairs = {}) {
  v1::Certificate certificate = PairsOnly(pairs);
  certificate.mutable_direction()->set_x(x);
  certificate.mutable_direction()->set_y(y);
  certificate.mutable_direction()->set_z(z);
  return certificate;
}

v1::Certificate Integers(const std::string& x, const std::string& y, const std::string& z,
                         const Pairs& pairs = {}) {
  v1::Certificate certificate = PairsOnly(pairs);
  certificate.mutable_integer_direction()->set_x(x);
  certificate.mutable_integer_direction()->set_y(y);
  certificate.mutable_integer_direction()->set_z(z);
  return certificate;
}

absl::Status Check(v1::Relation relation, const v1::Certificate& certificate, const Hull& a,
                   const Hull& b) {
  return CheckCertificate(relation, certificate, {a.xyz, a.pose, nullptr, false, {a.radius}},
                          {b.xyz, b.pose, nullptr, false, {b.radius}});
}

void ExpectInvalid(v1::Relation relation, const v1::Certificate& certificate, const Hull& a,
                   const Hull& b, const std::string& why) {
  const absl::Status status = Check(relation, certificate, a, b);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr(why));
}

void ExpectValid(v1::Relation relation, const v1::Certificate& certificate, const Hull& a,
                 const Hull& b) {
  const absl::Status status = Check(relation, certificate, a, b);
  EXPECT_TRUE(status.ok()) << status.ToString();
}

#ifdef __x86_64__
// Sets the processor to the mode that linking with -ffast-math gives to the whole program.
TEST(CommonExponent, IncludesSubnormalNumbersIfTheProcessorFlushesThem) {
  constexpr uint32_t kFlush = 0x8040;
  const double numbers[] = {kMin, -3 * kMin, 0x1p-1030, 1};
  const uint32_t before = __builtin_ia32_stmxcsr();
  __builtin_ia32_ldmxcsr(before | kFlush);
  CommonExponent exponent;
  exponent.Include(numbers);
  const BigInteger least = exponent.ToInteger(numbers[0]);
  const BigInteger negative = exponent.ToInteger(numbers[1]);
  __builtin_ia32_ldmxcsr(before);
  EXPECT_EQ(exponent.exponent(), -1074);
  EXPECT_EQ(least, 1);
  EXPECT_EQ(negative, -3);
  EXPECT_EQ(exponent.ToInteger(numbers[2]), BigInteger(1) << 44);
  EXPECT_EQ(exponent.ToInteger(numbers[3]), BigInteger(1) << 1074);
}
#endif

TEST(CertificateCheck, ADirectionSeparatesOrNotByOneUlp) {
  const Hull a = At(Cube());
  const Hull apart = At(Cube(), std::nextafter(1.0, 2.0));
  const Hull touching = At(Cube(), 1);
  ExpectValid(kSeparated, Direction(1, 0, 0), a, apart);
  ExpectValid(kSeparated, Direction(1e-300, 0, 0), a, apart);
  ExpectValid(kSeparated, Direction(kMin, 0, 0), a, apart);
  ExpectInvalid(kSeparated, Direction(1, 0, 0), a, touching, "does not separate");
  ExpectInvalid(kSeparated, Direction(-1, 0, 0), a, apart, "does not separate");
  ExpectInvalid(kSeparated, Direction(1, 1e-15, 0), a, apart, "does not separate");
  ExpectValid(kSeparated, Direction(-1, 0, 0), apart, a);
}

TEST(CertificateCheck, DirectionsMustBeFiniteAndNonzero) {
  const Hull a = At(Cube());
  const Hull b = At(Cube(), 2);
  ExpectInvalid(kSeparated, v1::Certificate(), a, b, "no direction");
  ExpectInvalid(kSeparated, Direction(0, 0, 0), a, b, "direction is zero");
  ExpectInvalid(kSeparated, Direction(0, -0.0, 0), a, b, "direction is zero");
  ExpectInvalid(kSeparated, Direction(NAN, 0, 0), a, b, "not finite");
  ExpectInvalid(kSeparated, Direction(INFINITY, 0, 0), a, b, "not finite");
  ExpectInvalid(kTouching, Direction(0, 0, 0, {{0, 0}}), a, a, "direction is zero");
}

TEST(CertificateCheck, IntegersOfAnyLengthAreDirections) {
  const Hull a = At(Cube());
  const Hull b = At(Cube(), 2);
  const std::string long_one = "1" + std::string(400, '0');
  ExpectValid(kSeparated, Integers(long_one, "-1", "0"), a, b);
  ExpectValid(kSeparated, Integers("00009", "0", "-0"), a, b);
  ExpectInvalid(kSeparated, Integers("-" + long_one, "0", "0"), a, b, "does not separate");
  ExpectInvalid(kSeparated, Integers("0", "0", "000"), a, b, "direction is zero");
  for (const char* text : {"", "-", "+1", "1.0", "1e9", " 1", "0x10", "1\n"}) {
    ExpectInvalid(kSeparated, Integers(text, "0", "0"), a, b, "decimal integer");
  }
  ExpectInvalid(kSeparated, Integers(std::string(100'001, '1'), "0", "0"), a, b, "decimal integer");
}

// q = (2, 1, 0, 0) rotates (0, 0, 5) to (0, -4, 3) exactly, though |q|^2 = 5.
TEST(CertificateCheck, RotationsAreExact) {
  const Hull a = Turned(At({0, 0, 5}, 1, 2, 3), 2, 1, 0, 0);
  const v1::Certificate same = Direction(0.5, 7, -1, {{0, 0}});
  ExpectValid(kTouching, same, a, At({1, -2, 6}));
  ExpectValid(kTouching, same, Turned(a, 2e-300, 1e-300, 0, 0), At({1, -2, 6}));
  ExpectInvalid(kTouching, same, a, At({1, -2, std::nextafter(6.0, 0.0)}), "0 is not in the hull");
  ExpectInvalid(kTouching, same, a, At({1, -2, std::nextafter(6.0, 9.0)}), "max n.A > min n.B");
  const Hull twice = Turned(At({0, 0, 5}), 0, 0, 0, 0);
  ExpectInvalid(kTouching, same, twice, a, "rotation is zero");
  // A rotation that doubles cannot represent: a third of a full turn about the diagonal.
  const Hull turned = Turned(At({1, 2, 3}), 1, 1, 1, 1);
  ExpectValid(kTouching, same, turned, At({3, 1, 2}));
  ExpectInvalid(kTouching, same, turned, At({2, 3, 1}), "");
}

TEST(CertificateCheck, TouchingNeedsADirectionAndACommonPoint) {
  const Hull a = At(Cube());
  const Hull b = At(Cube(), 1);
  ExpectValid(kTouching, Direction(1, 0, 0, {{4, 0}}), a, b);
  ExpectValid(kTouching, Direction(1, 0, 0, {{7, 0}, {4, 3}}), a, b);
  ExpectInvalid(kTouching, Direction(1, 0, 0, {{7, 0}}), a, b, "0 is not in the hull");
  ExpectInvalid(kTouching, Direction(1, 0, 0), a, b, "0 is not in the hull");
  ExpectInvalid(kTouching, Direction(0, 1, 0, {{4, 0}}), a, b, "max n.A > min n.B");
  ExpectInvalid(kTouching, PairsOnly({{4, 0}}), a, b, "no direction");
  const Hull deeper = At(Cube(), std::nextafter(1.0, 0.0));
  ExpectInvalid(kTouching, Direction(1, 0, 0, {{4, 0}}), a, deeper, "max n.A > min n.B");
  const Hull apart = At(Cube(), std::nextafter(1.0, 2.0));
  ExpectInvalid(kTouching, Direction(1, 0, 0, {{4, 0}}), a, apart, "0 is not in the hull");
  ExpectInvalid(kTouching, Direction(1, 0, 0, {{4, 0}, {4, 0}, {4, 0}, {4, 0}, {4, 0}}), a, b,
                "5 vertex pairs");
}

TEST(CertificateCheck, TouchingInEveryDimension) {
  const Hull along_x = At({-1, 0, 0, 1, 0, 0});
  const Hull along_y = At({0, -1, 0, 0, 1, 0});
  ExpectValid(kTouching, Direction(0, 0, 1, {{0, 0}, {0, 1}, {1, 0}, {1, 1}}), along_x, along_y);
  ExpectValid(kTouching, Direction(0, 0, 1, {{0, 0}, {1, 1}}), along_x, along_y);
  ExpectValid(kTouching, Direction(0, 0, -1, {{0, 0}, {1, 1}}), along_x, along_y);
  ExpectInvalid(kTouching, Direction(0, 0, 1, {{0, 0}, {1, 0}}), along_x, along_y,
                "0 is not in the hull");
  // A point inside a triangle, on its edge, and outside it.
  const Hull triangle = At({-1, -1, 0, 3, -1, 0, -1, 3, 0});
  const v1::Certificate corners = Direction(0, 0, 1, {{0, 0}, {1, 0}, {2, 0}});
  ExpectValid(kTouching, corners, triangle, At({0, 0, 0}));
  ExpectValid(kTouching, corners, triangle, At({1, 1, 0}));
  ExpectInvalid(kTouching, corners, triangle, At({1, std::nextafter(1.0, 2.0), 0}), "0 is not");
  ExpectInvalid(kTouching, corners, triangle, At({0, 0, kMin}), "0 is not");
  ExpectInvalid(kTouching, corners, triangle, At({0, 0, -kMin}), "max n.A > min n.B");
  // Collinear segments that overlap or share an end.
  ExpectValid(kTouching, Direction(0, 1, 0, {{0, 1}, {1, 0}}), along_x, At(along_x.xyz, 1));
  ExpectValid(kTouching, Direction(1, 0, 0, {{1, 0}}), along_x, At(along_x.xyz, 2));
  ExpectValid(kTouching, Direction(1, 2, 3, {{0, 0}}), At({5, 5, 5}), At({5, 5, 5}));
}

TEST(CertificateCheck, OverlappingNeedsTheOriginInside) {
  const Hull a = At(Tetrahedron());
  const Pairs corners = {{0, 0}, {1, 0}, {2, 0}, {3, 0}};
  ExpectValid(kOverlapping, PairsOnly(corners), a, At({1, 1, 1}));
  ExpectValid(kOverlapping, PairsOnly(corners), a, At({1, 1, kMin}));
  ExpectInvalid(kOverlapping, PairsOnly(corners), a, At({1, 1, 0}), "0 is not inside");
  ExpectInvalid(kOverlapping, PairsOnly(corners), a, At({1, 1, -kMin}), "0 is not inside");
  ExpectInvalid(kOverlapping, PairsOnly({{0, 0}, {1, 0}, {2, 0}}), a, At({1, 1, 1}), "not inside");
  ExpectInvalid(kOverlapping, PairsOnly({{0, 0}, {1, 0}, {2, 0}, {2, 0}}), a, At({1, 1, 1}),
                "not inside");
  ExpectInvalid(kOverlapping, v1::Certificate(), a, At({1, 1, 1}), "not inside");
}

TEST(CertificateCheck, SixPairsMayBeNeededAndSevenAreRefused) {
  const Hull octahedron = At({1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1});
  const Hull origin = At({0, 0, 0});
  Pairs pairs = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}};
  ExpectValid(kOverlapping, PairsOnly(pairs), octahedron, origin);
  pairs.emplace_back(0, 0);
  ExpectInvalid(kOverlapping, PairsOnly(pairs), octahedron, origin, "7 vertex pairs");
  pairs.resize(5);
  ExpectInvalid(kOverlapping, PairsOnly(pairs), octahedron, origin, "not inside");
}

TEST(CertificateCheck, ANeedleThroughAPolygonOverlaps) {
  const Hull needle = At({0, 0, -1, 0, 0, 1});
  const Hull square = At({-1, -1, 0, -1, 1, 0, 1, -1, 0, 1, 1, 0});
  const v1::Certificate through = PairsOnly({{0, 0}, {0, 3}, {1, 1}, {1, 2}});
  ExpectValid(kOverlapping, through, needle, square);
  ExpectInvalid(kOverlapping, through, At(needle.xyz, 0, 0, 1), square, "not inside");
  ExpectInvalid(kOverlapping, PairsOnly({{0, 0}, {0, 3}, {1, 0}, {1, 3}}), needle, square,
                "not inside");
}

TEST(CertificateCheck, PairsMustBeVerticesOfTheHulls) {
  const Hull a = At(Cube());
  const Hull b = At(Cube(), 1);
  ExpectInvalid(kTouching, Direction(1, 0, 0, {{8, 0}}), a, b, "pairs[0].a is vertex 8");
  ExpectInvalid(kTouching, Direction(1, 0, 0, {{4, 0}, {0, 4'000'000'000}}), a, b, "pairs[1].b");
  ExpectInvalid(kOverlapping, PairsOnly({{0, 9}}), a, a, "pairs[0].b is vertex 9");
  v1::Certificate named = Direction(1, 0, 0, {{4, 0}});
  named.mutable_pairs(0)->mutable_vertex_a()->set_x(1);
  named.mutable_pairs(0)->mutable_vertex_b();
  ExpectValid(kTouching, named, a, b);
  named.mutable_pairs(0)->mutable_vertex_a()->set_y(kMin);
  ExpectInvalid(kTouching, named, a, b, "pairs[0].a does not have the coordinates");
}

TEST(CertificateCheck, PointsInAnyOrderAreFoundByTheirCoordinates) {
  const Hull a = At({0.5, 0.5, 0.5, 1, 1, 1, 0, 0, 0, 0, 0, 0});
  const Hull b = At({0, 0, 0}, 1, 1, 1);
  v1::Certificate certificate = Direction(1, 0, 0, {{7, 0}});
  v1::VertexPair& pair = *certificate.mutable_pairs(0);
  pair.mutable_vertex_a()->set_x(1);
  pair.mutable_vertex_a()->set_y(1);
  pair.mutable_vertex_a()->set_z(1);
  pair.mutable_vertex_b()->set_x(-0.0);
  const auto check = [&](bool in_any_order) {
    return CheckCertificate(kTouching, certificate, {a.xyz, a.pose, nullptr, in_any_order},
                            {b.xyz, b.pose, nullptr, true});
  };
  EXPECT_TRUE(check(true).ok()) << check(true);
  EXPECT_THAT(std::string(check(false).message()), HasSubstr("pairs[0].a is vertex 7"));
  pair.mutable_vertex_a()->set_x(2);
  EXPECT_THAT(std::string(check(true).message()),
              HasSubstr("pairs[0].a is not one of the points of its inline shape"));
}

TEST(CertificateCheck, EmptyHullsAreSeparatedWithoutProof) {
  ExpectValid(kSeparated, v1::Certificate(), At({}), At(Cube()));
  ExpectValid(kSeparated, v1::Certificate(), At(Cube()), At({}));
  ExpectInvalid(kTouching, Direction(1, 0, 0), At({}), At(Cube()), "empty");
  ExpectInvalid(kOverlapping, v1::Certificate(), At({}), At({}), "empty");
}

TEST(CertificateCheck, OtherRelationsHaveNoCertificate) {
  for (const v1::Relation relation : {v1::RELATION_UNSPECIFIED, v1::RELATION_WITHIN_TOLERANCE}) {
    ExpectInvalid(relation, Direction(1, 0, 0), At(Cube()), At(Cube(), 9), "has no certificate");
  }
}

TEST(CertificateCheck, TheWholeRangeOfDoublesIsExact) {
  const double huge = std::numeric_limits<double>::max();
  ExpectValid(kSeparated, Direction(1, 0, 0), At({-huge, 0, 0, kMin, 0, 0}),
              At({huge, 0, 0, 2 * kMin, 0, 0}));
  ExpectInvalid(kSeparated, Direction(1, 0, 0), At({-huge, 0, 0, kMin, 0, 0}),
                At({huge, 0, 0, kMin, 0, 0}), "does not separate");
  ExpectValid(kTouching, Direction(huge, 0, 0, {{0, 0}}), At({huge, 0, 0}, huge),
              At({huge, 0, 0}, huge));
}

// Random certificates: every accepted one must be true, by a separate oracle.
TEST(CertificateCheck, RejectsFalseCertificates) {
  constexpr uint32_t kSeed = 20;
  std::mt19937 random(kSeed);
  std::uniform_int_distribution<int> lattice(-1, 1);
  std::uniform_int_distribution<int> size(1, 7);
  int accepted[4] = {};
  constexpr int kScenes = TestSize(4'000, 500);
  for (int scene = 0; scene < kScenes; ++scene) {
    Hull hulls[2];
    std::vector<oracle::Point> points[2];
    oracle::Placement placements[2];
    for (int k = 0; k < 2; ++k) {
      std::vector<double> xyz(3 * static_cast<size_t>(size(random)));
      for (double& x : xyz) x = lattice(random);
      for (size_t i = 0; i < xyz.size(); i += 3) {
        points[k].push_back({xyz[i], xyz[i + 1], xyz[i + 2]});
      }
      const double x = lattice(random), y = lattice(random), z = lattice(random);
      const double w = 1 + std::abs(lattice(random)), turn = lattice(random);
      hulls[k] = Turned(At(xyz, x, y, z), w, turn, 0, 0);
      placements[k] = {{w, turn, 0, 0}, {x, y, z}};
    }
    const auto truth = static_cast<int>(
        oracle::BruteForceRelation(points[0], placements[0], points[1], placements[1]));
    for (int attempt = 0; attempt < 20; ++attempt) {
      Pairs pairs(static_cast<size_t>(size(random)) % 7);
      for (auto& [a, b] : pairs) {
        a = static_cast<uint32_t>(random() % points[0].size());
        b = static_cast<uint32_t>(random() % points[1].size());
      }
      const v1::Certificate certificate =
          Direction(lattice(random), lattice(random), lattice(random), pairs);
      for (const v1::Relation relation : {kSeparated, kTouching, kOverlapping}) {
        if (!Check(relation, certificate, hulls[0], hulls[1]).ok()) continue;
        ++accepted[relation];
        ASSERT_EQ(relation - 1, truth)
            << "seed " << kSeed << ", scene " << scene << ": " << certificate.ShortDebugString();
      }
    }
  }
  EXPECT_GT(accepted[kSeparated], kScenes / 10);
  EXPECT_GT(accepted[kTouching], kScenes / 100);
  EXPECT_GT(accepted[kOverlapping], kScenes / 200);
}

Hull Ball(double radius, double x = 0, double y = 0, double z = 0) {
  Hull hull = At({0, 0, 0}, x, y, z);
  hull.radius = radius;
  return hull;
}

TEST(CertificateCheck, RadiiCloseTheGapToTheLastBit) {
  const Pairs centers = {{0, 0}};
  const Hull a = Ball(2);
  const Hull less = Ball(std::nextafter(3.0, 0), 3, 4);
  const Hull equal = Ball(3, 3, 4);
  const Hull more = Ball(std::nextafter(3.0, 4), 3, 4);
  const std::string lacks = "too small for their radii";
  const std::string far = "too far from 0 for the radii";
  ExpectValid(kSeparated, Direction(3, 4, 0), a, less);
  ExpectInvalid(kSeparated, Direction(3, 4, 1e-7), a, less, lacks);
  ExpectInvalid(kSeparated, Direction(-3, -4, 0), a, less, lacks);
  ExpectInvalid(kTouching, Direction(3, 4, 0, centers), a, less, far);
  ExpectInvalid(kSeparated, Direction(3, 4, 0), a, equal, lacks);
  ExpectValid(kTouching, Direction(0.75, 1, 0, centers), a, equal);
  ExpectValid(kTouching, Integers("3", "4", "0", centers), Turned(a, 2, 1, 0, 1), equal);
  ExpectInvalid(kTouching, Direction(3, 4, 0), a, equal, far);
  ExpectInvalid(kTouching, Direction(3, 5, 0, centers), a, equal, lacks);
  ExpectInvalid(kOverlapping, PairsOnly(centers), a, equal, far);
  ExpectInvalid(kTouching, Direction(3, 4, 0, centers), a, more, lacks);
  ExpectValid(kOverlapping, PairsOnly(centers), a, more);
}

TEST(CertificateCheck, PairsComeNearWithinEdgesTrianglesAndInsides) {
  Hull cube = At(Cube());
  cube.radius = 0.25;
  // Above a facet, next to an edge, and inside.
  ExpectValid(kTouching, Direction(0, 0, 1, {{1, 0}, {3, 0}, {5, 0}, {7, 0}}), cube,
              Ball(0.5, 0.25, 0.5, 1.75));
  ExpectInvalid(kTouching, Direction(0, 0, 1, {{1, 0}, {3, 0}}), cube, Ball(0.5, 0.25, 0.5, 1.75),
                "too far from 0");
  ExpectValid(kTouching, Direction(3, 4, 0, {{6, 0}, {7, 0}}), cube, Ball(4.75, 4, 5, 0.5));
  ExpectValid(kOverlapping, PairsOnly({{0, 0}, {6, 0}, {5, 0}, {3, 0}}), cube,
              Ball(0.01, 0.5, 0.5, 0.5));
  ExpectValid(kOverlapping, PairsOnly({{0, 0}, {7, 0}}), cube, Ball(0, 0.5, 0.5, 0.5));
  Hull bad = Ball(-1);
  ExpectInvalid(kSeparated, Direction(1, 0, 0), cube, bad, "a radius is negative");
  bad.radius = INFINITY;
  ExpectInvalid(kSeparated, Direction(1, 0, 0), cube, bad, "not finite");
}

}  // namespace certificate_check_test
}  // namespace hulld
