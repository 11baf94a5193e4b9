#include "client/enclosure/coverage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "client/enclosure/convex_region.h"
#include "tests/client/enclosure/box_mesh.h"

namespace hulld {
namespace coverage_test {

CoveringPiece Placed(HullMesh mesh, const RigidPose& X_WH) {
  return {std::make_shared<const HullMesh>(std::move(mesh)), X_WH};
}

Coverage Cover(const std::vector<CoveringPiece>& pieces, const TriangleMesh& mesh) {
  const auto coverage = CoverMesh(pieces, mesh, [](uint64_t) {});
  EXPECT_TRUE(coverage.ok()) << coverage.status();
  return *coverage;
}

Coverage Cover(const std::vector<HullMesh>& hulls, const TriangleMesh& mesh) {
  std::vector<CoveringPiece> pieces;
  for (const HullMesh& hull : hulls) pieces.push_back(Placed(hull, kNoMotion));
  return Cover(pieces, mesh);
}

TriangleMesh Triangle(const Corner3& a, const Corner3& b, const Corner3& c) {
  return {{a, b, c}, {{0, 1, 2}}};
}

TEST(Coverage, AHullEnclosesItself) {
  const Coverage coverage =
      Cover({BoxHull({0, 0, 0}, {0.1, 0.7, 3})}, BoxMesh({0, 0, 0}, {0.1, 0.7, 3}));
  EXPECT_TRUE(coverage.uncovered.empty());
  EXPECT_EQ(coverage.clipped, 0u);
}

TEST(Coverage, OneHullReportsHowFarTheMeshProtrudes) {
  const Coverage coverage =
      Cover({BoxHull({0, 0, 0}, {1, 1, 1})}, Triangle({0.5, 0.5, 0.5}, {4, 5, 1}, {0.5, 0.5, 1}));
  ASSERT_EQ(coverage.uncovered.size(), 1u);
  EXPECT_DOUBLE_EQ(coverage.distance, 5);
  EXPECT_EQ(coverage.uncovered[0].point, (Corner3{4, 5, 1}));
}

// Neither half contains the triangles that cross the cut.
TEST(Coverage, TwoHalvesEncloseTheWhole) {
  const TriangleMesh whole = BoxMesh({0, 0, 0}, {2, 1, 1});
  const Coverage coverage =
      Cover({BoxHull({0, 0, 0}, {0.7, 1, 1}), BoxHull({0.7, 0, 0}, {2, 1, 1})}, whole);
  EXPECT_TRUE(coverage.uncovered.empty());
  EXPECT_GT(coverage.clipped, 0u);
}

// The axes of a box rotate with it: a third turn about the diagonal (1, 1, 1), and a translation.
TEST(Coverage, APieceIsPlacedAtItsPose) {
  const CoveringPiece turned = Placed(BoxHull({0, 0, 0}, {1, 2, 3}), {1, 1, 1, 1, 10, 0, 0});
  EXPECT_TRUE(Cover({turned}, BoxMesh({10, 0, 0}, {13, 1, 2})).uncovered.empty());
  const Coverage coverage = Cover({turned}, BoxMesh({10, 0, 0}, {13.5, 1, 2}));
  EXPECT_FALSE(coverage.uncovered.empty());
  EXPECT_DOUBLE_EQ(coverage.distance, 0.5);
}

// The quaternion (2, 0, 0, 1) maps (x, y) to (3x - 4y, 4x + 3y) / 5, so that the points (3s, 4s)
// lie on an edge of the box, although a rotation rounded to doubles would move the edge. A point
// off by the smallest step is outside.
TEST(Coverage, APoseIsNotRounded) {
  const CoveringPiece turned = Placed(BoxHull({0, 0, 0}, {5, 1, 1}), {2, 0, 0, 1, 0, 0, 0});
  for (const double s : {0.1, 0.3, 0x1.123456789abcdp-3}) {
    // Rounded to few digits, so that its multiples by three and four are exact.
    const double t = std::ldexp(std::round(std::ldexp(s, 40)), -40);
    const Corner3 on = {3 * t, 4 * t, 0.5};
    EXPECT_TRUE(Cover({turned}, Triangle(on, on, on)).uncovered.empty());
    const Corner3 off = {std::nextafter(on[0], 9), on[1], 0.5};
    EXPECT_EQ(Cover({turned}, Triangle(off, off, off)).uncovered.size(), 1u);
  }
}

// Two halves of a box, rotated and moved together, still meet without a gap; separated by the
// smallest step, they do not.
TEST(Coverage, RotatedPiecesMayMeet) {
  const auto half = [](double from, double to, double shift) {
    return Placed(BoxHull({from, 0, 0}, {to, 1, 1}), {0.3, 0.5, -0.7, 0.11, 1 + shift, 2, 3});
  };
  // A triangle inside both, as closely as doubles allow, that crosses the cut.
  const auto at = [](double x, double y, double z) {
    const RigidPose X = Compose({0.3, 0.5, -0.7, 0.11, 1, 2, 3}, {1, 0, 0, 0, x, y, z});
    return Corner3{X[4], X[5], X[6]};
  };
  const TriangleMesh across = Triangle(at(0.1, 0.2, 0.3), at(1.9, 0.3, 0.4), at(1.5, 0.8, 0.6));
  const Coverage together = Cover({half(0, 0.7, 0), half(0.7, 2, 0)}, across);
  EXPECT_TRUE(together.uncovered.empty());
  EXPECT_EQ(together.clipped, 1u);
  EXPECT_EQ(Cover({half(0, 0.7, 0), half(std::nextafter(0.7, 1), 2, 0)}, across).uncovered.size(),
            1u);
}

// A gap of one unit in the last place counts as a gap.
TEST(Coverage, TheNarrowestGapIsFound) {
  const double start = std::nextafter(0.7, 1);
  const Coverage coverage =
      Cover({BoxHull({0, 0, 0}, {0.7, 1, 1}), BoxHull({start, 0, 0}, {2, 1, 1})},
            BoxMesh({0, 0, 0}, {2, 1, 1}));
  // Two triangles on each of the four sides that cross the gap.
  EXPECT_EQ(coverage.uncovered.size(), 8u);
  EXPECT_LE(coverage.distance, start - 0.7);
}

TEST(Coverage, FlatPiecesCoverTheirOwnPlane) {
  const TriangleMesh mesh = Triangle({0, 0, 1}, {2, 0, 1}, {0, 2, 1});
  const HullMesh left = BoxHull({0, 0, 1}, {1, 2, 1});
  const HullMesh right = BoxHull({1, 0, 1}, {2, 2, 1});
  EXPECT_TRUE(Cover({left, right}, mesh).uncovered.empty());
  EXPECT_EQ(Cover({left}, mesh).uncovered.size(), 1u);
  EXPECT_DOUBLE_EQ(Cover({left}, mesh).uncovered[0].area, 0.5);
  // Outside their plane they cover only the line of intersection.
  EXPECT_EQ(Cover({left, right}, Triangle({0, 0, 1}, {1, 0, 1}, {0, 0, 2})).uncovered.size(), 1u);
}

TEST(Coverage, TrianglesWithoutAreaAreSegmentsAndPoints) {
  const std::vector<HullMesh> pieces = {BoxHull({0, 0, 0}, {1, 1, 1}),
                                        BoxHull({1, 0, 0}, {2, 1, 1})};
  EXPECT_TRUE(Cover(pieces, Triangle({0.5, 0, 0}, {1.5, 0, 0}, {1, 0, 0})).uncovered.empty());
  EXPECT_TRUE(Cover(pieces, Triangle({2, 1, 1}, {2, 1, 1}, {2, 1, 1})).uncovered.empty());
  EXPECT_EQ(Cover(pieces, Triangle({0.5, 0, 0}, {3, 0, 0}, {1, 0, 0})).uncovered.size(), 1u);
  EXPECT_EQ(Cover(pieces, Triangle({3, 0, 0}, {3, 0, 0}, {3, 0, 0})).uncovered.size(), 1u);
}

TEST(Coverage, WithoutPiecesNothingIsCovered) {
  const Coverage coverage =
      Cover(std::vector<HullMesh>(), Triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
  EXPECT_EQ(coverage.uncovered.size(), 1u);
  HullMesh empty;
  EXPECT_EQ(Cover({empty}, Triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0})).uncovered.size(), 1u);
}

// Returns the area of a triangle within a unit cell, by clipping in floating point.
double AreaInCell(const std::array<std::array<double, 2>, 3>& triangle, double x, double y) {
  std::vector<std::array<double, 2>> polygon(triangle.begin(), triangle.end());
  const std::array<std::array<double, 3>, 4> sides = {
      {{1, 0, x}, {-1, 0, -x - 1}, {0, 1, y}, {0, -1, -y - 1}}};
  for (const auto& [nx, ny, d] : sides) {
    std::vector<std::array<double, 2>> kept;
    for (size_t i = 0; i < polygon.size(); ++i) {
      const auto& p = polygon[i];
      const auto& q = polygon[(i + 1) % polygon.size()];
      const double h = nx * p[0] + ny * p[1] - d;
      const double k = nx * q[0] + ny * q[1] - d;
      if (h >= 0) kept.push_back(p);
      if ((h < 0) != (k < 0)) {
        const double t = h / (h - k);
        kept.push_back({p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])});
      }
    }
    polygon = kept;
  }
  double twice = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const auto& p = polygon[i];
    const auto& q = polygon[(i + 1) % polygon.size()];
    twice += p[0] * q[1] - p[1] * q[0];
  }
  return std::abs(twice) / 2;
}

