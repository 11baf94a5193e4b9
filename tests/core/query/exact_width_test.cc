// The exact search in each width of integers: the same queries, the same answers, up to the limits
// of each width.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "core/query/exact/exact_frame.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/exact/exact_search.h"
#include "core/query/floating/float_search.h"
#include "core/query/placed/placed_hull.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {
namespace exact_width_test {

constexpr ExactWidth kWidths[] = {ExactWidth::k1Word, ExactWidth::k2Words, ExactWidth::k3Words,
                                  ExactWidth::k5Words, ExactWidth::kAny};
constexpr int kMaxBits[] = {55, 119, 183, 311, std::numeric_limits<int>::max()};
constexpr size_t kWidthCount = std::size(kWidths);

// Runs a query in all widths that are sufficient, from scratch and from the final state of floating
// point.
class WidthCheck {
 public:
  testing::AssertionResult Verify(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB,
                                  std::optional<Relation> expected = std::nullopt) {
    const QueryHull query_a(a);
    const QueryHull query_b(b);
    const PlacedHull placed_a(query_a, X_WA);
    const PlacedHull placed_b(query_b, X_WB);
    const FloatPair pair(placed_a, placed_b);
    SmallFrame frame;
    const bool is_small = FindSmallFrame(pair, frame);
    bits_ = is_small ? std::optional(frame.bits) : std::nullopt;
    if (is_small) {
      if (auto bounded = CheckBounds(pair, frame); !bounded) return bounded;
    }
    FloatSearchResult end;
    if (pair.usable()) end = SearchInFloatingPoint(pair, 0, -pair.CenterDifference());
    const bool has_end = pair.usable() && end.verdict == FloatVerdict::kUndecided;
    for (const FloatSearchResult* from : {static_cast<const FloatSearchResult*>(nullptr),
                                          static_cast<const FloatSearchResult*>(&end)}) {
      if (from != nullptr && !has_end) continue;
      const auto wanted = SearchExactly(pair, from, true, {}, ExactWidth::kAny);
      if (!wanted.ok()) return testing::AssertionFailure() << wanted.status();
      if (!expected) expected = wanted->relation;
      for (size_t i = 0; i < kWidthCount; ++i) {
        const auto found = SearchExactly(pair, from, true, {}, kWidths[i]);
        const bool fits = !is_small ? kWidths[i] == ExactWidth::kAny : frame.bits <= kMaxBits[i];
        if (found.ok() && !fits)
          return testing::AssertionFailure() << "width " << i << " too narrow";
        if (!found.ok()) continue;
        if (auto same = IsSame(*found, *wanted, *expected); !same) return same << " width " << i;
        ++counts_[i];
      }
      const auto chosen = SearchExactly(pair, from, true, {});
      if (!chosen.ok()) return testing::AssertionFailure() << chosen.status();
      if (auto same = IsSame(*chosen, *wanted, *expected); !same) return same << " chosen";
      // Without the axis everything else is equal.
      auto bare = SearchExactly(pair, from, false, {});
      if (!bare.ok() || bare->axis.has_value()) return testing::AssertionFailure() << "bare";
      bare->axis = wanted->axis;
      if (auto same = IsSame(*bare, *wanted, *expected); !same) return same << " bare";
    }
    return testing::AssertionSuccess();
  }

  // Returns the number of answers of each width.
  int count(ExactWidth width) const {
    for (size_t i = 0; i < kWidthCount; ++i) {
      if (kWidths[i] == width) return counts_[i];
    }
    return 0;
  }
  // Returns the bits of the last query if its frame is small.
  std::optional<int> bits() const { return bits_; }

 private:
  static testing::AssertionResult IsSame(const ExactSearchResult& found,
                                         const ExactSearchResult& wanted, Relation expected) {
    if (found.relation != expected) {
      return testing::AssertionFailure() << "relation " << static_cast<int>(found.relation)
                                         << ", not " << static_cast<int>(expected);
    }
    if (found.axis != wanted.axis) return testing::AssertionFailure() << "another axis";
    if (found.directions_tried != wanted.directions_tried) {
      return testing::AssertionFailure() << "other directions";
    }
    if (found.pair_count != wanted.pair_count || found.pairs != wanted.pairs) {
      return testing::AssertionFailure() << "other pairs";
    }
    return testing::AssertionSuccess();
  }

