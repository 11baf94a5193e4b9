#include "core/numeric/orientation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "tests/test_size.h"

namespace hulld {
namespace orientation_test {

using Rational = boost::multiprecision::cpp_rational;
using Points = std::array<Vector, 4>;

// In rationals, expanded along the last row: a different formula from the one under test.
int RationalOrient3d(const Points& p) {
  Rational m[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) m[i][k] = Rational(p[i][k]) - Rational(p[3][k]);
  }
  const Rational det = m[2][0] * (m[0][1] * m[1][2] - m[0][2] * m[1][1]) -
                       m[2][1] * (m[0][0] * m[1][2] - m[0][2] * m[1][0]) +
                       m[2][2] * (m[0][0] * m[1][1] - m[0][1] * m[1][0]);
  // det[a-d, b-d, c-d] = -det[b-a, c-a, d-a].
  return -det.sign();
}

int Sign(const Points& p) { return Orient3d(p[0], p[1], p[2], p[3]); }

// The sign is that of the determinant in rationals, in several orders of the points.
void ExpectExact(const Points& p) {
  const int sign = RationalOrient3d(p);
  ASSERT_EQ(Sign(p), sign) << p[0].transpose() << " / " << p[1].transpose() << " / "
                           << p[2].transpose() << " / " << p[3].transpose();
  ASSERT_EQ(Sign({p[1], p[0], p[2], p[3]}), -sign);
  ASSERT_EQ(Sign({p[0], p[1], p[3], p[2]}), -sign);
  ASSERT_EQ(Sign({p[1], p[2], p[0], p[3]}), sign);
}

// Points of a lattice, many of them coplanar, and points next to a plane at several scales, where
// floating point cannot decide the sign. Doubles represent the sums with the offset exactly.
struct LawCase {
  Points points;
  Vector offset;
};

std::vector<LawCase> LawCases() {
  std::mt19937_64 random(17);
  std::uniform_int_distribution<int> few(-2, 2);
  std::uniform_int_distribution<int64_t> many(-(int64_t{1} << 50), int64_t{1} << 50);
  std::vector<LawCase> cases;
  for (int i = 0; i < 3000; ++i) {
    const double scale = std::ldexp(1.0, std::array{-1000, 0, 900}[i % 3]);
    LawCase added;
    for (Vector& v : added.points) v = Vector(few(random), few(random), few(random));
    if (i % 2 == 0) {
      const auto large = [&] { return static_cast<double>(many(random)); };
      for (int k = 0; k < 3; ++k) added.points[k] = Vector(large(), large(), large());
      const Points& p = added.points;
      // Integers below 2^51, as near to the plane of the other points as possible.
      added.points[3] = (p[0] / 2 + p[1] / 4 + p[2] / 4).array().round();
    }
    const auto shift = [&] { return static_cast<double>(many(random)); };
    added.offset = scale * Vector(shift(), shift(), shift());
    for (Vector& v : added.points) v *= scale;
    cases.push_back(added);
  }
  return cases;
}

TEST(Orient3d, Law1ExchangingTwoPointsNegatesTheSign) {
  for (const LawCase& law_case : LawCases()) {
    for (int i = 0; i < 4; ++i) {
      for (int k = i + 1; k < 4; ++k) {
        Points exchanged = law_case.points;
        std::swap(exchanged[i], exchanged[k]);
        ASSERT_EQ(Sign(exchanged), -Sign(law_case.points)) << i << " " << k;
      }
    }
  }
}

TEST(Orient3d, Law2EvenPermutationsKeepTheSign) {
  for (const LawCase& law_case : LawCases()) {
    std::array<int, 4> order = {0, 1, 2, 3};
    do {
      int inversions = 0;
      for (int i = 0; i < 4; ++i) {
        for (int k = i + 1; k < 4; ++k) inversions += order[i] > order[k];
      }
      if (inversions % 2 != 0) continue;
      Points permuted;
      for (int i = 0; i < 4; ++i) permuted[i] = law_case.points[order[i]];
      ASSERT_EQ(Sign(permuted), Sign(law_case.points));
    } while (std::next_permutation(order.begin(), order.end()));
  }
}

TEST(Orient3d, Law3RepresentableTranslationsKeepTheSign) {
  int coplanar = 0;
  for (const LawCase& law_case : LawCases()) {
    Points moved = law_case.points;
    for (Vector& v : moved) v += law_case.offset;
    ASSERT_EQ(Sign(moved), Sign(law_case.points));
    coplanar += Sign(moved) == 0;
  }
  EXPECT_GT(coplanar, 100);
}

TEST(Orient3d, PositiveOnTheSideOfTheNormal) {
  const Vector a(0, 0, 0);
  const Vector b(1, 0, 0);
  const Vector c(0, 1, 0);
  EXPECT_EQ(Orient3d(a, b, c, Vector(0.3, 0.3, 1)), 1);
  EXPECT_EQ(Orient3d(a, b, c, Vector(0.3, 0.3, -1)), -1);
  EXPECT_EQ(Orient3d(a, b, c, Vector(7, -9, 0)), 0);
}

TEST(Orient3d, ExactOnSmallLattices) {
  std::mt19937_64 random(3);
  std::uniform_int_distribution<int> coordinate(-2, 2);
  int zero = 0;
  for (int i = 0; i < 20000; ++i) {
    Points p;
    for (Vector& v : p) v = Vector(coordinate(random), coordinate(random), coordinate(random));
    ExpectExact(p);
    zero += Sign(p) == 0;
  }
  EXPECT_GT(zero, 1000);
}

TEST(Orient3d, ExactNextToAPlaneAtEveryScaleAndEveryStageIsReached) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  const OrientationCounts before = ThreadOrientationCounts();
  for (const int scale : {-1070, -1000, -700, -320, -300, -100, 0, 100, 320, 340, 700, 1000}) {
    for (int i = 0; i < 300; ++i) {
      Points p;
      for (int k = 0; k < 3; ++k) {
        p[k] = Vector(unit(random), unit(random), unit(random));
      }
      // Anywhere, or rounded into the plane of the other points and thus very close to it.
      const double s = unit(random);
      const double t = unit(random);
      p[3] = i % 3 == 0 ? Vector(s, t, unit(random)) : p[0] + s * (p[1] - p[0]) + t * (p[2] - p[0]);
      // Similar magnitudes along the axes, or different ones, which take more bits.
      const int spread = i % 2 == 0 ? 0 : 12;
      for (Vector& v : p) {
        for (int k = 0; k < 3; ++k) v[k] = std::ldexp(v[k], scale - k * spread);
      }
      ExpectExact(p);
    }
  }
  const OrientationCounts after = ThreadOrientationCounts();
  EXPECT_GT(after.filter - before.filter, 1000u);
  EXPECT_GT(after.nearest_filter - before.nearest_filter, 1000u);
  EXPECT_GT(after.fixed_point - before.fixed_point, 1000u);
  EXPECT_GT(after.expansion - before.expansion, 1000u);
  // A common power of two needs no integers.
  EXPECT_EQ(after.integer, before.integer);
}

