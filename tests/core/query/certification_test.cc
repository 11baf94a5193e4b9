#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <variant>
#include <vector>

#include "core/query/collision.h"
#include "tests/core/checks/certificate_bridge.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/test_size.h"

namespace hulld {
namespace certification_test {

constexpr int kRounds = TestSize(4000, 300);

QueryOptions WantCertificate() {
  QueryOptions options;
  options.want_certificate = true;
  return options;
}

Pose At(double x, double y, double z) {
  Pose pose;
  pose.t = Vector(x, y, z);
  return pose;
}

std::vector<Vector> Cube() { return LatticeCube(2, 1); }

TEST(Certificate, DirectionsOfCubesAreSmallDoubles) {
  const Hull cube = BuildHull(Cube());
  for (const double x : {1.0, 1.5}) {
    const Answer answer =
        CheckCollision(cube, Pose(), cube, At(x, 0.25, 0), WantCertificate()).value();
    EXPECT_TRUE(CertificateIsValid(cube, Pose(), cube, At(x, 0.25, 0), answer));
    EXPECT_TRUE(std::holds_alternative<Vector>(answer.certificate->direction));
  }
}

TEST(Certificate, EmptyHullsNeedNone) {
  const Hull cube = BuildHull(Cube());
  const Answer answer = CheckCollision(cube, Pose(), Hull(), Pose(), WantCertificate()).value();
  EXPECT_FALSE(answer.certificate.has_value());
}

// Every vertex is needed: the origin is on a line or in a plane of opposite ones.
TEST(Certificate, SomeOverlapsNeedFiveOrSixPairs) {
  const std::vector<Vector> bipyramid = {{0, 0, 3}, {0, 0, -3}, {2, 0, 0}, {-1, 1, 0}, {-1, -1, 0}};
  const std::vector<Vector> octahedron = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                          {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  const Hull point = BuildHull(std::vector<Vector>{{0, 0, 0}});
  for (const std::vector<Vector>& corners : {bipyramid, octahedron}) {
    const Hull hull = BuildHull(corners);
    const Answer answer = CheckCollision(hull, Pose(), point, Pose(), WantCertificate()).value();
    EXPECT_EQ(answer.relation, Relation::kOverlapping);
    EXPECT_TRUE(CertificateIsValid(hull, Pose(), point, Pose(), answer));
    EXPECT_EQ(answer.certificate->pairs.size(), corners.size());
  }
}

TEST(Certificate, TheTextbookMethodReturnsCertificates) {
  const Hull cube = BuildHull(Cube());
  QueryOptions options = WantCertificate();
  options.method = Method::kTextbookSat;
  options.want_axis = true;
  options.want_analysis = true;
  for (const double x : {0.5, 1.0, 1.5}) {
    const Answer answer = CheckCollision(cube, Pose(), cube, At(x, 0, 0), options).value();
    EXPECT_TRUE(CertificateIsValid(cube, Pose(), cube, At(x, 0, 0), answer));
    EXPECT_EQ(answer.axis.has_value(), x >= 1);
    EXPECT_GT(answer.analysis->axes_total, 0u);
  }
}

// Swapped hulls yield the mirror image, bit for bit.
void ExpectMirrored(const Certificate& ab, const Certificate& ba) {
  ASSERT_EQ(ab.direction.index(), ba.direction.index());
  if (const Vector* n = std::get_if<Vector>(&ab.direction)) {
    EXPECT_EQ(*n, -std::get<Vector>(ba.direction));
  }
  if (const IntegerVector* n = std::get_if<IntegerVector>(&ab.direction)) {
    EXPECT_TRUE(*n == -std::get<IntegerVector>(ba.direction));
  }
  ASSERT_EQ(ab.pairs.size(), ba.pairs.size());
  for (size_t i = 0; i < ab.pairs.size(); ++i) {
    EXPECT_TRUE(ab.pairs[i].a == ba.pairs[i].b && ab.pairs[i].b == ba.pairs[i].a);
  }
}

struct Regimes {
  int relations[3] = {};
  int doubles = 0;
  int integers = 0;
  int pair_counts[7] = {};

  void Count(const Answer& answer) {
    ++relations[static_cast<int>(answer.relation)];
    doubles += std::holds_alternative<Vector>(answer.certificate->direction);
    integers += std::holds_alternative<IntegerVector>(answer.certificate->direction);
    ++pair_counts[answer.certificate->pairs.size()];
  }
};

// Small integer sets of every dimension in poses of small integers: half of them in contact. Their
// poses' rotations give directions that doubles cannot represent.
TEST(Certificate, SmallHullsOfEveryDimensionAreProven) {
  const uint64_t seed = TestSeed(701);
  Random random(seed);
  Regimes regimes;
  for (int round = 0; round < kRounds; ++round) {
    const double scale = std::array{1e-300, 1e-30, 1.0, 1e30, 1e290}[random.Below(5)];
    const auto points = [&] {
      return random.Below(2) ? RandomLatticePoints(random, random.Between(1, 8), 4)
                             : RandomFlatPoints(random, random.Between(1, 6), random.Below(4));
    };
    std::vector<Vector> first = points();
    std::vector<Vector> second = points();
    Pose X_WA;
    for (double& q : X_WA.q) q = random.Real(-1, 1);
    Pose X_WB = X_WA;
    if (random.Below(2)) {
      second = Shifted(second, first[random.Below(first.size())] - second[0]);
    } else {
      for (double& q : X_WB.q) q = random.Real(-1, 1);
    }
    const Hull a = BuildHull(Scaled(first, scale));
    const Hull b = BuildHull(Scaled(second, scale));
    const Answer answer = CheckCollision(a, X_WA, b, X_WB, WantCertificate()).value();
    ASSERT_EQ(answer.relation, OracleRelation(a, X_WA, b, X_WB)) << Describe(a, X_WA, b, X_WB);
    ASSERT_TRUE(CertificateIsValid(a, X_WA, b, X_WB, answer))
        << "seed " << seed << " round " << round << "\n"
        << Describe(a, X_WA, b, X_WB);
    regimes.Count(answer);
    // Equal hulls at equal poses: the query is its own mirror image.
    if (X_WA.q == X_WB.q && SameBits(a, b)) continue;
    ExpectMirrored(*answer.certificate,
                   *CheckCollision(b, X_WB, a, X_WA, WantCertificate()).value().certificate);
  }
  for (const int count : regimes.relations) EXPECT_GT(count, kRounds / 20);
  EXPECT_GT(regimes.doubles, kRounds / 20);
  EXPECT_GT(regimes.integers, kRounds / 20);
  for (int size = 1; size <= 4; ++size) EXPECT_GT(regimes.pair_counts[size], 0) << size;
}

}  // namespace certification_test
}  // namespace hulld