  // True if the frame equals the pair's in integers of any size, and its bits are a valid bound.
  static testing::AssertionResult CheckBounds(const FloatPair& pair, const SmallFrame& frame) {
    const std::function<bool()> never;
    ExactPair exact(pair, never);
    if (exact.exponent() != frame.exponent) return testing::AssertionFailure() << "exponent";
    unsigned most = 0;
    for (uint32_t i = 0; i < exact.a().point_count(); ++i) {
      most = std::max(most, BitLength(exact.VertexA(i)));
    }
    for (uint32_t i = 0; i < exact.b().point_count(); ++i) {
      most = std::max(most, BitLength(exact.VertexB(i)));
    }
    if (static_cast<int>(most) > frame.bits) {
      return testing::AssertionFailure() << most << " bits, not " << frame.bits;
    }
    return testing::AssertionSuccess();
  }

  std::array<int, kWidthCount> counts_ = {};
  std::optional<int> bits_;
};

std::vector<Vector> BoxPoints(const Vector& low, const Vector& high) {
  std::vector<Vector> points;
  for (int i = 0; i < 8; ++i) {
    points.emplace_back((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                        (i & 4) != 0 ? high.z() : low.z());
  }
  return points;
}

Vector IntegerVectorOf(Random& random, int most) {
  return {static_cast<double>(random.Between(-most, most)),
          static_cast<double>(random.Between(-most, most)),
          static_cast<double>(random.Between(-most, most))};
}

// Integer boxes, tetrahedra, and flat sets that touch, miss, or overlap by chance, at scales from
// the least double to near the largest.
TEST(ExactWidth, SmallIntegersAtEveryScale) {
  const uint64_t seed = TestSeed(601);
  Random random(seed);
  WidthCheck check;
  for (int i = 0; i < 1500; ++i) {
    const int exponent = std::array{-1074, -1060, -600, -30, 0, 30, 600, 1015}[random.Below(8)];
    const auto set = [&] {
      std::vector<Vector> points;
      if (random.Below(3) == 0) {
        const Vector low = IntegerVectorOf(random, 3);
        points = BoxPoints(low, low + Vector::Constant(random.Between(0, 4)));
      } else {
        for (int n = random.Between(1, 6); n > 0; --n) points.push_back(IntegerVectorOf(random, 3));
      }
      return points;
    };
    const std::vector<Vector> points_a = set();
    const std::vector<Vector> points_b = set();
    constexpr std::array<double, 4> kTurns[] = {{1, 0, 0, 0}, {-3, 0, 0, 0}, {0, 0, 0, 5},
                                                {1, 1, 0, 0}, {0, 1, 0, -1}, {1, 1, 1, -1}};
    const auto scaled = [&](const std::vector<Vector>& points) {
      std::vector<Vector> result = points;
      for (Vector& p : result) {
        for (int k = 0; k < 3; ++k) p[k] = std::ldexp(p[k], exponent);
      }
      return BuildHull(result);
    };
    Pose X_WA, X_WB;
    X_WA.q = kTurns[random.Below(6)];
    X_WB.q = kTurns[random.Below(6)];
    const Vector t_A = IntegerVectorOf(random, 4);
    const Vector t_B = IntegerVectorOf(random, 4);
    const Relation expected = [&] {
      Pose unit_A = X_WA, unit_B = X_WB;
      unit_A.t = t_A;
      unit_B.t = t_B;
      return OracleRelation(BuildHull(points_a), unit_A, BuildHull(points_b), unit_B);
    }();
    for (int k = 0; k < 3; ++k) {
      X_WA.t[k] = std::ldexp(t_A[k], exponent);
      X_WB.t[k] = std::ldexp(t_B[k], exponent);
    }
    ASSERT_TRUE(check.Verify(scaled(points_a), X_WA, scaled(points_b), X_WB, expected))
        << "seed " << seed << " round " << i;
    // Quarter and third turns take no additional bits.
    ASSERT_TRUE(check.bits().has_value() && *check.bits() <= 12) << *check.bits();
  }
  EXPECT_GT(check.count(ExactWidth::k1Word), 1500);
}

// Boxes with corners of every number of bits up to beyond each width, corner to corner, and one
// unit to either side: the largest products that a width must hold.
TEST(ExactWidth, CornersUpToTheLimitOfEachWidth) {
  WidthCheck check;
  std::array<bool, 400> reached = {};
  for (int bits = 2; bits <= 330; ++bits) {
    // Doubles have 53 bits: up to 52, the coordinates of the boxes themselves have `bits` bits;
    // beyond that, the boxes keep 52 and their translation is 2^bits.
    const int large = std::min(bits, 52);
    const double half = std::ldexp(1.0, large) - 1;
    const double far = std::ldexp(1.0, bits);
    const Hull box = BuildHull(BoxPoints(Vector::Constant(-half), Vector::Constant(half)));
    for (const double step : {-1.0, 0.0, 1.0}) {
      // Touching corners, with a common offset of many bits.
      Pose X_WA, X_WB;
      X_WA.t = bits > 52 ? Vector(far, -far, far) : Vector(0, 0, 0);
      X_WB.t = X_WA.t;
      if (bits <= 52) X_WB.t += Vector::Constant(2 * half + step);
      ASSERT_TRUE(check.Verify(box, X_WA, box, X_WB)) << bits << " bits, step " << step;
      if (check.bits() && *check.bits() < 400) reached[*check.bits()] = true;
      // Coordinates near the largest in opposite corners of space.
      X_WA.t = Vector(-far, far, -far);
      X_WB.t = Vector(far, -far, far) + (bits <= 52 ? Vector::Constant(step) : Vector(0, 0, 0));
      ASSERT_TRUE(check.Verify(box, X_WA, box, X_WB)) << bits << " bits apart";
      if (check.bits() && *check.bits() < 400) reached[*check.bits()] = true;
    }
  }
  for (const int limit : {55, 119, 183, 311}) {
    EXPECT_TRUE(reached[limit]) << limit;
    EXPECT_TRUE(reached[limit + 1]) << limit + 1;
  }
  for (const ExactWidth width : kWidths) EXPECT_GT(check.count(width), 200);
}

// The widest hulls that each width accepts: points with mantissas of ones at both ends of the range
// of bits, so that cross and triple products come near their bounds.
TEST(ExactWidth, WideHullsUpToTheLimitOfEachWidth) {
  const uint64_t seed = TestSeed(602);
  Random random(seed);
  WidthCheck check;
  for (int i = 0; i < 3000; ++i) {
    const int top = random.Between(20, 122);
    const auto coordinate = [&] {
      // The maximum, a few least units, or their sum if a double can represent it.
      const double large = std::ldexp(1.0 - 0x1p-53, top) * (random.Below(2) ? 1 : -1);
      const double least = random.Between(-3, 3);
      const double large_or_integer = top <= 53 ? std::round(large) : large;
      return random.Below(4) == 0 ? least : large_or_integer;
    };
    const auto set = [&] {
      std::vector<Vector> points;
      for (int n = random.Between(4, 10); n > 0; --n) {
        points.emplace_back(coordinate(), coordinate(), coordinate());
      }
      return BuildHull(points);
    };
    const Hull a = set();
    const Hull b = set();
    Pose X_WA, X_WB;
    const double shift = std::ldexp(1.0, top + 1);
    for (int k = 0; k < 3; ++k) X_WB.t[k] = shift * random.Between(-1, 1);
    if (random.Below(3) == 0) X_WB.q = {1, 1, 0, 0};
    if (random.Below(3) == 0) X_WA.q = {2, 1, 0, 0};
    ASSERT_TRUE(check.Verify(a, X_WA, b, X_WB)) << "seed " << seed << " round " << i;
  }
  for (const ExactWidth width : kWidths) EXPECT_GT(check.count(width), 300);
}

// Contacts under arbitrary rotations: the same for both hulls, or an apex on an apex.
TEST(ExactWidth, RotationsByAnyDoubles) {
  const uint64_t seed = TestSeed(603);
  Random random(seed);
  WidthCheck check;
  for (int i = 0; i < 600; ++i) {
    Pose X_WA, X_WB;
    for (double& q : X_WA.q) q = random.Real(-1, 1);
    X_WA.t = Vector(random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1));
    X_WB = X_WA;
    const auto cone = [&](double side) {
      std::vector<Vector> points = {{0, 0, 0}};
      for (int n = 0; n < 6; ++n) {
        points.emplace_back(random.Real(-0.5, 0.5), random.Real(-0.5, 0.5),
                            side * random.Real(1, 2));
      }
      if (random.Below(2)) points.emplace_back(0.25, 0.0, 0.0);
      return BuildHull(points);
    };
    std::optional<Relation> expected = Relation::kTouching;
    if (random.Below(2)) {
      // Rotated slightly about its apex.
      for (double& q : X_WB.q) q += random.Real(-0.01, 0.01);
      expected = std::nullopt;
    }
    if (random.Below(2)) {
      X_WB.t.x() = std::nextafter(X_WB.t.x(), 2);
      expected = std::nullopt;
    }
    if (random.Below(10) == 0) X_WB.q[1] *= 0x1p-30;
    if (random.Below(10) == 0) X_WB.q[1] *= 0x1p-300;
    if (X_WB.q != X_WA.q) expected = std::nullopt;
    ASSERT_TRUE(check.Verify(cone(1), X_WA, cone(-1), X_WB, expected))
        << "seed " << seed << " round " << i;
  }
  EXPECT_GT(check.count(ExactWidth::k5Words), 400);
  EXPECT_GT(check.count(ExactWidth::kAny), check.count(ExactWidth::k5Words));
}

// Contacts of large hulls, where floating point narrows down the vertices.
TEST(ExactWidth, LargeHullsOnAGrid) {
  const uint64_t seed = TestSeed(604);
  Random random(seed);
  WidthCheck check;
  for (int i = 0; i < 60; ++i) {
    std::vector<Vector> points;
    for (int n = 0; n < 150; ++n) {
      Vector v(random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1));
      v.normalize();
      points.push_back(Vector((v * 4096).array().round()));
    }
    for (int x = -1; x <= 1; x += 2) {
      for (int y = -1; y <= 1; y += 2) points.emplace_back(3000.0 * x, 3000.0 * y, 4200.0);
    }
    const Hull a = BuildHull(points);
    std::vector<Vector> mirrored = points;
    for (Vector& p : mirrored) p.z() = -p.z();
    const Hull b = BuildHull(mirrored);
    Pose X_WA, X_WB;
    X_WB.t = Vector(random.Between(-2000, 2000), random.Between(-2000, 2000), 8400);
    ASSERT_TRUE(check.Verify(a, X_WA, b, X_WB, Relation::kTouching))
        << "seed " << seed << " round " << i;
    X_WB.t.z() += 1;
    ASSERT_TRUE(check.Verify(a, X_WA, b, X_WB, Relation::kSeparated));
    X_WB.t.z() -= 2;
    ASSERT_TRUE(check.Verify(a, X_WA, b, X_WB, Relation::kOverlapping));
  }
  EXPECT_GT(check.count(ExactWidth::k1Word), 180);
}