// A power of two on each axis: exponents spread beyond the reach of a common power of two.
TEST(Orient3d, ExactIfAxesDifferInMagnitude) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const auto& [low, high] : {std::array{-1060, 1020},
                                  {-1060, -440},
                                  {-300, 330},
                                  {-306, 329},
                                  {-310, 333},
                                  {500, 1020}}) {
    const OrientationCounts before = ThreadOrientationCounts();
    for (int i = 0; i < 300; ++i) {
      Points p;
      for (int k = 0; k < 3; ++k) p[k] = Vector(unit(random), unit(random), unit(random));
      p[3] = p[0] + unit(random) * (p[1] - p[0]) + unit(random) * (p[2] - p[0]);
      for (Vector& v : p) {
        v = Vector(std::ldexp(v.x(), low), v.y(), std::ldexp(v.z(), high));
        v.y() = std::ldexp(v.y(), (low + high) / 2);
      }
      ExpectExact(p);
    }
    const uint64_t by_integers = ThreadOrientationCounts().integer - before.integer;
    if (high - low > 660) {
      EXPECT_GT(by_integers, 300u) << low << " to " << high;
    }
    if (high - low < 600) {
      EXPECT_EQ(by_integers, 0u) << low << " to " << high;
    }
  }
}

// Any two or three of the points are close together and the rest far away: the determinant is far
// below the error of differences from a far point. No exact arithmetic is needed.
TEST(Orient3d, NearbyPointsAreDecidedRelativeToOneOfThem) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto any = [&](double size) {
    return Vector(size * unit(random), size * unit(random), size * unit(random));
  };
  const OrientationCounts before = ThreadOrientationCounts();
  for (const double scale : {1.0, 0x1p-1000, 0x1p-500, 0x1p500, 0x1p900}) {
    for (int i = 0; i < 200; ++i) {
      // Clusters are a billionth wide.
      const Vector middle = any(1);
      const Vector far = any(1);
      const Vector other = any(1);
      Points p = {middle + any(1e-9), middle + any(1e-9), far, other};
      if (i % 2 == 0) p[2] = middle + any(1e-9);
      if (i % 2 == 1) p[3] = far + any(1e-9);
      std::shuffle(p.begin(), p.end(), random);
      for (Vector& v : p) v *= scale;
      ExpectExact(p);
    }
  }
  const OrientationCounts after = ThreadOrientationCounts();
  EXPECT_GT(after.nearest_filter - before.nearest_filter, 1000u);
  EXPECT_LT(after.fixed_point - before.fixed_point + after.expansion - before.expansion, 10u);
  EXPECT_EQ(after.integer, before.integer);
}