// Boxes over cells of a grid, and triangles on the grid: the uncovered area is counted cell by
// cell.
TEST(Coverage, AreaAgreesWithCellsOfAGrid) {
  constexpr int kSide = 6;
  constexpr uint64_t kSeed = 1201;
  std::mt19937_64 generator(kSeed);
  // From `least` to `most`; equal on every platform, unlike the standard's distributions.
  const auto between = [&generator](int least, int most) {
    return least + static_cast<int>(generator() % static_cast<uint64_t>(most - least + 1));
  };
  int covered = 0;
  int open = 0;
  for (int round = 0; round < 400; ++round) {
    std::vector<HullMesh> pieces;
    bool cell[kSide][kSide] = {};
    for (int i = between(1, 7); i > 0; --i) {
      const int x = between(0, kSide - 1);
      const int y = between(0, kSide - 1);
      const int right = between(x + 1, kSide);
      const int top = between(y + 1, kSide);
      pieces.push_back(BoxHull({double(x), double(y), -1}, {double(right), double(top), 1}));
      for (int a = x; a < right; ++a) {
        for (int b = y; b < top; ++b) cell[a][b] = true;
      }
    }
    std::array<std::array<double, 2>, 3> corners;
    for (auto& corner : corners) {
      for (double& x : corner) x = between(0, kSide);
    }
    const auto& [p, q, r] = corners;
    if ((q[0] - p[0]) * (r[1] - p[1]) == (q[1] - p[1]) * (r[0] - p[0])) continue;
    double expected = 0;
    for (int a = 0; a < kSide; ++a) {
      for (int b = 0; b < kSide; ++b) {
        if (!cell[a][b]) expected += AreaInCell(corners, a, b);
      }
    }
    const Coverage coverage =
        Cover(pieces, Triangle({p[0], p[1], 0}, {q[0], q[1], 0}, {r[0], r[1], 0}));
    const double area = coverage.uncovered.empty() ? 0 : coverage.uncovered[0].area;
    ASSERT_NEAR(area, expected, 1e-9) << "seed " << kSeed << " round " << round;
    ASSERT_EQ(coverage.uncovered.empty(), expected < 1e-9)
        << "seed " << kSeed << " round " << round;
    ++(coverage.uncovered.empty() ? covered : open);
  }
  EXPECT_GT(covered, 20);
  EXPECT_GT(open, 50);
}