// Multiples of a quaternion, and quarter and third turns by any multiple, reduce to the same small
// rotation.
TEST(ExactWidth, RotationsAreReduced) {
  const auto rotation = [](const std::array<double, 4>& q) {
    SmallRotation found;
    EXPECT_TRUE(FindSmallRotation(q, found));
    return found;
  };
  for (const double scale : {1.0, -2.0, 3.0, 0.1, std::sqrt(0.5), 0x1p-1070, 1e300}) {
    const SmallRotation none = rotation({scale, 0, 0, 0});
    const SmallRotation quarter = rotation({scale, 0, 0, scale});
    const SmallRotation third = rotation({scale, scale, -scale, scale});
    EXPECT_TRUE(none.norm == 1 && quarter.norm == 1 && third.norm == 1) << scale;
    EXPECT_TRUE(none.rows[0][0] == 1 && none.rows[1][1] == 1 && none.rows[0][1] == 0);
    EXPECT_TRUE(quarter.rows[0][0] == 0 && quarter.rows[0][1] == -1 && quarter.rows[1][0] == 1);
    const SmallRotation mixed = rotation({3 * scale, scale, 0, 0});
    // 3 * 0.1 rounds, so it is not a multiple.
    EXPECT_EQ(mixed.norm == 5, std::fmod(3 * scale, scale) == 0) << scale;
  }
  SmallRotation found;
  EXPECT_FALSE(FindSmallRotation({1, 0x1p-70, 0, 0}, found));
  EXPECT_TRUE(FindSmallRotation({1, 0x1p-59, 0, 0}, found));
  EXPECT_FALSE(FindSmallRotation({1, 0x1p-60, 0, 0}, found));
}

}  // namespace exact_width_test
}  // namespace hulld