// Points in a plane across an axis are coplanar at any magnitude, and no later stage is needed.
TEST(Orient3d, PlanesAcrossAxesTakeNoExactArithmetic) {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> unit(-1, 1);
  const OrientationCounts before = ThreadOrientationCounts();
  for (const int scale : {-1070, -320, 0, 320, 1000}) {
    for (int i = 0; i < 300; ++i) {
      Points p;
      for (Vector& v : p) {
        v = Vector(unit(random), unit(random), unit(random)) * std::ldexp(1.0, scale);
      }
      for (Vector& v : p) v[i % 3] = p[0][i % 3];
      ExpectExact(p);
      ASSERT_EQ(Sign(p), 0);
    }
  }
  const OrientationCounts after = ThreadOrientationCounts();
  EXPECT_EQ(after.fixed_point, before.fixed_point);
  EXPECT_EQ(after.expansion, before.expansion);
  EXPECT_EQ(after.integer, before.integer);
}

// Rounding terms far below the rest to zero neither loses a certain sign nor makes an uncertain one
// certain.
TEST(Orient3d, MagnitudesFarApartTakeNoIntegersUnlessTheyCount) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::uniform_int_distribution<int> exponent(-1060, 1020);
  const OrientationCounts before = ThreadOrientationCounts();
  for (int i = 0; i < 1000; ++i) {
    Points p;
    for (Vector& v : p) {
      for (int k = 0; k < 3; ++k) v[k] = std::ldexp(unit(random), exponent(random));
    }
    // In the plane of the other points.
    if (i % 8 == 0) p[3] = p[0] + (p[1] - p[0]) / 2 + (p[2] - p[0]) / 4;
    ExpectExact(p);
  }
  const OrientationCounts after = ThreadOrientationCounts();
  EXPECT_GT(after.nearest_filter - before.nearest_filter, 1000u);
  EXPECT_LT(after.integer - before.integer, 1000u);
  EXPECT_GT(after.integer - before.integer, 100u);
}

