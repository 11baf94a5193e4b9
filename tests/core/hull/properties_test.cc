#include "core/hull/properties.h"

#include <gtest/gtest.h>

#include <array>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <vector>

#include "core/numeric/exponent_limits.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {
namespace properties_test {

using Rational = boost::multiprecision::cpp_rational;
using BigInteger = boost::multiprecision::cpp_int;
using LongFloat = boost::multiprecision::cpp_bin_float_100;
using RationalPoint = std::array<Rational, 3>;

Rational ExactValue(double value) {
  int exponent = 0;
  const double mantissa = std::frexp(value, &exponent);
  const Rational integer(static_cast<int64_t>(std::ldexp(mantissa, 53)));
  const BigInteger power = BigInteger(1) << std::abs(exponent - 53);
  if (exponent < 53) return integer / power;
  return integer * power;
}

RationalPoint ExactPoint(const Vector& p) {
  return {ExactValue(p.x()), ExactValue(p.y()), ExactValue(p.z())};
}

RationalPoint Minus(const RationalPoint& p, const RationalPoint& q) {
  return {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
}

RationalPoint Cross(const RationalPoint& p, const RationalPoint& q) {
  return {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
}

Rational Dot(const RationalPoint& p, const RationalPoint& q) {
  return p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
}

// The measures of a solid, in rationals, by a quadrature that is exact for quadratic polynomials:
// 1/20 of each corner of a tetrahedron and 4/5 of its centroid.
class Oracle {
 public:
  explicit Oracle(const Hull& hull) {
    const RationalPoint apex = ExactPoint(hull.vertices().back());
    for (size_t f = 0; f < hull.facet_count(); ++f) {
      const auto facet = hull.facet(f);
      RationalPoint normal = {0, 0, 0};
      for (size_t i = 2; i < facet.size(); ++i) {
        const RationalPoint a = ExactPoint(hull.vertices()[facet[0]]);
        const RationalPoint b = ExactPoint(hull.vertices()[facet[i - 1]]);
        const RationalPoint c = ExactPoint(hull.vertices()[facet[i]]);
        const RationalPoint n = Cross(Minus(b, a), Minus(c, a));
        for (int k = 0; k < 3; ++k) normal[k] += n[k];
        AddTetrahedron(Dot(n, Minus(a, apex)) / 6, {apex, a, b, c});
      }
      area += sqrt(LongFloat(Dot(normal, normal))) / 2;
    }
  }

  Rational Centroid(int i) const { return first_[i] / volume; }
  // The integral of x_i x_j about the centroid.
  Rational Central(int i, int j) const { return second_[i][j] - first_[i] * first_[j] / volume; }

  Rational volume = 0;
  LongFloat area = 0;

 private:
  void AddTetrahedron(const Rational& content, const std::array<RationalPoint, 4>& corners) {
    RationalPoint centroid = {0, 0, 0};
    for (const RationalPoint& p : corners) {
      for (int k = 0; k < 3; ++k) centroid[k] += p[k] / 4;
      Add(content / 20, p);
    }
    Add(content * 4 / 5, centroid);
  }

  void Add(const Rational& weight, const RationalPoint& p) {
    volume += weight;
    for (int i = 0; i < 3; ++i) {
      first_[i] += weight * p[i];
      for (int j = 0; j < 3; ++j) second_[i][j] += weight * p[i] * p[j];
    }
  }

  RationalPoint first_ = {0, 0, 0};
  std::array<RationalPoint, 3> second_ = {RationalPoint{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
};

testing::AssertionResult IsNearest(const Rounded& actual, const Rational& exact) {
  if (actual.bound == kInfinity) {
    if (abs(exact) > ExactValue(kLargestDouble) && std::abs(actual.value) == kLargestDouble) {
      return testing::AssertionSuccess();
    }
    return testing::AssertionFailure() << "saturated, but is " << exact;
  }
  const Rational error = abs(Rational(ExactValue(actual.value) - exact));
  bool nearest = error <= ExactValue(actual.bound) && (error == 0) == (actual.bound == 0);
  for (const double toward : {-kLargestDouble, kLargestDouble}) {
    const double neighbor = std::nextafter(actual.value, toward);
    nearest = nearest && error <= abs(Rational(ExactValue(neighbor) - exact));
  }
  if (nearest) return testing::AssertionSuccess();
  return testing::AssertionFailure()
         << actual.value << " within " << actual.bound << " is not " << exact;
}

testing::AssertionResult Matches(const Hull& hull) {
  const HullProperties actual = ComputeProperties(hull).value();
  const Oracle oracle(hull);
  if (auto result = IsNearest(actual.volume, oracle.volume); !result) return result << " (volume)";
  const LongFloat area_error = abs(LongFloat(actual.area.value) - oracle.area);
  if (!(area_error <= LongFloat(actual.area.bound))) {
    return testing::AssertionFailure() << "area " << actual.area.value << ", not " << oracle.area;
  }
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    if (auto result = IsNearest(actual.centroid[i], oracle.Centroid(i)); !result) {
      return result << " (centroid " << i << ")";
    }
    const Rational diagonal = oracle.Central(j, j) + oracle.Central(k, k);
    if (auto result = IsNearest(actual.inertia[i], diagonal); !result) {
      return result << " (inertia " << i << i << ")";
    }
  }
  constexpr int kOff[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  for (int i = 0; i < 3; ++i) {
    const Rational product = -oracle.Central(kOff[i][0], kOff[i][1]);
    if (auto result = IsNearest(actual.inertia[3 + i], product); !result) {
      return result << " (inertia " << kOff[i][0] << kOff[i][1] << ")";
    }
  }
  return testing::AssertionSuccess();
}

std::vector<Vector> Box(const Vector& low, const Vector& high) {
  std::vector<Vector> corners;
  for (int i = 0; i < 8; ++i) {
    corners.emplace_back(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(),
                         i & 4 ? high.z() : low.z());
  }
  return corners;
}

void ExpectExact(const Rounded& actual, double expected) {
  EXPECT_EQ(actual.value, expected);
  EXPECT_EQ(actual.bound, 0);
}

TEST(HullProperties, BoxesAreExact) {
  for (const double offset : {0.0, -5.0, 0x1p50}) {
    const Vector low = Vector::Constant(offset);
    const HullProperties box =
        ComputeProperties(BuildHull(Box(low, low + Vector(1, 2, 4)))).value();
    ExpectExact(box.volume, 8);
    EXPECT_EQ(box.area.value, 28);
    EXPECT_LE(box.area.bound, 28 * 0x1.1p-52);
    ExpectExact(box.centroid[0], offset + 0.5);
    ExpectExact(box.centroid[1], offset + 1);
    ExpectExact(box.centroid[2], offset + 2);
    // m (b^2 + c^2) / 12.
    EXPECT_EQ(box.inertia[0].value, 8 * 20 / 12.0);
    EXPECT_EQ(box.inertia[1].value, 8 * 17 / 12.0);
    EXPECT_EQ(box.inertia[2].value, 8 * 5 / 12.0);
    for (int k = 3; k < 6; ++k) ExpectExact(box.inertia[k], 0);
  }
}

TEST(HullProperties, TheUnitTetrahedronHasItsTextbookValues) {
  const HullProperties unit =
      ComputeProperties(BuildHull(std::vector<Vector>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}))
          .value();
  EXPECT_EQ(unit.volume.value, 1 / 6.0);
  EXPECT_NEAR(unit.area.value, 1.5 + std::sqrt(0.75), unit.area.bound + 0x1p-52);
  EXPECT_LE(unit.area.bound, 0x1p-50);
  for (int i = 0; i < 3; ++i) {
    ExpectExact(unit.centroid[i], 0.25);
    EXPECT_EQ(unit.inertia[i].value, 1 / 80.0);
    EXPECT_EQ(unit.inertia[3 + i].value, 1 / 480.0);
  }
}

TEST(HullProperties, SolidsMatchRationals) {
  const uint64_t seed = TestSeed(811);
  Random random(seed);
  int solids = 0;
  for (int round = 0; round < 60; ++round) {
    const int n = random.Between(4, 24);
    const std::vector<Vector> points = round % 3 == 0   ? RandomLatticePoints(random, n, 5)
                                       : round % 3 == 1 ? RandomInCube(random, n, 1)
                                                        : RandomOnSphere(random, n, 3);
    const double offset = std::array{0.0, 1e-3, 1e9, 1e17}[random.Below(4)];
    const Hull hull = BuildHull(Shifted(points, Vector(offset, -offset, 1)));
    if (hull.dimension() < 3) continue;
    ++solids;
    EXPECT_TRUE(Matches(hull)) << "seed " << seed << " round " << round;
  }
  EXPECT_GT(solids, 50);
  EXPECT_TRUE(Matches(BuildHull(LatticeCubeSurface(4))));
  EXPECT_TRUE(Matches(BuildHull(IntegerSphere(101))));
  EXPECT_TRUE(Matches(BuildHull(IntegerParaboloid(5))));
}

// Slivers, needles, and ranges of exponents, where volumes underflow, overflow, or are what remains
// of numbers that cancel.
TEST(HullProperties, ExtremesOfScaleMatchRationals) {
  const uint64_t seed = TestSeed(812);
  Random random(seed);
  int zero = 0;
  int infinite = 0;
  for (int round = 0; round < 60; ++round) {
    Vector scale;
    for (int k = 0; k < 3; ++k) scale[k] = std::ldexp(1.0, random.Between(-1000, 1000));
    if (round % 3 == 0) scale = Vector::Constant(scale.x());
    std::vector<Vector> points = RandomInCube(random, random.Between(4, 8), 1);
    for (Vector& p : points) p = p.cwiseProduct(scale);
    const Hull hull = BuildHull(points);
    ASSERT_EQ(hull.dimension(), 3);
    EXPECT_TRUE(Matches(hull)) << "seed " << seed << " round " << round;
    const HullProperties properties = ComputeProperties(hull).value();
    zero += properties.volume.value == 0;
    infinite += properties.volume.bound == kInfinity;
  }
  EXPECT_GT(zero, 5);
  EXPECT_GT(infinite, 5);
}

TEST(HullProperties, CubesBeyondTheRangeOfDoublesSaturate) {
  const HullProperties small =
      ComputeProperties(BuildHull(Box(Vector::Zero(), Vector::Constant(0x1p-1000)))).value();
  EXPECT_EQ(small.volume.value, 0);
  EXPECT_EQ(small.volume.bound, kMinDouble);
  EXPECT_EQ(small.area.value, kMinDouble);
  ExpectExact(small.centroid[0], 0x1p-1001);
  const HullProperties large =
      ComputeProperties(BuildHull(Box(Vector::Zero(), Vector::Constant(0x1p1000)))).value();
  for (const Rounded& value : {large.volume, large.area, large.inertia[0]}) {
    EXPECT_EQ(value.value, kLargestDouble);
    EXPECT_EQ(value.bound, kInfinity);
  }
  ExpectExact(large.centroid[0], 0x1p999);
  ExpectExact(large.inertia[3], 0);
  const HullProperties most =
      ComputeProperties(BuildHull(Box(Vector::Zero(), Vector::Constant(0x1p341)))).value();
  ExpectExact(most.volume, 0x1p1023);
}

TEST(HullProperties, FlatHullsHaveNoVolume) {
  const struct {
    std::vector<Vector> points;
    double area;
    Vector centroid;
  } kCases[] = {
      // Two sides of 6 each, and of 15 each: 3-4-5 triangle, and 3 x 5 rectangle in a tilted plane.
      {{{1, 1, 7}, {4, 1, 7}, {1, 5, 7}}, 12, {2, 7 / 3.0, 7}},
      {{{0, 0, 0}, {3, 0, 0}, {0, 3, 4}, {3, 3, 4}}, 30, {1.5, 1.5, 2}},
      // Not symmetric: a square and a triangle on it.
      {{{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 3, 0}, {0, 2, 0}}, 10, {1, 19 / 15.0, 0}},
      {{{1, 2, 3}, {2, 4, 8}}, 0, {1.5, 3, 5.5}},
      {{{0.1, -0.2, 1e300}}, 0, {0.1, -0.2, 1e300}},
  };
  for (const auto& [points, area, centroid] : kCases) {
    const HullProperties flat = ComputeProperties(BuildHull(points)).value();
    ExpectExact(flat.volume, 0);
    EXPECT_EQ(flat.area.value, area);
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(flat.centroid[i].value, centroid[i]);
      EXPECT_LE(flat.centroid[i].bound, 0x1p-53 * std::abs(centroid[i]));
    }
    for (const Rounded& entry : flat.inertia) ExpectExact(entry, 0);
  }
}

// All coordinates are multiples of 2^-40, so a translation by 2^12 is exact.
TEST(HullProperties, TranslationsMoveOnlyTheCentroid) {
  Random random(TestSeed(813));
  std::vector<Vector> points = RandomInBall(random, 80, 1);
  for (Vector& p : points) {
    for (double& x : p) x = std::round(x * 0x1p40) * 0x1p-40;
  }
  const HullProperties here = ComputeProperties(BuildHull(points)).value();
  const HullProperties there =
      ComputeProperties(BuildHull(Shifted(points, Vector(0x1p12, -0x1p12, 1)))).value();
  EXPECT_EQ(here.volume.value, there.volume.value);
  EXPECT_EQ(here.area.value, there.area.value);
  for (int k = 0; k < 6; ++k) EXPECT_EQ(here.inertia[k].value, there.inertia[k].value);
  EXPECT_NEAR(there.centroid[0].value, here.centroid[0].value + 0x1p12, 0x1p-40);
}

TEST(HullProperties, AStopEndsTheSum) {
  for (const Hull& hull :
       {BuildHull(FibonacciSphere(1000)), BuildHull(std::vector<Vector>{{1, 2, 3}})}) {
    int polls = 0;
    ASSERT_TRUE(ComputeProperties(hull, [&] { return ++polls == 0; }).ok());
    const int all = polls;
    EXPECT_GE(static_cast<size_t>(all), 1 + hull.facet_count() / 128);
    for (int last = 1; last <= all; ++last) {
      polls = 0;
      const absl::Status stopped =
          ComputeProperties(hull, [&] { return ++polls == last; }).status();
      EXPECT_EQ(stopped.code(), absl::StatusCode::kCancelled);
      EXPECT_EQ(polls, last);
    }
  }
}

}  // namespace properties_test
}  // namespace hulld