TEST(Coverage, CoordinatesOfAnyMagnitudeAreExact) {
  const Coverage coverage =
      Cover({BoxHull({0, 0, 0}, {1e300, 1, 1e-300})}, BoxMesh({0, 0, 0}, {1e300, 1, 1e-300}));
  EXPECT_TRUE(coverage.uncovered.empty());
  EXPECT_FALSE(Cover({BoxHull({0, 0, 0}, {1e300, 1, 1e-300})},
                     BoxMesh({0, 0, 0}, {1e300, 1, std::nextafter(1e-300, 1)}))
                   .uncovered.empty());
}

std::vector<double> CornersOf(const HullMesh& mesh) { return mesh.xyz; }

TEST(IsHullOf, DistinguishesHulls) {
  const HullMesh box = BoxHull({0, 0, 0}, {1, 2, 3});
  std::vector<double> points = CornersOf(box);
  EXPECT_TRUE(*IsHullOf(box, points));
  points.insert(points.end(), {0.5, 1, 1.5});
  EXPECT_TRUE(*IsHullOf(box, points));
  std::vector<double> outside = points;
  outside.insert(outside.end(), {std::nextafter(1, 2), 1, 1});
  EXPECT_FALSE(*IsHullOf(box, outside));
  std::vector<double> fewer(points.begin() + 3, points.end());
  EXPECT_FALSE(*IsHullOf(box, fewer));
  points[0] = -0.0;
  EXPECT_TRUE(*IsHullOf(box, points));
  EXPECT_FALSE(*IsHullOf(box, {}));
  EXPECT_TRUE(*IsHullOf(HullMesh(), {}));
  HullMesh segment;
  segment.xyz = {0, 0, 0, 3, 3, 3};
  EXPECT_TRUE(*IsHullOf(segment, {0, 0, 0, 3, 3, 3, 1, 1, 1}));
  EXPECT_FALSE(*IsHullOf(segment, {0, 0, 0, 3, 3, 3, 1, 1, 1.5}));
}

}  // namespace coverage_test
}  // namespace hulld