// Numbers that just fit into the integers of fixed size, and that just do not.
TEST(Orient3d, ExactAtTheEdgeOfFixedSize) {
  const uint64_t seed = 7;
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<int> pick(0, 5);
  const double values[] = {0x1p60 - 0x1p8, -(0x1p60 - 0x1p8), 0x1p60, 1, -1, 0.5};
  const OrientationCounts before = ThreadOrientationCounts();
  for (const int scale : {-1070, -60, 0, 900}) {
    for (int i = 0; i < TestSize(10000, 2000); ++i) {
      Points p;
      for (Vector& v : p) {
        for (int k = 0; k < 3; ++k) v[k] = std::ldexp(values[pick(random)], scale);
      }
      ExpectExact(p);
    }
  }
  const OrientationCounts after = ThreadOrientationCounts();
  EXPECT_GT(after.fixed_point - before.fixed_point, uint64_t{TestSize(100, 10)}) << "seed " << seed;
  EXPECT_GT(after.expansion - before.expansion, uint64_t{TestSize(100, 10)}) << "seed " << seed;
}

TEST(Orient3d, ExactOnMixedMagnitudes) {
  std::mt19937_64 random(5);
  const double values[] = {0,     1e-310,   -1e-310, 5e-324,   -5e-324, 1e-300,   -1e-160,
                           1e-30, -1,       1,       1e16,     -1e16,   1e150,    -1e300,
                           1e308, -1.7e308, 1.7e308, 0x1p-306, 0x1p330, -0x1p-307};
  std::uniform_int_distribution<size_t> pick(0, std::size(values) - 1);
  for (int i = 0; i < TestSize(5000, 500); ++i) {
    Points p;
    for (Vector& v : p)
      v = Vector(values[pick(random)], values[pick(random)], values[pick(random)]);
    ExpectExact(p);
  }
}

int RationalOrient2d(const Vector& a, const Vector& b, const Vector& c, CoordinatePlane plane) {
  const auto d = [&](const Vector& p, int k) { return Rational(p[k]) - Rational(c[k]); };
  return Rational(d(a, plane.first) * d(b, plane.second) - d(a, plane.second) * d(b, plane.first))
      .sign();
}

TEST(Orient2d, ExactInEveryPlaneAtEveryScale) {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const int scale : {-1073, -1060, -600, -540, 0, 400, 600, 1000}) {
    for (int i = 0; i < 500; ++i) {
      Vector a(unit(random), unit(random), unit(random));
      Vector b(unit(random), unit(random), unit(random));
      Vector c = a + unit(random) * (b - a);
      for (Vector* v : {&a, &b, &c}) {
        for (int k = 0; k < 3; ++k) (*v)[k] = std::ldexp((*v)[k], scale);
      }
      for (const CoordinatePlane plane : {CoordinatePlane{0, 1}, {1, 2}, {2, 0}}) {
        ASSERT_EQ(Orient2d(a, b, c, plane), RationalOrient2d(a, b, c, plane));
      }
    }
  }
}

TEST(Orient2d, OverflowAndUnderflowAreExact) {
  const Vector big(1.7e308, -1.7e308, 0);
  EXPECT_EQ(Orient2d(-big, big, Vector(0, 5e-324, 0), {0, 1}), 1);
  EXPECT_EQ(Orient2d(-big, big, Vector(0, 0, 0), {0, 1}), 0);
  EXPECT_EQ(Orient2d(Vector(0, 0, 0), Vector(5e-324, 0, 0), Vector(0, 5e-324, 0), {0, 1}), 1);
}

TEST(ProjectionOf, FindsAPlaneUnlessCollinear) {
  EXPECT_LT(ProjectionOf(Vector(0, 0, 0), Vector(1, 2, 3), Vector(3, 6, 9)).first, 0);
  const Vector a(0, 0, 0);
  const Vector b(0, 0, 1);
  const Vector c(0, 1, 0);
  const CoordinatePlane plane = ProjectionOf(a, b, c);
  ASSERT_GE(plane.first, 0);
  EXPECT_NE(Orient2d(a, b, c, plane), 0);
}

}  // namespace orientation_test
}  // namespace hulld
